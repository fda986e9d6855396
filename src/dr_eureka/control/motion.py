"""What the engine runs between two decisions: a set of joints following trajectories, or waiting for something."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Mapping

import numpy as np

from dr_eureka.control.trajectory import JointTrajectory, SampledTrajectory, TrajectorySequence

Trajectory = JointTrajectory | SampledTrajectory | TrajectorySequence
Track = tuple[tuple[str, ...], Trajectory]
# Asked each cycle with the seconds since the motion began and the measured joints [rad].
Condition = Callable[[float, Mapping[str, float]], bool]


@dataclass(frozen=True)
class Follow:
    """Let groups of joints follow trajectories, all starting together; over when the longest is.

    `may_touch`: pairs of bodies whose contact is what the motion is for, such as a finger and the tube that it closes on.
    """

    tracks: tuple[Track, ...]
    may_touch: frozenset[frozenset[str]] = frozenset()

    @property
    def duration(self) -> float:
        """Seconds until the last joint is there."""
        return max(trajectory.duration for _, trajectory in self.tracks)

    def goals(self, elapsed: float) -> dict[str, float]:
        """Return the joint goals [rad] after `elapsed` seconds."""
        return {name: float(position) for name, position in self.sampled(elapsed).items()}

    def sampled(self, times: np.ndarray | float) -> dict[str, np.ndarray]:
        """Return the joint goals (...) [rad] at times (...) [s] after the start, by name."""
        return {
            name: positions
            for names, trajectory in self.tracks
            for name, positions in zip(names, np.moveaxis(trajectory.at(times), -1, 0))
        }

    def over(self, elapsed: float, joints: Mapping[str, float]) -> bool:
        """Tell whether the motion's time is up."""
        return elapsed >= self.duration


class Brake:
    """Bring a motion to rest on its own path: its clock runs slower evenly until it stands still.

    No joint slows down harder than `deceleration` [rad/s^2] besides what the motion itself asks of it.
    """

    def __init__(self, motion: Follow, elapsed: float, deceleration: float):
        self._motion, self._began = motion, elapsed
        # The clock stops after half of the braking time, so only the speeds up to there matter.
        step, seconds = 0.001, 0.0
        for _ in range(2):
            times = elapsed + np.arange(0.0, 0.5 * seconds + 2.0 * step, step)
            speed = max(float(np.abs(np.diff(values)).max()) for values in motion.sampled(times).values()) / step
            seconds = speed / deceleration
        self.duration = seconds

    def goals(self, elapsed: float) -> dict[str, float]:
        """Return the joint goals [rad] `elapsed` seconds after braking began."""
        braked = min(elapsed, self.duration)
        run = braked - 0.5 * braked**2 / self.duration if self.duration > 0.0 else 0.0
        return self._motion.goals(self._began + run)

    def over(self, elapsed: float, joints: Mapping[str, float]) -> bool:
        """Tell whether all joints are at rest."""
        return elapsed >= self.duration


@dataclass(frozen=True)
class Wait:
    """Hold all joints until a condition on the measured joints is met, at most `limit` seconds of robot time.

    Running out of time is not an error here: the skill that waited looks at the joints and decides.
    """

    until: Condition
    limit: float

    def goals(self, elapsed: float) -> dict[str, float]:
        """Return no new goals: everything holds."""
        return {}

    def over(self, elapsed: float, joints: Mapping[str, float]) -> bool:
        """Tell whether the condition is met or the time is up."""
        return elapsed >= self.limit or self.until(elapsed, joints)


Motion = Follow | Wait


def settled(names: tuple[str, ...], quiet: float = 0.002, seconds: float = 0.08) -> Condition:
    """Return a condition that holds once the joints have moved less than `quiet` [rad] for `seconds`."""
    reference: dict[str, float] = {}
    since = [0.0]

    def condition(elapsed: float, joints: Mapping[str, float]) -> bool:
        if any(name not in reference or abs(joints[name] - reference[name]) > quiet for name in names):
            reference.update({name: joints[name] for name in names})
            since[0] = elapsed
        return elapsed - since[0] >= seconds

    return condition
