"""The game's cards, drawn: textures for the simulator and, with the places of balls and feet, training data.

The art follows the publisher's cards: a white border with rounded corners, a black chalkboard with grey streaks, three
outlined tubes on disc feet, glossy balls, now and then a wooden bench. Image x runs right and y down.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from dr_eureka.errors import DrEurekaError
from dr_eureka.vision.card_style import CardStyle, sample_style

# Base colour and lower-right crescent of each ball, RGB.
BALL_COLOURS = {
    "R": ((234, 82, 42), (199, 40, 37)),
    "G": ((190, 212, 59), (130, 165, 59)),
    "P": ((148, 69, 139), (115, 51, 111)),
}
SURROUND_RGB = (96, 96, 96)  # what shows outside the rounded corners
_SUPERSAMPLING = 2
_MOST_BALLS = 4


class CardRenderError(DrEurekaError):
    """A card that cannot be drawn: not three tubes, an unknown colour, too many balls, or no pixels."""


@dataclass(frozen=True)
class DrawnBall:
    """A ball in a drawing: centre and diameter in pixels, colour letter, tube index 0 (left) to 2."""

    x: float
    y: float
    diameter: float
    colour: str
    tube: int


@dataclass(frozen=True)
class CardDrawing:
    """A drawn card: RGB image (side, side, 3) uint8, its balls, the three feet's centres (3, 2) in pixels, its style."""

    image: np.ndarray
    balls: tuple[DrawnBall, ...]
    feet: np.ndarray
    style: CardStyle

    def outline_mask(self) -> np.ndarray:
        """Return 1 on the card and 0 outside its rounded corners, (side, side) float32."""
        side = self.image.shape[0]
        return _rounded_mask(side, 0.0, self.style.corner_radius * side)


def render_card(state: str, seed: int, side_px: int = 512) -> np.ndarray:
    """Return the card of a state as a square RGB texture (side_px, side_px, 3) uint8, its look chosen by the seed.

    Raises CardRenderError for a state that cannot be drawn.
    """
    return draw_card(state, np.random.default_rng(seed), side_px).image


def draw_card(
    state: str, rng: np.random.Generator, side_px: int = 512, style: CardStyle | None = None
) -> CardDrawing:
    """Draw a state, also an impossible one (for tests of rejection), and return picture, balls and feet.

    Raises CardRenderError unless the state has three tubes of at most four balls out of R, G, P.
    """
    if side_px < 16:
        raise CardRenderError(f"card of side {side_px} px: expected at least 16")
    style = style or sample_style(rng)
    side = side_px * _SUPERSAMPLING
    canvas = _chalkboard(rng, side, style)
    if style.bench:
        _draw_bench(canvas, rng, side, style)
    balls, feet = lay_out(state, rng, style, side_px)
    for x in feet[:, 0]:
        _draw_tube_back(canvas, x / side_px, side, style)
    for ball in balls:
        place = (length * _SUPERSAMPLING for length in (ball.x, ball.y, ball.diameter))
        _draw_ball(canvas, *place, ball.colour, style)
    for x in feet[:, 0]:
        _draw_tube_front(canvas, x / side_px, side, style)
    _draw_border(canvas, side, style)
    image = cv2.resize(canvas, (side_px, side_px), interpolation=cv2.INTER_AREA)
    return CardDrawing(image, balls, feet, style)


def lay_out(
    state: str, rng: np.random.Generator, style: CardStyle, side_px: float
) -> tuple[tuple[DrawnBall, ...], np.ndarray]:
    """Return where a drawing's balls and feet (3, 2) are, in pixels, without painting it.

    Raises CardRenderError unless the state has three tubes of at most four balls out of R, G, P.
    """
    tubes = str(state).split("|")
    if len(tubes) != 3 or any(len(t) > _MOST_BALLS or set(t) - set(BALL_COLOURS) for t in tubes):
        raise CardRenderError(
            f"card {state!r}: expected three tubes of at most {_MOST_BALLS} balls out of R, G, P, like RR|GG|PP"
        )
    axes = 0.5 + style.group_offset + style.tube_spacing * np.arange(-1, 2)
    diameter = style.ball_diameter
    balls = []
    for index, (axis, content) in enumerate(zip(axes, tubes)):
        for level, colour in enumerate(content):
            x = axis + rng.normal(0.0, 0.02) * diameter
            y = style.foot_line - diameter * (0.56 + level * style.ball_pitch)
            balls.append(DrawnBall(x * side_px, y * side_px, diameter * side_px, colour, index))
    return tuple(balls), np.column_stack((axes, np.full(3, style.foot_line))) * side_px


