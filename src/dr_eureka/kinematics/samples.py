"""Training samples of the arm network: start joints, wanted hand step, and the joint step that makes it.

The paper (section 3.4) draws joints and joint changes uniformly, and learns the drawn change. As the arm is redundant, many
changes make the same hand step, and their mean makes none of them: an error floor of 0.36 cm that no network can pass. So
here the drawn change only says which hand step is wanted, and the target is the smallest joint step that makes it. A share
of the samples are steps straight through space, as the hybrid asks for them; random joint changes hardly ever make one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dr_eureka.kinematics.chain import Chain
from dr_eureka.kinematics.jacobian_step import damped_steps
from dr_eureka.kinematics.transforms import rotation_vectors, rotations_from_vectors

# Joints (n, 7) [rad], hand steps (n, 6) [m, rad] and target poses (n, 4, 4), drawn within settings.
Draw = Callable[[Chain, np.random.Generator, "SampleSettings"], tuple[np.ndarray, ...]]

_NEWTON_STEPS = 8
_NEWTON_DAMPING = 1e-6
_LARGEST_CHANGE = 1.5  # [rad] of a joint in the search for the least norm; no target may have so much
_SETTLED = 1e-5  # [rad] a change that moves less in a Newton step is at rest: the next would be of the order of its square
_CHUNK = 4096  # arrays of one chunk stay in the processor's cache


@dataclass(frozen=True)
class SampleSettings:
    """Where samples are drawn; left arm, joint order of the chain, [rad] and [m].

    lower, upper: the authors' ranges as far as the maker's URDF allows, widened where a hand yawed by 30 degrees needs more.
    The elbow's goes beyond this robot's limit, which is the e-Manual's; no target does. change: of each joint, uniform.
    max_turn: of each part of the rotation vector. max_shift: of the hand. large_shift: hand steps shorter than this are
    thinned out by the square of their length, down to least_share, for steps of 30 cm are one in fifty otherwise.
    straight_share: of the samples are straight steps, at most straight_shift and straight_turn. max_change: of a joint in a
    target. target_error: how exactly a target must make its step.
    """

    lower: tuple[float, ...] = (-1.5708, 0.4363, -0.4403, -1.2003, 0.0514, -0.7854, -1.4137)
    upper: tuple[float, ...] = (0.5236, 1.5708, 1.1345, 1.1868, 1.8641, 0.9655, 0.5236)
    change: float = 0.5
    max_turn: float = 0.5
    max_shift: float = 0.5
    large_shift: float = 0.25
    least_share: float = 0.15
    straight_share: float = 0.3
    straight_shift: float = 0.2
    straight_turn: float = 0.4
    max_change: float = 1.0
    target_error: float = 1e-4

    @classmethod
    def paper(cls) -> SampleSettings:
        """Return the paper's recipe as far as the maker's URDF allows: all hand steps that are not too large."""
        return cls(
            lower=(-1.5708, 0.7837, -0.4403, -1.2003, 0.0514, -0.4201, -1.4137),
            upper=(0.5173, 1.5708, 0.8960, 1.1748, 1.8641, 0.9655, 0.3806),
            least_share=1.0,
            straight_share=0.0,
        )


@dataclass(frozen=True)
class Samples:
    """joints (n, 7) [rad], delta (n, 6) [m, rad], change (n, 7) [rad], target (n, 4, 4) end link's pose in the root."""

    joints: np.ndarray
    delta: np.ndarray
    change: np.ndarray
    target: np.ndarray

    def __len__(self) -> int:
        return len(self.joints)


def draw_paper_samples(
    chain: Chain, count: int, rng: np.random.Generator, settings: SampleSettings = SampleSettings.paper()
) -> Samples:
    """Draw `count` samples just as the paper does (3.4, Figure 12): the target is the joint change that was drawn.

    Joints and changes uniform, the ends clipped into the range, hand steps that are too large discarded. The authors'
    program discards what it would have to clip, takes differences of roll, pitch and yaw for the hand's turn, and exceeds
    the robot's limits.
    """
    parts, missing = [], count
    while missing > 0:
        joints, delta, targets, ends = (array[:missing] for array in _draw_changes(chain, rng, settings))
        parts.append((joints, delta, ends - joints, targets))
        missing -= len(joints)
    return Samples(*(np.concatenate(arrays) for arrays in zip(*parts)))


def draw_samples(chain: Chain, count: int, rng: np.random.Generator, settings: SampleSettings = SampleSettings()) -> Samples:
    """Draw `count` samples, mixed: random joint changes (the paper's) and straight steps."""
    straight = int(round(count * settings.straight_share))
    parts = _collect(chain, count - straight, rng, settings, _draw_paper)
    parts += _collect(chain, straight, rng, settings, _draw_straight)
    order = rng.permutation(count)
    return Samples(*(np.concatenate(arrays)[order] for arrays in zip(*parts)))


