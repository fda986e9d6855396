"""The paper's prediction (section 7): a line and a parabola over depth, the older a point the less it counts.

In the paper's axes (right x, up y, depth z) the path is x = a0 + a1 z and y = b0 + b1 z + b2 z^2, its Equations 3 and 11,
solved by `reliability_sums` with f = (1, z, z^2). That is what its Equations 7 and 8, garbled in print, must say (for the
line: A's first two rows and columns), and in Equation 12 the last term is y_i.

The paper predicts no time. Here depth is a line over time, fitted with the same reliability.
"""

from __future__ import annotations

import math

import numpy as np

from dr_eureka.catching.prediction import BallPoint, CatchingPlane, Prediction, PredictionReason, PredictionRefused
from dr_eureka.catching.reliability_sums import ReliabilitySums, SummedPoints

# Depth that changes by less than so many standard deviations of its speed does not change.
_LEAST_SPEED_SIGMAS = 3.0


class ReliabilityFit(SummedPoints):
    """The paper's predictor, in our axes: x and z over the depth y."""

    def __init__(self, reliability: float):
        """Start without points; `reliability` is r of Equation 9, 0 < r <= 1."""
        super().__init__()
        self._over_depth = ReliabilitySums(3, 2, reliability)
        self._over_time = ReliabilitySums(2, 1, reliability)

    def add(self, point: BallPoint) -> None:
        """Take one more point; its covariance does not count here. Raises PredictionRefused."""
        elapsed_s, (right, depth, up) = self._taken(point)
        self._over_depth.add(depth, np.array([right, up]))
        self._over_time.add(elapsed_s, np.array([depth]))

    def line(self) -> tuple[float, float]:
        """Return a0 [m] and a1 of Equation 3, x = a0 + a1 y in `base`. Raises PredictionRefused."""
        line, _ = self._solved(self._over_depth, 2, 0)
        depth = self._origin[1]
        return float(self._origin[0] + line[0] - line[1] * depth), float(line[1])

    def parabola(self) -> tuple[float, float, float]:
        """Return b0 [m], b1 and b2 [1/m] of Equation 11, z = b0 + b1 y + b2 y^2 in `base`. Raises PredictionRefused."""
        parabola, _ = self._solved(self._over_depth, 3, 1)
        shifted = np.polynomial.Polynomial(parabola)(np.polynomial.Polynomial([-self._origin[1], 1.0]))
        b0, b1, b2 = shifted.coef
        return float(self._origin[2] + b0), float(b1), float(b2)

    def predict(self, plane: CatchingPlane) -> Prediction:
        """Return where and when the fitted path crosses the plane, a height from above. Raises PredictionRefused."""
        line, line_covariance = self._solved(self._over_depth, 2, 0)
        parabola, parabola_covariance = self._solved(self._over_depth, 3, 1)
        approach, approach_covariance = self._approach()
        wanted = plane.offset_m - self._origin[plane.axis]
        depth = wanted if plane.axis == 1 else _depth_on_the_way_down(parabola, wanted, approach[1])
        basis = np.array([1.0, depth, depth * depth])
        elapsed_s = (depth - approach[0]) / approach[1]
        direction = np.array([line[1], 1.0, parabola[1] + 2.0 * parabola[2] * depth])
        at_depth = np.diag([basis[:2] @ line_covariance @ basis[:2], 0.0, basis @ parabola_covariance @ basis])
        covariance, depth_variance = plane.project(at_depth, direction)
        instant = np.array([1.0, elapsed_s])
        time_variance = (instant @ approach_covariance @ instant + depth_variance) / approach[1] ** 2
        return Prediction(
            time_s=self._origin_s + elapsed_s,
            time_sigma_s=math.sqrt(time_variance),
            position=self._origin + [basis[:2] @ line, depth, basis @ parabola],
            covariance=covariance,
            velocity=direction * approach[1],
            points=self._points,
        )

    def positions(self, times_s: np.ndarray) -> np.ndarray:
        """Return the fitted path (n, 3) [m] at times (n,) [s]. Raises PredictionRefused."""
        line, _ = self._solved(self._over_depth, 2, 0)
        parabola, _ = self._solved(self._over_depth, 3, 1)
        approach, _ = self._approach()
        depth = approach[0] + approach[1] * (np.asarray(times_s, float) - self._origin_s)
        right, up = line[0] + line[1] * depth, parabola[0] + parabola[1] * depth + parabola[2] * depth**2
        return self._origin + np.stack([right, depth, up], axis=-1)

    def _approach(self) -> tuple[np.ndarray, np.ndarray]:
        """Return depth as a line over time, with its covariance; refuse a depth that does not shrink."""
        approach, covariance = self._solved(self._over_time, 2, 0)
        if not approach[1] < -_LEAST_SPEED_SIGMAS * math.sqrt(covariance[1, 1]):
            raise PredictionRefused(
                PredictionReason.DEPTH_CONSTANT,
                f"depth changes by {approach[1]:.3f} m/s, standard deviation {math.sqrt(covariance[1, 1]):.3f}; "
                "expected a ball that comes nearer",
            )
        return approach, covariance


def _depth_on_the_way_down(parabola: np.ndarray, height: float, speed: float) -> float:
    """Return the depth at which a ball with this depth speed sinks through a height. Raises PredictionRefused."""
    roots = np.roots((parabola - [height, 0.0, 0.0])[::-1])
    real = roots[np.isreal(roots)].real
    sinking = real[(parabola[1] + 2.0 * parabola[2] * real) * speed < 0.0]
    if len(sinking) == 0:
        raise PredictionRefused(PredictionReason.NEVER_CROSSES, "the parabola does not sink through the catching height")
    return float(sinking[0])
