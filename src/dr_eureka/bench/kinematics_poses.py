"""Hand poses to solve for: reachable ones at tubes, and ones at singularities."""

from __future__ import annotations

import numpy as np

from dr_eureka.kinematics.arms import arm_chain
from dr_eureka.kinematics.chain import Chain
from dr_eureka.kinematics.jacobian_step import damped_steps
from dr_eureka.kinematics.samples import pose_errors
from dr_eureka.kinematics.transforms import rotations_from_vectors

#: Where the left hand's grasp centre is drawn, x, y, z [m] in base: around the sheet, from the grip to over standing tubes.
LOWEST, HIGHEST = np.array([0.36, -0.05, 0.80]), np.array([0.52, 0.22, 1.02])
MEAN_YAW, YAW_SPREAD = np.radians(-30.0), np.radians(15.0)  # of the level left hand
CENTRE_BEYOND_END = 0.019  # [m]
_STARTS, _ITERATIONS = 12, 60
_DAMPING = 0.05
_LONGEST_STEP = 0.4  # [rad] of a joint in one iteration
_REACHED = 1e-5  # [m, rad]
_CANDIDATES = 20  # postures for each of the most singular ones that are kept
_POLISHINGS = 12


def tube_poses(side: str, count: int, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """Return `count` reachable end-link poses (count, 4, 4) of a level hand at a tube, and the share of drawn ones that are.

    Reachable is what `witnesses` found joints for, which has nothing in common with the solvers that are compared.
    """
    chain, mirrored = arm_chain(side), 1.0 if side == "left" else -1.0
    kept, drawn, missing = [], 0, count
    while missing > 0:
        number = missing + missing // 10 + 10
        places = rng.uniform(LOWEST, HIGHEST, (number, 3)) * (1.0, mirrored, 1.0)
        yaws = mirrored * (MEAN_YAW + rng.uniform(-YAW_SPREAD, YAW_SPREAD, number))
        poses = np.tile(np.eye(4), (number, 1, 1))
        poses[:, :3, :3] = rotations_from_vectors(np.outer(yaws, [0.0, 0.0, 1.0]))
        poses[:, :3, 3] = places - CENTRE_BEYOND_END * poses[:, :3, 0]
        reachable = np.flatnonzero(np.isfinite(witnesses(chain, poses, rng)).all(axis=1))
        # What comes after the last one kept was not needed, and does not count as drawn.
        drawn += number if len(reachable) <= missing else int(reachable[missing - 1]) + 1
        kept.append(poses[reachable[:missing]])
        missing -= len(kept[-1])
    return np.concatenate(kept), count / drawn


def witnesses(chain: Chain, targets: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return joints (k, n) [rad] inside the limits that reach targets (k, 4, 4), NaN where none were found.

    Damped least squares on all targets at once, clipped to the limits, from random starts.
    """
    found = np.full((len(targets), len(chain)), np.nan)
    open_ones = np.arange(len(targets))
    for _ in range(_STARTS):
        joints = rng.uniform(chain.lower, chain.upper, (len(open_ones), len(chain)))
        moving = np.arange(len(open_ones))
        for _ in range(_ITERATIONS):
            poses, jacobians = chain.forward_and_jacobian(joints[moving])
            errors = pose_errors(poses, targets[open_ones[moving]])
            reached = np.abs(errors).max(axis=1) < _REACHED
            found[open_ones[moving[reached]]] = joints[moving[reached]]
            moving, errors, jacobians = moving[~reached], errors[~reached], jacobians[~reached]
            if not len(moving):
                break
            size = np.minimum(np.linalg.norm(errors, axis=1), 1.0)
            step = damped_steps(jacobians, errors, (_DAMPING * size) ** 2)
            joints[moving] = chain.clip(joints[moving] + np.clip(step, -_LONGEST_STEP, _LONGEST_STEP))
        open_ones = open_ones[moving]
        if not len(open_ones):
            break
    return found


def singular_postures(chain: Chain, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return postures (count, n) [rad] inside the limits at which the hand can hardly move in some direction.

    The most singular of many random ones, moved on by smaller and smaller random turns as long as they get more so.
    """
    joints = rng.uniform(chain.lower, chain.upper, (_CANDIDATES * count, len(chain)))
    best = np.argsort(least_singular_values(chain, joints))[:count]
    joints = joints[best]
    for polishing in range(_POLISHINGS):
        turned = chain.clip(joints + rng.normal(0.0, 0.2 * 0.6**polishing, joints.shape))
        better = least_singular_values(chain, turned) < least_singular_values(chain, joints)
        joints[better] = turned[better]
    return joints


def least_singular_values(chain: Chain, joints: np.ndarray) -> np.ndarray:
    """Return the least singular value (k,) of the Jacobian at joints (k, n) [rad]."""
    return np.linalg.svd(chain.jacobian(joints), compute_uv=False)[:, -1]
