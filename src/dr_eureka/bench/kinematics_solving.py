"""Inverse kinematics in the form of TRAC-IK's comparison: reachable poses, what share is solved, how fast, how exactly.

Source of the form: Beeson and Ames, "TRAC-IK: An Open-Source Library for Improved Solving of Generic Inverse Kinematics",
2015.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial

import numpy as np

from dr_eureka.bench.kinematics_poses import tube_poses
from dr_eureka.bench.kinematics_solvers import HYBRID, JACOBIAN, METHODS, PAPER_HYBRID, PAPER_JACOBIAN, Answer, solvers
from dr_eureka.bench.report import BenchOptions, Row, mean_row, share_row
from dr_eureka.bench.workers import shared_out
from dr_eureka.control.settings import ControlSettings
from dr_eureka.kinematics.arms import SIDES, arm_chain, mirror
from dr_eureka.kinematics.chain import Chain
from dr_eureka.kinematics.samples import pose_errors
from dr_eureka.resources import load_yaml

POSES = 10_000
STARTS = ("the ready pose", "random postures")
LEAST_SOLVED = 0.999
LARGEST_SHIFT, LARGEST_TURN = 0.001, np.radians(1.0)  # [m], [rad] of an answer that counts as solved
CYCLE_SECONDS = 0.008  # the manager takes a goal so often
#: How long the authors let the robot take for a step of the network and of the Jacobian.
AUTHORS_NETWORK_SECONDS, AUTHORS_JACOBIAN_SECONDS = 0.4, 0.01
_BLOCK = 250
SETTINGS = "config/control_engine.yaml"


@dataclass(frozen=True)
class Trials:
    """What one method answered to some poses; arrays (n,). NaN: the method does not say."""

    seconds: np.ndarray
    shift: np.ndarray  # [m]
    turn: np.ndarray  # [rad]
    inside: np.ndarray  # the answer and all of its path respect the limits
    cycles: np.ndarray
    commanded: np.ndarray  # [s]
    authors_commanded: np.ndarray  # [s]

    @property
    def solved(self) -> np.ndarray:
        """Tell which answers are near enough and inside the limits."""
        return (self.shift <= LARGEST_SHIFT) & (self.turn <= LARGEST_TURN) & self.inside.astype(bool)


def measure_solving(options: BenchOptions) -> tuple[dict[tuple[str, str], Trials], float]:
    """Let each method solve each pose from both starts; return Trials by method and start, and the reachable share."""
    settings = ControlSettings.from_mapping(load_yaml(SETTINGS), SETTINGS)
    blocks, shares = [], []
    for number, side in enumerate(SIDES):
        poses, share = tube_poses(side, options.trials or POSES, np.random.default_rng([options.seed, 100 + number]))
        shares.append(share)
        blocks += [(side, first, poses[first : first + _BLOCK]) for first in range(0, len(poses), _BLOCK)]
    run = partial(_solve_block, settings, options.seed)
    results = shared_out(run, blocks, options.processes, "kinematics, poses")
    keys = results[0]
    return {key: Trials(*np.hstack([result[key] for result in results])) for key in keys}, float(np.mean(shares))


def solving_rows(measured: dict[tuple[str, str], Trials], reachable: float) -> list[Row]:
    """Return the rows of each start and method, the hybrid judged against its goals."""
    count = len(measured[HYBRID, STARTS[0]].seconds)
    rows = [Row("tube poses drawn that are reachable, by another solver", reachable, "share", count)]
    for start in STARTS:
        for method in METHODS:
            rows += _method_rows(start, method, measured)
    return rows


def commanded_seconds(path: np.ndarray, speed: float) -> float:
    """Return how long joints take along a path (k, n) [rad], each step at `speed` [rad/s] but no shorter than a cycle."""
    return float(np.maximum(np.abs(np.diff(path, axis=0)).max(axis=1) / speed, CYCLE_SECONDS).sum())


def _method_rows(start: str, method: str, measured: dict[tuple[str, str], Trials]) -> list[Row]:
    trials = measured[method, start]
    against = {HYBRID: JACOBIAN, PAPER_HYBRID: PAPER_JACOBIAN}.get(method)
    name, count, solved = f"from {start}, {method}", len(trials.seconds), int(trials.solved.sum())
    judged = method == HYBRID
    rows = [
        share_row(
            f"{name}: within 1 mm, 1 degree and the limits", solved, count,
            goal=f">= {LEAST_SOLVED}" if judged else None, ok=solved >= LEAST_SOLVED * count if judged else None,
        ),
        share_row(
            f"{name}: answer inside the limits", int(trials.inside.sum()), count,
            goal="1" if judged else None, ok=bool(trials.inside.all()) if judged else None,
        ),
        mean_row(f"{name}: time", 1000.0 * trials.seconds, "ms"),
        Row(f"{name}: time, 99th percentile", 1000.0 * float(np.percentile(trials.seconds, 99)), "ms", count),
        Row(f"{name}: position error, median", 1000.0 * float(np.median(trials.shift)), "mm", count),
        Row(f"{name}: position error, largest", 1000.0 * float(trials.shift.max()), "mm", count),
        Row(f"{name}: turn error, largest", float(np.degrees(trials.turn.max())), "degrees", count),
    ]
    for figure, title, unit in (("cycles", "cycles", "cycles"), ("commanded", "commanded time", "s")):
        values = getattr(trials, figure)
        if np.isfinite(values).all():
            other = getattr(measured[against, start], figure) if against else None
            rows.append(
                mean_row(
                    f"{name}: {title}", values, unit,
                    goal=f"< {against}" if judged else None, ok=bool(values.mean() < other.mean()) if judged else None,
                )
            )
    if method in (PAPER_HYBRID, PAPER_JACOBIAN):
        title = f"{name}: commanded time at the authors' 0.4 s and 0.01 s a step"
        rows.append(mean_row(title, trials.authors_commanded, "s"))
    return rows


def _solve_block(
    settings: ControlSettings, seed: int, block: tuple[str, int, np.ndarray]
) -> dict[tuple[str, str], np.ndarray]:
    """Return figures (7, n), in the order of Trials, by method and start, of one block of poses."""
    side, first, poses = block
    chain, rng = arm_chain(side), np.random.default_rng([seed, 200 + SIDES.index(side), first])
    ready = np.array(settings.postures.home)
    starts = {
        STARTS[0]: np.tile(ready if side == "left" else mirror(ready), (len(poses), 1)),
        STARTS[1]: rng.uniform(chain.lower, chain.upper, (len(poses), len(chain))),
    }
    figures = {}
    for method, solve in solvers(side, settings.kinematics).items():
        solve(starts[STARTS[0]][0], poses[0])  # what is loaded at the first call is not the method's time
        for start, postures in starts.items():
            answers, seconds = [], []
            for posture, pose in zip(postures, poses):
                began = time.process_time()
                answers.append(solve(posture, pose))
                seconds.append(time.process_time() - began)
            columns = [_figures(chain, answer, settings.speeds.move.speed) for answer in answers]
            errors = pose_errors(chain.forward(np.array([answer.joints for answer in answers])), poses)
            sizes = [np.linalg.norm(errors[:, :3], axis=1), np.linalg.norm(errors[:, 3:], axis=1)]
            figures[method, start] = np.vstack([seconds, *sizes, np.array(columns).T])
    return figures


def _figures(chain: Chain, answer: Answer, speed: float) -> tuple[float, float, float, float]:
    """Return whether an answer is inside the limits, cycles, and commanded time [s] at `speed` [rad/s] and the authors'."""
    if answer.path is None:
        return float(chain.within_limits(answer.joints)), np.nan, np.nan, np.nan
    inside = all(chain.within_limits(joints) for joints in answer.path)
    jacobian_cycles = answer.cycles - answer.network_cycles
    authors = answer.network_cycles * AUTHORS_NETWORK_SECONDS + jacobian_cycles * AUTHORS_JACOBIAN_SECONDS
    return float(inside), answer.cycles, commanded_seconds(answer.path, speed), authors
