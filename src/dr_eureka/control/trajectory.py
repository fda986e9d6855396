"""Joint trajectories: a path through way-points, and a profile that says how far along it the joints are when."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol, Sequence

import numpy as np
from ruckig import InputParameter, Result, Ruckig, Trajectory
from scipy.interpolate import CubicSpline

_POSITIVE = {"min": 1e-6}
# Where a path is looked at for its steepest stretches, and a trajectory for its peaks.
_SAMPLES = 400


@dataclass(frozen=True)
class MotionLimits:
    """How fast joints may go: speed [rad/s], acceleration [rad/s^2], jerk [rad/s^3]."""

    speed: float = field(metadata=_POSITIVE)
    acceleration: float = field(metadata=_POSITIVE)
    jerk: float = field(metadata=_POSITIVE)

    def stretch(self, speed: float, acceleration: float, jerk: float) -> float:
        """Return by what factor a motion with these peaks must take longer to keep the limits; below 1 it is within them."""
        return max(speed / self.speed, np.sqrt(acceleration / self.acceleration), np.cbrt(jerk / self.jerk))


class Profile(Protocol):
    """The share 0..1 of a path that is travelled over time, at rest at both ends."""

    duration: float

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the shares (k,) at times (k,) [s]."""


class MinimumJerk:
    """The rest-to-rest profile of least jerk that takes a given time [s] (Flash and Hogan 1985)."""

    def __init__(self, duration: float):
        if not duration > 0.0:
            raise ValueError(f"a trajectory's duration must be positive, got {duration} s")
        self.duration = float(duration)

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the shares (k,) at times (k,) [s]."""
        s = np.clip(np.asarray(times) / self.duration, 0.0, 1.0)
        return s * s * s * (10.0 + s * (-15.0 + 6.0 * s))


class Quickest:
    """The quickest rest-to-rest profile within limits on speed [1/s], acceleration [1/s^2] and jerk [1/s^3] of the share.

    It takes `at_least` [s], even where the limits would let it be quicker. Source: ruckig (Berscheid and Kroeger, RSS 2021).
    """

    def __init__(self, speed: float, acceleration: float, jerk: float, at_least: float = 0.0):
        wanted = InputParameter(1)
        wanted.current_position, wanted.target_position = [0.0], [1.0]
        wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = [speed], [acceleration], [jerk]
        wanted.minimum_duration = at_least
        self._trajectory = Trajectory(1)
        result = Ruckig(1).calculate(wanted, self._trajectory)
        if result != Result.Working:
            limits = f"speed {speed}, acceleration {acceleration}, jerk {jerk}"
            raise ValueError(f"no profile within {limits} that takes {at_least} s: {result}")
        self.duration = float(self._trajectory.duration)

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the shares (k,) at times (k,) [s]."""
        inside = np.clip(times, 0.0, self.duration)
        return np.array([self._trajectory.at_time(time)[0][0] for time in np.atleast_1d(inside)]).reshape(np.shape(times))