def _chalkboard(rng: np.random.Generator, side: int, style: CardStyle) -> np.ndarray:
    """Return the black ground with wiped chalk streaks, RGB."""
    coarse = 96
    chalk = np.zeros((coarse, coarse), np.float32)
    heading = rng.uniform(0, np.pi)
    for _ in range(style.streaks):
        x, y = rng.uniform(0, coarse, 2)
        angle = heading + rng.normal(0, 0.25)
        length = rng.uniform(8, 45)
        end = (int(x + length * np.cos(angle)), int(y + length * np.sin(angle)))
        cv2.line(chalk, (int(x), int(y)), end, float(rng.uniform(8, 60)), int(rng.integers(1, 5)), cv2.LINE_AA)
    chalk = cv2.GaussianBlur(chalk, (0, 0), 1.6)
    chalk += rng.normal(0, 3.0, chalk.shape).astype(np.float32)
    chalk = np.clip(cv2.resize(chalk, (side, side), interpolation=cv2.INTER_CUBIC), 0, 67)
    grey = (chalk + style.ground_level).astype(np.uint8)
    return cv2.merge((grey, grey, cv2.subtract(grey, 2)))


def _draw_bench(canvas: np.ndarray, rng: np.random.Generator, side: int, style: CardStyle) -> None:
    """Paint horizontal planks from just above the feet down to the border."""
    top = style.foot_line - rng.uniform(0.02, 0.05)
    planks = int(rng.integers(2, 4))
    edges = np.linspace(top, 1.0 - style.border / 2, planks + 1) * side
    for upper, lower in zip(edges[:-1], edges[1:]):
        colour = np.array((176, 112, 58)) + rng.integers(-16, 17)
        cv2.rectangle(canvas, (0, int(upper)), (side, int(lower)), tuple(int(c) for c in colour), -1)
        for _ in range(5):
            y = int(rng.uniform(upper, lower))
            cv2.line(canvas, (0, y), (side, y + int(rng.integers(-4, 5))), tuple(int(c * 0.88) for c in colour), 1)
        cv2.line(canvas, (0, int(lower)), (side, int(lower)), (92, 55, 28), max(1, side // 200))


def _outline_rgb(style: CardStyle) -> tuple[float, float, float]:
    return (style.outline_level,) * 3


def _ellipse(centre: tuple[float, float], axes: tuple[float, float]) -> tuple:
    return (int(round(centre[0])), int(round(centre[1]))), (max(1, int(round(axes[0]))), max(1, int(round(axes[1]))))


def _tube_figures(axis: float, side: int, style: CardStyle) -> tuple[float, float, float, float, float]:
    """Return x of the axis, y of foot and mouth, half the tube's width and half the foot's width, in canvas pixels."""
    diameter = style.ball_diameter * side
    foot = style.foot_line * side
    return (axis * side, foot, foot - style.tube_height * diameter, style.tube_width * diameter / 2,
            style.foot_width * diameter / 2)


def _draw_tube_back(canvas: np.ndarray, axis: float, side: int, style: CardStyle) -> None:
    """Draw what lies behind the balls: translucent inside, disc foot."""
    x, foot, mouth, half, half_foot = _tube_figures(axis, side, style)
    stroke = max(1, int(round(style.outline * side)))
    left, right, top, bottom = (int(round(v)) for v in (x - half, x + half, mouth, foot))
    inside = canvas[top:bottom, left:right].astype(np.float32)
    canvas[top:bottom, left:right] = (inside * 0.86 + 255 * 0.14 * 0.7).astype(np.uint8)
    disc = _ellipse((x, foot), (half_foot, 0.26 * half_foot))
    cv2.ellipse(canvas, *disc, 0, 0, 360, (120, 122, 122), -1, cv2.LINE_AA)
    cv2.ellipse(canvas, *disc, 0, 0, 360, _outline_rgb(style), stroke, cv2.LINE_AA)


def _draw_tube_front(canvas: np.ndarray, axis: float, side: int, style: CardStyle) -> None:
    """Draw the white outline: two walls and the ellipse of the mouth."""
    x, foot, mouth, half, _ = _tube_figures(axis, side, style)
    stroke = max(1, int(round(style.outline * side)))
    white = _outline_rgb(style)
    for wall in (x - half, x + half):
        cv2.line(canvas, (int(round(wall)), int(round(mouth))), (int(round(wall)), int(round(foot))), white, stroke,
                 cv2.LINE_AA)
    cv2.ellipse(canvas, *_ellipse((x, mouth), (half, 0.24 * half)), 0, 0, 360, white, stroke, cv2.LINE_AA)


def _draw_ball(canvas: np.ndarray, x: float, y: float, diameter: float, colour: str, style: CardStyle) -> None:
    """Paint one glossy ball: base, blurred highlight where the light comes from, crescent opposite."""
    radius = diameter / 2
    x0, y0 = int(np.floor(x - radius)) - 1, int(np.floor(y - radius)) - 1
    size = int(np.ceil(diameter)) + 3
    rows, columns = np.mgrid[y0:y0 + size, x0:x0 + size].astype(np.float32)
    u, v = (columns - x) / radius, (rows - y) / radius
    base, crescent = (np.clip(np.array(c) + style.colour_shift, 0, 255) for c in BALL_COLOURS[colour])
    light = np.array((np.cos(style.shine_angle), np.sin(style.shine_angle)))
    towards, aside = u * light[0] + v * light[1], u * light[1] - v * light[0]
    shade = 1 / (1 + np.exp(-(np.hypot(towards - 0.4, aside) - 0.98) * 9))[..., None]
    shine = style.gloss * np.exp(-(((towards - 0.55) / 0.18) ** 2 + (aside / 0.25) ** 2))[..., None]
    paint = (base * (1 - shade) + crescent * shade) * (1 - shine) + 255 * shine
    alpha = np.clip((1 - np.hypot(u, v)) * radius + 0.5, 0, 1)[..., None]
    height, width = canvas.shape[:2]
    top, left, bottom, right = max(y0, 0), max(x0, 0), min(y0 + size, height), min(x0 + size, width)
    part = np.s_[top - y0:bottom - y0, left - x0:right - x0]
    patch = canvas[top:bottom, left:right]
    patch[...] = (patch * (1 - alpha[part]) + paint[part] * alpha[part]).astype(np.uint8)


def _draw_border(canvas: np.ndarray, side: int, style: CardStyle) -> None:
    """Lay the white border over the edges and cut the outer corners round."""
    inner_radius = 0.6 * style.corner_radius * side
    ground = _rounded_mask(side, style.border * side, inner_radius)
    card = _rounded_mask(side, 0.0, style.corner_radius * side)
    for mask, colour in ((ground, (246, 246, 246)), (card, SURROUND_RGB)):
        outside = mask < 1
        share = mask[outside][:, None]
        canvas[outside] = (canvas[outside] * share + np.array(colour, np.float32) * (1 - share)).astype(np.uint8)


def _rounded_mask(side: int, margin: float, radius: float) -> np.ndarray:
    """Return a (side, side) float32 mask, 1 inside a rounded square inset by the margin."""
    reach = np.float32(side / 2 - margin - radius)
    away = np.abs(np.arange(side, dtype=np.float32) + 0.5 - side / 2) - reach
    x, y = away[None, :], away[:, None]
    outside = np.hypot(np.maximum(x, 0), np.maximum(y, 0)) + np.minimum(np.maximum(x, y), 0)
    return np.clip(radius - outside + 0.5, 0, 1)
