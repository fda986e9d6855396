"""Cards among other things, as training crops and as whole camera pictures with the truth beside them.

Pixels: x right, y down. A card's corners go clockwise from its upper left as printed.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from dr_eureka.game.state import COLOURS
from dr_eureka.vision.aruco import marker_image
from dr_eureka.vision.card_finder import rectify
from dr_eureka.vision.card_renderer import CardDrawing, draw_card
from dr_eureka.vision.card_style import sample_style
from dr_eureka.vision.card_views import View, ViewRanges, card_corners, degrade, sample_view

_SCENE_PX = (640, 480)
_TEXTURE_PX = 384


@dataclass(frozen=True)
class CardScene:
    """A camera picture (480, 640, 3) uint8 RGB with one card in it: its corners (4, 2) [px], drawing, and view."""

    image: np.ndarray
    corners: np.ndarray
    drawing: CardDrawing
    view: View


def paste_card(image: np.ndarray, drawing: CardDrawing, corners: np.ndarray) -> None:
    """Draw a card into an RGB image in place, its corners (4, 2) at the given pixels."""
    texture, mask = drawing.image, drawing.outline_mask()
    longest = max(np.linalg.norm(corners - np.roll(corners, 1, 0), axis=1))
    if longest * 1.3 < texture.shape[0]:  # shrink by area first, as a lens would, so that warping does not alias
        size = (int(longest * 1.3),) * 2
        texture, mask = (cv2.resize(a, size, interpolation=cv2.INTER_AREA) for a in (texture, mask))
    low = np.maximum(np.floor(corners.min(0)).astype(int) - 1, 0)
    high = np.minimum(np.ceil(corners.max(0)).astype(int) + 2, image.shape[1::-1])
    if np.any(high <= low):
        return
    side = texture.shape[0]
    square = np.array([(0, 0), (side, 0), (side, side), (0, side)], np.float32) - 0.5
    homography = cv2.getPerspectiveTransform(square, (corners - low).astype(np.float32))
    size = tuple(int(v) for v in high - low)
    paint = cv2.warpPerspective(texture, homography, size, borderMode=cv2.BORDER_REPLICATE)
    alpha = cv2.warpPerspective(mask, homography, size)[..., None]
    patch = image[low[1]:high[1], low[0]:high[0]]
    patch[...] = (patch * (1 - alpha) + paint * alpha).astype(np.uint8)


def clutter(rng: np.random.Generator, width: int, height: int, things: int) -> np.ndarray:
    """Return an RGB background (height, width, 3): a graded ground with random boxes, discs and lines on it."""
    first, second = rng.uniform(10, 245, (2, 3))
    ramp = np.linspace(0, 1, height, dtype=np.float32)[:, None, None]
    image = np.broadcast_to(first.astype(np.float32) * ramp + second.astype(np.float32) * (1 - ramp), (height, width, 3))
    if rng.random() < 0.4:
        grain = rng.normal(0, rng.uniform(4, 25), (height // 12 + 2, width // 12 + 2)).astype(np.float32)
        image = np.clip(image + cv2.resize(grain, (width, height), interpolation=cv2.INTER_LINEAR)[..., None], 0, 255)
    image = image.astype(np.uint8, order="C")
    for _ in range(things):
        colour = tuple(int(c) for c in rng.integers(0, 256, 3))
        centre = (int(rng.uniform(0, width)), int(rng.uniform(0, height)))
        size = rng.uniform(0.03, 0.4, 2) * min(width, height)
        kind = rng.integers(4)
        if kind == 0:
            cv2.circle(image, centre, int(size[0] / 2), colour, -1, cv2.LINE_AA)
        elif kind == 1:
            end = (int(rng.uniform(0, width)), int(rng.uniform(0, height)))
            cv2.line(image, centre, end, colour, int(rng.integers(1, 9)), cv2.LINE_AA)
        else:
            box = cv2.boxPoints((centre, tuple(float(s) for s in size), float(rng.uniform(0, 90))))
            cv2.fillConvexPoly(image, box.astype(np.int32), colour, cv2.LINE_AA)
    return image


def decoy(rng: np.random.Generator, side_px: int) -> CardDrawing:
    """Draw what is no card but has a white border round a dark ground: a marker, a screen with bars, or nothing."""
    image = np.full((side_px, side_px, 3), 245, np.uint8)
    style = sample_style(rng, "training")
    margin = int(style.border * side_px)
    ground = image[margin:-margin, margin:-margin]
    ground[...] = rng.integers(5, 60)
    kind = rng.integers(4)
    if kind <= 1:
        cells = int(rng.integers(3, 8))
        bits = cv2.copyMakeBorder(rng.integers(0, 2, (cells, cells)).astype(np.uint8) * 235 + 10, 1, 1, 1, 1,
                                  cv2.BORDER_CONSTANT, value=10)
        ground[...] = cv2.resize(bits, ground.shape[1::-1], interpolation=cv2.INTER_NEAREST)[..., None]
    elif kind == 2:
        for _ in range(int(rng.integers(2, 12))):
            x, y, width, height = (rng.uniform(0, 1, 4) * (1, 1, 0.7, 0.12) * ground.shape[0]).astype(int)
            ground[y:y + height, x:x + width] = rng.integers(40, 256, 3)
    return CardDrawing(image, (), np.zeros((0, 2)), style)


def random_scene(state: str, rng: np.random.Generator, ranges: ViewRanges, look: str) -> CardScene:
    """Return a picture of a state's card, drawn in a look, whole somewhere in view among things that are no cards."""
    width, height = _SCENE_PX
    image = clutter(rng, width, height, int(rng.integers(0, 12)))
    for _ in range(int(rng.integers(0, 3))):
        _put_distractor(image, rng)
    drawing, view = draw_card(state, rng, _TEXTURE_PX, sample_style(rng, look)), sample_view(rng, ranges)
    corners = card_corners(view)
    low, high = corners.min(0) - 1, corners.max(0) + 1
    corners = corners - low + rng.uniform(0, 1, 2) * np.maximum(_SCENE_PX - (high - low), 0)
    paste_card(image, drawing, corners)
    return CardScene(degrade(image, view, rng), corners, drawing, view)


