"""Joint trajectories: minimum-jerk moves, smooth paths through way-points, sampled profiles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

# Peaks of the rest-to-rest minimum-jerk profile of unit length and duration: 15/8 and 10/sqrt(3).
MINIMUM_JERK_PEAK_SPEED = 1.875
MINIMUM_JERK_PEAK_ACCELERATION = 5.7735


def minimum_jerk(fraction: np.ndarray | float) -> np.ndarray | float:
    """Return the travelled share [0..1] at a share of the time, at rest at both ends (Flash and Hogan 1985)."""
    s = np.clip(fraction, 0.0, 1.0)
    return s * s * s * (10.0 + s * (-15.0 + 6.0 * s))


@dataclass(frozen=True)
class MotionLimits:
    """How fast joints may go: speed [rad/s] and acceleration [rad/s^2]."""

    speed: float
    acceleration: float

    def duration(self, change: np.ndarray, shortest: float = 0.04) -> float:
        """Return the shortest minimum-jerk duration [s] for a joint change (n,) [rad]."""
        largest = float(np.max(np.abs(change), initial=0.0))
        return max(
            shortest,
            MINIMUM_JERK_PEAK_SPEED * largest / self.speed,
            float(np.sqrt(MINIMUM_JERK_PEAK_ACCELERATION * largest / self.acceleration)),
        )


class JointTrajectory:
    """Joint positions over time, through way-points, at rest at both ends.

    `points` (k, n) [rad] are passed at the path shares 0, 1/(k-1), .. 1; the share itself follows the minimum-jerk profile,
    so the hand starts and stops smoothly whatever the number of points.
    """

    def __init__(self, points: np.ndarray, duration: float):
        self.points = np.asarray(points, dtype=float)
        if self.points.ndim != 2 or len(self.points) < 2 or not np.isfinite(self.points).all():
            raise ValueError(f"a trajectory needs at least two finite points (k, n), got shape {self.points.shape}")
        if not duration > 0.0:
            raise ValueError(f"a trajectory's duration must be positive, got {duration} s")
        self.duration = float(duration)
        self._spline = CubicSpline(np.linspace(0.0, 1.0, len(self.points)), self.points) if len(self.points) > 2 else None

    @classmethod
    def within(cls, points: np.ndarray, limits: MotionLimits) -> JointTrajectory:
        """Return the quickest trajectory through the points that keeps the limits (checked on a fine grid)."""
        points = np.asarray(points, dtype=float)
        travelled = np.abs(np.diff(points, axis=0)).sum(axis=0)
        trajectory = cls(points, limits.duration(travelled))
        speed, acceleration = trajectory.peaks()
        stretch = max(speed / limits.speed, float(np.sqrt(acceleration / limits.acceleration)))
        return trajectory if stretch <= 1.0 else cls(points, trajectory.duration * stretch)

    @property
    def end(self) -> np.ndarray:
        """Joint positions (n,) [rad] at the end."""
        return self.points[-1]

    def at(self, elapsed: float) -> np.ndarray:
        """Return the joint positions (n,) [rad] after `elapsed` seconds; the end position from then on."""
        share = float(minimum_jerk(elapsed / self.duration))
        if self._spline is None:
            return self.points[0] + share * (self.points[1] - self.points[0])
        return self._spline(share)

    def peaks(self, samples: int = 200) -> tuple[float, float]:
        """Return the largest joint speed [rad/s] and acceleration [rad/s^2] by central differences on a grid."""
        times = np.linspace(0.0, self.duration, samples + 1)
        positions = np.array([self.at(t) for t in times])
        step = times[1]
        speeds = np.diff(positions, axis=0) / step
        return float(np.abs(speeds).max()), float(np.abs(np.diff(speeds, axis=0)).max() / step)


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

    def at(self, elapsed: float) -> np.ndarray:
        """Return the joint positions (n,) [rad] after `elapsed` seconds, linear between the samples."""
        t = float(np.clip(elapsed, self.times[0], self.times[-1]))
        k = min(int(np.searchsorted(self.times, t, side="right")), len(self.times) - 1)
        t0, t1 = self.times[k - 1], self.times[k]
        return self.points[k - 1] + (t - t0) / (t1 - t0) * (self.points[k] - self.points[k - 1])
