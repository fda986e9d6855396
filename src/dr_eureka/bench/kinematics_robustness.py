"""What the hybrid answers to hard questions: targets beyond reach, at singularities or no poses, starts at limits."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dr_eureka.bench.kinematics_poses import least_singular_values, singular_postures, tube_poses
from dr_eureka.bench.report import Row, progress, share_row
from dr_eureka.kinematics.arms import SIDES, arm_chain
from dr_eureka.kinematics.chain import Chain
from dr_eureka.kinematics.hybrid import HybridSettings, HybridSolver, IkCode
from dr_eureka.kinematics.ik_result import IkResult
from dr_eureka.kinematics.network import ArmNetwork
from dr_eureka.kinematics.samples import pose_errors
from dr_eureka.kinematics.transforms import rotations_from_vectors, transform

TRIES = 10_000
_ROUNDING = 1e-9
_SHOWN = 200  # singular postures whose singularity is measured
_FARTHEST = 3.0  # [m] from the shoulder


@dataclass(frozen=True)
class Question:
    """A start (7,) [rad] and a target (4, 4), and the codes that may be the right answer."""

    start: np.ndarray
    target: np.ndarray
    codes: tuple[str, ...]


def robustness_rows(seed: int, tries: int | None, settings: HybridSettings) -> list[Row]:
    """Ask `tries` questions (10,000), as many of each kind and for each arm, and return the rows."""
    each = max(1, (tries or TRIES) // (len(_KINDS) * len(SIDES)))
    network, rows, longest = ArmNetwork.load(), [], 0.0
    pairs = [(kind, side) for kind in _KINDS for side in SIDES]
    bar = progress(pairs, len(pairs), "kinematics, hard questions")
    counts: dict[str, dict[str, int]] = {kind: {"right": 0, "broken": 0, "converged": 0} for kind in _KINDS}
    for number, (kind, side) in enumerate(bar):
        chain = arm_chain(side)
        solver = HybridSolver(chain, network, settings)
        for question in _KINDS[kind](chain, side, each, np.random.default_rng([seed, 300 + number])):
            began = time.process_time()
            result = solver.solve(question.start, question.target)
            longest = max(longest, time.process_time() - began)
            counts[kind]["right"] += is_right(chain, question, result, settings)
            counts[kind]["converged"] += result.code == IkCode.CONVERGED
            counts[kind]["broken"] += not all(chain.within_limits(joints) for joints in result.path)
    count = len(SIDES) * each
    for kind, found in counts.items():
        rows.append(share_row(f"{kind}: right code", found["right"], count, goal="1", ok=found["right"] == count))
        if kind in _SOLVABLE:
            rows.append(share_row(f"{kind}: solved", found["converged"], count))
    broken = sum(found["broken"] for found in counts.values())
    rows.append(share_row("all of these: a limit broken on the way", broken, count * len(_KINDS), goal="0", ok=broken == 0))
    goal, ok = f"<= {settings.max_seconds:g} s", longest <= settings.max_seconds
    rows.append(Row("all of these: longest answer", longest, "s", count * len(_KINDS), goal=goal, ok=ok))
    chain = arm_chain("left")
    least = least_singular_values(chain, singular_postures(chain, _SHOWN, np.random.default_rng([seed, 299])))
    rows.append(Row("at a singularity: Jacobian's least singular value, median", float(np.median(least)), "m, rad", _SHOWN))
    return rows


def is_right(chain: Chain, question: Question, result: IkResult, settings: HybridSettings) -> bool:
    """Tell whether the code is one that may be right, and CONVERGED exactly when the joints reach the target."""
    if result.code not in question.codes:
        return False
    if result.code in (IkCode.INVALID_TARGET, IkCode.UNREACHABLE) or not result.path:
        return True
    error = pose_errors(chain.forward(result.joints)[None], question.target[None])[0]
    reached = np.linalg.norm(error[:3]) <= settings.position_tolerance + _ROUNDING
    reached &= np.linalg.norm(error[3:]) <= settings.orientation_tolerance + _ROUNDING
    return bool(reached) == (result.code == IkCode.CONVERGED)


_ANY_END = (IkCode.CONVERGED, IkCode.NO_CONVERGENCE, IkCode.OUT_OF_LIMITS)


def _beyond_reach(chain: Chain, side: str, count: int, rng: np.random.Generator) -> list[Question]:
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    places = chain.first_joint_origin + directions * rng.uniform(HybridSettings().reach, _FARTHEST, (count, 1))
    return [
        Question(rng.uniform(chain.lower, chain.upper), transform(turn, place), (IkCode.UNREACHABLE,))
        for turn, place in zip(_turns(count, rng), places)
    ]


def _anywhere(chain: Chain, side: str, count: int, rng: np.random.Generator) -> list[Question]:
    places = chain.first_joint_origin + rng.uniform(-0.4, 0.4, (count, 3))
    return [
        Question(rng.uniform(chain.lower, chain.upper), transform(turn, place), _ANY_END)
        for turn, place in zip(_turns(count, rng), places)
    ]


def _random_postures(chain: Chain, side: str, count: int, rng: np.random.Generator) -> list[Question]:
    starts, reached = rng.uniform(chain.lower, chain.upper, (2, count, len(chain)))
    return [Question(start, target, _ANY_END) for start, target in zip(starts, chain.forward(reached))]


def _singular(chain: Chain, side: str, count: int, rng: np.random.Generator) -> list[Question]:
    targets = chain.forward(singular_postures(chain, count, rng))
    starts = singular_postures(chain, count, rng)
    return [Question(start, target, _ANY_END) for start, target in zip(starts, targets)]


def _not_numbers(chain: Chain, side: str, count: int, rng: np.random.Generator) -> list[Question]:
    questions = []
    for target in chain.forward(rng.uniform(chain.lower, chain.upper, (count, len(chain)))):
        start, nonsense = rng.uniform(chain.lower, chain.upper), rng.choice([np.nan, np.inf, -np.inf])
        if rng.random() < 0.3:
            start[rng.integers(len(start))] = nonsense
        elif rng.random() < 0.7:
            target[rng.integers(3), rng.integers(4)] = nonsense
        else:
            target[:3, :3] *= rng.choice([-1.0, 0.5, 2.0])
        questions.append(Question(start, target, (IkCode.INVALID_TARGET,)))
    return questions


def _from_limits(chain: Chain, side: str, count: int, rng: np.random.Generator) -> list[Question]:
    corners = np.where(rng.random((count, len(chain))) < 0.5, chain.lower, chain.upper)
    return [Question(start, target, (IkCode.CONVERGED,)) for start, target in zip(corners, tube_poses(side, count, rng)[0])]


def _turns(count: int, rng: np.random.Generator) -> np.ndarray:
    axes = rng.normal(size=(count, 3))
    return rotations_from_vectors(axes / np.linalg.norm(axes, axis=1, keepdims=True) * rng.uniform(0.0, np.pi, (count, 1)))


_KINDS: dict[str, Callable[[Chain, str, int, np.random.Generator], list[Question]]] = {
    "target beyond reach": _beyond_reach,
    "random pose, reachable or not": _anywhere,
    "pose of a random posture, from another": _random_postures,
    "at a singularity, from another": _singular,
    "NaN, infinity, no rotation": _not_numbers,
    "tube pose, from a corner of the limits": _from_limits,
}
_SOLVABLE = (
    "pose of a random posture, from another",
    "at a singularity, from another",
    "tube pose, from a corner of the limits",
)
