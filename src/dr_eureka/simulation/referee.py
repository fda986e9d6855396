"""The referee: which ball is where, by the simulator's true poses. For people and tests, never for the robot."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Mapping, Sequence

import numpy as np

from dr_eureka.game.state import TUBES, State
from dr_eureka.pieces import Pieces
from dr_eureka.simulation.settings import RefereeSettings


@dataclass(frozen=True)
class Verdict:
    """What the referee saw.

    `tubes` holds each tube's balls bottom to top; `state` the same as `RR|GG|PP`, or None while a ball is in no tube;
    `balls_lost` counts those, a ball in flight among them. `tubes_standing`: on the sheet and upright.
    """

    tubes: dict[str, str]
    state: str | None
    balls_lost: int
    tubes_standing: dict[str, bool]

    def solved(self, goal: State | str) -> bool:
        """Return whether every tube stands and holds what the goal asks for."""
        return self.state == str(goal) and all(self.tubes_standing.values())


def judge(base_from_tubes: Mapping[str, np.ndarray], balls: Sequence[tuple[str, np.ndarray]], sheet_height: float,
          pieces: Pieces, settings: RefereeSettings) -> Verdict:
    """Say which ball is in which tube.

    Args:
        base_from_tubes: name -> (4, 4), origin at the underside of the foot, z toward the mouth [m].
        balls: (colour letter, centre (3,) in base [m]) of each ball.
        sheet_height: z of the sheet's surface in base [m].

    A ball is in a tube while its centre is inside the bore and below the mouth.
    """
    heights: dict[str, list[tuple[float, str]]] = {name: [] for name in TUBES}
    lost = 0
    for colour, centre in balls:
        for name in TUBES:
            x, y, z = _in_frame(base_from_tubes[name], centre)
            if np.hypot(x, y) < pieces.tube_bore / 2 and 0.0 < z < pieces.tube_height:
                heights[name].append((z, colour))
                break
        else:
            lost += 1
    tubes = {name: "".join(colour for _, colour in sorted(found)) for name, found in heights.items()}
    standing = {name: _stands(base_from_tubes[name], sheet_height, settings) for name in TUBES}
    state = "|".join(tubes[name] for name in TUBES) if lost == 0 else None
    return Verdict(tubes, state, lost, standing)


def _in_frame(base_from_frame: np.ndarray, point: np.ndarray) -> np.ndarray:
    return base_from_frame[:3, :3].T @ (np.asarray(point) - base_from_frame[:3, 3])


def _stands(base_from_tube: np.ndarray, sheet_height: float, settings: RefereeSettings) -> bool:
    upright = base_from_tube[2, 2] > np.cos(settings.standing_tilt)
    return bool(upright and abs(base_from_tube[2, 3] - sheet_height) < settings.standing_height)
