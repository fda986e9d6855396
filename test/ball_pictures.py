"""Pictures of balls by exact geometry: a pixel shows a ball as far as its rays touch it. Shared by tests; holds none."""

from __future__ import annotations

from typing import Sequence

import numpy as np

from dr_eureka.catching.localisation import camera_model
from dr_eureka.catching.settings import SaikaSettings

GREY = (120, 122, 118)
_SUBPIXELS = (-0.375, -0.125, 0.125, 0.375)


def ball_picture(
    settings: SaikaSettings,
    centres_camera: Sequence[Sequence[float]],
    rng: np.random.Generator | None = None,
    colour: Sequence[int] | None = None,
    background: Sequence[int] = GREY,
) -> np.ndarray:
    """Return a picture of balls with middles (3,) [m] in the optical frame, the last in front; noise of 2 with an rng."""
    camera = camera_model(settings.cameras)
    picture = np.empty((camera.height, camera.width, 3))
    picture[:] = background
    for centre in np.asarray(centres_camera, dtype=float):
        share = np.zeros((camera.height, camera.width))
        distance = np.linalg.norm(centre)
        sine = 0.5 * settings.ball_diameter_m / distance
        # Only pixels near the ball: within its size and a half about its middle.
        column, row = camera.project(centre)
        reach = 1.5 * sine * distance / centre[2] * camera.matrix[0, 0] + 2.0
        columns = np.arange(max(int(column - reach), 0), min(int(column + reach) + 2, camera.width))
        rows = np.arange(max(int(row - reach), 0), min(int(row + reach) + 2, camera.height))
        if len(columns) == 0 or len(rows) == 0:
            continue
        for right in _SUBPIXELS:
            for down in _SUBPIXELS:
                x = (columns + right - camera.matrix[0, 2]) / camera.matrix[0, 0]
                y = (rows + down - camera.matrix[1, 2]) / camera.matrix[1, 1]
                x, y = np.meshgrid(x, y)
                cosine = (x * centre[0] + y * centre[1] + centre[2]) / (np.sqrt(x**2 + y**2 + 1.0) * distance)
                share[np.ix_(rows, columns)] += (cosine > np.sqrt(1.0 - sine**2)) / len(_SUBPIXELS) ** 2
        ball = np.array(settings.ball_finder.ball_rgb if colour is None else colour, dtype=float)
        picture += share[..., None] * (ball - picture)
    if rng is not None:
        picture += rng.normal(0.0, 2.0, picture.shape)
    return np.clip(picture + 0.5, 0, 255).astype(np.uint8)
