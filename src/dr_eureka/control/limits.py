"""The last word on every command: finite, inside the joint limits, no faster than the joints may go."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Mapping

from dr_eureka.control.codes import ControlError, EngineCode
from dr_eureka.control.port import grip_joint
from dr_eureka.game.hands import HANDS
from dr_eureka.kinematics.arms import BASE_LINK, URDF, head_chain
from dr_eureka.kinematics.chain import Chain
from dr_eureka.resources import resource_path


@dataclass(frozen=True)
class JointLimit:
    """Range [rad] and speed [rad/s] of one joint."""

    lower: float
    upper: float
    speed: float


def joint_ranges() -> dict[str, tuple[float, float]]:
    """Return lower and upper limit [rad] of every controlled joint, by name, as the robot's description has them."""
    hands = [Chain.from_urdf(resource_path(URDF), BASE_LINK, f"{grip_joint(hand)}_link") for hand in HANDS]
    return {
        name: (float(low), float(high))
        for chain in (head_chain(), *hands)
        for name, low, high in zip(chain.joint_names, chain.lower, chain.upper)
    }


class CommandLimiter:
    """Clamp joint goals to range and speed, cycle by cycle; nothing is written to a robot but through this.

    It acts on the commands' own history (open loop), so a late or noisy measurement cannot make it jump. A gap in the cycles
    allows no more than `longest_step` [s] of movement at once.
    """

    def __init__(self, limits: Mapping[str, JointLimit], longest_step: float):
        self._limits = dict(limits)
        self._longest_step = longest_step
        self._last: dict[str, float] = {}
        self._time: float | None = None

    def reset(self, time_s: float, positions: Mapping[str, float]) -> None:
        """Start anew from measured positions [rad]; joints outside their range are taken as they are and led back."""
        self._time = time_s
        self._last = {name: float(positions[name]) for name in self._limits if name in positions}

    def apply(self, time_s: float, goals: Mapping[str, float]) -> dict[str, float]:
        """Return the goals [rad] as they may be written at `time_s`; raise ControlError for an unknown joint or a NaN."""
        elapsed = min(max(0.0, time_s - self._time), self._longest_step) if self._time is not None else 0.0
        allowed: dict[str, float] = {}
        for name, goal in goals.items():
            limit = self._limits.get(name)
            if limit is None or name not in self._last:
                problem = f"joint {name!r} is not controlled; known: {sorted(self._limits)}"
                raise ControlError(EngineCode.UNKNOWN_JOINT, problem)
            if not isfinite(goal):
                raise ControlError(EngineCode.INVALID_VALUE, f"goal of {name} is {goal}, expected a finite angle [rad]")
            reach = limit.speed * elapsed
            last = self._last[name]
            step = min(max(min(max(goal, limit.lower), limit.upper) - last, -reach), reach)
            allowed[name] = last + step
        self._last.update(allowed)
        self._time = time_s
        return allowed
