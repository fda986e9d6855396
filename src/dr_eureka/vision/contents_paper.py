"""Where the sheet's blank paper lies in the picture, and how bright it is."""

from __future__ import annotations

import cv2
import numpy as np

from dr_eureka.pieces import Pieces
from dr_eureka.vision.camera import CameraModel

_EDGE_M = 0.004
_EDGE_POINTS = 12


def paper_mask(
    camera: CameraModel, base_from_camera: np.ndarray, base_from_sheet: np.ndarray | None, pieces: Pieces
) -> np.ndarray:
    """Return where unprinted paper is in the picture, (height, width) bool, whatever stands on it; none without a sheet."""
    mask = np.zeros((camera.height, camera.width), np.uint8)
    if base_from_sheet is None:
        return mask.astype(bool)
    camera_from_sheet = np.linalg.inv(base_from_camera) @ base_from_sheet
    half = np.array([pieces.sheet_depth, pieces.sheet_width]) / 2 - _EDGE_M
    signs = np.array([(1, 1), (1, -1), (-1, -1), (-1, 1)])
    squares = [pieces.marker_corners(marker) + signs * _EDGE_M for marker in pieces.marker_centres]
    for corners, value in [(signs * half, 1), *((square, 0) for square in squares)]:
        # Straight edges are curved by the lens: give each some points.
        shares = np.arange(_EDGE_POINTS)[:, None] / _EDGE_POINTS
        edges = [start + shares * (end - start) for start, end in zip(corners, np.roll(corners, -1, axis=0))]
        points = np.concatenate(edges) @ camera_from_sheet[:3, :2].T + camera_from_sheet[:3, 3]
        outline = camera.project(points)
        if np.isfinite(outline).all():
            cv2.fillPoly(mask, [np.rint(outline).astype(np.int32)], value)
    return mask.astype(bool)


def paper_white(image_rgb: np.ndarray, paper: np.ndarray) -> float:
    """Return the brightness of the paper [grey levels], its brightest channel's median; 0 if none is in the picture."""
    return float(np.median(image_rgb[paper].max(axis=1))) if paper.any() else 0.0
