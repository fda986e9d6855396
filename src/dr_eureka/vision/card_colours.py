"""A check of the detector's classes that knows no colour: in one light, balls of one colour look alike."""

from __future__ import annotations

from typing import Sequence

import numpy as np

from dr_eureka.vision.card_detections import SeenBall

_PATCH_RADIUS = 0.3  # [ball diameters] about a ball's centre
_DARK_LEVEL = 4.0  # added to each channel, so that noise on nearly black balls has no hue
# Oddity over 800 drawn cards in training's hardest light: median 0.05, 99 % below 0.66.
ODD = 0.8  # from here on a ball is taken for another colour than it has
PLAIN = 0.4  # up to here there is no doubt about any colour


def oddest_ball(crop: np.ndarray, balls: Sequence[SeenBall]) -> tuple[SeenBall, float]:
    """Return the ball least like its own colour, and its oddity: how far its partner looks, over the nearest stranger.

    crop (h, w, 3) is the picture the balls, two or more of each colour, were seen in; their places and diameters are
    fractions of its side.
    """
    looks = np.array([_chromaticity(crop, ball) for ball in balls])
    apart = np.linalg.norm(looks[:, None] - looks[None], axis=2)
    colours = np.array([ball.colour for ball in balls])
    alike = colours[:, None] == colours[None]
    oddity = np.where(alike, apart, 0.0).max(1) / np.maximum(np.where(alike, np.inf, apart).min(1), 1e-6)
    oddest = int(oddity.argmax())
    return balls[oddest], float(oddity[oddest])


def _chromaticity(crop: np.ndarray, ball: SeenBall) -> np.ndarray:
    """Return the shares of red, green and blue in the middle of a ball."""
    height, width = crop.shape[:2]
    reach = _PATCH_RADIUS * ball.diameter * width
    x, y = ball.x * width, ball.y * height
    rows, columns = (slice(max(int(v - reach), 0), max(int(v + reach) + 1, 1)) for v in (y, x))
    patch = crop[rows, columns].reshape(-1, 3)
    half = len(patch) // 2
    middle = np.partition(patch, half, axis=0)[half] + _DARK_LEVEL  # the median, sooner than numpy's own
    return middle / middle.sum()
