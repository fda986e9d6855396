"""Black feet of the tubes in the rectified picture of the sheet: Hough circles, then an edge fit for each.

All positions here are pixels (column, row) of the rectified sheet. The camera looks down on the foot from the front,
so of the foot's outline only the half that faces the camera is sure to be seen: there it is the circle in which the
disc touches the paper, without parallax. Behind, the taped wall hides the disc (the paper's crescent). Everything
that decides or measures below therefore looks at that half alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import cv2
import numpy as np

from dr_eureka.vision.edges import rising_edges, sample

RAYS, FEWEST_RAYS = 61, 8
RADIAL_STEP_PX, EDGE_REACH_PX = 0.5, 2.0
FIT_STEPS = 6
PAPER = 1.0
WELL_SEEN = 0.85  # share of the facing outline
OVERLAP_RADII = 1.5  # feet stand at least two radii apart


@dataclass(frozen=True)
class FootSettings:
    """Which circles count as feet; config/dr_eureka_main.yaml gives meaning and unit of each key."""

    radius_tolerance: float = field(metadata={"min": 0.01, "max": 0.5})
    hough_votes: float = field(metadata={"min": 1.0})
    most_candidates: int = field(metadata={"min": 3})
    half_arc_rad: float = field(metadata={"min": 0.3, "max": 1.57})
    search_px: float = field(metadata={"min": 1.0})
    smallest_step: float = field(metadata={"min": 0.01, "max": 1.0})
    edge_band: float = field(metadata={"min": 0.1})
    smallest_arc_share: float = field(metadata={"min": 0.05, "max": 1.0})
    smallest_agreement: float = field(metadata={"min": 0.05, "max": 1.0})
    brightest_rim: float = field(metadata={"min": 0.01, "max": 1.0})
    most_coloured_rim: float = field(metadata={"min": 0.01, "max": 1.0})


@dataclass(frozen=True, eq=False)
class Foot:
    """A foot's centre (2,) [px], its covariance (2, 2) [px^2] and the share of its facing outline that was seen."""

    centre: np.ndarray
    covariance: np.ndarray
    arc_share: float


def find_feet(
    brightness: np.ndarray,
    wiped: np.ndarray,
    below_camera: np.ndarray,
    camera_pixel: Callable[[np.ndarray], float],
    tint: Callable[[np.ndarray], float],
    radius_px: float,
    rim_px: float,
    settings: FootSettings,
) -> list[Foot]:
    """Find the feet in a rectified picture.

    Args:
        brightness: (rows, columns) float32, 0 = printed black, 1 = white paper; what is not paper must be set to 1.
        wiped: (rows, columns) bool, what was set to 1: a foot beside it ends there only in this picture.
        below_camera: (2,) the point of the sheet's plane right below the camera [px], usually outside of the picture.
        camera_pixel: tells for a place (2,) of the picture how long a pixel of the camera is there [px].
        tint: tells how far from the paper's white places (..., 2) of the picture are in hue: the difference of their
            brightest and their darkest channel, each as a share of the paper's.
        radius_px: radius of the foot's disc.
        rim_px: width of the disc outside of the taped wall.

    Returns:
        Feet that do not overlap, the best seen first.
    """
    feet: list[Foot] = []
    wiped = wiped.astype(np.float32)
    for centre in _candidates(brightness, radius_px, settings):
        # A foot draws several circles; once it is seen well, its other circles need no fit.
        if any(foot.arc_share > WELL_SEEN and np.linalg.norm(foot.centre - centre) < radius_px for foot in feet):
            continue
        # Where the camera sees the paper coarsely, the outline is as jagged as its pixels are long.
        band_px = settings.edge_band * camera_pixel(centre)
        foot = _fit(brightness, wiped, centre, below_camera, tint, radius_px, rim_px, band_px, settings)
        if foot is not None:
            feet.append(foot)
    kept: list[Foot] = []
    for foot in sorted(feet, key=lambda foot: -foot.arc_share):
        if all(np.linalg.norm(foot.centre - other.centre) > OVERLAP_RADII * radius_px for other in kept):
            kept.append(foot)
    return kept


