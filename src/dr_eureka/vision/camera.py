"""Pinhole camera with OpenCV's plumb-bob distortion: pixels to rays and back."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml

from dr_eureka.errors import DrEurekaError
from dr_eureka.resources import load_yaml

LAB_MATRIX = ((617.73492686, 0.0, 301.59321376), (0.0, 620.08687683, 238.79976856), (0.0, 0.0, 1.0))
LAB_DISTORTION = (0.09185878, -0.06354207, 0.00779513, -0.00322328, -0.36163446)
_DISTORTION_MODEL = "plumb_bob"


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
            # One function from OpenCV 5 on.
            undistort = getattr(cv2, "undistortPointsIter", None) or cv2.undistortPoints
            straight = undistort(flat, self.matrix, self.distortion, R=np.eye(3), P=np.eye(3), criteria=until)
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


def save_camera(camera: CameraModel, path: str | Path, name: str = "camera") -> None:
    """Write a calibration as the yaml that ROS's camera drivers read (package camera_calibration_parsers).

    Rectified images keep the camera's own matrix, as those of `undistort` do.

    Raises:
        CameraError: the file cannot be written.
    """
    content = {
        "image_width": camera.width,
        "image_height": camera.height,
        "camera_name": name,
        "camera_matrix": _as_mapping(camera.matrix),
        "distortion_model": _DISTORTION_MODEL,
        "distortion_coefficients": _as_mapping(camera.distortion[None]),
        "rectification_matrix": _as_mapping(np.eye(3)),
        "projection_matrix": _as_mapping(np.hstack([camera.matrix, np.zeros((3, 1))])),
    }
    try:
        Path(path).write_text(yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=200), encoding="utf-8")
    except OSError as error:
        raise CameraError(f"{path}: cannot be written: {error.strerror}") from error


def load_camera(path: str | Path) -> CameraModel:
    """Load the calibration in a yaml of ROS's camera drivers (package camera_calibration_parsers).

    Raises:
        ResourceError: the file is missing or no yaml.
        CameraError: naming the file and the key that is missing or wrong, such as another distortion model.
    """
    content = load_yaml(Path(path).absolute())
    model = content.get("distortion_model", _DISTORTION_MODEL)
    if model != _DISTORTION_MODEL:
        raise CameraError(f"{path}: distortion_model is {model!r}, expected {_DISTORTION_MODEL!r}")
    try:
        size = int(content["image_width"]), int(content["image_height"])
        matrix, distortion = (np.array(content[key]["data"], float) for key in ("camera_matrix", "distortion_coefficients"))
    except KeyError as error:
        raise CameraError(f"{path}: key {error} is missing, expected a camera_info yaml") from error
    except (TypeError, ValueError) as error:
        raise CameraError(f"{path}: holds something that is no number, expected a camera_info yaml: {error}") from error
    try:
        return CameraModel(*size, matrix, distortion)
    except CameraError as error:
        raise CameraError(f"{path}: {error}") from error


def _as_mapping(matrix: np.ndarray) -> dict[str, Any]:
    return {"rows": matrix.shape[0], "cols": matrix.shape[1], "data": matrix.ravel().tolist()}
