"""The calibration of the simulated head camera, as a robot would know it."""

from __future__ import annotations

from dr_eureka.simulation.settings import CameraSettings
from dr_eureka.vision.camera import CameraModel


def camera_model(settings: CameraSettings) -> CameraModel:
    """Return the camera's calibration."""
    matrix = ((settings.fx, 0.0, settings.cx), (0.0, settings.fy, settings.cy), (0.0, 0.0, 1.0))
    return CameraModel(settings.width, settings.height, matrix, settings.distortion)