def _candidates(brightness: np.ndarray, radius_px: float, settings: FootSettings) -> np.ndarray:
    """Centres (n, 2) of Hough circles of about the foot's radius, strongest first."""
    smooth = cv2.GaussianBlur((brightness * 255).astype(np.uint8), (0, 0), 1.5)
    least, most = (radius_px * (1 + sign * settings.radius_tolerance) for sign in (-1, 1))
    circles = cv2.HoughCircles(
        smooth,
        cv2.HOUGH_GRADIENT,
        dp=2,
        minDist=radius_px / 4,
        param1=100,
        param2=settings.hough_votes,
        minRadius=round(least),
        maxRadius=round(most),
    )
    return np.empty((0, 2)) if circles is None else circles.reshape(-1, 3)[: settings.most_candidates, :2].astype(float)


def _fit(
    brightness: np.ndarray,
    wiped: np.ndarray,
    centre: np.ndarray,
    below_camera: np.ndarray,
    tint: Callable[[np.ndarray], float],
    radius_px: float,
    rim_px: float,
    band_px: float,
    settings: FootSettings,
) -> Foot | None:
    """Fit a circle of known radius to the dark-to-bright steps facing the camera; None if they are not a foot's."""
    offsets = np.arange(-settings.search_px, settings.search_px + 1e-6, RADIAL_STEP_PX)
    for _ in range(FIT_STEPS):
        facing = np.arctan2(*(below_camera - centre)[::-1])
        angles = facing + np.linspace(-settings.half_arc_rad, settings.half_arc_rad, RAYS)
        outward = np.column_stack([np.cos(angles), np.sin(angles)])
        lines = centre + (radius_px + offsets[:, None]) * outward[:, None]
        steps, errors = rising_edges(sample(brightness, lines, PAPER), offsets, EDGE_REACH_PX, settings.smallest_step)
        # A line that runs into what was wiped ends there, not at the foot's edge.
        steps &= ~((sample(wiped, lines, 0.0) > 0) & (offsets < errors[:, None] + EDGE_REACH_PX)).any(axis=1)
        if steps.sum() < FEWEST_RAYS:
            return None
        # Edges off the circle count little, yet enough to draw in a candidate that starts a few pixels away.
        weights = np.where(steps, 1 / (1 + (errors / band_px) ** 2) ** 2, 0.0)
        normal = outward.T @ (weights[:, None] * outward)
        if np.linalg.det(normal) < 1e-3:
            return None
        shift = np.linalg.solve(normal, outward.T @ (weights * errors))
        centre = centre + shift
        if np.linalg.norm(shift) < 0.03:
            break
    good = steps & (np.abs(errors - outward @ shift) < band_px)
    share = float(good.mean())
    # The upright disc of a fallen tube has an outline all round, but not that of a circle on the paper.
    if share < settings.smallest_arc_share or share < settings.smallest_agreement * steps.mean():
        return None
    # Between the edge's blur and the wall, the disc itself must be dark.
    depths = np.linspace(EDGE_REACH_PX, 0.8 * rim_px, 4)
    rim = centre + (radius_px - depths[:, None]) * outward[good][:, None]
    if np.median(sample(brightness, rim, PAPER)) > settings.brightest_rim:
        return None
    # The shaded side of a purple ball is as dark as a foot behind another tube, but coloured.
    if tint(rim) > settings.most_coloured_rim:
        return None
    spread = max(0.2, float(np.std(errors[good] - (outward @ shift)[good])))
    # Neighbouring rays share camera pixels: count every second one.
    covariance = 2 * spread**2 * np.linalg.inv(outward[good].T @ outward[good])
    return Foot(centre, covariance, share)
