"""The chains of THORMANG3's upper body, and the mirror that turns left arm into right arm.

The arms are mirror images in the plane y = 0: with q_right = -q_left, joint by joint, the right end frame is the left one
reflected. So whatever is learned or tabulated for the left arm serves the right one.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Mapping

import numpy as np

from dr_eureka.errors import DrEurekaError
from dr_eureka.kinematics.chain import Chain
from dr_eureka.resources import resource_path

SIDES = ("left", "right")
ARM_JOINTS = ("sh_p1", "sh_r", "sh_p2", "el_y", "wr_r", "wr_y", "wr_p")
URDF = "config/robot/thormang3.urdf"
BASE_LINK = "base"
MIRROR_TRANSFORM = np.diag([1.0, -1.0, 1.0, 1.0])
MIRROR_DELTA = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])  # displacement, then rotation vector (an axial vector)


class UnknownSideError(DrEurekaError):
    """Report an arm that is neither left nor right."""


def arm_joint_names(side: str) -> tuple[str, ...]:
    """Return the seven joint names of an arm, shoulder first, as the robotis manager spells them."""
    if side not in SIDES:
        raise UnknownSideError(f"no arm '{side}', expected one of {', '.join(SIDES)}")
    return tuple(f"{side[0]}_arm_{joint}" for joint in ARM_JOINTS)


@lru_cache(maxsize=None)
def arm_chain(side: str) -> Chain:
    """Return the 7-joint chain from `base` to the end link of the left or right arm, torso at zero."""
    prefix = arm_joint_names(side)[0][0]
    return Chain.from_urdf(resource_path(URDF), BASE_LINK, f"{prefix}_arm_end_link", held={"torso_y": 0.0})


@lru_cache(maxsize=None)
def head_chain() -> Chain:
    """Return the chain from `base` to the camera's optical frame `cam_link`: torso_y, head_y, head_p."""
    return Chain.from_urdf(resource_path(URDF), BASE_LINK, "cam_link")


def base_from_camera(joints: Mapping[str, float]) -> np.ndarray:
    """Return base_from_camera (4, 4) for joint positions [rad] by name; head joints that are missing raise KeyError."""
    return head_chain().forward(np.array([joints[name] for name in head_chain().joint_names]))


def mirror(joints: np.ndarray) -> np.ndarray:
    """Return the joints (..., 7) [rad] of the other arm that put it into the mirror pose."""
    return -np.asarray(joints, dtype=float)


def mirror_transform(base_from_link: np.ndarray) -> np.ndarray:
    """Return the pose (..., 4, 4) in `base` reflected in the plane y = 0 (reflected on both sides, so still a rotation)."""
    return MIRROR_TRANSFORM @ base_from_link @ MIRROR_TRANSFORM


def mirror_delta(delta: np.ndarray) -> np.ndarray:
    """Return a hand's step (..., 6) [m, rad] reflected in the plane y = 0: dy, rotation about x and about z change sign."""
    return MIRROR_DELTA * delta


def side_of(chain: Chain) -> str:
    """Tell which arm a chain is, by its joint names; raises UnknownSideError for a chain that is no arm."""
    for side in SIDES:
        if chain.joint_names == arm_joint_names(side):
            return side
    raise UnknownSideError(f"joints {', '.join(chain.joint_names)} are not those of an arm")
