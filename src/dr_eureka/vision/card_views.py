"""How a camera may see a card: its pose, light, blur, noise and compression, drawn as figures and applied to pictures.

Pixels: x right, y down. A card's corners go clockwise from its upper left as printed. Angles in radians.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from dr_eureka.vision.card_style import Bands, draw

_CARD_SIDE_M = 0.10
_FOCAL_PX = 619.0


@dataclass(frozen=True)
class View:
    """One way of seeing a card, whatever the card and its surroundings."""

    side_px: float  # of the card facing the camera, in a 640x480 picture
    turn: float  # clockwise in the picture
    tilt: float  # out of the picture's plane ..
    heading: float  # .. about an axis in it that lies this far from x
    exposure: float  # factor of all light
    white_balance: tuple[float, float, float]  # factor of each channel
    slope: tuple[float, float]  # light across and down the picture: 1 - slope at one end, 1 + slope at the other
    glare: tuple[float, float, float, float] | None  # x, y [share of the picture], spread [share], level [0..255]
    motion_px: float  # length of the motion blur; 0: none
    motion_angle: float
    defocus_px: float  # standard deviation
    noise: float  # standard deviation [0..255]
    jpeg: int | None  # quality; None: not compressed


@dataclass(frozen=True)
class ViewRanges:
    """What views are drawn from; names and units as in View.

    With `usual` given, a view takes `outside` of its quantities from these ranges and all others from the usual ones.
    """

    side_px: Bands = ((75.0, 330.0),)
    turn: Bands = ((-np.pi, np.pi),)
    tilt: Bands = ((0.0, 0.8),)
    exposure: Bands = ((0.5, 2.0),)
    white_balance: float = 0.06  # standard deviation of each channel's factor, as a logarithm
    motion_px: Bands = ((1.0, 5.0),)
    motion_share: float = 0.4  # of views that have any
    defocus_px: Bands = ((0.0, 1.2),)
    noise: Bands = ((0.0, 9.0),)
    jpeg: Bands = ((35.0, 95.0),)
    jpeg_share: float = 0.6
    glare_share: float = 0.15
    usual: ViewRanges | None = None
    outside: int = 1


TRAINING_VIEWS = ViewRanges()
# Outside of training's in one or two of six quantities at a time: all at once would leave nothing to see.
HELD_OUT_VIEWS = ViewRanges(
    side_px=((62.0, 75.0), (330.0, 380.0)), tilt=((0.8, 0.92),), exposure=((0.42, 0.5), (2.0, 2.3)), motion_px=((5.0, 6.5),),
    motion_share=1.0, noise=((9.0, 12.0),), jpeg=((25.0, 35.0),), jpeg_share=1.0, usual=TRAINING_VIEWS,
)
FAR_VIEWS = replace(HELD_OUT_VIEWS, outside=2)
_HELD_OUT = ("side_px", "tilt", "exposure", "motion_px", "noise", "jpeg")


def sample_view(rng: np.random.Generator, ranges: ViewRanges) -> View:
    """Return a random view."""
    if ranges.usual is not None:
        outside = sample_view(rng, replace(ranges, usual=None))
        chosen = rng.choice(_HELD_OUT, ranges.outside, replace=False)
        return replace(sample_view(rng, ranges.usual), **{name: getattr(outside, name) for name in chosen})
    glare = None
    if rng.random() < ranges.glare_share:
        glare = (rng.uniform(0, 1), rng.uniform(0, 1), rng.uniform(0.08, 0.4), rng.uniform(20, 110))
    moves, packed = rng.random() < ranges.motion_share, rng.random() < ranges.jpeg_share
    return View(
        side_px=_draw_evenly_in_ratio(rng, ranges.side_px),
        turn=draw(rng, ranges.turn),
        tilt=draw(rng, ranges.tilt),
        heading=rng.uniform(-np.pi, np.pi),
        exposure=_draw_evenly_in_ratio(rng, ranges.exposure),
        white_balance=tuple(np.exp(rng.normal(0, ranges.white_balance, 3))),
        slope=tuple(rng.uniform(-0.3, 0.3, 2)),
        glare=glare,
        motion_px=draw(rng, ranges.motion_px) if moves else 0.0,
        motion_angle=rng.uniform(0, np.pi),
        defocus_px=draw(rng, ranges.defocus_px),
        noise=draw(rng, ranges.noise),
        jpeg=round(draw(rng, ranges.jpeg)) if packed else None,
    )


def _draw_evenly_in_ratio(rng: np.random.Generator, bands: Bands) -> float:
    """Return a factor drawn so that halving and doubling are equally likely."""
    return float(np.exp(draw(rng, tuple((np.log(low), np.log(high)) for low, high in bands))))


def card_corners(view: View) -> np.ndarray:
    """Return the four corners (4, 2) of a card about its centre, in pixels."""
    half = _CARD_SIDE_M / 2
    card = np.array([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)])
    in_plane, _ = cv2.Rodrigues(np.array((0, 0, view.turn)))
    out_of_plane, _ = cv2.Rodrigues(view.tilt * np.array((np.cos(view.heading), np.sin(view.heading), 0)))
    points = card @ (out_of_plane @ in_plane).T
    depth = _FOCAL_PX * _CARD_SIDE_M / view.side_px
    return _FOCAL_PX * points[:, :2] / (points[:, 2:] + depth)


def degrade(image: np.ndarray, view: View, rng: np.random.Generator) -> np.ndarray:
    """Return an RGB image (h, w, 3) uint8 as a web camera would deliver it: light, glare, blur, noise, JPEG.

    The generator draws the noise and nothing else.
    """
    height, width = image.shape[:2]
    across, down = np.linspace(-1, 1, width)[None], np.linspace(-1, 1, height)[:, None]
    light = (view.exposure * (1 + view.slope[0] * across + view.slope[1] * down)).astype(np.float32)
    seen = image * (light[..., None] * np.array(view.white_balance, np.float32))
    if view.glare is not None:
        x, y, spread, level = view.glare
        apart = (np.arange(width)[None] - x * width) ** 2 + (np.arange(height)[:, None] - y * height) ** 2
        seen += (level * np.exp(-apart / (spread * min(width, height)) ** 2))[..., None].astype(np.float32)
    if view.motion_px > 0:
        seen = cv2.filter2D(seen, -1, _motion_kernel(view.motion_px, view.motion_angle))
    if view.defocus_px > 0.3:
        seen = cv2.GaussianBlur(seen, (0, 0), view.defocus_px)
    noise = rng.standard_normal(seen.shape, np.float32)
    noise *= view.noise
    seen += noise
    seen = np.clip(seen, 0, 255, out=seen).astype(np.uint8)
    if view.jpeg is None:
        return seen
    _, packed = cv2.imencode(".jpg", seen[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, view.jpeg])
    return np.ascontiguousarray(cv2.imdecode(packed, cv2.IMREAD_COLOR)[..., ::-1])


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
