"""Recursive weighted least squares, the older a point the less it counts, and what the paper's fits have in common.

With the reliability p_i = r^(n-i) of the paper's Equation 9 and a basis f = (1, z, z^2, ...), minimising
sum p_i (f_i . b - y_i)^2 gives

    A b = s,   A = sum p_i f_i f_i^T,   s = sum p_i f_i y_i.

As Equation 10 has it, every sum follows from the one before: S_n = (term n) + r S_(n-1). The covariances hold for points of
equal, independent errors: b = A^-1 s has covariance A^-1 (sum p_i^2 f_i f_i^T) A^-1 times the error's variance, and the sum
of squares has the mean variance * (sum p_i - trace(A^-1 sum p_i^2 f_i f_i^T)), from which it is estimated.
"""

from __future__ import annotations

import math

import numpy as np

from dr_eureka.catching.prediction import (
    LEAST_POINTS,
    BallPoint,
    PredictionReason,
    PredictionRefused,
    StampCheck,
    too_few,
)

# A system of equations, scaled to a diagonal of ones, that is worse conditioned is singular.
_WORST_CONDITION = 1e10


class ReliabilitySums:
    """Recursive weighted least squares of `values` outputs that are polynomials of degree `terms` - 1.

    `reliability` r (0 < r <= 1): what a point's weight is multiplied with whenever another comes (Equations 9 and 10).
    """

    def __init__(self, terms: int, values: int, reliability: float):
        if not 0.0 < reliability <= 1.0:
            raise ValueError(f"reliability is {reliability}; expected 0 < r <= 1")
        self._reliability = reliability
        self._matrix = np.zeros((terms, terms))
        # With the squared weights, for the covariance.
        self._matrix_of_squares = np.zeros((terms, terms))
        self._right = np.zeros((terms, values))
        self._squares = np.zeros(values)

    def add(self, at: float, values: np.ndarray) -> None:
        """Take the outputs (values,) seen at `at`."""
        basis = float(at) ** np.arange(len(self._matrix))
        outer, r = np.outer(basis, basis), self._reliability
        self._matrix = outer + r * self._matrix
        self._matrix_of_squares = outer + r * r * self._matrix_of_squares
        self._right = np.outer(basis, values) + r * self._right
        self._squares = np.square(values) + r * self._squares

    def solve(self, terms: int, value: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the first `terms` coefficients of output number `value`, lowest power first, and their covariance.

        Raises PredictionRefused (DEPTH_CONSTANT) when the points do not determine them.
        """
        matrix, squares = self._matrix[:terms, :terms], self._matrix_of_squares[:terms, :terms]
        scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
        scaled = matrix * np.outer(scale, scale)
        if not np.linalg.cond(scaled) < _WORST_CONDITION:
            problem = f"the points lie at fewer than {terms} depths; expected a ball that comes nearer"
            raise PredictionRefused(PredictionReason.DEPTH_CONSTANT, problem)
        inverse = np.linalg.inv(scaled) * np.outer(scale, scale)
        right = self._right[:terms, value]
        coefficients = inverse @ right
        freedom = self._matrix[0, 0] - np.trace(inverse @ squares)
        error = max(self._squares[value] - coefficients @ right, 0.0)
        variance = error / freedom if freedom > 1e-9 else math.inf
        return coefficients, inverse @ squares @ inverse * variance


class SummedPoints:
    """Points of one ball: checked, counted, and taken relative to the first, which keeps the digits of sums of powers."""

    def __init__(self) -> None:
        self._stamps = StampCheck()
        self._points = 0
        self._origin = np.zeros(3)
        self._origin_s = 0.0

    @property
    def points(self) -> int:
        """How many points were taken."""
        return self._points

    def _taken(self, point: BallPoint) -> tuple[float, np.ndarray]:
        """Count a point; return how long after the first one [s] and how far from it (3,) [m]. Raises PredictionRefused."""
        self._stamps.check(point)
        if self._points == 0:
            self._origin, self._origin_s = np.array(point.position, float), point.time_s
        self._points += 1
        return point.time_s - self._origin_s, point.position - self._origin

    def _solved(self, sums: ReliabilitySums, terms: int, value: int) -> tuple[np.ndarray, np.ndarray]:
        """Return what `sums.solve` does. Raises PredictionRefused, TOO_FEW_POINTS among the reasons."""
        if self._points < LEAST_POINTS:
            raise too_few(self._points)
        return sums.solve(terms, value)
