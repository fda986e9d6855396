"""Where cards may be in a picture, and their rectified crops (paper section 3.1, Figure 6).

The paper's way, grey, threshold, contours, four corners, rectify, with three differences. The grey is each pixel's
smallest channel, in which balls and bench are as dark as the chalkboard and only what is white is bright. Several
thresholds are tried, so that no exposure is assumed. And the quadrilateral is the black ground inside the white border,
whose contrast the card brings along, whatever it lies on. A picture is searched at a fraction of its size, and at its own
size only if nothing was found: lines fitted to whole sides lose nothing by that. Sizes are compared with the picture and
with the quadrilateral itself, never with pixels at an assumed camera height.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np

CROP_PX = 416
NOMINAL_BORDER = 0.065  # white border as a share of the card's side
_SAMPLES_A_SIDE = 16
_MOST_POINTS = 320  # of an outline: lines fitted to more are no better
_SEARCH_HEIGHT_PX = 240
_OUTLINES_A_PLACE = 2  # of one card at several thresholds, tried in turn when it cannot be read
_NEXT = [1, 2, 3, 0]
_COARSE_PX = 64
THUMBNAIL_PX = 2 * _COARSE_PX  # of a crop that is large enough for coloured_share
_SIDE_SHARES = np.linspace(0.06, 0.94, _SAMPLES_A_SIDE, dtype=np.float32)[:, None]  # of a side, where it is sampled
_SAMPLED_SCALES = np.array([1.07, 0.93], np.float32)[:, None, None]  # of the ground: in its border and inside it
_PLAIN_CHROMA = 0.15  # largest less smallest channel, of the border's white; purple, the palest ball, has 0.32


@dataclass(frozen=True)
class FinderSettings:
    """What a quadrilateral must be like to be looked at as a card."""

    threshold_steps: int = field(metadata={"min": 2, "max": 30})  # levels between black and the picture's white
    smallest_side: float = field(metadata={"min": 0.02, "max": 1.0})  # of the picture's height
    longest_aspect: float = field(metadata={"min": 1.0, "max": 3.0})  # longest side over shortest
    least_fill: float = field(metadata={"min": 0.5, "max": 1.0})  # hull's area over the quadrilateral's
    least_contrast: float = field(metadata={"min": 0.0, "max": 1.0})  # border over ground, of the picture's white
    least_coloured: float = field(metadata={"min": 0.0, "max": 1.0})  # share of a card that balls and bench colour
    most_candidates: int = field(metadata={"min": 1, "max": 50})


@dataclass(frozen=True)
class Candidate:
    """A dark quadrilateral in a white border: corners (4, 2) of the ground, clockwise, in pixels; side; quality 0..1."""

    ground: np.ndarray
    side_px: float
    quality: float

    @cached_property
    def centre(self) -> np.ndarray:
        return self.ground.mean(0)


def find_candidates(image_rgb: np.ndarray, settings: FinderSettings) -> list[Candidate]:
    """Return quadrilaterals that may be cards in an RGB image (h, w, 3) uint8, best first; the same card may repeat."""
    red, green, blue = cv2.split(image_rgb)
    whiteness = cv2.min(cv2.min(red, green), blue)
    step = image_rgb.shape[0] // _SEARCH_HEIGHT_PX
    if step >= 2:
        height, width = (length // step * step for length in whiteness.shape)
        small = cv2.resize(whiteness[:height, :width], (width // step, height // step), interpolation=cv2.INTER_AREA)
        found = _search(small, step, settings)
        if found:
            return found
    return _search(cv2.GaussianBlur(whiteness, (3, 3), 0), 1, settings)


def _search(smooth: np.ndarray, scale: int, settings: FinderSettings) -> list[Candidate]:
    """Return the candidates, best first, in a grey picture (h, w) uint8 each pixel of which is `scale` wide."""
    white = max(float(np.percentile(smooth[::2, ::2], 99.5)), 16.0)
    smallest = settings.smallest_side * smooth.shape[0]
    outlines = []
    for level in np.linspace(0.0, white, settings.threshold_steps + 2)[1:-1]:
        _, dark = cv2.threshold(smooth, level, 255, cv2.THRESH_BINARY_INV)
        contours, nesting = cv2.findContours(dark, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
        around = nesting[0, :, 3].tolist() if contours else ()
        for contour, surrounding in zip(contours, around):
            if surrounding >= 0 or len(contour) < 3 * smallest:  # the rim of a bright hole in something dark, or small
                continue
            polygon = _four_corners(contour, smallest, settings)
            if polygon is not None:
                outlines.append((polygon, contour, level))
    if not outlines:
        return []
    polygons, _, levels = zip(*outlines)
    qualities = _qualities(smooth, np.stack(polygons), np.array(levels), white, settings.least_contrast / 2)
    found: list[Candidate] = []
    for index in np.argsort(-qualities, kind="stable"):
        polygon, contour, level = outlines[index]
        outline = Candidate(polygon, float(np.sqrt(cv2.contourArea(polygon))), float(qualities[index]))
        if outline.quality == 0.0:
            break
        if sum(_same_place(outline, other, scale) for other in found) == _OUTLINES_A_PLACE:
            continue
        ground = _refine(contour[:, 0, :].astype(np.float32), outline.ground)
        if ground is None or not _filled(contour, ground, settings):
            continue
        quality = float(_qualities(smooth, ground[None], np.array([level]), white, settings.least_contrast)[0])
        if quality > 0.0:
            ground = (ground + 0.5) * scale - 0.5  # pixel centres of the small picture in the large one
            found.append(Candidate(ground, float(np.sqrt(cv2.contourArea(ground))), quality))
    found.sort(key=lambda candidate: -candidate.quality)
    return found


def _qualities(
    smooth: np.ndarray, grounds: np.ndarray, levels: np.ndarray, white: float, least_contrast: float
) -> np.ndarray:
    """Return how well grounds (n, 4, 2), found at threshold levels (n,), contrast with their borders, (n,) of 0..1.

    A ground with less than the least contrast gets 0.
    """
    border, inside = _borders_and_insides(smooth, grounds)
    contrast = (border - inside).min(1) / white
    # An edge that is blurred lies where its threshold is halfway: other levels see a card too small or large.
    apart = np.maximum((border - inside).mean(1), 1e-6)
    bias = np.abs(levels - (border + inside).mean(1) / 2) / apart
    return np.where(contrast > least_contrast, np.minimum(contrast, 1.0) * np.maximum(1.0 - bias, 0.1), 0.0)


def _same_place(one: Candidate, other: Candidate, scale: int = 1) -> bool:
    """Tell whether two candidates have nearly one place and size; `scale` enlarges the first."""
    if not 0.8 < scale * one.side_px / other.side_px < 1.25:
        return False
    x, y = scale * one.centre - other.centre
    return math.hypot(x, y) < 0.15 * other.side_px


def group(candidates: list[Candidate], most: int) -> list[list[Candidate]]:
    """Gather candidates of one place and size, best first in each group; the `most` largest groups in quality."""
    groups: list[list[Candidate]] = []
    for candidate in candidates:
        for members in groups:
            if _same_place(candidate, members[0]):
                members.append(candidate)
                break
        else:
            groups.append([candidate])
    return groups[:most]


def rectify(image: np.ndarray, ground: np.ndarray, side_px: int = CROP_PX) -> tuple[np.ndarray, np.ndarray]:
    """Cut a card out by its ground's corners (4, 2), clockwise from the one that becomes the upper left.

    Returns the crop (side_px, side_px, 3), in which a card of nominal border fills the frame, and the homography from
    picture to crop pixels.
    """
    near, far = NOMINAL_BORDER * side_px - 0.5, (1 - NOMINAL_BORDER) * side_px - 0.5
    target = np.array([(near, near), (far, near), (far, far), (near, far)], np.float32)
    homography = cv2.getPerspectiveTransform(ground.astype(np.float32), target)
    crop = cv2.warpPerspective(image, homography, (side_px, side_px), borderMode=cv2.BORDER_REPLICATE)
    return crop, homography


def coloured_share(crop: np.ndarray) -> float:
    """Return which share of a crop of any size is plainly coloured, its border taken for white.

    Balls are, markers are not.
    """
    small = cv2.resize(crop, (_COARSE_PX, _COARSE_PX), interpolation=cv2.INTER_AREA).astype(np.float32)
    edge = np.concatenate((small[2], small[-3], small[:, 2], small[:, -3]))
    margin = int(1.5 * NOMINAL_BORDER * _COARSE_PX)  # what surrounds the dark ground may have any colour
    relative = small[margin:-margin, margin:-margin] / np.maximum(np.median(edge, axis=0), 1.0)
    return float(((relative.max(-1) - relative.min(-1)) > _PLAIN_CHROMA).mean())


def _four_corners(contour: np.ndarray, smallest: float, settings: FinderSettings) -> np.ndarray | None:
    """Return the rough corners (4, 2) float32, clockwise in the picture, of a contour that is nearly a quadrilateral."""
    hull = cv2.convexHull(np.ascontiguousarray(contour[:: 1 + len(contour) // _MOST_POINTS]))
    if cv2.contourArea(hull) < smallest**2:
        return None
    perimeter = cv2.arcLength(hull, True)
    for tolerance in (0.03, 0.045, 0.06, 0.08):
        polygon = cv2.approxPolyDP(hull, tolerance * perimeter, True)[:, 0, :].astype(np.float32)
        if len(polygon) <= 4:
            break
    if len(polygon) != 4:
        return None
    sides = np.linalg.norm(polygon[_NEXT] - polygon, axis=1)
    if sides.min() < smallest or sides.max() > settings.longest_aspect * sides.min():
        return None
    # A positive area runs clockwise when y points down.
    return polygon if cv2.contourArea(polygon, oriented=True) > 0 else np.ascontiguousarray(polygon[::-1])


def _filled(contour: np.ndarray, ground: np.ndarray, settings: FinderSettings) -> bool:
    """Tell whether a contour's hull and a quadrilateral are nearly the same."""
    if not cv2.isContourConvex(ground):
        return False
    fill = cv2.contourArea(cv2.convexHull(contour)) / max(cv2.contourArea(ground), 1.0)
    return settings.least_fill <= fill <= 2.0 - settings.least_fill


