"""A check of the detector's classes that knows no colour: in one light, balls of one colour look alike."""

from __future__ import annotations

from typing import Sequence

import numpy as np

from dr_eureka.vision.card_detections import SeenBall

_PATCH_RADIUS = 0.3  # [ball diameters] about a ball's centre
_DARK_LEVEL = 4.0  # added to each channel, so that noise on nearly black balls has no hue
# Partner over nearest stranger. Over 800 drawn cards in training's hardest light: median 0.05, 99 % below 0.66.
_LEAST_LIKE = 0.8


def odd_ball(crop: np.ndarray, balls: Sequence[SeenBall]) -> SeenBall | None:
    """Return a ball that looks more like one of another colour than like all those of its own, or None.

    crop (h, w, 3) is the picture the balls were seen in; their places and diameters are fractions of its side.
    """
    looks = np.array([_chromaticity(crop, ball) for ball in balls])
    for index, ball in enumerate(balls):
        apart = np.linalg.norm(looks - looks[index], axis=1)
        own = [apart[i] for i, other in enumerate(balls) if i != index and other.colour == ball.colour]
        others = [apart[i] for i, other in enumerate(balls) if other.colour != ball.colour]
        if own and others and max(own) > _LEAST_LIKE * min(others):
            return ball
    return None


def _chromaticity(crop: np.ndarray, ball: SeenBall) -> np.ndarray:
    """Return the shares of red, green and blue in the middle of a ball."""
    height, width = crop.shape[:2]
    reach = _PATCH_RADIUS * ball.diameter * width
    x, y = ball.x * width, ball.y * height
    rows, columns = (slice(max(int(v - reach), 0), max(int(v + reach) + 1, 1)) for v in (y, x))
    patch = crop[rows, columns].reshape(-1, 3)
    middle = np.median(patch, axis=0) + _DARK_LEVEL
    return middle / middle.sum()