def _put_distractor(image: np.ndarray, rng: np.random.Generator) -> None:
    """Paste a marker on white paper, or another white-bordered thing that is no card, into an RGB image in place."""
    side = int(rng.integers(40, 160))
    x, y = (int(rng.integers(-side // 2, size - side // 2)) for size in _SCENE_PX)
    square = np.array([(x, y), (x + side, y), (x + side, y + side), (x, y + side)], float)
    if rng.random() < 0.5:
        print_px = max(side - 2 * (side // 7), 20)
        paper = np.full((side, side, 3), 245, np.uint8)
        start = (side - print_px) // 2
        paper[start:start + print_px, start:start + print_px] = marker_image(int(rng.integers(50)), print_px)[..., None]
        thing = CardDrawing(paper, (), np.zeros((0, 2)), sample_style(rng))
    else:
        thing = decoy(rng, side)
    paste_card(image, thing, square + rng.normal(0, 0.06 * side, (4, 2)))


def rectified_sample(
    drawing: CardDrawing, rng: np.random.Generator, ranges: ViewRanges
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a training crop of a card seen at random, cut out as the finder would, in one of four turns.

    The crop is (416, 416, 3) uint8 RGB; balls (n, 4) hold x, y, diameter as fractions of the crop and the class index;
    feet (m, 2) x, y.
    """
    view = sample_view(rng, ranges)
    corners = card_corners(view)
    corners -= corners.min(0) - 8
    width, height = (int(v) for v in np.ceil(corners.max(0)) + 8)
    image = clutter(rng, width, height, int(rng.integers(0, 6)))
    paste_card(image, drawing, corners)
    image = degrade(image, view, rng)

    side = drawing.image.shape[0]
    square = np.array([(0, 0), (side, 0), (side, side), (0, side)], np.float32) - 0.5
    border = drawing.style.border * side
    ground = square + np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]) * border
    into_view = cv2.getPerspectiveTransform(square, corners.astype(np.float32))
    found = cv2.perspectiveTransform(ground[None].astype(np.float32), into_view)[0]
    scale = np.linalg.norm(corners[0] - corners[2]) / np.sqrt(2)
    found += rng.normal(0, 0.3 + 0.006 * scale, found.shape)
    found = np.roll(found, -int(rng.integers(4)), 0)
    crop, into_crop = rectify(image, found)

    to_fractions = np.diag((1 / crop.shape[1], 1 / crop.shape[0], 1)) @ into_crop @ into_view
    balls = np.zeros((len(drawing.balls), 4))
    for row, ball in zip(balls, drawing.balls):
        rim = np.array([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)]) * ball.diameter / 2 + (ball.x, ball.y)
        centre, *edges = _apply(to_fractions, rim)
        row[:] = (*centre, 2 * np.mean(np.linalg.norm(edges - centre, axis=1)), COLOURS.index(ball.colour))
    return crop, balls, _apply(to_fractions, drawing.feet)


def _apply(homography: np.ndarray, points: np.ndarray) -> np.ndarray:
    points = np.asarray(points, np.float64)
    return cv2.perspectiveTransform(points[None], homography)[0] if len(points) else points
