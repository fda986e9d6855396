"""Saika in PyBullet: twelve joints and both cameras' own under position control, each as fast as its speed limit lets it."""

from __future__ import annotations

from typing import Sequence

import numpy as np
import pybullet
from pybullet_utils.bullet_client import BulletClient

from dr_eureka.catching.description import describe_saika, hand_link
from dr_eureka.catching.posture import CAMERA_JOINTS
from dr_eureka.catching.saika import JOINTS
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.kinematics.arms import SIDES
from dr_eureka.simulation.bodies import scratch_folder
from dr_eureka.simulation.saika_settings import SaikaPhysicsSettings
from dr_eureka.simulation.settings import SimulationError


class SimulatedSaika:
    """The robot in one PyBullet world, fixed at the torso; joints in the order of `catching.saika.JOINTS`, angles rad."""

    def __init__(
        self, client: BulletClient, settings: SaikaSettings, physics: SaikaPhysicsSettings, start: Sequence[float]
    ) -> None:
        """Put the robot into the world with its joints (12,) at `start`; raises SimulationError as `command` does."""
        self._client, self._physics = client, physics
        text = describe_saika(settings)
        # PyBullet remembers files by name, so another robot in this process needs another one.
        path = scratch_folder() / f"saika_{abs(hash(text))}.urdf"
        path.write_text(text, encoding="utf-8")
        self.body = client.loadURDF(str(path), useFixedBase=True, flags=pybullet.URDF_USE_INERTIA_FROM_FILE)
        infos = [client.getJointInfo(self.body, index) for index in range(client.getNumJoints(self.body))]
        index_of = {info[1].decode(): info[0] for info in infos}
        self._hand = next(info[0] for info in infos if info[12].decode() == hand_link("left"))
        self._indices = [index_of[name] for name in JOINTS + CAMERA_JOINTS]
        self._lower, self._upper, effort, speed = (
            np.array([infos[index][column] for index in self._indices]) for column in (8, 9, 10, 11)
        )
        self._forces, self._gains = effort.tolist(), [physics.servo_gain] * len(self._indices)
        self._reach = speed * physics.step_s
        self._goals = np.clip(np.concatenate([_checked(start), np.zeros(len(CAMERA_JOINTS))]), self._lower, self._upper)
        self._setpoints = np.full(len(self._indices), np.nan)
        for index, angle in zip(self._indices, self._goals):
            client.resetJointState(self.body, index, angle)
        self._steer(self._goals)
        for info in infos:
            client.changeDynamics(
                self.body, info[0], restitution=physics.basket_restitution, lateralFriction=physics.basket_friction,
                linearDamping=0, angularDamping=0, jointDamping=0,
            )

    def command(self, joints: Sequence[float]) -> None:
        """Set goals of the joints (12,). Raises SimulationError for another number of joints, or values not finite."""
        self._goals[: len(JOINTS)] = np.clip(_checked(joints), self._lower[: len(JOINTS)], self._upper[: len(JOINTS)])

    def aim_cameras(self, left_pan_tilt: Sequence[float], right_pan_tilt: Sequence[float]) -> None:
        """Set goals of each camera's own pan and tilt (2,)."""
        wanted = [*left_pan_tilt, *right_pan_tilt]
        self._goals[len(JOINTS) :] = np.clip(wanted, self._lower[len(JOINTS) :], self._upper[len(JOINTS) :])

    def drive(self) -> None:
        """Move the servos' set-points on for one step of the physics."""
        if not np.array_equal(self._setpoints, self._goals):
            self._steer(np.clip(self._goals, self._setpoints - self._reach, self._setpoints + self._reach))

    def _steer(self, setpoints: np.ndarray) -> None:
        self._setpoints = setpoints.copy()
        self._client.setJointMotorControlArray(
            self.body, self._indices, pybullet.POSITION_CONTROL, targetPositions=setpoints.tolist(), forces=self._forces,
            positionGains=self._gains,
        )

    def joints(self) -> np.ndarray:
        """Return the joints' present angles (12,)."""
        return self._angles()[: len(JOINTS)]

    def camera_pan_tilt(self, side: str) -> np.ndarray:
        """Return a camera's own present pan and tilt (2,)."""
        first = len(JOINTS) + 2 * SIDES.index(side)
        return self._angles()[first : first + 2]

    def _angles(self) -> np.ndarray:
        return np.array([state[0] for state in self._client.getJointStates(self.body, self._indices)])

    def hand_motion(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the left hand's true base_from_hand (4, 4) [m] and velocity (3,) [m/s]."""
        state = self._client.getLinkState(self.body, self._hand, computeLinkVelocity=True, computeForwardKinematics=True)
        pose = np.eye(4)
        pose[:3, :3] = np.reshape(self._client.getMatrixFromQuaternion(state[5]), (3, 3))
        pose[:3, 3] = state[4]
        return pose, np.array(state[6])


def _checked(joints: Sequence[float]) -> np.ndarray:
    values = np.asarray(joints, dtype=float)
    if values.shape != (len(JOINTS),) or not np.all(np.isfinite(values)):
        raise SimulationError(f"joints: are {values.tolist()}; expected {len(JOINTS)} finite angles")
    return values
