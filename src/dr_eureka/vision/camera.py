"""Pinhole camera with OpenCV's plumb-bob distortion: pixels to rays and back."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np

from dr_eureka.errors import DrEurekaError

LAB_MATRIX = ((617.73492686, 0.0, 301.59321376), (0.0, 620.08687683, 238.79976856), (0.0, 0.0, 1.0))
LAB_DISTORTION = (0.09185878, -0.06354207, 0.00779513, -0.00322328, -0.36163446)


class CameraError(DrEurekaError):
    """Raised for a calibration that is none, or an image that is not this camera's."""


@dataclass(frozen=True, eq=False)
class CameraModel:
    """One calibrated camera; its optical frame has z forward, x right and y down.

    Args:
        width, height: size of the image [px].
        matrix: (3, 3) intrinsics K [px].
        distortion: up to five coefficients k1, k2, p1, p2, k3 of the plumb-bob model; missing ones are zero.

    Raises:
        CameraError: sizes, focal lengths or coefficients that no calibrated camera has (zero or NaN K and the like).
    """

    width: int
    height: int
    matrix: np.ndarray
    distortion: np.ndarray = field(default=(0.0,) * 5)

    def __post_init__(self) -> None:
        matrix = np.array(self.matrix, dtype=np.float64)
        distortion = np.array(self.distortion, dtype=np.float64).ravel()
        if self.width < 1 or self.height < 1:
            raise CameraError(f"camera image size is {self.width}x{self.height} px, expected at least 1x1")
        if matrix.size != 9 or not np.isfinite(matrix).all():
            raise CameraError(f"camera matrix is {matrix.ravel().tolist()}, expected 9 finite numbers")
        matrix = matrix.reshape(3, 3)
        if matrix[0, 0] <= 0 or matrix[1, 1] <= 0 or not np.allclose(matrix[2], (0, 0, 1)):
            raise CameraError(f"camera matrix is {matrix.ravel().tolist()}, expected fx, fy > 0 and last row 0 0 1")
        if distortion.size > 5 or not np.isfinite(distortion).all():
            raise CameraError(f"camera distortion is {distortion.tolist()}, expected at most 5 finite numbers")
        distortion = np.concatenate([distortion, np.zeros(5 - distortion.size)])
        for array in (matrix, distortion):
            array.setflags(write=False)
        object.__setattr__(self, "matrix", matrix)
        object.__setattr__(self, "distortion", distortion)

    @classmethod
    def lab(cls, distorted: bool = False) -> CameraModel:
        """Return the paper's head camera as its authors calibrated it, 640x480, without lens distortion by default."""
        return cls(640, 480, np.array(LAB_MATRIX), np.array(LAB_DISTORTION if distorted else (0.0,) * 5))

    @property
    def is_distorted(self) -> bool:
        return bool(np.any(self.distortion))

    def without_distortion(self) -> CameraModel:
        """Return the camera whose images `undistort` gives: same matrix, straight lines stay straight."""
        return CameraModel(self.width, self.height, self.matrix)

    def project(self, points_camera: np.ndarray) -> np.ndarray:
        """Project points into the image.

        Args:
            points_camera: (..., 3) in the optical frame [m].

        Returns:
            (..., 2) pixels (column, row); NaN for points that are not in front of the camera.
        """
        points = np.asarray(points_camera, dtype=np.float64)
        flat = points.reshape(-1, 3)
        in_front = flat[:, 2] > 0
        pixels = np.full((len(flat), 2), np.nan)
        if in_front.any():
            still = np.zeros(3)
            projected, _ = cv2.projectPoints(flat[in_front], still, still, self.matrix, self.distortion)
            pixels[in_front] = projected.reshape(-1, 2)
        return pixels.reshape(*points.shape[:-1], 2)

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """Return the directions that pixels look in, the inverse of `project`.

        Args:
            pixels: (..., 2) (column, row) [px].

        Returns:
            (..., 3) directions in the optical frame, scaled to z = 1.
        """
        pixels = np.asarray(pixels, dtype=np.float64)
        flat = np.ascontiguousarray(pixels.reshape(-1, 1, 2))
        directions = np.ones((len(flat), 3))
        if len(flat):
            until = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-9)
            straight = cv2.undistortPointsIter(flat, self.matrix, self.distortion, np.eye(3), np.eye(3), until)
            directions[:, :2] = straight.reshape(-1, 2)
        return directions.reshape(*pixels.shape[:-1], 3)

    def check_size(self, image: np.ndarray) -> None:
        """Raise CameraError unless the image has this camera's size."""
        if image.ndim < 2 or image.shape[:2] != (self.height, self.width):
            raise CameraError(f"image has shape {image.shape}, expected {self.height} rows x {self.width} columns")

    def undistort(self, image: np.ndarray) -> np.ndarray:
        """Return the image as `without_distortion()` sees it; pixels beyond the lens's view repeat the nearest edge.

        Raises:
            CameraError: the image has another size than the camera.
        """
        self.check_size(image)
        if not self.is_distorted:
            return image
        return cv2.remap(image, *self._undistortion_maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)

    @cached_property
    def _undistortion_maps(self) -> tuple[np.ndarray, np.ndarray]:
        size = (self.width, self.height)
        return cv2.initUndistortRectifyMap(self.matrix, self.distortion, None, self.matrix, size, cv2.CV_32FC1)
