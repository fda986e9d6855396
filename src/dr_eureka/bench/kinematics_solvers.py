"""The ways to solve inverse kinematics that are compared, each from start and target to one answer."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dr_eureka.bench.kinematics_engines import BulletArm, KdlArm
from dr_eureka.kinematics.arms import arm_chain
from dr_eureka.kinematics.hybrid import HybridSettings, HybridSolver
from dr_eureka.kinematics.network import ArmNetwork
from dr_eureka.kinematics.transforms import rotation_vector

HYBRID, JACOBIAN = "hybrid", "Jacobian only"
PAPER_HYBRID, PAPER_JACOBIAN = "hybrid as in the paper", "Jacobian only as in the paper"
NETWORK, BULLET, KDL = "network only", "PyBullet", "KDL"
METHODS = (HYBRID, JACOBIAN, PAPER_HYBRID, PAPER_JACOBIAN, NETWORK, KDL, BULLET)
_NETWORK_CYCLES = 60
_STALLED = 5  # cycles without progress that end the network's attempt


@dataclass(frozen=True)
class Answer:
    """Joints (7,) [rad]; for our own solvers the steps taken, those by the network, and the path (k, 7) from the start."""

    joints: np.ndarray
    cycles: int | None = None
    network_cycles: int = 0
    path: np.ndarray | None = None


Solver = Callable[[np.ndarray, np.ndarray], Answer]


@lru_cache(maxsize=None)
def solvers(side: str, settings: HybridSettings) -> dict[str, Solver]:
    """Return the solvers of an arm by name; each maps start joints (7,) [rad] and a target pose (4, 4) to an Answer."""
    chain, network, paper = arm_chain(side), ArmNetwork.load(), HybridSettings.paper()
    by_name: dict[str, Solver] = {
        HYBRID: _hybrid(HybridSolver(chain, network, settings)),
        JACOBIAN: _hybrid(HybridSolver(chain, None, settings)),
        PAPER_HYBRID: _hybrid(HybridSolver(chain, network, paper)),
        PAPER_JACOBIAN: _hybrid(HybridSolver(chain, None, paper)),
        NETWORK: _network_only(side, network, settings),
    }
    for name, arm in ((KDL, KdlArm(side)), (BULLET, BulletArm(side))):
        by_name[name] = lambda start, target, arm=arm: Answer(arm.solve(start, target))
    return by_name


def _hybrid(solver: HybridSolver) -> Solver:
    def solve(start: np.ndarray, target: np.ndarray) -> Answer:
        result = solver.solve(start, target)
        return Answer(result.joints, result.cycles, result.network_cycles, np.array(result.path))

    return solve


def _network_only(side: str, network: ArmNetwork, settings: HybridSettings) -> Solver:
    """Return a solver that steps by the network alone, clipped to the limits, and keeps the best pose it came through."""
    chain = arm_chain(side)

    def solve(start: np.ndarray, target: np.ndarray) -> Answer:
        joints, best, best_score, best_cycle, path = start, start, math.inf, 0, [start]
        for cycle in range(_NETWORK_CYCLES):
            pose = chain.forward(joints)
            shift, turn = target[:3, 3] - pose[:3, 3], rotation_vector(target[:3, :3] @ pose[:3, :3].T)
            distance, angle = float(np.linalg.norm(shift)), float(np.linalg.norm(turn))
            score = distance + settings.rotation_length * angle
            if score < best_score:
                best, best_score, best_cycle = joints, score, cycle
            reached = distance <= settings.position_tolerance and angle <= settings.orientation_tolerance
            if reached or cycle - best_cycle > _STALLED:
                break
            share = min(1.0, settings.network_step / max(distance, 1e-12))
            turn_share = min(1.0, settings.network_rotation / max(float(np.abs(turn).max()), 1e-12))
            joints = chain.clip(joints + network.step(joints, np.concatenate([share * shift, turn_share * turn]), side))
            path.append(joints)
        return Answer(best, len(path) - 1, len(path) - 1, np.array(path[: best_cycle + 1]))

    return solve
