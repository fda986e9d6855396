"""Saika's arms and head: forward kinematics, and the fifth joint that keeps the basket upright (paper 3.1, 5)."""

from __future__ import annotations

import numpy as np

from dr_eureka.catching.description import BASE_LINK, camera_link, describe_saika, hand_link
from dr_eureka.catching.settings import ARM_JOINTS, NECK_JOINTS, SaikaSettings
from dr_eureka.kinematics.arms import SIDES, UnknownSideError
from dr_eureka.kinematics.chain import Chain

# The order of the twelve joints wherever they come as one array: neck, left arm, right arm.
JOINTS = NECK_JOINTS + tuple(f"{side}_{name}" for side in SIDES for name in ARM_JOINTS)
NECK, LEFT_ARM, RIGHT_ARM = slice(0, 2), slice(2, 7), slice(7, 12)
_UP = np.array([0.0, 0.0, 1.0])


class SaikaArm:
    """One arm: four joints a, b, c, d that place the hand, and e that turns it about the forearm (paper 5)."""

    def __init__(self, settings: SaikaSettings, side: str = "left") -> None:
        """Read the chain from our own URDF. Raises UnknownSideError."""
        self.chain = Chain.from_urdf(describe_saika(settings), BASE_LINK, hand_link(_checked(side)))
        self.upper_arm_m = settings.body.upper_arm_m
        self.elbow_to_hand_m = settings.body.forearm_m + settings.body.basket_beyond_wrist_m

    @property
    def lower(self) -> np.ndarray:
        """Lower limits (5,) [rad]."""
        return self.chain.lower

    @property
    def upper(self) -> np.ndarray:
        """Upper limits (5,) [rad]."""
        return self.chain.upper

    @property
    def speed(self) -> np.ndarray:
        """Largest speeds (5,) [rad/s]."""
        return self.chain.velocity

    @property
    def shoulder(self) -> np.ndarray:
        """Where the shoulder is, (3,) [m] in base."""
        return self.chain.first_joint_origin

    def forward(self, joints: np.ndarray) -> np.ndarray:
        """Return base_from_hand (..., 4, 4) [m] of joints (..., 5) [rad]."""
        return self.chain.forward(joints)

    def basket_centre(self, joints: np.ndarray) -> np.ndarray:
        """Return the middle of the basket's rim (..., 3) [m] in base for joints (..., 5), or (..., 4) without e."""
        joints = np.asarray(joints, dtype=float)
        if joints.shape[-1] == 4:
            joints = np.concatenate([joints, np.zeros_like(joints[..., :1])], axis=-1)
        return self.chain.forward(joints)[..., :3, 3]

    def posture_joint(self, four_joints: np.ndarray) -> np.ndarray:
        """Return the fifth joint e (...,) [rad] of a, b, c, d (..., 4) [rad], within its limits.

        The plane of the rim's normal and e's own axis, the forearm, is then vertical and the normal points up (paper 5). For
        a forearm that is itself vertical every e does; it is 0 then.
        """
        four_joints = np.asarray(four_joints, dtype=float)
        flat = np.concatenate([four_joints, np.zeros_like(four_joints[..., :1])], axis=-1)
        normals = self.forward(flat)[..., :3, 2]
        turned = self.forward(flat + np.array([0.0, 0.0, 0.0, 0.0, 0.5 * np.pi]))[..., :3, 2]
        # The normal is along + cos e * across + sin e * beside; its height above the horizon is largest in the vertical
        # plane.
        axis = self._forearm(flat)
        along = np.sum(normals * axis, axis=-1, keepdims=True) * axis
        height, beside = (normals - along) @ _UP, (turned - along) @ _UP
        steep = np.hypot(height, beside) < 1e-9
        return np.clip(np.where(steep, 0.0, np.arctan2(beside, height)), self.lower[4], self.upper[4])

    def with_posture(self, four_joints: np.ndarray) -> np.ndarray:
        """Return all joints (..., 5) [rad] of the four that place the hand (..., 4), the posture joint computed."""
        return np.concatenate([four_joints, self.posture_joint(four_joints)[..., None]], axis=-1)

    def _forearm(self, joints: np.ndarray) -> np.ndarray:
        """Return the unit direction (..., 3) from elbow to hand: what turning e leaves where it is."""
        elbow = self.chain.jacobian(joints)[..., 3:, 4]
        return elbow / np.linalg.norm(elbow, axis=-1, keepdims=True)


class SaikaHead:
    """Neck and both cameras."""

    def __init__(self, settings: SaikaSettings) -> None:
        """Read the chains from our own URDF."""
        urdf = describe_saika(settings)
        self._chains = {side: Chain.from_urdf(urdf, BASE_LINK, camera_link(side)) for side in SIDES}

    def base_from_camera(self, side: str, pan_tilt: np.ndarray = (0.0, 0.0), neck: np.ndarray = (0.0, 0.0)) -> np.ndarray:
        """Return base_from_camera (..., 4, 4) [m].

        side: left or right. pan_tilt (..., 2): the camera's own pan and tilt; neck (..., 2): pan and tilt of the neck [rad];
        positive to the left and up. Raises UnknownSideError.
        """
        return self._chains[_checked(side)].forward(np.concatenate([neck, pan_tilt], axis=-1))


def _checked(side: str) -> str:
    if side not in SIDES:
        raise UnknownSideError(f"no side '{side}', expected one of {', '.join(SIDES)}")
    return side
