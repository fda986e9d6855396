"""Finds balls of a known colour in a picture, to a tenth of a pixel, also when the picture's edge or a thing cuts them.

A coloured spot gives a first outline. Then the outline is sought anew along rays from its middle, where the colour has
fallen half-way to what is around. The outline of a ball is the cone of rays that touch it: unit rays u with
u . c = cos(alpha), where c points to the ball's middle and alpha is its angular radius. So w = c / cos(alpha) solves
u . w = 1, a linear problem that a part of the outline determines as well, and from which the middle and the size follow
without approximation.
"""

from __future__ import annotations

import colorsys
from dataclasses import dataclass

import cv2
import numpy as np

from dr_eureka.catching.localisation import camera_model
from dr_eureka.catching.seen_ball import SeenBall
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.vision.camera import CameraModel

_RAYS = 96
_SAMPLES = 25  # along a ray
_REFITS = 8
_LEAST_POINTS = 6
_CUT_OFF_PX = 1.5  # an outline's point that is farther off belongs to something else
_WIDE_CUT_OFF = 0.08  # the same for the first outline, as a share of the radius
_LEAST_CONTRAST = 0.35  # of the step in colour across the outline, as a share of the ball's own
_LEAST_FILLED = 0.5  # share of the disc that has the ball's colour
_MOST_SPOTS = 6
_BORDER_PX = 1.5
_WHOLE_TURN = np.linspace(0.0, 2.0 * np.pi, _RAYS, endpoint=False)


@dataclass(frozen=True, eq=False)
class _Points:
    """Points of an outline: pixels (n, 2), unit rays (n, 3), and how many pixels a radian is there (n,)."""

    pixels: np.ndarray
    rays: np.ndarray
    px_per_rad: np.ndarray

    @classmethod
    def of(cls, pixels: np.ndarray, camera: CameraModel) -> _Points:
        rays = camera.rays(pixels)
        lengths = np.sqrt(np.einsum("ij,ij->i", rays, rays))
        return cls(pixels, rays / lengths[:, None], camera.matrix[0, 0] * lengths)

    def only(self, wanted: np.ndarray) -> _Points:
        """Return those for which `wanted` (n,) is true."""
        return _Points(self.pixels[wanted], self.rays[wanted], self.px_per_rad[wanted])

    def __len__(self) -> int:
        return len(self.pixels)


def find_balls(image_rgb: np.ndarray, settings: SaikaSettings) -> tuple[SeenBall, ...]:
    """Return the balls in a picture (height, width, 3) uint8 RGB of a head camera, the largest, thus nearest, first.

    Raises CameraError for a picture that has not the camera's size.
    """
    camera = camera_model(settings.cameras)
    camera.check_size(image_rgb)
    mask = _colour_mask(image_rgb, settings)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    least_area = settings.ball_finder.least_arc * 0.25 * np.pi * settings.ball_finder.least_diameter_px**2
    spots = [index for index in range(1, count) if stats[index, cv2.CC_STAT_AREA] >= least_area]
    spots.sort(key=lambda index: -stats[index, cv2.CC_STAT_AREA])
    found = []
    for index in spots[:_MOST_SPOTS]:
        left, top, width, height = stats[index, :4]
        spot = (labels[top : top + height, left : left + width] == index).astype(np.uint8)
        found += _balls_of_spot(image_rgb, mask, spot, (left, top), camera, settings)
    return tuple(sorted(found, key=lambda ball: -ball.diameter_px))


def _colour_mask(image_rgb: np.ndarray, settings: SaikaSettings) -> np.ndarray:
    """Return uint8 (height, width), 1 where a pixel has the ball's hue."""
    finder = settings.ball_finder
    hue = 180.0 * colorsys.rgb_to_hsv(*np.divide(finder.ball_rgb, 255.0))[0]  # OpenCV counts hue from 0 to 180
    reach = 0.5 * finder.hue_tolerance_deg
    hsv = cv2.cvtColor(image_rgb, cv2.COLOR_RGB2HSV)
    least, most = (255 * finder.least_saturation, 255 * finder.least_brightness), (255, 255)
    mask = cv2.inRange(hsv, (max(hue - reach, 0), *least), (min(hue + reach, 180), *most))
    # A hue near red goes on at the other end of the scale.
    for turn in (-180, 180):
        if 0 < hue + reach + turn <= 180 or 0 <= hue - reach + turn < 180:
            mask |= cv2.inRange(hsv, (max(hue - reach + turn, 0), *least), (min(hue + reach + turn, 180), *most))
    return cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) // 255


