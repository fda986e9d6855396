"""Where the ball is: by the parallax of both views (paper 4.1), or by its size in one (paper 4.2, Equation 1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dr_eureka.catching.saika import SaikaHead
from dr_eureka.catching.settings import HeadCameraSettings, SaikaSettings
from dr_eureka.errors import DrEurekaError
from dr_eureka.vision.camera import CameraModel

NOT_FINITE = "NOT_FINITE"
NOT_A_SIZE = "NOT_A_SIZE"
RAYS_DIVERGE = "RAYS_DIVERGE"
VIEWS_DISAGREE = "VIEWS_DISAGREE"
# How far a ball falls between two pictures that are not taken at once: at most 33 ms at 5 m/s, and a little for noise.
_LARGEST_FALL_M = 0.20


class LocalisationError(DrEurekaError):
    """Report a ball that cannot be localised; `reason` is one of this module's constants."""

    def __init__(self, reason: str, message: str) -> None:
        super().__init__(f"{reason}: {message}")
        self.reason = reason


@dataclass(frozen=True, eq=False)
class Eye:
    """One camera where it is now: model, base_from_camera (4, 4), the ball's size [m] and the finder's deviations [px]."""

    camera: CameraModel
    base_from_camera: np.ndarray
    ball_diameter_m: float
    centre_sigma_px: float
    diameter_sigma_px: float


@dataclass(frozen=True, eq=False)
class Rig:
    """Both cameras where they are now."""

    left: Eye
    right: Eye


def camera_model(cameras: HeadCameraSettings) -> CameraModel:
    """Return the pinhole of either head camera; the principal point is the middle of the picture."""
    focal, middle = cameras.focal_px, (0.5 * (cameras.width - 1), 0.5 * (cameras.height - 1))
    matrix = np.array([[focal, 0.0, middle[0]], [0.0, focal, middle[1]], [0.0, 0.0, 1.0]])
    return CameraModel(cameras.width, cameras.height, matrix)


def eye_at(settings: SaikaSettings, base_from_camera: np.ndarray) -> Eye:
    """Return a head camera at a pose (4, 4) [m]."""
    cameras = settings.cameras
    model = camera_model(cameras)
    return Eye(model, base_from_camera, settings.ball_diameter_m, cameras.centre_sigma_px, cameras.diameter_sigma_px)


def rig_at(
    settings: SaikaSettings,
    head: SaikaHead,
    neck: np.ndarray = (0.0, 0.0),
    left_pan_tilt: np.ndarray = (0.0, 0.0),
    right_pan_tilt: np.ndarray = (0.0, 0.0),
) -> Rig:
    """Return both cameras for pan and tilt (2,) of the neck and of each camera [rad]."""
    left, right = (
        eye_at(settings, head.base_from_camera(side, pan_tilt, neck))
        for side, pan_tilt in (("left", left_pan_tilt), ("right", right_pan_tilt))
    )
    return Rig(left, right)


