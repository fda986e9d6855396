"""The rules by which THORMANG3's manager takes commands: joints belong to modules, or to nobody and obey directly.

Behaviour of ROBOTIS' robotis_controller (commit 288e048), except that messages which would crash it or make it read out
of range are refused as a whole, and that every refusal has a name. The motion modules themselves are not simulated: a
joint that belongs to one holds its goal.
"""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Sequence

from dr_eureka.simulation.joints import ALL_JOINTS, ARM_JOINTS, GRIP_JOINTS, HEAD_JOINTS, LEG_JOINTS, TORSO_JOINT

NONE = "none"
MOTION_MODULE_MODE = "MotionModuleMode"
DIRECT_CONTROL_MODE = "DirectControlMode"
MODES = (MOTION_MODULE_MODE, DIRECT_CONTROL_MODE)
MODULE_JOINTS = {
    "base_module": frozenset(ALL_JOINTS),
    "action_module": frozenset(ALL_JOINTS),
    "manipulation_module": frozenset((*ARM_JOINTS, TORSO_JOINT)),
    "gripper_module": frozenset(GRIP_JOINTS),
    "head_control_module": frozenset(HEAD_JOINTS),
    "walking_module": frozenset(LEG_JOINTS),
}


class RefusalCode:
    """Why a command, or one joint of it, had no effect."""

    UNEQUAL_LENGTHS = "UNEQUAL_LENGTHS"
    UNKNOWN_JOINT = "UNKNOWN_JOINT"
    NOT_FINITE = "NOT_FINITE"
    OWNED_BY_MODULE = "OWNED_BY_MODULE"
    DIRECT_CONTROL = "DIRECT_CONTROL"
    UNKNOWN_MODULE = "UNKNOWN_MODULE"
    JOINT_NOT_IN_MODULE = "JOINT_NOT_IN_MODULE"
    UNKNOWN_MODE = "UNKNOWN_MODE"


@dataclass(frozen=True)
class Refusal:
    """A named reason and one line that says what was refused and what was expected."""

    code: str
    message: str

    def __str__(self) -> str:
        return f"{self.code}: {self.message}"


class RobotisManager:
    """Decides what a command to the manager does. At start every joint is in module `none`, in MotionModuleMode."""

    def __init__(self) -> None:
        self._owner = dict.fromkeys(ALL_JOINTS, NONE)
        self._enabled: set[str] = set()
        self._mode = MOTION_MODULE_MODE

    @property
    def control_mode(self) -> str:
        """The mode last set, `MotionModuleMode` or `DirectControlMode`."""
        return self._mode

    @property
    def enabled_modules(self) -> frozenset[str]:
        """The modules that would run; a module that lost a joint is switched off although it still owns others."""
        return frozenset(self._enabled)

    def joint_modules(self) -> dict[str, str]:
        """Return joint -> module of all 31 joints, alphabetical, as `present_joint_ctrl_modules` reports them."""
        return dict(self._owner)

    def set_joint_states(self, names: Sequence[str], positions: Sequence[float]) -> tuple[dict[str, float], list[Refusal]]:
        """Return the joint goals [rad] that a `set_joint_states` message sets, and what of it was refused.

        Only joints in module `none` obey. A message with unequal lengths, an unknown joint or a value that is not
        finite sets nothing at all.
        """
        if len(names) != len(positions):
            return {}, [Refusal(RefusalCode.UNEQUAL_LENGTHS,
                                f"{len(names)} names and {len(positions)} positions; expected as many of one as of the other")]
        broken = [_unknown_joint(name) for name in names if name not in self._owner]
        broken += [Refusal(RefusalCode.NOT_FINITE, f"{name} is {position}; expected a finite angle in rad")
                   for name, position in zip(names, positions) if not math.isfinite(position)]
        if broken:
            return {}, broken
        if self._mode == DIRECT_CONTROL_MODE:
            return {}, [Refusal(RefusalCode.DIRECT_CONTROL, f"mode is {self._mode}; expected {MOTION_MODULE_MODE}")]
        goals = {name: float(position) for name, position in zip(names, positions) if self._owner[name] == NONE}
        owned = [Refusal(RefusalCode.OWNED_BY_MODULE, f"{name} belongs to {self._owner[name]}; expected module {NONE}")
                 for name in names if self._owner[name] != NONE]
        return goals, owned

    def enable_ctrl_module(self, module: str) -> list[Refusal]:
        """Give a module all of its joints, or with `none` (or nothing) free every joint."""
        if module in ("", NONE):
            self._owner = dict.fromkeys(ALL_JOINTS, NONE)
            self._enabled.clear()
            return []
        if module not in MODULE_JOINTS:
            return [_unknown_module(module)]
        for joint in MODULE_JOINTS[module]:
            self._owner[joint] = module
        self._enabled = {owner for owner in self._owner.values() if owner != NONE}
        return []

    def set_joint_ctrl_modules(self, joints: Sequence[str], modules: Sequence[str]) -> list[Refusal]:
        """Assign joints to modules one by one; return what was refused.

        The previous module of a joint is switched off even where the new one is refused. Only modules named here are
        switched on.
        """
        if len(joints) != len(modules):
            return [Refusal(RefusalCode.UNEQUAL_LENGTHS,
                            f"{len(joints)} joints and {len(modules)} modules; expected as many of one as of the other")]
        refusals = [_unknown_joint(joint) for joint in joints if joint not in self._owner]
        known = [(joint, module or NONE) for joint, module in zip(joints, modules) if joint in self._owner]
        for joint, module in known:
            if self._owner[joint] != module:
                self._enabled.discard(self._owner[joint])
        for joint, module in known:
            if module == NONE or joint in MODULE_JOINTS.get(module, ()):
                self._owner[joint] = module
            elif module not in MODULE_JOINTS:
                refusals.append(_unknown_module(module))
            else:
                refusals.append(Refusal(RefusalCode.JOINT_NOT_IN_MODULE, f"{module} has no joint {joint}"))
        self._enabled |= {module for joint, module in known if module != NONE and self._owner[joint] == module}
        return refusals

    def set_control_mode(self, mode: str) -> list[Refusal]:
        """Choose the mode; the real manager ignores any other word, and so does this one, but says so."""
        if mode not in MODES:
            return [Refusal(RefusalCode.UNKNOWN_MODE, f"{mode!r}; expected one of {', '.join(MODES)}")]
        self._mode = mode
        return []


def _unknown_joint(name: str) -> Refusal:
    return Refusal(RefusalCode.UNKNOWN_JOINT, f"{name!r}; expected one of {', '.join(ALL_JOINTS)}")


def _unknown_module(name: str) -> Refusal:
    return Refusal(RefusalCode.UNKNOWN_MODULE, f"{name!r}; expected {NONE} or one of {', '.join(MODULE_JOINTS)}")
