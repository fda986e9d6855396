"""Saika's eyes in the simulated world: rendered pictures, and an analytic camera that is a thousand times faster."""

from __future__ import annotations

from typing import Sequence

import numpy as np
import pybullet
from pybullet_utils.bullet_client import BulletClient

from dr_eureka.catching.localisation import camera_model
from dr_eureka.catching.seen_ball import SeenBall
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.kinematics.transforms import invert
from dr_eureka.simulation.rendering import EGL, projection_matrix
from dr_eureka.simulation.saika_settings import SensorSettings
from dr_eureka.simulation.settings import CameraSettings

_NEAR_M, _FAR_M = 0.03, 12.0
_LAMP_M = (2.0, -3.0, 8.0)
# From the optical frame (x right, y down, z forward) to OpenGL's (x right, y up, z backward).
_OPENGL_FROM_OPTICAL = np.diag([1.0, -1.0, -1.0, 1.0])


class RenderedCamera:
    """Takes pictures with either head camera: exposures too short for motion blur, sensor noise, the room's light."""

    def __init__(
        self, client: BulletClient, renderer: str, settings: SaikaSettings, sensor: SensorSettings, rng: np.random.Generator
    ) -> None:
        """renderer: what `open_renderer` returned for this client. rng draws the light once, and each picture's noise."""
        cameras = settings.cameras
        matrix = camera_model(cameras).matrix
        pinhole = CameraSettings(
            cameras.width, cameras.height, matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], (), _NEAR_M, _FAR_M,
            renderer, 1.0, sensor.brightness_noise, False,
        )
        self._client, self._renderer, self._pinhole, self._rng = client, renderer, pinhole, rng
        self._projection = projection_matrix(pinhole, renderer).flatten("F").tolist()
        self._light = rng.uniform(*sensor.light)

    def picture(self, base_from_camera: np.ndarray) -> np.ndarray:
        """Return what a camera at this pose (4, 4) [m] sees, (height, width, 3) uint8 RGB."""
        pinhole, opengl = self._pinhole, self._renderer == EGL
        view = (_OPENGL_FROM_OPTICAL @ invert(base_from_camera)).flatten("F").tolist()
        pixels = self._client.getCameraImage(
            pinhole.width, pinhole.height, view, self._projection,
            lightDirection=_LAMP_M, lightColor=(1, 1, 1), shadow=int(opengl), flags=pybullet.ER_NO_SEGMENTATION_MASK,
            renderer=pybullet.ER_BULLET_HARDWARE_OPENGL if opengl else pybullet.ER_TINY_RENDERER,
        )[2]
        scene = np.asarray(pixels, dtype=np.uint8).reshape(pinhole.height, pinhole.width, 4)[:, :, :3]
        noise = self._rng.standard_normal(scene.shape, dtype=np.float32) * np.float32(pinhole.noise)
        return np.clip(scene * np.float32(self._light) + noise + 0.5, 0, 255).astype(np.uint8)


class AnalyticCamera:
    """Projects balls instead of rendering them, and adds the errors that the ball finder makes in pictures."""

    def __init__(self, settings: SaikaSettings, sensor: SensorSettings, rng: np.random.Generator) -> None:
        self._settings, self._sensor, self._rng = settings, sensor, rng
        self._camera = camera_model(settings.cameras)

    def balls(self, base_from_camera: np.ndarray, centres: Sequence[np.ndarray]) -> tuple[SeenBall, ...]:
        """Return the balls in view of a camera at a pose (4, 4), their true centres (3,) [m] in base; nearest first.

        A ball cut by the picture's edge is in view as long as its middle is; what may hide a ball is not considered.
        """
        seen = []
        for centre in centres:
            x, y, depth = (invert(base_from_camera) @ [*centre, 1.0])[:3]
            if depth < self._settings.ball_diameter_m:
                continue
            pixel = self._camera.project(np.array([x, y, depth]))
            if not (0 <= pixel[0] <= self._camera.width - 1 and 0 <= pixel[1] <= self._camera.height - 1):
                continue
            size = self._settings.ball_diameter_m * self._settings.cameras.focal_px / depth
            column, row = pixel + self._rng.normal(0.0, 1.0, 2) * self._sensor.centre_noise_px
            diameter = size + self._rng.normal() * self._sensor.diameter_noise_px
            if diameter >= self._settings.ball_finder.least_diameter_px:
                seen.append(SeenBall((float(column), float(row)), float(diameter), 1.0))
        return tuple(sorted(seen, key=lambda ball: -ball.diameter_px))
