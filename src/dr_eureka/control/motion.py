"""What the engine runs between two decisions: a set of joints following trajectories, or waiting for something."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Mapping

from dr_eureka.control.trajectory import JointTrajectory, SampledTrajectory

Trajectory = JointTrajectory | SampledTrajectory


@dataclass(frozen=True)
class Follow:
    """Let groups of joints follow trajectories, all starting together; over when the longest is."""

    tracks: tuple[tuple[tuple[str, ...], Trajectory], ...]

    @property
    def duration(self) -> float:
        """Seconds until the last joint is there."""
        return max(trajectory.duration for _, trajectory in self.tracks)

    def goals(self, elapsed: float) -> dict[str, float]:
        """Return the joint goals [rad] after `elapsed` seconds."""
        return {
            name: float(position)
            for names, trajectory in self.tracks
            for name, position in zip(names, trajectory.at(elapsed))
        }

    def over(self, elapsed: float, joints: Mapping[str, float]) -> bool:
        """Tell whether the motion's time is up."""
        return elapsed >= self.duration


@dataclass(frozen=True)
class Wait:
    """Hold all joints until a condition on the measured joints is met, at most `limit` seconds of robot time.

    Running out of time is not an error here: the skill that waited looks at the joints and decides.
    """

    until: Callable[[float, Mapping[str, float]], bool]
    limit: float

    def goals(self, elapsed: float) -> dict[str, float]:
        """Return no new goals: everything holds."""
        return {}

    def over(self, elapsed: float, joints: Mapping[str, float]) -> bool:
        """Tell whether the condition is met or the time is up."""
        return elapsed >= self.limit or self.until(elapsed, joints)


Motion = Follow | Wait


def settled(names: tuple[str, ...], quiet: float = 0.002, seconds: float = 0.08) -> Callable[[float, Mapping[str, float]], bool]:
    """Return a condition that holds once the joints have moved less than `quiet` [rad] for `seconds`."""
    reference: dict[str, float] = {}
    since = [0.0]

    def condition(elapsed: float, joints: Mapping[str, float]) -> bool:
        if any(name not in reference or abs(joints[name] - reference[name]) > quiet for name in names):
            reference.update({name: joints[name] for name in names})
            since[0] = elapsed
        return elapsed - since[0] >= seconds

    return condition
