"""Pours spoilt on purpose, so that a test can see what the robot makes of them. Nothing happens unless asked for."""
from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Mapping

import numpy as np

from dr_eureka.game.state import TUBES
from dr_eureka.pieces import Pieces
from dr_eureka.simulation.joints import ALL_JOINTS
from dr_eureka.simulation.settings import SimulationError
from dr_eureka.simulation.world import World

# A tube whose axis is this near the horizontal is being poured from; the receiving one leans by 35 degrees only.
POURING_ELEVATION = math.radians(30.0)
# A jog comes and goes in this time [s]: the arm is pushed, not struck.
RAMP_SECONDS = 0.2
LARGEST_JOG = 1.0
# Where a ball comes to lie, x and y in the sheet's frame [m]: behind the tubes, where no hand comes.
KNOCKED_OUT_TO = (0.09, 0.05)


class FaultName:
    """What can be done to a pour; the names are those of `SpoilPour.srv`."""

    JOG = "JOG"
    KNOCK_OUT_BALL = "KNOCK_OUT_BALL"

    ALL = (JOG, KNOCK_OUT_BALL)


@dataclass(frozen=True)
class Fault:
    """One spoilt pour.

    `JOG`: joints are pushed by `offsets` [rad] for `seconds`, and their encoders do not notice. `KNOCK_OUT_BALL`: the
    uppermost ball of the tube that is poured from lies on the sheet instead.

    Raises:
        SimulationError: an unknown name or joint, an offset that is not finite or too large, a time that is not positive.
    """

    name: str
    offsets: Mapping[str, float] = field(default_factory=dict)
    seconds: float = 0.0

    def __post_init__(self) -> None:
        if self.name not in FaultName.ALL:
            raise SimulationError(f"fault {self.name!r}: unknown; expected one of {', '.join(FaultName.ALL)}")
        if self.name != FaultName.JOG:
            return
        for joint, offset in self.offsets.items():
            if joint not in ALL_JOINTS:
                raise SimulationError(f"jog: unknown joint {joint!r}; expected one of {', '.join(ALL_JOINTS)}")
            if not abs(offset) <= LARGEST_JOG:
                raise SimulationError(f"jog of {joint}: is {offset} rad; expected at most {LARGEST_JOG:g} either way")
        if not self.offsets or not 0.0 < self.seconds < math.inf:
            given = f"{len(self.offsets)} joints for {self.seconds} s"
            raise SimulationError(f"jog: {given}; expected at least one, and a finite time")


class PourSpoiler:
    """Waits for the next pour in a world and spoils it, once for each fault asked for.

    Call `step` after every control cycle; commands go to the world through `pushed`, angles to the robot through `noticed`.
    """

    def __init__(self, world: World, pieces: Pieces) -> None:
        self._world = world
        self._pieces = pieces
        self._waiting: list[Fault] = []
        self._jog = Fault(FaultName.KNOCK_OUT_BALL)
        self._jog_began_s = -math.inf
        self._poured_from: str | None = None

    def spoil_next_pour(self, fault: Fault) -> None:
        """Let a pour that has not begun yet go wrong."""
        self._waiting.append(fault)

    def step(self) -> Fault | None:
        """Spoil the pour that has just begun; return how, None when nothing was done."""
        before, self._poured_from = self._poured_from, self._tipped_tube()
        if not self._waiting or before or not self._poured_from:
            return None
        fault = self._waiting.pop(0)
        if fault.name == FaultName.JOG:
            self._jog, self._jog_began_s = fault, self._world.time_s
        else:
            self._knock_out(self._poured_from)
        return fault

    def _knock_out(self, tube: str) -> None:
        """Lay a tube's uppermost ball on the sheet; nothing to do for an empty tube."""
        pieces, pose = self._pieces, self._world.tube_pose(tube)
        inside = []
        for index, (_, centre) in enumerate(self._world.ball_positions()):
            x, y, z = pose[:3, :3].T @ (centre - pose[:3, 3])
            if np.hypot(x, y) < pieces.tube_bore / 2 and 0.0 < z < pieces.tube_height:
                inside.append((z, index))
        if inside:
            in_sheet = [*KNOCKED_OUT_TO, pieces.ball_radius, 1.0]
            self._world.put_ball(max(inside)[1], (self._world.placement.base_from_sheet @ in_sheet)[:3])

    def _tipped_tube(self) -> str | None:
        return next((name for name in TUBES if abs(self._world.tube_pose(name)[2, 2]) < math.sin(POURING_ELEVATION)), None)

    def _share(self) -> float:
        """Return how much of the jog acts now (0..1)."""
        since = self._world.time_s - self._jog_began_s
        return float(np.clip(min(since, self._jog.seconds - since) / RAMP_SECONDS, 0.0, 1.0))

    def pushed(self, goals: Mapping[str, float]) -> dict[str, float]:
        """Return joint goals [rad] with the jog in them."""
        return {name: goal + self._share() * self._jog.offsets.get(name, 0.0) for name, goal in goals.items()}

    def noticed(self, angles: Mapping[str, float]) -> dict[str, float]:
        """Return joint angles [rad] as the encoders tell them: without the jog."""
        return {name: angle - self._share() * self._jog.offsets.get(name, 0.0) for name, angle in angles.items()}