def locate_by_parallax(left_px: np.ndarray, right_px: np.ndarray, rig: Rig) -> tuple[np.ndarray, np.ndarray]:
    """Return the ball's middle (3,) [m] in base and its covariance (3, 3) [m^2], from its pixel (2,) in each view.

    The views need not be taken at once, if the ball falls in between: it is where the vertical planes through both rays
    meet. The point nearest to both rays would be wrong: rays of two heights come nearer to one another the nearer they are
    to the eyes. The height is the mean of those at which both rays pass, thus that in the middle of both times. The
    covariance is that of pixel noise alone. Raises LocalisationError NOT_FINITE, RAYS_DIVERGE (the planes do not meet in
    front of both cameras), VIEWS_DISAGREE (no ball falls so far in between).
    """
    eyes = (rig.left, rig.right)
    pixels = _finite(np.array([left_px, right_px], dtype=float), "pixels of the two views")
    origins = np.array([eye.base_from_camera[:3, 3] for eye in eyes])
    rays = np.array([eye.base_from_camera[:3, :3] @ eye.camera.rays(pixel) for eye, pixel in zip(eyes, pixels)])
    level = np.linalg.norm(rays[:, :2], axis=1)
    if level.min() < 1e-6:
        raise LocalisationError(RAYS_DIVERGE, "a view looks straight up or down; expected rays that lead ahead")
    ahead = rays[:, :2] / level[:, None]
    crossing = ahead[0, 0] * ahead[1, 1] - ahead[0, 1] * ahead[1, 0]
    if abs(crossing) < 1e-9:
        raise LocalisationError(RAYS_DIVERGE, "both views look along one direction; expected rays that meet")
    apart = origins[1, :2] - origins[0, :2]
    far = np.array([apart[0] * line[1] - apart[1] * line[0] for line in ahead[::-1]]) / crossing
    if np.any(far <= 0.0):
        raise LocalisationError(RAYS_DIVERGE, f"the rays meet behind a camera, {far[0]:.2f} and {far[1]:.2f} m ahead")
    slopes = rays[:, 2] / level
    heights = origins[:, 2] + slopes * far
    fall = abs(heights[1] - heights[0])
    if fall > _LARGEST_FALL_M:
        raise LocalisationError(VIEWS_DISAGREE, f"the rays pass {1000 * fall:.0f} mm above one another; expected one ball")
    place = origins[0, :2] + far[0] * ahead[0]
    deviations = far / level * np.array([eye.centre_sigma_px / eye.camera.matrix[0, 0] for eye in eyes])
    across = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = np.linalg.inv((across / deviations[:, None] ** 2).T @ across)
    rise = 0.5 * (slopes @ ahead)
    covariance[2, :2] = covariance[:2, 2] = covariance[:2, :2] @ rise
    covariance[2, 2] = rise @ covariance[:2, :2] @ rise + 0.25 * np.sum((1.0 + slopes**2) * deviations**2)
    return np.array([*place, heights.mean()]), covariance


def locate_by_size(centre_px: np.ndarray, diameter_px: float, camera: Eye) -> tuple[np.ndarray, np.ndarray]:
    """Return the ball's middle (3,) [m] in base and its covariance (3, 3) [m^2], from one view (Equation 1, l = d f / n).

    Raises LocalisationError NOT_FINITE or NOT_A_SIZE (a diameter that is not positive).
    """
    values = _finite(np.array([*centre_px, diameter_px], dtype=float), "centre and diameter")
    if diameter_px <= 0.0:
        raise LocalisationError(NOT_A_SIZE, f"the ball's diameter is {diameter_px} px; expected more than 0")
    focal = camera.camera.matrix[0, 0]
    depth = camera.ball_diameter_m * focal / diameter_px
    ray = camera.camera.rays(values[:2])
    by_values = np.zeros((3, 3))  # how the point in the camera's frame moves with column, row and diameter
    by_values[0, 0] = by_values[1, 1] = depth / focal
    by_values[:, 2] = -ray * depth / diameter_px
    spread = np.array([camera.centre_sigma_px, camera.centre_sigma_px, camera.diameter_sigma_px])
    rotation = camera.base_from_camera[:3, :3]
    root = rotation @ by_values * spread
    return rotation @ (depth * ray) + camera.base_from_camera[:3, 3], root @ root.T


def depth_resolution(depth_m: np.ndarray, settings: SaikaSettings) -> np.ndarray:
    """Return how much nearer [m] a ball at these depths [m] is when it looks one pixel larger (Equation 2)."""
    depth = np.asarray(depth_m, dtype=float)
    return depth * (1.0 - 1.0 / (1.0 + depth / (settings.ball_diameter_m * settings.cameras.focal_px)))


def _finite(values: np.ndarray, what: str) -> np.ndarray:
    if not np.all(np.isfinite(values)):
        raise LocalisationError(NOT_FINITE, f"{what} are {values.tolist()}; expected finite numbers")
    return values
