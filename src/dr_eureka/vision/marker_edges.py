"""Corners of a square marker from its four sides, for markers that a tube's wall or a hand covers in part.

The detector needs an unbroken outline and takes each corner from a few pixels; a line through some twenty edge points
a side needs neither, and puts the corner where the sides would meet.
"""

from __future__ import annotations

import cv2
import numpy as np

from dr_eureka.vision.edges import rising_edges, sample

POINTS_A_SIDE = 28
STEP_PX, EDGE_REACH_PX = 0.25, 1.0
# A point belongs to a side if it lies this close to its line; the first look is wider, as the prediction may be off.
INLIER_PX = 0.6
FEWEST_SHARE = 0.35
MODULE_PX = 8


def refine_corners(grey: np.ndarray, corners: np.ndarray, search_px: float, smallest_step: float) -> np.ndarray | None:
    """Move a marker's predicted corners to where its dark border really ends.

    Args:
        grey: (rows, columns) float32 picture without lens distortion.
        corners: (4, 2) predicted corners [px], clockwise as seen.
        search_px: how far a side may lie from the prediction; less than the marker's modules are wide.
        smallest_step: least rise from border to paper [grey levels].

    Returns:
        (4, 2) corners in the same order, or None if a side cannot be made out.
    """
    shares = np.linspace(0.06, 0.94, POINTS_A_SIDE)
    ends = np.roll(corners, -1, axis=0)
    along = ends - corners
    length = np.linalg.norm(along, axis=1, keepdims=True)
    if not length.min() >= 4 * search_px:  # also true of corners that have no place in the picture (NaN)
        return None
    # Image rows grow downward, so outward of a clockwise outline is to its left.
    outward = np.column_stack([along[:, 1], -along[:, 0]]) / length
    reach = search_px + EDGE_REACH_PX
    offsets = np.arange(-reach, reach + 1e-6, STEP_PX)
    points = corners[:, None] + shares[None, :, None] * along[:, None]
    samples = points[:, :, None] + offsets[:, None] * outward[:, None, None]
    profiles = sample(grey, samples.reshape(-1, len(offsets), 2), beyond=0.0)
    found, distance = rising_edges(profiles, offsets, EDGE_REACH_PX, smallest_step)
    lines = _lines(shares, distance.reshape(4, -1), found.reshape(4, -1))
    if lines is None:
        return None
    starts = corners + lines[:, :1] * outward
    directions = along + lines[:, 1:] * outward
    return np.array([_crossing(starts[k - 1], directions[k - 1], starts[k], directions[k]) for k in range(4)])


def resemblance(grey: np.ndarray, corners: np.ndarray, printed: np.ndarray) -> float:
    """Return the correlation (-1 to 1) of what lies between four corners with a marker drawn by `marker_image`."""
    side = printed.shape[0]
    square = np.array([[0, 0], [side, 0], [side, side], [0, side]], np.float32) - 0.5
    homography = cv2.getPerspectiveTransform(square, corners.astype(np.float32))
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    seen = cv2.warpPerspective(grey, homography, (side, side), flags=flags)
    return float(cv2.matchTemplate(seen, printed.astype(np.float32), cv2.TM_CCOEFF_NORMED)[0, 0])


def _lines(shares: np.ndarray, distance: np.ndarray, found: np.ndarray) -> np.ndarray | None:
    """Fit distance = offset + slope * share to each side (4, n): (4, 2), or None if too few points of a side agree."""
    fewest = FEWEST_SHARE * len(shares)
    if (found.sum(axis=1) < fewest).any():
        return None
    design = np.column_stack([np.ones_like(shares), shares])
    lines = np.column_stack([[np.median(distance[side, found[side]]) for side in range(4)], np.zeros(4)])
    for width in (3.0, 1.5, 1.0, INLIER_PX, INLIER_PX):
        errors = (distance - lines @ design.T) / width
        weights = np.where(found & (np.abs(errors) < 1), (1 - errors**2) ** 2, 0.0)
        if ((weights > 0).sum(axis=1) < fewest).any():
            return None
        weighted = weights[:, :, None] * design
        lines = np.linalg.solve(design.T @ weighted, (weighted * distance[:, :, None]).sum(axis=1)[..., None])[..., 0]
    return lines


def _crossing(
    first: np.ndarray, first_direction: np.ndarray, second: np.ndarray, second_direction: np.ndarray
) -> np.ndarray:
    """Point where two lines meet."""
    steps = np.linalg.solve(np.column_stack([first_direction, -second_direction]), second - first)
    return first + steps[0] * first_direction
