"""The paper's prediction of a ball that falls straight down (section 6): it is caught vertically under where it was seen."""

from __future__ import annotations

import math

import numpy as np

from dr_eureka.catching.prediction import (
    DEPTH,
    GRAVITY_M_S2,
    BallPoint,
    CatchingPlane,
    Prediction,
    PredictionReason,
    PredictionRefused,
    seconds_until_below,
)
from dr_eureka.catching.reliability_sums import ReliabilitySums, SummedPoints


class FallingFit(SummedPoints):
    """The mean place on the ground, and height under gravity over time, with the reliability of the paper's Equation 9.

    The paper sends the hand under the ball and needs no time; the time here is that of a free fall fitted to the heights.
    """

    def __init__(self, reliability: float):
        """Start without points; `reliability` is r of Equation 9, 0 < r <= 1."""
        super().__init__()
        self._ground = ReliabilitySums(1, 2, reliability)
        self._height = ReliabilitySums(2, 1, reliability)

    def add(self, point: BallPoint) -> None:
        """Take one more point; its covariance does not count here. Raises PredictionRefused."""
        elapsed_s, (right, depth, up) = self._taken(point)
        self._ground.add(elapsed_s, np.array([right, depth]))
        self._height.add(elapsed_s, np.array([up + 0.5 * GRAVITY_M_S2 * elapsed_s**2]))

    def predict(self, plane: CatchingPlane) -> Prediction:
        """Return where and when the ball falls through a height. Raises PredictionRefused, for a depth NEVER_CROSSES."""
        place, variance = self._place()
        (start, speed), covariance = self._solved(self._height, 2, 0)
        if plane.kind == DEPTH:
            raise PredictionRefused(PredictionReason.NEVER_CROSSES, "a falling ball crosses no depth; expected a height")
        elapsed_s = seconds_until_below(plane.offset_m - self._origin[2] - start, speed)
        final = speed - GRAVITY_M_S2 * elapsed_s
        instant = np.array([1.0, elapsed_s])
        return Prediction(
            time_s=self._origin_s + elapsed_s,
            time_sigma_s=math.sqrt(instant @ covariance @ instant) / abs(final),
            position=np.array([*place, plane.offset_m]),
            covariance=np.diag([*variance, 0.0]),
            velocity=np.array([0.0, 0.0, final]),
            points=self._points,
        )

    def positions(self, times_s: np.ndarray) -> np.ndarray:
        """Return the fitted path (n, 3) [m] at times (n,) [s]. Raises PredictionRefused."""
        (right, depth), _ = self._place()
        (start, speed), _ = self._solved(self._height, 2, 0)
        elapsed = np.asarray(times_s, float) - self._origin_s
        up = self._origin[2] + start + speed * elapsed - 0.5 * GRAVITY_M_S2 * elapsed**2
        return np.stack([np.full_like(up, right), np.full_like(up, depth), up], axis=-1)

    def _place(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the mean place on the ground (x, y) [m] and its variances [m^2]."""
        solved = [self._solved(self._ground, 1, axis) for axis in range(2)]
        mean, variance = (np.array([each[part].item() for each in solved]) for part in range(2))
        return self._origin[:2] + mean, variance
