"""The sheet as seen from straight above, in shades between its print and its paper."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from dr_eureka.pieces import Pieces
from dr_eureka.vision.camera import CameraModel

# Percentiles of the brightness inside a marker: its border alone is over half of it, white modules a fifth or more.
BLACK_PERCENTILE, WHITE_PERCENTILE = 30, 92


@dataclass(frozen=True)
class SheetGrid:
    """Pixels of a picture of the whole sheet, laid out as `sheet_image`: far edge in row 0, left edge in column 0.

    Args:
        pieces: sizes of the sheet [m].
        pixels_per_metre: resolution [px/m].
        margin_m: width of the strip round the sheet that the picture shows, too [m].
    """

    pieces: Pieces
    pixels_per_metre: float
    margin_m: float = 0.0

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows."""
        return tuple(np.rint(2 * self._far_left * self.pixels_per_metre).astype(int).tolist())

    def pixels(self, points_sheet: np.ndarray) -> np.ndarray:
        """Return the pixels (..., 2) (column, row) of points (..., 2) of the sheet frame [m]."""
        return (self._far_left - np.asarray(points_sheet)[..., ::-1]) * self.pixels_per_metre - 0.5

    def points(self, pixels: np.ndarray) -> np.ndarray:
        """Return the points (..., 2) of the sheet frame [m] of pixels (..., 2), the inverse of `pixels`."""
        return (self._far_left - (np.asarray(pixels) + 0.5) / self.pixels_per_metre)[..., ::-1]

    @property
    def _far_left(self) -> np.ndarray:
        return np.array([self.pieces.sheet_width, self.pieces.sheet_depth]) / 2 + self.margin_m


def rectify(image: np.ndarray, camera: CameraModel, camera_from_sheet: np.ndarray, grid: SheetGrid) -> np.ndarray:
    """Remove the perspective from the sheet's part of an image.

    Args:
        image: picture of `camera`, which has no distortion.
        camera_from_sheet: (4, 4) pose of the sheet in the optical frame.

    Returns:
        Picture of the sheet on `grid`; white where the camera does not look.
    """
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    image_from_grid = _image_from_grid(camera, camera_from_sheet, grid)
    return cv2.warpPerspective(image, image_from_grid, grid.size, flags=flags, borderValue=(255, 255, 255))


def camera_pixels(camera: CameraModel, camera_from_sheet: np.ndarray, grid: SheetGrid, pixels: np.ndarray) -> np.ndarray:
    """Return the pixels (..., 2) of the camera that see pixels (..., 2) of `grid`."""
    image_from_grid = _image_from_grid(camera, camera_from_sheet, grid)
    seen = np.asarray(pixels) @ image_from_grid[:, :2].T + image_from_grid[:, 2]
    return seen[..., :2] / seen[..., 2:]


def camera_pixel_size(camera: CameraModel, camera_from_sheet: np.ndarray, grid: SheetGrid, pixel: np.ndarray) -> float:
    """Return how long a pixel of the camera is on `grid` at a pixel (2,) of it, along its longer side [px]."""
    image_from_grid = _image_from_grid(camera, camera_from_sheet, grid)
    column, row, depth = image_from_grid @ [*pixel, 1.0]
    derivative = (image_from_grid[:2, :2] - np.outer((column, row), image_from_grid[2, :2]) / depth) / depth
    return float(1.0 / np.linalg.svd(derivative, compute_uv=False)[-1])


def _image_from_grid(camera: CameraModel, camera_from_sheet: np.ndarray, grid: SheetGrid) -> np.ndarray:
    """Return the homography (3, 3) from pixels of `grid` to those of the camera."""
    (x0, y0), (x1, y1) = grid.points(np.array([[0.0, 0.0], [1.0, 1.0]]))
    points_from_pixels = np.array([[0.0, x1 - x0, x0], [y1 - y0, 0.0, y0], [0.0, 0.0, 1.0]])
    return camera.matrix @ camera_from_sheet[:3][:, [0, 1, 3]] @ points_from_pixels


def paper_brightness(
    rectified: np.ndarray, grid: SheetGrid, markers: tuple[int, ...], margin_m: float, smallest_contrast: float
) -> np.ndarray | None:
    """Scale a picture of the sheet so that print is 0 and paper 1 whatever the light, and wipe the markers out.

    Both levels are read off the markers; that of the paper is a plane over the sheet, since light falls off.

    Args:
        rectified: (rows, columns) uint8 on `grid`.
        markers: the markers that are in view, at least three.
        margin_m: width of the strip round each marker, seen or not, that is set to 1 with it (`wiped_out`) [m].
        smallest_contrast: least difference of paper and print [grey levels].

    Returns:
        (rows, columns) float32 from 0 to 1, or None if the contrast is smaller.
    """
    squares = {marker: grid.pixels(grid.pieces.marker_corners(marker)[[0, 2]]) for marker in grid.pieces.marker_centres}
    levels = []
    for marker in markers:
        (left, top), (right, bottom) = np.rint(squares[marker]).astype(int)
        levels.append(np.percentile(rectified[top:bottom, left:right], (BLACK_PERCENTILE, WHITE_PERCENTILE)))
    black, whites = float(np.median(levels, axis=0)[0]), np.array(levels)[:, 1]
    if whites.min() - black < smallest_contrast:
        return None
    centres = np.array([[*squares[marker].mean(axis=0), 1.0] for marker in markers])
    by_column, by_row, offset = np.linalg.lstsq(centres, whites - black, rcond=None)[0].astype(np.float32)
    rows, columns = (axis.astype(np.float32) for axis in np.indices(rectified.shape, sparse=True))
    paper = np.maximum(by_column * columns + by_row * rows + offset, np.float32(smallest_contrast))
    brightness = np.clip((rectified - np.float32(black)) / paper, 0.0, 1.0)
    brightness[wiped_out(grid, margin_m)] = 1.0
    return brightness


def wiped_out(grid: SheetGrid, margin_m: float) -> np.ndarray:
    """Return which pixels of `grid` belong to a marker or to the strip round it, (rows, columns) bool."""
    columns, rows = grid.size
    wiped = np.zeros((rows, columns), bool)
    margin = margin_m * grid.pixels_per_metre
    for marker in grid.pieces.marker_centres:
        square = grid.pixels(grid.pieces.marker_corners(marker)[[0, 2]])
        (left, top), (right, bottom) = np.maximum(np.rint(square + [[-margin], [margin]]).astype(int), 0)
        wiped[top:bottom, left:right] = True
    return wiped