def _refine(contour: np.ndarray, polygon: np.ndarray) -> np.ndarray | None:
    """Move a polygon's corners to where lines through the middles of its sides meet: the card's corners are round."""
    lines = []
    middle = polygon.mean(0)
    contour = contour[:: 1 + len(contour) // _MOST_POINTS]
    for start, end in zip(polygon, polygon[_NEXT]):
        length = np.linalg.norm(end - start)
        if length < 4:
            return None
        along = (end - start) / length
        normal = np.array((-along[1], along[0]))
        offset = contour - start
        share = offset @ along / length
        near = contour[(share > 0.12) & (share < 0.88) & (np.abs(offset @ normal) < 0.05 * length + 1)]
        if len(near) < 8:
            return None
        vx, vy, x, y = cv2.fitLine(near, cv2.DIST_HUBER, 0, 0.01, 0.01).ravel()
        point = np.array((x, y))
        outward = np.array((-vy, vx))
        outward *= np.sign(outward @ (point - middle)) or 1.0
        lines.append((point + 0.5 * outward, np.array((vx, vy))))  # a contour runs through the edge pixels' centres
    corners = []
    for (p, u), (q, v) in zip(np.roll(np.array(lines), 1, 0), lines):
        across = u[0] * v[1] - u[1] * v[0]
        if abs(across) < 0.5:  # sides that meet at less than 30 degrees
            return None
        reach = ((q - p)[0] * v[1] - (q - p)[1] * v[0]) / across
        corners.append(p + reach * u)
    return np.array(corners, np.float32)


def _borders_and_insides(whiteness: np.ndarray, grounds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the levels of the white borders and those just inside the grounds (n, 4, 2), for each side: (n, 4) each."""
    middle = grounds.mean(1)[:, None, None]
    corners = middle + _SAMPLED_SCALES * (grounds[:, None] - middle)
    along = corners[:, :, _NEXT] - corners
    points = (corners[:, :, :, None] + _SIDE_SHARES * along[:, :, :, None]).reshape(-1, _SAMPLES_A_SIDE, 2)
    levels = cv2.remap(whiteness, np.ascontiguousarray(points), None, cv2.INTER_LINEAR,
                       borderMode=cv2.BORDER_CONSTANT, borderValue=0)
    levels.sort(axis=1)
    levels = levels.reshape(len(grounds), 2, 4, _SAMPLES_A_SIDE).astype(float)
    # A quarter of the border may be hidden; inside, three white feet may leave little of a side dark.
    return levels[:, 0, :, _SAMPLES_A_SIDE // 4], levels[:, 1, :, _SAMPLES_A_SIDE // 7]