def _balls_of_spot(
    image_rgb: np.ndarray,
    mask: np.ndarray,
    spot: np.ndarray,
    corner: tuple[int, int],
    camera: CameraModel,
    settings: SaikaSettings,
) -> list[SeenBall]:
    """Return the balls, at most two, of a spot (h, w) whose left top corner is at `corner` (column, row)."""
    contours, _ = cv2.findContours(spot, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    pixels = np.vstack([contour.reshape(-1, 2) for contour in contours]) + np.array(corner, dtype=float)
    points = _Points.of(pixels[_within(pixels, camera, _BORDER_PX)], camera)
    found: list[SeenBall] = []
    for _ in range(2):
        first = _first_outline(points, spot, corner)
        if first is None or _middle_and_radius(first, camera)[1] > camera.width:
            break
        ball = _refined(image_rgb, mask, first, camera, settings)
        if ball is not None:
            found.append(ball)
        left_over = np.abs(_distance_px(points, first)) > 2.0 * _CUT_OFF_PX
        # What is left of a spot when one ball's outline is taken away may be another ball, partly behind it.
        if left_over.sum() < 0.25 * len(points):
            break
        points = points.only(left_over)
        spot = _without_disc(spot, corner, first, camera)
    return found


def _first_outline(points: _Points, spot: np.ndarray, corner: tuple[int, int]) -> np.ndarray | None:
    """Return the cone w (3,) of a spot's contour, or None if it is no ball's.

    Where the contour as a whole is not one, the largest disc inside the spot tells which part of it is.
    """
    depth = cv2.distanceTransform(spot, cv2.DIST_L2, 5)
    radius = float(depth.max())
    row, column = np.unravel_index(int(depth.argmax()), depth.shape)
    from_middle = np.linalg.norm(points.pixels - (column + corner[0], row + corner[1]), axis=1)
    on_disc = np.abs(from_middle - radius) < 0.15 * radius + 1.0
    cut_off = max(_CUT_OFF_PX, _WIDE_CUT_OFF * radius)
    best, most = None, 0.5
    for start in (np.ones(len(points), dtype=bool), on_disc):
        if start.sum() < _LEAST_POINTS:
            continue
        cone = _fit(points.only(start), points, cut_off)
        if cone is None:
            continue
        share = float(np.mean(np.abs(_distance_px(points, cone)) < cut_off))
        if share > most:
            best, most = cone, share + 0.1
    return best


def _refined(
    image_rgb: np.ndarray, mask: np.ndarray, cone: np.ndarray, camera: CameraModel, settings: SaikaSettings
) -> SeenBall | None:
    """Return the ball of an outline sought anew between pixels, or None when too little of it is there."""
    share = 0.0
    for _ in range(2):
        middle, radius = _middle_and_radius(cone, camera)
        if radius > camera.width:
            return None
        edges = _edges(image_rgb, middle, radius, camera, settings)
        if len(edges) < _LEAST_POINTS:
            return None
        refit = _fit(edges, edges, _CUT_OFF_PX)
        if refit is None:
            return None
        cone = refit
        share = float(np.sum(np.abs(_distance_px(edges, cone)) < _CUT_OFF_PX)) / _RAYS
    if share < settings.ball_finder.least_arc or _filled(mask, cone, camera) < _LEAST_FILLED:
        return None
    length = float(np.linalg.norm(cone))
    to_middle = cone / length
    diameter = 2.0 * settings.cameras.focal_px * np.sqrt(1.0 - 1.0 / length**2) / to_middle[2]
    column, row = camera.project(to_middle)
    if diameter < settings.ball_finder.least_diameter_px:
        return None
    return SeenBall((float(column), float(row)), float(diameter), share)


def _edges(
    image_rgb: np.ndarray, middle: np.ndarray, radius: float, camera: CameraModel, settings: SaikaSettings
) -> _Points:
    """Return points of the outline between pixels: where the colour falls half-way, along rays from the middle."""
    reach = min(max(3.0, 0.12 * radius), 0.8 * radius)
    along = np.linspace(-reach, reach, _SAMPLES)
    directions = np.stack([np.cos(_WHOLE_TURN), np.sin(_WHOLE_TURN)], axis=1)
    places = middle + (radius + along)[None, :, None] * directions[:, None, :]
    low = np.maximum(np.floor(places.min(axis=(0, 1))).astype(int) - 1, 0)
    high = np.minimum(np.ceil(places.max(axis=(0, 1))).astype(int) + 2, (camera.width, camera.height))
    if np.any(high - low < 2):
        return _Points.of(np.empty((0, 2)), camera)
    window = image_rgb[low[1] : high[1], low[0] : high[0]].astype(np.float32) @ _colour_axis(settings)
    profile = cv2.remap(
        window, *np.moveaxis((places - low).astype(np.float32), -1, 0), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    ends = _SAMPLES // 4
    inside, outside = np.median(profile[:, :ends], axis=1), np.median(profile[:, -ends:], axis=1)
    strong = inside - outside > _LEAST_CONTRAST * np.median(inside)
    below = profile < 0.5 * (inside + outside)[:, None]
    crossing = np.argmax(below, axis=1)
    usable = strong & (crossing > 0) & below.any(axis=1)
    rows = np.flatnonzero(usable)
    column = crossing[rows]
    before, after, level = profile[rows, column - 1], profile[rows, column], 0.5 * (inside + outside)[rows]
    at = along[column - 1] + (along[1] - along[0]) * (before - level) / np.maximum(before - after, 1e-6)
    points = middle + (radius + at)[:, None] * directions[rows]
    return _Points.of(points[_within(points, camera, _BORDER_PX)], camera)


def _colour_axis(settings: SaikaSettings) -> np.ndarray:
    """Return the direction (3,) in which the ball's colour differs from grey of any brightness."""
    colour = np.array(settings.ball_finder.ball_rgb, dtype=np.float32)
    chroma = colour - colour.mean()
    return chroma / np.linalg.norm(chroma)


def _fit(start: _Points, points: _Points, cut_off_px: float) -> np.ndarray | None:
    """Return the cone w (3,) of points, beginning with `start`; later only those within the cut-off count. None: no cone."""
    cone, last = _cone(start), None
    for _ in range(_REFITS):
        if cone is None:
            return None
        near = np.abs(_distance_px(points, cone)) < cut_off_px
        if near.sum() < _LEAST_POINTS:
            return None
        if last is not None and np.array_equal(near, last):
            break
        last, cone = near, _cone(points.only(near))
    return cone


def _cone(points: _Points) -> np.ndarray | None:
    """Return w (3,) with u . w = 1 for the unit rays u of points, by least squares; None where they make no cone."""
    try:
        cone = np.linalg.solve(points.rays.T @ points.rays, points.rays.sum(axis=0))
    except np.linalg.LinAlgError:
        return None
    return cone if cone[2] > 0.0 and cone @ cone > 1.0 else None


def _distance_px(points: _Points, cone: np.ndarray) -> np.ndarray:
    """Return how far [px] points are outside of a cone's outline, negative inside."""
    length = np.sqrt(cone @ cone)
    angle = np.arccos(np.minimum(points.rays @ (cone / length), 1.0))
    return (angle - np.arccos(1.0 / length)) * points.px_per_rad


def _middle_and_radius(cone: np.ndarray, camera: CameraModel) -> tuple[np.ndarray, float]:
    """Return about where the outline's middle (2,) and how large its radius is [px]."""
    length = float(np.linalg.norm(cone))
    focal = camera.matrix[0, 0]
    return camera.project(cone), float(focal * np.sqrt(length**2 - 1.0) / cone[2])


def _filled(mask: np.ndarray, cone: np.ndarray, camera: CameraModel) -> float:
    """Return which share of the outline's disc, as far as it is in the picture, has the ball's colour."""
    disc = np.zeros_like(mask)
    _draw_disc(disc, cone, camera, (0, 0), 1)
    area = int(disc.sum())
    return float((mask & disc).sum()) / area if area else 0.0


def _without_disc(spot: np.ndarray, corner: tuple[int, int], cone: np.ndarray, camera: CameraModel) -> np.ndarray:
    rest = spot.copy()
    _draw_disc(rest, cone, camera, corner, 0)
    return rest


def _draw_disc(picture: np.ndarray, cone: np.ndarray, camera: CameraModel, corner: tuple[int, int], value: int) -> None:
    middle, radius = _middle_and_radius(cone, camera)
    cv2.circle(picture, tuple(int(round(v)) for v in middle - corner), int(round(radius)), value, -1)


def _within(points: np.ndarray, camera: CameraModel, border: float) -> np.ndarray:
    """Tell which points (n, 2) are in the picture, not at its border."""
    return np.all((points >= border) & (points <= np.array([camera.width - 1, camera.height - 1]) - border), axis=1)
