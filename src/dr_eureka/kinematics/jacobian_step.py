"""Steps of the damped Jacobian (paper 3.4): one inside the joint limits, spare freedom put to use, or many plain ones."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg.lapack import dposv

from dr_eureka.kinematics.chain import Chain
from dr_eureka.kinematics.hybrid_settings import HybridSettings

_LEAST_DAMPING = 1e-4  # keeps J J^T invertible at singularities, where the settings leave the inverse undamped


class JacobianStep:
    """Joint steps of the damped pseudo-inverse J^T (J J^T + lambda^2 I)^-1."""

    def __init__(self, chain: Chain, settings: HybridSettings) -> None:
        self._lower, self._upper, self._settings = chain.lower, chain.upper, settings
        self._damping = max(settings.damping, _LEAST_DAMPING) ** 2 * np.eye(6)

    def step(
        self,
        joints: np.ndarray,
        jacobian: np.ndarray,
        shift: np.ndarray,
        turn: np.ndarray,
        pull: np.ndarray,
        limited: bool = True,
    ) -> np.ndarray:
        """Return a joint step (n,) [rad] towards a hand displaced by shift (3,) [m] and turned by turn (3,) [rad].

        jacobian: (6, n) at joints (n,) [rad]. pull: (n,) [rad], what of it does not move the hand is added. Unless `limited`
        is False, a joint that would pass its limit is stopped there and the others take over what it leaves.
        """
        settings = self._settings
        twist = np.concatenate(
            [
                shift * min(1.0, settings.jacobian_step / max(math.sqrt(shift @ shift), 1e-12)),
                turn * min(1.0, settings.jacobian_rotation / max(math.sqrt(turn @ turn), 1e-12)),
            ]
        )
        step = pull + self._inverse(jacobian, twist - jacobian @ pull)
        if limited:
            lowest, highest = self._lower - joints, self._upper - joints
            if (step < lowest).any() or (step > highest).any():
                step = self._stopped(step, jacobian, twist, pull, lowest, highest)
        turned = float(np.abs(step).max())
        return step if turned <= settings.jacobian_joint_step else step * (settings.jacobian_joint_step / turned)

    def _stopped(
        self,
        step: np.ndarray,
        jacobian: np.ndarray,
        twist: np.ndarray,
        pull: np.ndarray,
        lowest: np.ndarray,
        highest: np.ndarray,
    ) -> np.ndarray:
        """Return the step with joints stopped at their limits, more of them each round until none passes its own."""
        step, free = step.copy(), np.ones(len(step), dtype=bool)
        while True:
            passing = free & ((step < lowest) | (step > highest))
            if not passing.any():
                return step
            step[passing] = np.clip(step, lowest, highest)[passing]
            free &= ~passing
            moving = jacobian[:, free]
            step[free] = pull[free] + self._inverse(moving, twist - jacobian[:, ~free] @ step[~free] - moving @ pull[free])

    def _inverse(self, jacobian: np.ndarray, twist: np.ndarray) -> np.ndarray:
        """Return J^T (J J^T + lambda^2 I)^-1 twist."""
        return jacobian.T @ dposv(jacobian @ jacobian.T + self._damping, twist)[1]


def damped_steps(jacobians: np.ndarray, twists: np.ndarray, damping_squared: float | np.ndarray) -> np.ndarray:
    """Return J^T (J J^T + lambda^2 I)^-1 twist (n, k) [rad] of Jacobians (n, r, k) and twists (n, r) [m, rad], all at once.

    damping_squared: lambda^2, one for all or (n,). By Cholesky's method with the batch as the last axis, along which numpy
    runs: LAPACK takes such small matrices one by one, four times as slowly.
    """
    rows, left = np.ascontiguousarray(jacobians.transpose(1, 2, 0)), twists.T.copy()
    count = len(rows)
    factor = np.empty((count, count, len(twists)))
    for row in range(count):
        factor[row:, row] = np.einsum("ikn,kn->in", rows[row:], rows[row])
        factor[row, row] += damping_squared
    for row in range(count):
        factor[row:, row] /= np.sqrt(factor[row, row])
        left[row] /= factor[row, row]
        left[row + 1 :] -= factor[row + 1 :, row] * left[row]
        for below in range(row + 1, count):
            factor[below:, below] -= factor[below:, row] * factor[below, row]
    for row in reversed(range(count)):
        left[row] /= factor[row, row]
        left[:row] -= factor[row, :row] * left[row]
    return np.einsum("ikn,in->nk", rows, left)
