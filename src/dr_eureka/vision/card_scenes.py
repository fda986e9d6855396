"""Cards as a camera sees them: turned, tilted, lit, blurred and compressed; for training and for measuring.

Pixels: x right, y down. A card's corners go clockwise from its upper left as printed.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from dr_eureka.vision.card_finder import rectify
from dr_eureka.vision.card_renderer import CardDrawing, sample_style

_CARD_SIDE_M = 0.10
_FOCAL_PX = 619.0


@dataclass(frozen=True)
class ViewRanges:
    """Ranges that random views are drawn from; turns and tilts in radians, sides in pixels of a 640x480 camera."""

    side: tuple[float, float] = (75.0, 330.0)
    turn: tuple[float, float] = (-np.pi, np.pi)
    tilt: tuple[float, float] = (0.0, 0.8)
    exposure: tuple[float, float] = (0.5, 2.0)
    white_balance: float = 0.12
    motion_px: float = 5.0
    defocus_px: float = 1.2
    noise: float = 9.0
    jpeg: tuple[int, int] = (35, 96)
    glare_share: float = 0.15


def card_corners(rng: np.random.Generator, ranges: ViewRanges) -> np.ndarray:
    """Return the four corners (4, 2) of a randomly posed card about its centre, in pixels."""
    side = np.exp(rng.uniform(*np.log(ranges.side)))
    turn, tilt, heading = rng.uniform(*ranges.turn), rng.uniform(*ranges.tilt), rng.uniform(-np.pi, np.pi)
    half = _CARD_SIDE_M / 2
    card = np.array([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)])
    in_plane, _ = cv2.Rodrigues(np.array((0, 0, turn)))
    out_of_plane, _ = cv2.Rodrigues(tilt * np.array((np.cos(heading), np.sin(heading), 0)))
    points = card @ (out_of_plane @ in_plane).T
    depth = _FOCAL_PX * _CARD_SIDE_M / side
    return _FOCAL_PX * points[:, :2] / (points[:, 2:] + depth)


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


def degrade(image: np.ndarray, rng: np.random.Generator, ranges: ViewRanges) -> np.ndarray:
    """Return an RGB image as a web camera would deliver it: light, white balance, glare, blur, noise, JPEG."""
    height, width = image.shape[:2]
    exposure = np.exp(rng.uniform(*np.log(ranges.exposure)))
    gain = (exposure * np.exp(rng.normal(0, ranges.white_balance, 3) / 2)).astype(np.float32)
    slope = rng.uniform(-0.3, 0.3, 2)
    light = 1 + slope[0] * np.linspace(-1, 1, width)[None] + slope[1] * np.linspace(-1, 1, height)[:, None]
    view = image.astype(np.float32) * gain * light[..., None].astype(np.float32)
    if rng.random() < ranges.glare_share:
        x, y = rng.uniform(0, width), rng.uniform(0, height)
        spread = rng.uniform(0.08, 0.4) * min(width, height)
        spot = np.exp(-((np.arange(width) - x)[None] ** 2 + (np.arange(height) - y)[:, None] ** 2) / spread**2)
        view += (rng.uniform(20, 110) * spot[..., None]).astype(np.float32)
    if rng.random() < 0.4 and ranges.motion_px >= 1:
        view = cv2.filter2D(view, -1, _motion_kernel(rng.uniform(1, ranges.motion_px), rng.uniform(0, np.pi)))
    sigma = rng.uniform(0, ranges.defocus_px)
    if sigma > 0.3:
        view = cv2.GaussianBlur(view, (0, 0), sigma)
    view += rng.normal(0, rng.uniform(0, ranges.noise), view.shape).astype(np.float32)
    view = np.clip(view, 0, 255).astype(np.uint8)
    if rng.random() < 0.6:
        _, packed = cv2.imencode(".jpg", view[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(*ranges.jpeg))])
        view = np.ascontiguousarray(cv2.imdecode(packed, cv2.IMREAD_COLOR)[..., ::-1])
    return view


def _motion_kernel(length: float, angle: float) -> np.ndarray:
    """Return a straight motion-blur kernel of a length in pixels."""
    size = 2 * int(np.ceil(length / 2)) + 3
    kernel = np.zeros((size, size), np.float32)
    middle = (size - 1) / 2
    for along in np.linspace(-length / 2, length / 2, 25):
        x, y = middle + along * np.cos(angle), middle + along * np.sin(angle)
        column, row = int(x), int(y)
        for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
            kernel[row + dy, column + dx] += (1 - abs(x - column - dx)) * (1 - abs(y - row - dy))
    return kernel / kernel.sum()


def clutter(rng: np.random.Generator, width: int, height: int, things: int) -> np.ndarray:
    """Return an RGB background (height, width, 3): a graded ground with random boxes, discs and lines on it."""
    first, second = rng.uniform(10, 245, (2, 3))
    ramp = np.linspace(0, 1, height)[:, None, None] * np.ones((1, width, 1))
    image = np.ascontiguousarray((first * ramp + second * (1 - ramp)).astype(np.uint8))
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
    style = sample_style(rng, wide=True)
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


def rectified_sample(
    drawing: CardDrawing, rng: np.random.Generator, ranges: ViewRanges
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a training crop of a card seen at random, cut out as the finder would, in one of four turns.

    The crop is (416, 416, 3) uint8 RGB; balls (n, 4) hold x, y, diameter as fractions of the crop and the class index;
    feet (3, 2) x, y.
    """
    corners = card_corners(rng, ranges)
    corners -= corners.min(0) - 8
    width, height = (int(v) for v in np.ceil(corners.max(0)) + 8)
    image = clutter(rng, width, height, int(rng.integers(0, 6)))
    paste_card(image, drawing, corners)
    image = degrade(image, rng, ranges)

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
        row[:] = (*centre, 2 * np.mean(np.linalg.norm(edges - centre, axis=1)), "RGP".index(ball.colour))
    return crop, balls, _apply(to_fractions, drawing.feet)


def _apply(homography: np.ndarray, points: np.ndarray) -> np.ndarray:
    points = np.asarray(points, np.float64)
    return cv2.perspectiveTransform(points[None], homography)[0] if len(points) else points
