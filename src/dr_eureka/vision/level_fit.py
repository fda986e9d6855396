"""Least-squares pose of a level sheet of known points, and of the camera that sees it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from dr_eureka.errors import DrEurekaError
from dr_eureka.vision.camera import CameraModel

STEPS = 20
HUBER_SIGMAS = 3.0


class LevelFitError(DrEurekaError):
    """Raised when the points cannot lie on a level plane in front of the camera."""


@dataclass(frozen=True, eq=False)
class LevelFit:
    """Result of `fit_level_sheet`.

    `base_from_sheet`, `base_from_camera`: (4, 4) poses, the camera's with its tilt corrected; `tilt`: (2,) that
    correction about base x and y [rad]; `residuals`: (n, 2) [px]; `covariance`: (3, 3) of the sheet's height [m] and
    the two tilts [rad].
    """

    base_from_sheet: np.ndarray
    base_from_camera: np.ndarray
    tilt: np.ndarray
    residuals: np.ndarray
    covariance: np.ndarray

    @property
    def residual_px(self) -> float:
        """RMS distance of the points from where the fit puts them [px]."""
        return float(np.sqrt(np.mean((self.residuals**2).sum(axis=1))))


def fit_level_sheet(
    printed: np.ndarray,
    seen: np.ndarray,
    camera: CameraModel,
    base_from_camera: np.ndarray,
    start_height: float,
    sigma_px: float,
    tilt_sigma_rad: float,
) -> LevelFit:
    """Fit x, y, z and yaw of a level sheet, and the camera's tilt within its prior, by Gauss-Newton.

    The joints tell the camera's pose, but a head that nods by a tenth of a degree moves a tube by a millimetre. Since
    the sheet is level, its perspective shows that tilt; the joints' value enters as a prior of `tilt_sigma_rad`, so
    that few corners cannot pull it off. Reprojection errors are Huber weighted.

    Args:
        printed: (n, 2) points on the sheet [m], n >= 4.
        seen: (n, 2) where they are in the picture [px].
        camera: camera without distortion.
        base_from_camera: (4, 4) pose of the optical frame in `base`, z up, from the joints.
        start_height: first guess of the sheet's z in `base` [m].
        sigma_px: standard deviation of `seen` along each axis; larger residuals widen the stated covariance.
        tilt_sigma_rad: standard deviation of the camera's tilt as the joints tell it.

    Raises:
        LevelFitError: a point at or above the horizon, or no convergence in front of the camera.
    """
    rotation, centre = np.array(base_from_camera[:3, :3]), base_from_camera[:3, 3]
    focal = camera.matrix[[0, 1], [0, 1]]
    parameters = np.array([*_start(printed, seen, camera, base_from_camera, start_height), 0.0, 0.0])
    prior = np.diag([0, 0, 0, 0, 1, 1]) / tilt_sigma_rad**2
    for _ in range(STEPS):
        x, y, z, yaw = parameters[:4]
        turned = printed @ _yaw_matrix(yaw).T
        from_centre = np.column_stack([turned + (x, y), np.full(len(printed), z)]) - centre
        in_camera = from_centre @ rotation
        residuals = camera.project(in_camera) - seen
        if not np.isfinite(residuals).all():
            raise LevelFitError("they do not fit a level sheet in front of the camera")
        depth = in_camera[:, 2:]
        image_by_camera = np.zeros((len(printed), 2, 3))
        image_by_camera[:, [0, 1], [0, 1]] = focal / depth
        image_by_camera[:, :, 2] = -focal * in_camera[:, :2] / depth**2
        base_by_parameters = np.zeros((len(printed), 3, 6))
        base_by_parameters[:, :3, :3] = np.eye(3)
        base_by_parameters[:, 0, 3], base_by_parameters[:, 1, 3] = -turned[:, 1], turned[:, 0]
        for axis in range(2):
            base_by_parameters[:, :, 4 + axis] = -np.cross(np.eye(3)[axis], from_centre)
        jacobian = (image_by_camera @ rotation.T @ base_by_parameters).reshape(-1, 6) / sigma_px
        errors = residuals.ravel() / sigma_px
        weights = np.minimum(1.0, HUBER_SIGMAS / np.maximum(np.abs(errors), 1e-12))
        normal = jacobian.T @ (weights[:, None] * jacobian) + prior
        step = -np.linalg.solve(normal, jacobian.T @ (weights * errors) + prior @ parameters)
        parameters = parameters + step
        rotation = cv2.Rodrigues(np.array([*step[4:], 0.0]))[0] @ rotation
        if np.abs(step).max() < 1e-9:
            break
    base_from_sheet, corrected = np.eye(4), np.array(base_from_camera)
    base_from_sheet[:2, :2], base_from_sheet[:3, 3] = _yaw_matrix(parameters[3]), parameters[:3]
    corrected[:3, :3] = rotation
    spread = max(1.0, float(np.mean(errors**2)))
    covariance = (spread * np.linalg.inv(normal))[np.ix_([2, 4, 5], [2, 4, 5])]
    return LevelFit(base_from_sheet, corrected, parameters[4:], residuals, covariance)


def _yaw_matrix(yaw: float) -> np.ndarray:
    return np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])


def _start(
    printed: np.ndarray, seen: np.ndarray, camera: CameraModel, base_from_camera: np.ndarray, height: float
) -> tuple[float, float, float, float]:
    """Rigid 2-D fit (x, y, z, yaw) to where the points' rays meet the plane z = height."""
    rays = camera.rays(seen) @ base_from_camera[:3, :3].T
    if (rays[:, 2] > -1e-3).any():
        raise LevelFitError("they are seen at or above the horizon, so not on a level sheet")
    centre = base_from_camera[:3, 3]
    met = centre[:2] + rays[:, :2] * ((height - centre[2]) / rays[:, 2:])
    # In the complex plane a turn is one factor: its angle is the argument of sum(conj(printed) * met).
    from_points, to_points = (points[:, 0] + 1j * points[:, 1] for points in (printed, met))
    turn = np.vdot(from_points - from_points.mean(), to_points - to_points.mean())
    offset = to_points.mean() - from_points.mean() * turn / abs(turn)
    return offset.real, offset.imag, height, float(np.angle(turn))
