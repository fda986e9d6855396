"""Our prediction: the one flight under gravity that fits all points best, each weighted by its own covariance.

Where the paper fits three coefficients of height over noisy depths, gravity is known here, the fit runs over time, which
is exact, and a point counts along each direction as much as it is known: a view from one camera is sure across its ray and
unsure along it, so that views of both cameras, at whatever times, measure the depth by parallax together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import special

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
    seconds_until_below,
    too_few,
)

_GRAVITY = np.array([0.0, 0.0, -GRAVITY_M_S2])
# A share of the points that may be wrong before the flight itself is doubted.
_LARGEST_OUTLIER_SHARE = 1.0 / 3.0
# Points whose variance is so many times what they say are no flight: ten times the standard deviation.
_LARGEST_INFLATION = 100.0
_MEDIAN_CHI2 = float(special.chdtri(3, 0.5))


@dataclass(frozen=True, eq=False)
class _Flight:
    """A fitted flight: place and speed (6,) at the origin of time, their covariance (6, 6), and which points it rests on."""

    state: np.ndarray
    covariance: np.ndarray
    kept: np.ndarray


class BallisticFit:
    """Weighted least squares in time with known gravity; points that do not belong are left out.

    `outlier_chance`: how often a good point may be taken for an outlier.
    """

    def __init__(self, outlier_chance: float):
        self._gate = float(special.chdtri(3, outlier_chance))
        self._stamps = StampCheck()
        self._times: list[float] = []
        self._places: list[np.ndarray] = []
        self._covariances: list[np.ndarray] = []
        self._weights: list[np.ndarray] = []
        self._flight: _Flight | None = None

    @property
    def points(self) -> int:
        """How many points the flight rests on, or how many there are before the first fit."""
        return len(self._times) if self._flight is None else int(self._flight.kept.sum())

    def add(self, point: BallPoint) -> None:
        """Take one more point and fit anew.

        Raises PredictionRefused: NOT_FINITE, STAMP_NOT_RISING (the point is forgotten); OUTLIER (it is kept in mind, in case
        later ones agree with it); NOT_A_FLIGHT (too many disagree: the older half is forgotten, as when a ball that was
        held is let go).
        """
        self._stamps.check(point)
        try:
            weight = np.linalg.inv(point.covariance)
        except np.linalg.LinAlgError as error:
            problem = f"point at {point.time_s} s has a singular covariance"
            raise PredictionRefused(PredictionReason.NOT_FINITE, problem) from error
        self._times.append(point.time_s)
        self._places.append(np.array(point.position, float))
        self._covariances.append(np.array(point.covariance, float))
        self._weights.append(weight)
        self._flight = None
        if len(self._times) < LEAST_POINTS:
            return
        self._flight = self._fit()
        if self._flight is None:
            count = len(self._times)
            for kept in (self._times, self._places, self._covariances, self._weights):
                del kept[: count // 2]
            raise PredictionRefused(PredictionReason.NOT_A_FLIGHT, f"{count} points agree with no flight under gravity")
        if not self._flight.kept[-1]:
            problem = f"point at {point.time_s:.3f} s is not on the path of the others"
            raise PredictionRefused(PredictionReason.OUTLIER, problem)

    def predict(self, plane: CatchingPlane) -> Prediction:
        """Return where and when the flight crosses the plane, a height from above. Raises PredictionRefused."""
        flight = self._known()
        elapsed_s = self._crossing(flight.state, plane)
        _, velocity = self._at(flight.state, elapsed_s)
        carry = np.hstack([np.eye(3), elapsed_s * np.eye(3)])
        covariance, time_variance = plane.project(carry @ flight.covariance @ carry.T, velocity)
        return Prediction(
            time_s=self._times[0] + elapsed_s,
            time_sigma_s=math.sqrt(time_variance),
            position=self._at(flight.state, elapsed_s)[0],
            covariance=covariance,
            velocity=velocity,
            points=self.points,
        )

    def positions(self, times_s: np.ndarray) -> np.ndarray:
        """Return the fitted path (n, 3) [m] at times (n,) [s]. Raises PredictionRefused."""
        flight = self._known()
        elapsed = (np.asarray(times_s, float) - self._times[0])[:, None]
        return flight.state[:3] + flight.state[3:] * elapsed + 0.5 * _GRAVITY * elapsed**2

    def _known(self) -> _Flight:
        if self._flight is None or self.points < LEAST_POINTS:
            raise too_few(self.points)
        return self._flight

    @staticmethod
    def _at(state: np.ndarray, elapsed_s: float) -> tuple[np.ndarray, np.ndarray]:
        place = state[:3] + state[3:] * elapsed_s + 0.5 * _GRAVITY * elapsed_s**2
        return place, state[3:] + _GRAVITY * elapsed_s

    def _crossing(self, state: np.ndarray, plane: CatchingPlane) -> float:
        """Return the time from the origin on [s] at which the flight comes through the plane."""
        gap, speed = plane.offset_m - state[plane.axis], state[3 + plane.axis]
        if plane.kind == DEPTH:
            if not speed < 0.0:
                problem = f"depth changes by {speed:.2f} m/s; expected a ball that comes nearer"
                raise PredictionRefused(PredictionReason.NEVER_CROSSES, problem)
            return gap / speed
        return seconds_until_below(gap, speed)

    def _fit(self) -> _Flight | None:
        """Fit all points, leaving out the worst one by one while that is beyond the gate; None if too many are."""
        elapsed = np.array(self._times) - self._times[0]
        places = np.array(self._places) - 0.5 * _GRAVITY * elapsed[:, None] ** 2
        weights, covariances = np.array(self._weights), np.array(self._covariances)
        t = elapsed[:, None, None]
        pulls = (weights @ places[:, :, None])[:, :, 0]
        kept = np.ones(len(elapsed), bool)
        least = max(LEAST_POINTS - 1, math.ceil(len(elapsed) * (1.0 - _LARGEST_OUTLIER_SHARE)))
        while True:
            of_place, of_both, of_speed = (np.sum((t**power * weights)[kept], axis=0) for power in range(3))
            try:
                covariance = np.linalg.inv(np.block([[of_place, of_both], [of_both, of_speed]]))
            except np.linalg.LinAlgError:
                return None
            state = covariance @ np.concatenate([pulls[kept].sum(axis=0), elapsed[kept] @ pulls[kept]])
            off = (places - state[:3] - state[3:] * elapsed[:, None])[:, :, None]
            # How much worse the fit is for each point, other than by its share: e^T (C - H)^-1 e, with the covariance C of
            # the point and H of the path there (the deleted residual of regression diagnostics).
            mixed = covariance[:3, 3:] + covariance[3:, :3]
            path = covariance[:3, :3] + t * mixed + t * t * covariance[3:, 3:]
            worth = np.where(kept, np.sum(off * np.linalg.solve(covariances - path, off), axis=(1, 2)), 0.0)
            worst = int(np.argmax(worth))
            # Where all points scatter more than they say, the cameras are worse than thought, and none is an outlier for it.
            inflation = np.clip(np.median(worth[kept]) / _MEDIAN_CHI2, 1.0, _LARGEST_INFLATION)
            if worth[worst] <= self._gate * inflation:
                break
            if kept.sum() - 1 < least:
                return None
            kept[worst] = False
        chi2 = float(np.sum((off * (weights @ off))[kept]))
        freedom = 3 * int(kept.sum()) - 6
        if chi2 / freedom > _LARGEST_INFLATION:
            return None
        # Points that scatter more than they say make the path less sure, too.
        return _Flight(state, covariance * max(1.0, chi2 / freedom), kept)