def least_norm_change(chain: Chain, joints: np.ndarray, targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest joint changes (n, k) [rad] from joints (n, k) to target poses (n, 4, 4), and their error (n,).

    Newton's method on the constrained least-norm problem, dq <- J^+ (error + J dq) with J at q + dq: at rest there, dq lies
    in the row space of J, which is the condition for the least norm. The error is the larger of metres and radians left
    over; where the method did not settle it is large.
    """
    change = np.zeros_like(joints)
    moving = np.arange(len(joints))
    for _ in range(_NEWTON_STEPS):
        poses, jacobians = chain.forward_and_jacobian(joints[moving] + change[moving])
        wanted = pose_errors(poses, targets[moving]) + np.einsum("nij,nj->ni", jacobians, change[moving])
        found = np.clip(damped_steps(jacobians, wanted, _NEWTON_DAMPING), -_LARGEST_CHANGE, _LARGEST_CHANGE)
        restless = np.abs(found - change[moving]).max(axis=1) > _SETTLED
        change[moving] = found
        moving = moving[restless]
        if not len(moving):
            break
    errors = pose_errors(chain.forward(joints + change), targets)
    return change, np.maximum(np.linalg.norm(errors[:, :3], axis=1), np.linalg.norm(errors[:, 3:], axis=1))


def pose_errors(poses: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Return displacement [m] and rotation vector [rad] (n, 6), in the root frame, from poses (n, 4, 4) to targets."""
    turns = rotation_vectors(targets[:, :3, :3] @ poses[:, :3, :3].transpose(0, 2, 1))
    return np.concatenate([targets[:, :3, 3] - poses[:, :3, 3], turns], axis=1)


def moved(poses: np.ndarray, delta: np.ndarray) -> np.ndarray:
    """Return poses (n, 4, 4) displaced and turned by delta (n, 6) [m, rad] in the root frame."""
    result = poses.copy()
    result[:, :3, :3] = rotations_from_vectors(delta[:, 3:]) @ poses[:, :3, :3]
    result[:, :3, 3] += delta[:, :3]
    return result


def _collect(
    chain: Chain, count: int, rng: np.random.Generator, settings: SampleSettings, draw: Draw
) -> list[tuple[np.ndarray, ...]]:
    """Gather chunks of `draw` until there are `count` samples with a settled target inside the limits."""
    parts, missing = [], count
    while missing > 0:
        joints, delta, targets = draw(chain, rng, settings)
        change, error = least_norm_change(chain, joints, targets)
        end = joints + change
        good = (error < settings.target_error) & (np.abs(change).max(axis=1) <= settings.max_change)
        good &= np.all((end >= chain.lower) & (end <= chain.upper), axis=1)
        kept = np.flatnonzero(good)[:missing]
        parts.append((joints[kept], delta[kept], change[kept], targets[kept]))
        missing -= len(kept)
    return parts


def _draw_paper(chain: Chain, rng: np.random.Generator, settings: SampleSettings) -> tuple[np.ndarray, ...]:
    """Draw hand steps that random joint changes make."""
    parts, kept = [], 0
    while kept < _CHUNK:
        parts.append(_draw_changes(chain, rng, settings)[:3])
        kept += len(parts[-1][0])
    return tuple(np.concatenate(arrays)[:_CHUNK] for arrays in zip(*parts))


def _draw_changes(chain: Chain, rng: np.random.Generator, settings: SampleSettings) -> tuple[np.ndarray, ...]:
    """Draw joints and changes uniformly, clipped to the range; return joints, delta, targets and ends of what is kept."""
    joints = rng.uniform(settings.lower, settings.upper, (_CHUNK, len(chain)))
    ends = np.clip(joints + rng.uniform(-settings.change, settings.change, joints.shape), settings.lower, settings.upper)
    targets = chain.forward(ends)
    delta = pose_errors(chain.forward(joints), targets)
    shift = np.linalg.norm(delta[:, :3], axis=1)
    good = (np.abs(delta[:, 3:]).max(axis=1) < settings.max_turn) & (shift <= settings.max_shift)
    good &= rng.random(_CHUNK) < np.maximum((shift / settings.large_shift) ** 2, settings.least_share)
    return joints[good], delta[good], targets[good], ends[good]


def _draw_straight(chain: Chain, rng: np.random.Generator, settings: SampleSettings) -> tuple[np.ndarray, ...]:
    """Draw joints uniformly and steps in any direction, lengths and turns uniform from zero."""
    joints = rng.uniform(settings.lower, settings.upper, (_CHUNK, len(chain)))
    directions = rng.normal(size=(_CHUNK, 2, 3))
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    lengths = rng.uniform(0.0, [settings.straight_shift, settings.straight_turn], (_CHUNK, 2))
    delta = (directions * lengths[:, :, None]).reshape(_CHUNK, 6)
    return joints, delta, moved(chain.forward(joints), delta)
