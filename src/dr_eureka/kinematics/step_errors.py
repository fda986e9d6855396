"""How far one single step misses: the network against the (damped) pseudo-inverse (paper 4.3, Figure 18).

Two tests. `joint_change`, the paper's: the wanted step is one that some joint change of at most 0.5 rad makes, so the hand
turns as well. `straight`: the hand goes straight and does not turn, as the hybrid asks for; whatever joints that takes.
"""

from __future__ import annotations

from typing import Callable

import numpy as np

from dr_eureka.kinematics.chain import Chain
from dr_eureka.kinematics.jacobian_step import damped_steps
from dr_eureka.kinematics.network import ArmNetwork
from dr_eureka.kinematics.samples import SampleSettings, least_norm_change, moved, pose_errors

STEP_SIZES = (0.005, 0.01, 0.02, 0.05, 0.10, 0.15, 0.20, 0.30)  # [m]
TESTS = ("joint_change", "straight")
_WAY_POINT_SPACING = 0.02  # [m] between the poses by which a straight step is shown to be reachable
_BATCH = 2048

Method = Callable[[np.ndarray, np.ndarray], np.ndarray]


def step_methods(chain: Chain, network: ArmNetwork | None, damping: float = 0.05) -> dict[str, Method]:
    """Return the methods to compare by name; each maps joints (n, 7) and delta (n, 6) to joint increments (n, 7)."""

    def pseudo_inverse(lambda_squared: float) -> Method:
        def step(joints: np.ndarray, delta: np.ndarray) -> np.ndarray:
            return damped_steps(chain.jacobian(joints), delta, lambda_squared)

        return step

    methods = {"pseudo_inverse": pseudo_inverse(0.0), "damped": pseudo_inverse(damping**2)}
    return {"network": network.step, **methods} if network is not None else methods


def step_errors(
    chain: Chain,
    methods: dict[str, Method],
    size: float,
    test: str,
    count: int,
    rng: np.random.Generator,
    settings: SampleSettings = SampleSettings(),
) -> dict[str, np.ndarray]:
    """Return position errors (count,) [m] after one step of `size` [m], by method, on the same random steps of the left arm.

    Joints are drawn from the range of `settings`.
    """
    draw = {"joint_change": _draw_joint_change, "straight": _draw_straight}[test]
    parts, missing = [], count
    while missing > 0:
        joints, delta, targets = (array[:missing] for array in draw(chain, size, rng, settings))
        parts.append((joints, delta, targets))
        missing -= len(joints)
    joints, delta, targets = (np.concatenate(arrays) for arrays in zip(*parts))
    return {
        name: np.linalg.norm(chain.forward(joints + method(joints, delta))[:, :3, 3] - targets[:, :3, 3], axis=1)
        for name, method in methods.items()
    }


def _draw_joint_change(
    chain: Chain, size: float, rng: np.random.Generator, settings: SampleSettings
) -> tuple[np.ndarray, ...]:
    """Draw joints and a change of each, then bend the change as little as it takes for the hand to move by `size`."""
    joints = rng.uniform(settings.lower, settings.upper, (_BATCH, len(chain)))
    change = rng.uniform(-settings.change, settings.change, joints.shape)
    start = chain.forward(joints)
    direction = chain.forward(joints + change)[:, :3, 3] - start[:, :3, 3]
    wanted = start[:, :3, 3] + size * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    for _ in range(8):
        poses, jacobians = chain.forward_and_jacobian(joints + change)
        change = change + np.clip(damped_steps(jacobians[:, :3], wanted - poses[:, :3, 3], 1e-6), -0.2, 0.2)
    targets = chain.forward(joints + change)
    delta = pose_errors(start, targets)
    ends = joints + change
    good = np.abs(np.linalg.norm(delta[:, :3], axis=1) - size) < 1e-4
    good &= (np.abs(change).max(axis=1) <= settings.change) & (np.abs(delta[:, 3:]).max(axis=1) < settings.max_turn)
    good &= np.all((ends >= settings.lower) & (ends <= settings.upper), axis=1)
    return joints[good], delta[good], targets[good]


def _draw_straight(chain: Chain, size: float, rng: np.random.Generator, settings: SampleSettings) -> tuple[np.ndarray, ...]:
    """Draw joints and a direction; keep the steps whose whole way can be gone inside the limits."""
    joints = rng.uniform(settings.lower, settings.upper, (_BATCH, len(chain)))
    delta = np.zeros((_BATCH, 6))
    direction = rng.normal(size=(_BATCH, 3))
    delta[:, :3] = size * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    start = chain.forward(joints)
    targets = moved(start, delta)
    ends, good = joints, np.ones(_BATCH, dtype=bool)
    for share in np.linspace(0.0, 1.0, 1 + int(np.ceil(size / _WAY_POINT_SPACING)))[1:]:
        change, error = least_norm_change(chain, ends, moved(start, share * delta))
        ends = ends + change
        good &= (error < 1e-4) & np.all((ends >= chain.lower) & (ends <= chain.upper), axis=1)
    return joints[good], delta[good], targets[good]
