"""Where a hand is, from the marker glued on top of it."""

from __future__ import annotations

import cv2
import numpy as np

from dr_eureka.errors import DrEurekaError
from dr_eureka.pieces import Pieces
from dr_eureka.vision.aruco import find_markers
from dr_eureka.vision.camera import CameraModel
from dr_eureka.vision.marker_edges import refine_corners

EDGE_SEARCH_PX = 3.0
SMALLEST_EDGE = 12.0
LARGEST_RESIDUAL_PX = 0.7


class HandMarkerError(DrEurekaError):
    """The marker on a hand was not made out; the text says why."""


def locate_hand(image_rgb: np.ndarray, camera: CameraModel, pieces: Pieces, hand: str, expected: np.ndarray) -> np.ndarray:
    """Return camera_from_end (4, 4) [m] of a hand whose marker is in the picture.

    A square seen at a slant has two poses that look almost alike (Collins and Bartoli, "Infinitesimal Plane-Based Pose
    Estimation", 2014; OpenCV's IPPE_SQUARE returns both): the one that is turned more like the expected is refined.

    Args:
        image_rgb: (height, width, 3) uint8, as the camera gives it.
        expected: camera_from_end (4, 4) as the joints tell it.

    Raises:
        HandMarkerError: marker not seen, seen twice, with a side covered, or corners that no marker of its size has.
        CameraError: the image has another size than the camera.
    """
    marker = pieces.hand_markers[hand]
    grey = cv2.cvtColor(camera.undistort(image_rgb), cv2.COLOR_RGB2GRAY)
    detection = find_markers(grey, pieces.marker_dictionary)
    if marker not in detection.corners:
        seen = f"seen twice {list(detection.duplicates)}, " if detection.duplicates else ""
        seen += f"seen {sorted(detection.corners)}"
        raise HandMarkerError(f"marker {marker} on the {hand} hand is not in the picture; {seen}")
    corners = refine_corners(grey.astype(np.float32), detection.corners[marker], EDGE_SEARCH_PX, SMALLEST_EDGE)
    if corners is None:
        raise HandMarkerError(f"marker {marker} on the {hand} hand: a side of it cannot be made out")
    points = pieces.hand_marker_corners()
    centre = points.mean(axis=0)
    # IPPE_SQUARE wants the square round its origin with x to the print's right, the hand's -y, and y up, the hand's x.
    half = pieces.hand_marker_side / 2
    square = np.array([(-half, half, 0.0), (half, half, 0.0), (half, -half, 0.0), (-half, -half, 0.0)])
    end_from_square = np.eye(4)
    end_from_square[:3, :3], end_from_square[:3, 3] = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], centre
    _, rotations, shifts, _ = cv2.solvePnPGeneric(square, corners, camera.matrix, None, flags=cv2.SOLVEPNP_IPPE_SQUARE)
    candidates = [_pose(*pose) @ np.linalg.inv(end_from_square) for pose in zip(rotations, shifts)]
    nearest = max(candidates, key=lambda pose: np.trace(pose[:3, :3].T @ expected[:3, :3]))
    first_turn, first_shift = cv2.Rodrigues(nearest[:3, :3])[0], nearest[:3, 3:].copy()
    turn, shift = cv2.solvePnPRefineLM(points, corners, camera.matrix, None, first_turn, first_shift)
    pose = _pose(turn, shift)
    misses = camera.without_distortion().project(points @ pose[:3, :3].T + pose[:3, 3]) - corners
    residual = float(np.sqrt((misses**2).sum(axis=1).mean()))
    if not residual <= LARGEST_RESIDUAL_PX:
        raise HandMarkerError(
            f"marker {marker} on the {hand} hand: corners miss a square of {pieces.hand_marker_side} m by "
            f"{residual:.2f} px, expected at most {LARGEST_RESIDUAL_PX} px"
        )
    return pose


def _pose(turn: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """Return OpenCV's rotation vector and translation as a (4, 4) transform."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = cv2.Rodrigues(turn)[0], np.ravel(shift)
    return pose
