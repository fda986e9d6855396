"""Where a hand must be for a tube to be somewhere, and the other way round.

A tube's frame has its origin at the centre of the foot's underside and z along the axis to the mouth; x is the hand's
approach direction made perpendicular to the axis. A hand's frame is the arm's end link (x approach, y finger opening, z pad
width).
"""

from __future__ import annotations

import numpy as np

from dr_eureka.kinematics.transforms import invert, transform

UP = np.array([0.0, 0.0, 1.0])


def frame_along(axis: np.ndarray, approach: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """Return the frame (4, 4) with z along `axis` and x along `approach` made perpendicular to it."""
    z = axis / np.linalg.norm(axis)
    x = approach - (approach @ z) * z
    x = x / np.linalg.norm(x)
    return transform(np.column_stack([x, np.cross(z, x), z]), origin)


def level_hand(grasp_centre: np.ndarray, yaw: float, centre_beyond_end: float) -> np.ndarray:
    """Return base_from_end (4, 4) of a level hand with its grasp centre at a point (3,) [m], approaching along `yaw` [rad].

    `centre_beyond_end` [m]: how far the grasp centre is in front of the end link.
    """
    approach = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    return frame_along(UP, approach, np.asarray(grasp_centre) - centre_beyond_end * approach)


def tube_in_hand(base_from_end: np.ndarray, foot: np.ndarray) -> np.ndarray:
    """Return end_from_tube (4, 4) when the fingers have closed on an upright tube whose foot is at (3,) [m] in base.

    The fingers are coupled, so they slide the tube to the middle between them: along y the tube is where the hand is, not
    where it was seen.
    """
    end_from_base = invert(base_from_end)
    axis = end_from_base[:3, :3] @ UP
    origin = (end_from_base @ np.append(foot, 1.0))[:3]
    at_pads = origin - axis * (origin[2] / axis[2])
    origin = origin - np.array([0.0, at_pads[1], 0.0])
    return frame_along(axis, np.array([1.0, 0.0, 0.0]), origin)


def hand_for_tube(base_from_tube: np.ndarray, end_from_tube: np.ndarray) -> np.ndarray:
    """Return base_from_end (4, 4) that brings a held tube to a pose (4, 4)."""
    return base_from_tube @ invert(end_from_tube)
