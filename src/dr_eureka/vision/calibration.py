"""A camera's calibration from views of a ChArUco board, with its uncertainty and what speaks against trusting it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from dr_eureka.errors import DrEurekaError
from dr_eureka.vision.calibration_views import CalibrationSettings, ViewCollection
from dr_eureka.vision.camera import CameraError, CameraModel
from dr_eureka.vision.charuco import BoardView, CharucoBoard

FEWEST_TO_FIT = 3


class CalibrationError(DrEurekaError):
    """Views that no camera can be fitted to."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """A fitted camera.

    Attributes:
        camera: with five plumb-bob coefficients.
        rms_px: root mean square way from a corner to its reprojection [px].
        focal_sigmas, centre_sigmas: (2,) standard deviations of fx, fy and of cx, cy [px], as OpenCV estimates them; 4.6
            errs on the safe side by half, since it counts the two coordinates of a corner as one measurement.
        normals: (views, 3) direction into the board in the optical frame, one a view.
    """

    camera: CameraModel
    rms_px: float
    focal_sigmas: np.ndarray
    centre_sigmas: np.ndarray
    normals: np.ndarray

    @property
    def tilt_spread_rad(self) -> float:
        """Angle between the two boards that face the most different ways [rad]."""
        return float(np.arccos(np.clip(self.normals @ self.normals.T, -1.0, 1.0)).max())


def fit_camera(views: Sequence[BoardView], board: CharucoBoard, size: tuple[int, int]) -> Calibration:
    """Fit matrix and distortion to all views at once (Zhang 2000, as `cv2.calibrateCameraExtended` does it).

    Args:
        views: at least three, each with four corners or more that are not on one line.
        size: (width, height) of the pictures [px].

    Raises:
        CalibrationError: fewer views, or no camera fits them.
    """
    if len(views) < FEWEST_TO_FIT:
        raise CalibrationError(f"{len(views)} of at least {FEWEST_TO_FIT} views")
    points = [board.corner_points(view.ids).astype(np.float32) for view in views]
    pixels = [view.pixels.astype(np.float32) for view in views]
    try:
        rms, matrix, distortion, turns, _, sigmas, _, _ = cv2.calibrateCameraExtended(points, pixels, size, None, None)
        camera = CameraModel(*size, matrix, distortion.ravel()[:5])
    except (cv2.error, CameraError) as error:
        raise CalibrationError(f"no camera fits the {len(views)} views: {' '.join(str(error).split())}") from error
    sigmas = np.ravel(sigmas)
    normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in turns])
    return Calibration(camera, float(rms), sigmas[:2], sigmas[2:4], normals)


def weaknesses(calibration: Calibration, collection: ViewCollection, settings: CalibrationSettings) -> tuple[str, ...]:
    """Return in a few words each why the calibration should not be used; none if it may.

    Few or alike views fit well and are wrong all the same: a small reprojection error alone says nothing.
    """
    found = []
    count, coverage = len(collection.views), collection.covered().mean()
    if count < settings.fewest_views:
        found.append(f"{count} of at least {settings.fewest_views} views")
    if coverage < settings.smallest_coverage:
        wanted = f"expected {settings.smallest_coverage:.0%}: hold the board nearer and toward the edges"
        found.append(f"corners cover {coverage:.0%} of the picture, {wanted}")
    spread, least = np.degrees((calibration.tilt_spread_rad, settings.smallest_tilt_spread))
    if spread < least:
        wanted = f"expected {least:.0f}: tilt it to the camera, to all sides"
        found.append(f"the board was tilted alike in all views, within {spread:.0f} degrees, {wanted}")
    if not calibration.rms_px <= settings.largest_rms:
        wanted = f"expected at most {settings.largest_rms:g} px: is the board the one described, and flat?"
        found.append(f"reprojection error is {calibration.rms_px:.2f} px, {wanted}")
    return tuple(found) or _uncertain(calibration, settings)


def _uncertain(calibration: Calibration, settings: CalibrationSettings) -> tuple[str, ...]:
    """Return which standard deviations are too large, for a reason that none of the plainer weaknesses tells."""
    focal = float(np.max(calibration.focal_sigmas / np.diag(calibration.camera.matrix)[:2]))
    centre = float(np.max(calibration.centre_sigmas)) / calibration.camera.width
    found = []
    # A fit without any hold has a standard deviation of NaN, which no comparison calls small.
    if not focal <= settings.largest_focal_sigma:
        found.append(f"focal lengths known to {focal:.1%}, expected {settings.largest_focal_sigma:.1%}: take more views")
    if not centre <= settings.largest_centre_sigma:
        wanted = f"expected {settings.largest_centre_sigma:.1%}: take more views"
        found.append(f"optical centre known to {centre:.1%} of the width, {wanted}")
    return tuple(found)
