"""What predicting a ball's path takes and gives: observed points, a plane to catch at, where and when the ball crosses it.

The frame is `base` (see the package): x right, y forward, z up; metres, seconds. The paper's x, y, z are right, up and
depth, so its x-z plane is our x-y plane and its y-z plane our z-y plane: its depth z is our y, its height y our z.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from dr_eureka.errors import DrEurekaError

GRAVITY_M_S2 = 9.80665
#: The paper's first prediction comes with the fifth point (section 7).
LEAST_POINTS = 5
DEPTH, HEIGHT = "depth", "height"
_AXES = {DEPTH: 1, HEIGHT: 2}


class PredictionReason:
    """Why there is no prediction, or why a point was not taken."""

    TOO_FEW_POINTS = "TOO_FEW_POINTS"
    NOT_FINITE = "NOT_FINITE"
    STAMP_NOT_RISING = "STAMP_NOT_RISING"
    OUTLIER = "OUTLIER"
    NOT_A_FLIGHT = "NOT_A_FLIGHT"
    DEPTH_CONSTANT = "DEPTH_CONSTANT"
    NEVER_CROSSES = "NEVER_CROSSES"


class PredictionRefused(DrEurekaError):
    """A point that cannot be taken, or a question that the points do not answer; `reason` is a PredictionReason."""

    def __init__(self, reason: str, message: str):
        super().__init__(f"{reason}: {message}")
        self.reason = reason


@dataclass(frozen=True, eq=False)
class BallPoint:
    """One observed place of the ball: stamp [s], position (3,) [m], covariance (3, 3) [m^2], and which camera saw it."""

    time_s: float
    position: np.ndarray
    covariance: np.ndarray
    source: str = ""


@dataclass(frozen=True)
class CatchingPlane:
    """The plane y = offset (`depth`: in front of the robot) or z = offset (`height`), crossed from above; offset [m]."""

    kind: str
    offset_m: float

    @property
    def axis(self) -> int:
        """The coordinate that is constant: 1 or 2."""
        return _AXES[self.kind]

    def project(self, covariance: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, float]:
        """Carry a covariance (3, 3) at one moment over to the crossing of a path with this direction (3,), per unit.

        Returns the place's covariance (3, 3) within the plane, and the variance of how far along the path it lies [units^2].
        """
        slide = np.eye(3)
        slide[:, self.axis] -= direction / direction[self.axis]
        return slide @ covariance @ slide.T, float(covariance[self.axis, self.axis] / direction[self.axis] ** 2)


@dataclass(frozen=True, eq=False)
class Prediction:
    """Where and when the ball crosses a plane.

    time_s and its standard deviation [s]; position (3,) [m] and its covariance (3, 3) [m^2], zero across the plane;
    velocity (3,) [m/s]; the number of points it rests on.
    """

    time_s: float
    time_sigma_s: float
    position: np.ndarray
    covariance: np.ndarray
    velocity: np.ndarray
    points: int

    @property
    def sigma_m(self) -> float:
        """The standard deviation of the place along its worst direction [m]."""
        return float(math.sqrt(max(np.linalg.eigvalsh(self.covariance)[-1], 0.0)))


class Predictor(Protocol):
    """What fits a path to points as they come."""

    @property
    def points(self) -> int:
        """How many points the next prediction rests on."""

    def add(self, point: BallPoint) -> None:
        """Take one more point. Raises PredictionRefused for one on which the path does not rest."""

    def predict(self, plane: CatchingPlane) -> Prediction:
        """Return where and when the ball crosses the plane. Raises PredictionRefused."""

    def positions(self, times_s: np.ndarray) -> np.ndarray:
        """Return the fitted path (n, 3) at times (n,). Raises PredictionRefused."""


class StampCheck:
    """Refuses points that are not finite, or not later than the last one of the same camera."""

    def __init__(self) -> None:
        self._last_s: dict[str, float] = {}

    def check(self, point: BallPoint) -> None:
        """Raise PredictionRefused (NOT_FINITE, STAMP_NOT_RISING) unless the point can be used; remember its stamp."""
        position, covariance = np.shape(point.position), np.shape(point.covariance)
        if position != (3,) or covariance != (3, 3):
            raise PredictionRefused(
                PredictionReason.NOT_FINITE, f"point has shapes {position} and {covariance}; expected (3,) and (3, 3)"
            )
        if not (math.isfinite(point.time_s) and np.isfinite(point.position).all() and np.isfinite(point.covariance).all()):
            problem = f"point at {point.time_s} s is {np.asarray(point.position).tolist()}; expected finite numbers"
            raise PredictionRefused(PredictionReason.NOT_FINITE, problem)
        last_s = self._last_s.get(point.source, -math.inf)
        if point.time_s <= last_s:
            problem = f"point is stamped {point.time_s:.6f} s; expected later than {last_s:.6f} s"
            raise PredictionRefused(PredictionReason.STAMP_NOT_RISING, problem)
        self._last_s[point.source] = point.time_s


def seconds_until_below(rise_m: float, speed_m_s: float) -> float:
    """Return when [s] a ball that goes up at a speed (or down: negative) sinks through a height `rise_m` above it.

    Before now, thus negative, when it already fell through. Raises PredictionRefused (NEVER_CROSSES).
    """
    rest = speed_m_s * speed_m_s - 2.0 * GRAVITY_M_S2 * rise_m
    if rest <= 0.0:
        raise PredictionRefused(PredictionReason.NEVER_CROSSES, "the ball does not rise to the catching height")
    return (speed_m_s + math.sqrt(rest)) / GRAVITY_M_S2


def too_few(points: int) -> PredictionRefused:
    """Return the refusal of a path with so few points."""
    return PredictionRefused(PredictionReason.TOO_FEW_POINTS, f"{points} points; expected at least {LEAST_POINTS}")
