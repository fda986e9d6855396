"""The paper's prediction of a ball that falls straight down (section 6): it is caught vertically under where it was seen."""

from __future__ import annotations

import math

import numpy as np

from dr_eureka.catching.prediction import (
    DEPTH,
    GRAVITY_M_S2,
    LEAST_POINTS,
    BallPoint,
    CatchingPlane,
    Prediction,
    PredictionReason,
    PredictionRefused,
    StampCheck,
    too_few,
)
from dr_eureka.catching.reliability_fit import ReliabilitySums


class FallingFit:
    """The mean place on the ground, and height under gravity over time, with the reliability of the paper's Equation 9.

    The paper sends the hand under the ball and needs no time; the time here is that of a free fall fitted to the heights.
    """

    def __init__(self, reliability: float):
        """Start without points; `reliability` is r of Equation 9, 0 < r <= 1."""
        self._ground = ReliabilitySums(1, 2, reliability)
        self._height = ReliabilitySums(2, 1, reliability)
        self._stamps = StampCheck()
        self._origin_s = 0.0
        self._points = 0

    @property
    def points(self) -> int:
        """How many points were taken."""
        return self._points

    def add(self, point: BallPoint) -> None:
        """Take one more point; its covariance does not count here. Raises PredictionRefused."""
        self._stamps.check(point)
        if self._points == 0:
            self._origin_s = point.time_s
        elapsed_s = point.time_s - self._origin_s
        right, depth, up = point.position
        self._ground.add(elapsed_s, np.array([right, depth]))
        self._height.add(elapsed_s, np.array([up + 0.5 * GRAVITY_M_S2 * elapsed_s**2]))
        self._points += 1

    def predict(self, plane: CatchingPlane) -> Prediction:
        """Return where and when the ball falls through a height. Raises PredictionRefused, for a depth NEVER_CROSSES."""
        (right, depth), spread = self._place()
        (start, speed), covariance = self._fall()
        if plane.kind == DEPTH:
            raise PredictionRefused(PredictionReason.NEVER_CROSSES, "a falling ball crosses no depth; expected a height")
        rest = speed * speed + 2.0 * GRAVITY_M_S2 * (start - plane.offset_m)
        if rest <= 0.0:
            raise PredictionRefused(PredictionReason.NEVER_CROSSES, "the ball is below the catching height")
        elapsed_s = (speed + math.sqrt(rest)) / GRAVITY_M_S2
        final = speed - GRAVITY_M_S2 * elapsed_s
        instant = np.array([1.0, elapsed_s])
        return Prediction(
            time_s=self._origin_s + elapsed_s,
            time_sigma_s=math.sqrt(instant @ covariance @ instant) / abs(final),
            position=np.array([right, depth, plane.offset_m]),
            covariance=np.diag([*spread, 0.0]),
            velocity=np.array([0.0, 0.0, final]),
            points=self._points,
        )

    def positions(self, times_s: np.ndarray) -> np.ndarray:
        """Return the fitted path (n, 3) [m] at times (n,) [s]. Raises PredictionRefused."""
        (right, depth), _ = self._place()
        (start, speed), _ = self._fall()
        elapsed = np.asarray(times_s, float) - self._origin_s
        up = start + speed * elapsed - 0.5 * GRAVITY_M_S2 * elapsed**2
        return np.stack([np.full_like(up, right), np.full_like(up, depth), up], axis=-1)

    def _place(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the mean place on the ground (x, y) [m] and its variances [m^2]."""
        if self._points < LEAST_POINTS:
            raise too_few(self._points)
        solved = [self._ground.solve(1, axis) for axis in range(2)]
        return tuple(float(mean[0]) for mean, _ in solved), tuple(float(spread[0, 0]) for _, spread in solved)

    def _fall(self) -> tuple[np.ndarray, np.ndarray]:
        if self._points < LEAST_POINTS:
            raise too_few(self._points)
        return self._height.solve(2, 0)
