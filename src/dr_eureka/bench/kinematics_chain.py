"""Figures of the arms' chain: forward kinematics and Jacobian against published vectors, other libraries and differences."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from dr_eureka.bench.kinematics_engines import BulletArm, KdlArm
from dr_eureka.bench.report import Row
from dr_eureka.kinematics.arms import BASE_LINK, SIDES, URDF, arm_chain, mirror, mirror_transform
from dr_eureka.kinematics.chain import Chain
from dr_eureka.kinematics.transforms import matrix_to_quaternion, rotation_vectors
from dr_eureka.resources import load_yaml, resource_path

VECTORS = "config/robot/fk_vectors.yaml"
LARGEST_ERROR = 1e-9
# Of a turn about x alone (single_joint_mix, right hand) the published quaternion has z = 3e-9 instead of 0.
LARGEST_QUATERNION_ERROR = 4e-9
_POSTURES = 1000
_STEP = 1e-5  # [rad] of the central differences: their own error is of the order of its square
_BATCH = 100_000


def chain_rows(rng: np.random.Generator) -> list[Row]:
    """Return the rows on forward kinematics and Jacobian, over random postures inside the limits of both arms."""
    rows = _vectors_rows()
    postures = {side: rng.uniform(arm_chain(side).lower, arm_chain(side).upper, (_POSTURES, 7)) for side in SIDES}
    count = len(SIDES) * _POSTURES
    for name, engine, goal in (("KDL", KdlArm, LARGEST_ERROR), ("PyBullet, which has single precision", BulletArm, 1e-6)):
        worst = max(
            float(np.abs(arm_chain(side).forward(joints) - [arm.forward(one) for one in joints]).max())
            for side, joints in postures.items()
            for arm in [engine(side)]
        )
        rows.append(_largest(f"forward kinematics against {name}, largest difference", worst, "m, share", count, goal))
    worst = max(_mirror_error(joints) for joints in postures.values())
    name = "right arm against the left one's mirror image, largest difference"
    rows.append(_largest(name, worst, "m, share", count, LARGEST_ERROR))
    worst = max(
        float(np.abs(arm_chain(side).jacobian(joints) - [arm.jacobian(one) for one in joints]).max())
        for side, joints in postures.items()
        for arm in [KdlArm(side)]
    )
    rows.append(_largest("Jacobian against KDL, largest difference", worst, "m/rad, rad/rad", count, LARGEST_ERROR))
    worst = max(
        float(np.abs(arm_chain(side).jacobian(joints) - finite_differences(arm_chain(side), joints)).max())
        for side, joints in postures.items()
    )
    rows.append(_largest("Jacobian against central differences, largest difference", worst, "m/rad, rad/rad", count, 1e-8))
    return rows + _speed_rows(rng)


def finite_differences(chain: Chain, joints: np.ndarray) -> np.ndarray:
    """Return the Jacobians (k, 6, n) of joints (k, n) [rad] by central differences of the forward kinematics."""
    columns = []
    for index in range(len(chain)):
        turn = _STEP * np.eye(len(chain))[index]
        after, before = chain.forward(joints + turn), chain.forward(joints - turn)
        turns = rotation_vectors(after[:, :3, :3] @ before[:, :3, :3].transpose(0, 2, 1))
        columns.append(np.concatenate([after[:, :3, 3] - before[:, :3, 3], turns], axis=1) / (2.0 * _STEP))
    return np.stack(columns, axis=2)


def _vectors_rows() -> list[Row]:
    """Compare hands and camera with the published poses, which are rounded to 1e-9."""
    chains: dict[str, Chain] = {}
    errors = []
    for vector in load_yaml(VECTORS)["vectors"]:
        for link, wanted in vector["poses"].items():
            chain = chains.setdefault(link, Chain.from_urdf(resource_path(URDF), BASE_LINK, link))
            pose = chain.forward(np.array([vector["joints"].get(name, 0.0) for name in chain.joint_names]))
            differences = np.abs(np.append(pose[:3, 3], matrix_to_quaternion(pose)) - wanted)
            errors.append((differences[:3].max(), differences[3:].max()))
    place, turn = (float(worst) for worst in np.max(errors, axis=0))
    name = "forward kinematics against published vectors, largest difference"
    return [
        _largest(f"{name} of places", place, "m", len(errors), LARGEST_ERROR),
        _largest(f"{name} of quaternions", turn, "share", len(errors), LARGEST_QUATERNION_ERROR),
    ]


def _mirror_error(joints: np.ndarray) -> float:
    left, right = (arm_chain(side).forward(one) for side, one in zip(SIDES, (joints, mirror(joints))))
    return float(np.abs(right - mirror_transform(left)).max())


def _largest(name: str, value: float, unit: str, count: int, goal: float) -> Row:
    return Row(name, value, unit, count, goal=f"<= {goal:g}", ok=value <= goal)


def _speed_rows(rng: np.random.Generator) -> list[Row]:
    chain = arm_chain("left")
    many = rng.uniform(chain.lower, chain.upper, (_BATCH, 7))
    rows = []
    runs = {"forward kinematics": chain.forward, "forward kinematics and Jacobian": chain.forward_and_jacobian}
    for name, run in runs.items():
        rows.append(Row(f"{name}, one posture", 1e6 * _seconds(lambda: run(many[0]), 200), "us", 200))
        rows.append(Row(f"{name}, in batches", _BATCH / _seconds(lambda: run(many), 3), "postures/s", _BATCH))
    return rows


def _seconds(run: Callable[[], object], times: int) -> float:
    """Return the median processor time of a call."""
    taken = []
    for _ in range(times):
        began = time.process_time()
        run()
        taken.append(time.process_time() - began)
    return float(np.median(taken))
