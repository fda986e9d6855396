"""Inverse kinematics that switches between a learned step far from the target and the damped Jacobian near it.

Paper section 3.4 and 4.3 (after Montenegro et al., LARS 2018). Unlike the authors' loop, orientation is a true rotation
error, limits hold at every step, the network's steps are checked before they are taken, and every solve ends with a code.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from typing import Iterator, NamedTuple, Sequence

import numpy as np

from dr_eureka.kinematics.arms import side_of
from dr_eureka.kinematics.chain import Chain
from dr_eureka.kinematics.hybrid_settings import HybridSettings
from dr_eureka.kinematics.ik_result import IkCode, IkResult
from dr_eureka.kinematics.jacobian_step import JacobianStep
from dr_eureka.kinematics.network import ArmNetwork
from dr_eureka.kinematics.transforms import rotation_vector

__all__ = ["HybridSettings", "HybridSolver", "IkCode", "IkResult"]

_RESTART_SEED = 2020  # restarts are drawn afresh, but alike, in each solve: equal questions get equal answers
_FADE_DISTANCE = 0.05  # [m] nearer than this the pull to the rest posture fades, so that it cannot delay the last millimetre
_SETTLED = 1e-3  # [rad] a posture that moves less than this in a step has settled
_CYCLES_UNASKED = 6  # after a refused step: what misled the network here will do so a little farther on
_BELOW = np.array([0.0, 0.0, 0.0, 1.0])  # last row of a homogeneous transform
_PROGRESS = 0.98  # an error below this share of the best one so far counts as progress


@dataclass
class _Attempt:
    """One run of the loop from one start; the best pose seen so far."""

    joints: np.ndarray
    position_error: float = math.inf
    orientation_error: float = math.inf
    score: float = math.inf
    converged: bool = False
    cycles: int = 0
    network_cycles: int = 0
    path: list[np.ndarray] = field(default_factory=list)


class _View(NamedTuple):
    """A posture seen from the target: displacement (3,) [m] and rotation vector (3,) [rad] left to go, in the root frame."""

    jacobian: np.ndarray
    shift: np.ndarray
    turn: np.ndarray
    distance: float
    angle: float
    score: float


class HybridSolver:
    """Find joint angles that bring a chain's tip to a pose."""

    def __init__(self, chain: Chain, network: ArmNetwork | None, settings: HybridSettings = HybridSettings()) -> None:
        """Take the chain, the learned step (None: Jacobian only) and the settings."""
        self._chain = chain
        self._network = network
        self._side = side_of(chain) if network is not None else None
        self._settings = settings
        self._shoulder = chain.first_joint_origin
        self._mid_range = np.where(np.isfinite(chain.lower + chain.upper), 0.5 * (chain.lower + chain.upper), 0.0)
        self._jacobian_step = JacobianStep(chain, settings).step

    def solve(
        self, start_joints: np.ndarray, target: np.ndarray, rest: np.ndarray | None = None, restarts: int | None = None
    ) -> IkResult:
        """Bring the tip to `target` (4, 4), its pose in the chain's root frame, from start_joints (n,) [rad].

        rest: posture (n,) [rad] that the arm's spare freedom is pulled to, by default the middle of the limits. restarts:
        how many other starts to try when the first fails, by default the setting. Never raises for a bad target or start;
        the code says it.
        """
        problem = self._problem_with(start_joints, target)
        if problem is not None:
            return problem
        target = np.asarray(target, dtype=float)
        start = self._chain.clip(np.asarray(start_joints, dtype=float))
        rest = self._mid_range if rest is None else np.asarray(rest, dtype=float)
        restarts = self._settings.restarts if restarts is None else restarts
        deadline = time.monotonic() + self._settings.max_seconds
        best, cycles, network_cycles, used = None, 0, 0, 0
        for number, seed in enumerate(self._starts(start, rest, restarts)):
            attempt = self._attempt(seed, target, rest, deadline)
            cycles += attempt.cycles
            network_cycles += attempt.network_cycles
            if best is None or attempt.score < best.score:
                best, used = attempt, number
            if attempt.converged:
                best = self._settle(attempt, target, rest, deadline)
                cycles += best.cycles - attempt.cycles
            if attempt.converged or time.monotonic() > deadline:
                break
        path = best.path if used == 0 else [start] + best.path
        errors = (best.position_error, best.orientation_error)
        if best.converged:
            return IkResult(IkCode.CONVERGED, best.joints, *errors, cycles, network_cycles, used, path)
        at_limit = np.isclose(best.joints, self._chain.lower) | np.isclose(best.joints, self._chain.upper)
        if at_limit.any() and self._reached_without_limits(best.joints, target, deadline):
            names = ", ".join(name for name, stuck in zip(self._chain.joint_names, at_limit) if stuck)
            reason = f"only reached beyond the limits of {names}"
            return IkResult(IkCode.OUT_OF_LIMITS, best.joints, *errors, cycles, network_cycles, used, path, reason)
        reason = f"{1000.0 * errors[0]:.1f} mm and {errors[1]:.3f} rad left after {cycles} cycles"
        return IkResult(IkCode.NO_CONVERGENCE, best.joints, *errors, cycles, network_cycles, used, path, reason)

    def solve_path(
        self, start_joints: np.ndarray, targets: Sequence[np.ndarray], rest: np.ndarray | None = None
    ) -> list[IkResult]:
        """Solve neighbouring poses (4, 4) one after another, each from the one before, for a path without jumps.

        rest: as in `solve`, by default start_joints: then equal poses on the way there and back get equal joints. The list
        ends at the first pose that fails; a solution that turns a joint more than the setting path_joint_step away from the
        one before is a failure (NO_CONVERGENCE with the reason).
        """
        results: list[IkResult] = []
        joints = np.asarray(start_joints, dtype=float)
        rest = joints if rest is None else rest
        for target in targets:
            result = self.solve(joints, target, rest=rest, restarts=0)
            if result.code == IkCode.CONVERGED:
                turns = np.abs(result.joints - joints)
                largest = int(np.argmax(turns))
                if turns[largest] > self._settings.path_joint_step:
                    reason = f"{self._chain.joint_names[largest]} would jump by {turns[largest]:.2f} rad"
                    errors = result.position_error_m, result.orientation_error_rad
                    result = IkResult(IkCode.NO_CONVERGENCE, joints, *errors, result.cycles, reason=reason)
            results.append(result)
            if result.code != IkCode.CONVERGED:
                break
            joints = result.joints
        return results

    def _problem_with(self, start_joints: np.ndarray, target: np.ndarray) -> IkResult | None:
        """Return the refusal of a start or target that makes no sense, or None."""

        def refuse(code: str, reason: str, distance: float = math.nan) -> IkResult:
            return IkResult(code, start_joints, distance, math.nan, reason=reason)

        try:
            pose, start = np.asarray(target, dtype=float), np.asarray(start_joints, dtype=float)
        except (TypeError, ValueError):
            return refuse(IkCode.INVALID_TARGET, "target or start is not an array of numbers")
        if pose.shape != (4, 4) or not np.all(np.isfinite(pose)):
            return refuse(IkCode.INVALID_TARGET, f"target of shape {pose.shape} is not a finite 4x4 transform")
        if not _is_rigid(pose):
            return refuse(IkCode.INVALID_TARGET, "target is no rigid transform: a rotation, a place, and 0 0 0 1 below")
        if start.shape != (len(self._chain),) or not np.all(np.isfinite(start)):
            count = len(self._chain)
            return refuse(IkCode.INVALID_TARGET, f"start of shape {start.shape} is not {count} finite joint angles")
        slack = self._settings.limit_slack
        if not self._chain.within_limits(start, slack):
            outside = (start < self._chain.lower - slack) | (start > self._chain.upper + slack)
            names = ", ".join(name for name, out in zip(self._chain.joint_names, outside) if out)
            return refuse(IkCode.OUT_OF_LIMITS, f"start is outside the limits of {names}")
        distance = float(np.linalg.norm(pose[:3, 3] - self._shoulder))
        if distance > self._settings.reach:
            reach, short = self._settings.reach, distance - self._settings.reach
            return refuse(IkCode.UNREACHABLE, f"target is {short:.3f} m beyond the arm's reach of {reach} m", short)
        return None

    def _starts(self, start: np.ndarray, rest: np.ndarray, restarts: int) -> Iterator[np.ndarray]:
        """Yield the given start, then the rest posture, the middle of the limits, and postures at random."""
        yield start
        rng = np.random.default_rng(_RESTART_SEED)
        for number in range(restarts):
            if number == 0:
                yield self._chain.clip(rest)
            elif number == 1:
                yield self._mid_range
            else:
                yield rng.uniform(np.maximum(self._chain.lower, -np.pi), np.minimum(self._chain.upper, np.pi))

    def _attempt(
        self, start: np.ndarray, target: np.ndarray, rest: np.ndarray, deadline: float, limited: bool = True
    ) -> _Attempt:
        """Step from `start` towards `target` until it is reached, progress stalls, or cycles or time are used up."""
        settings = self._settings
        joints, view = start, self._view(start, target)
        attempt = _Attempt(joints)
        walked, best_cycle = [joints], 0
        progress_score, progress_cycle = math.inf, 0
        ask_from = 0 if limited and self._network is not None else math.inf
        for cycle in range(settings.max_cycles + 1):
            if view.score < attempt.score:
                attempt.joints, attempt.score, best_cycle = joints, view.score, cycle
                attempt.position_error, attempt.orientation_error = view.distance, view.angle
            if view.distance <= settings.position_tolerance and view.angle <= settings.orientation_tolerance:
                attempt.converged = True
                break
            if view.score < _PROGRESS * progress_score:
                progress_score, progress_cycle = view.score, cycle
            if cycle == settings.max_cycles or cycle - progress_cycle > settings.stall_cycles or time.monotonic() > deadline:
                break
            learned = None
            if cycle >= ask_from and view.distance > settings.network_distance:
                learned = self._network_step(joints, view, target)
                if learned is None:
                    ask_from = cycle + _CYCLES_UNASKED
            if learned is not None:
                joints, view = learned
                attempt.network_cycles += 1
            else:
                pull = settings.rest_gain * min(1.0, view.score / _FADE_DISTANCE) * (rest - joints)
                ahead = joints + self._jacobian_step(joints, view.jacobian, view.shift, view.turn, pull, limited)
                joints = self._chain.clip(ahead) if limited else ahead  # rounding passes a limit that the step stops at
                view = self._view(joints, target)
            attempt.cycles += 1
            walked.append(joints)
        attempt.path = walked[: best_cycle + 1]
        return attempt

    def _settle(self, reached: _Attempt, target: np.ndarray, rest: np.ndarray, deadline: float) -> _Attempt:
        """Move the arm's spare freedom to the rest posture, the hand held; return `reached` if it could not be held."""
        joints, walked = reached.joints, []
        for _ in range(self._settings.rest_cycles if self._settings.rest_gain > 0.0 else 0):
            view = self._view(joints, target)
            pull = self._settings.rest_gain * (rest - joints)
            step = self._jacobian_step(joints, view.jacobian, view.shift, view.turn, pull)
            if np.abs(step).max() < _SETTLED:
                break
            joints = self._chain.clip(joints + step)
            walked.append(joints)
        if not walked:
            return reached
        settled = self._attempt(joints, target, joints, deadline)
        if not settled.converged:
            return reached
        settled.cycles += reached.cycles + len(walked)
        settled.network_cycles += reached.network_cycles
        settled.path = reached.path + walked + settled.path[1:]
        return settled

    def _network_step(self, joints: np.ndarray, view: _View, target: np.ndarray) -> tuple[np.ndarray, _View] | None:
        """Return where the network steps to, or None where it cannot be trusted: limits, a jump, or no nearer."""
        settings = self._settings
        share = min(1.0, settings.network_step / view.distance)
        turn_share = min(share, settings.network_rotation / max(float(np.abs(view.turn).max()), 1e-12))
        step = self._network.step(joints, np.concatenate([share * view.shift, turn_share * view.turn]), self._side)
        ahead = joints + step
        if not np.all(np.abs(step) <= settings.network_joint_step) or not self._chain.within_limits(ahead):
            return None
        view_ahead = self._view(ahead, target)
        return (ahead, view_ahead) if view_ahead.distance < view.distance and view_ahead.score < view.score else None

    def _view(self, joints: np.ndarray, target: np.ndarray) -> _View:
        """Return how far the hand is from the target."""
        pose, jacobian = self._chain.forward_and_jacobian(joints)
        shift, turn = target[:3, 3] - pose[:3, 3], rotation_vector(target[:3, :3] @ pose[:3, :3].T)
        distance, angle = math.sqrt(shift @ shift), math.sqrt(turn @ turn)
        return _View(jacobian, shift, turn, distance, angle, distance + self._settings.rotation_length * angle)

    def _reached_without_limits(self, joints: np.ndarray, target: np.ndarray, deadline: float) -> bool:
        """Tell whether the limits are what keeps the arm from the target."""
        return self._attempt(joints, target, self._mid_range, deadline, limited=False).converged


def _is_rigid(pose: np.ndarray) -> bool:
    """Tell whether a finite (4, 4) is a rotation and a translation, to a thousandth."""
    rotation = pose[:3, :3]
    if np.abs(rotation).max() > 2.0 or np.abs(pose[3] - _BELOW).max() > 1e-9:  # before products that might overflow
        return False
    return bool(np.abs(rotation @ rotation.T - np.eye(3)).max() <= 1e-3 and np.linalg.det(rotation) > 0.0)