class JointTrajectory:
    """Joint positions over time through `points` (k, n) [rad], at the path shares 0, 1/(k-1), .. 1; at rest at both ends."""

    def __init__(self, points: np.ndarray, profile: Profile):
        self.points = np.asarray(points, dtype=float)
        if self.points.ndim != 2 or len(self.points) < 2 or not np.isfinite(self.points).all():
            raise ValueError(f"a trajectory needs at least two finite points (k, n), got shape {self.points.shape}")
        self._profile = profile
        self._path = _path_through(self.points)

    @classmethod
    def lasting(cls, points: np.ndarray, duration: float) -> JointTrajectory:
        """Return the trajectory of least jerk that takes `duration` [s]."""
        return cls(points, MinimumJerk(duration))

    @classmethod
    def within(
        cls, points: np.ndarray, limits: MotionLimits, share_speed: float = np.inf, at_least: float = 0.0
    ) -> JointTrajectory:
        """Return a quick trajectory through the points that keeps the limits at every moment (checked on a fine grid).

        It takes `at_least` [s] and travels no more than `share_speed` [1/s] of the path at a time.
        """
        points = np.asarray(points, dtype=float)
        steepest = float(np.abs(_path_through(points)(np.linspace(0.0, 1.0, _SAMPLES + 1), 1)).max())
        steepest = max(steepest, 1e-3)  # what hardly moves need not hurry
        speed, acceleration, jerk = (
            min(limits.speed / steepest, share_speed), limits.acceleration / steepest, limits.jerk / steepest
        )
        trajectory = cls(points, Quickest(speed, acceleration, jerk, at_least))
        # On a bent path the bends add to what the profile does; slower by one factor, all of it is within the limits.
        stretch = limits.stretch(*trajectory.peaks())
        if stretch <= 1.0:
            return trajectory
        return cls(points, Quickest(speed / stretch, acceleration / stretch**2, jerk / stretch**3, at_least))

    @property
    def duration(self) -> float:
        """Seconds from the first point to the last."""
        return self._profile.duration

    @property
    def end(self) -> np.ndarray:
        """Joint positions (n,) [rad] at the end."""
        return self.points[-1]

    def at(self, times: np.ndarray | float) -> np.ndarray:
        """Return the joint positions (..., n) [rad] at times (...) [s]; those at the ends before and after."""
        return self._path(self._profile.at(np.asarray(times, dtype=float)))

    def peaks(self) -> tuple[float, float, float]:
        """Return the largest joint speed [rad/s], acceleration [rad/s^2] and jerk [rad/s^3], by differences on a grid."""
        times = np.linspace(0.0, self.duration, _SAMPLES + 1)
        positions, step = self.at(times), times[1]
        return tuple(float(np.abs(np.diff(positions, n, axis=0)).max()) / step**n for n in (1, 2, 3))


class SampledTrajectory:
    """Joint positions given at times of one's own, for profiles that are not rest-to-rest (the direct pour)."""

    def __init__(self, times: np.ndarray, points: np.ndarray):
        self.times = np.asarray(times, dtype=float)
        self.points = np.asarray(points, dtype=float)
        if len(self.times) != len(self.points) or len(self.times) < 2 or (np.diff(self.times) <= 0.0).any():
            raise ValueError("a sampled trajectory needs rising times, one for each point")
        self.duration = float(self.times[-1])

    @property
    def end(self) -> np.ndarray:
        """Joint positions (n,) [rad] at the end."""
        return self.points[-1]

    def at(self, times: np.ndarray | float) -> np.ndarray:
        """Return the joint positions (..., n) [rad] at times (...) [s], linear between the samples."""
        return np.stack([np.interp(times, self.times, column) for column in self.points.T], axis=-1)


class TrajectorySequence:
    """Trajectories one after the other, without a pause."""

    def __init__(self, parts: Sequence[JointTrajectory | SampledTrajectory]):
        self._parts = tuple(parts)
        self._ends = np.cumsum([part.duration for part in self._parts])
        self.duration = float(self._ends[-1])

    def at(self, times: np.ndarray | float) -> np.ndarray:
        """Return the joint positions (..., n) [rad] at times (...) [s]."""
        times = np.asarray(times, dtype=float)
        which = np.minimum(np.searchsorted(self._ends, times), len(self._parts) - 1)
        began = np.concatenate([[0.0], self._ends])[which]
        result = np.empty(times.shape + self._parts[0].at(0.0).shape)
        for index, part in enumerate(self._parts):
            mine = which == index
            if mine.any():
                result[mine] = part.at((times - began)[mine])
        return result


def _path_through(points: np.ndarray) -> CubicSpline:
    """Return the smooth path, share -> (n,), through points (k, n); straight when there are two."""
    return CubicSpline(np.linspace(0.0, 1.0, len(points)), points)
