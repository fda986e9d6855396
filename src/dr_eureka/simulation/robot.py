"""THORMANG3's upper body in PyBullet: joints under position control, grippers with one motor each."""
from __future__ import annotations

import itertools
from typing import Mapping

import numpy as np
import pybullet
from pybullet_utils.bullet_client import BulletClient

from dr_eureka.resources import resource_path
from dr_eureka.simulation.arm_errors import ArmErrors, stretch_links
from dr_eureka.simulation.bodies import scratch_folder
from dr_eureka.simulation.joints import ALL_JOINTS, GRIP_FOLLOWERS, LEG_JOINTS, SIMULATED_JOINTS
from dr_eureka.simulation.settings import PhysicsSettings, ServoSettings, SimulationError

URDF = "config/robot/thormang3.urdf"
# One motor drives both fingers, so the gear between them yields to nothing a hand meets.
GEAR_FORCE = 1000.0
GEAR_ERP = 0.9
PRESSING_LEAD = 0.005  # [rad] a finger whose set-point is farther inward than this closes, or presses
# What PyBullet gives each moving link, and given again makes it look for all of the link's contacts anew.
DEFAULT_GROUP, ALL_GROUPS = 1, -1
# Which links may touch which of the robot's own; neighbours and what cannot meet are left out for speed.
_FOREARM = ("el_y", "wr_r", "wr_y", "wr_p", "grip", "grip_1")
_TRUNK = ("pelvis_link", "chest_link", "head_p_link")
_robot_numbers = itertools.count()


class SimulatedRobot:
    """The robot in one PyBullet world, fixed at the pelvis.

    Goals pass a speed limit and reach the servos in equal parts over the physics steps of a control cycle. Servos are
    stiff and limited in torque by the URDF's effort. Angles rad, as the robot reports them: hidden `errors` of the arms
    are between them and the truth.
    """

    def __init__(self, client: BulletClient, servos: ServoSettings, physics: PhysicsSettings, cycle: float,
                 start: Mapping[str, float], errors: ArmErrors) -> None:
        self._client = client
        self._servos = servos
        self._cycle = cycle
        self.body = client.loadURDF(_description(errors), useFixedBase=True,
                                    flags=pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_SELF_COLLISION)
        self.link_index = {"base": -1}
        self.joint_index = {}
        lower, upper, effort = {}, {}, {}
        for index in range(client.getNumJoints(self.body)):
            info = client.getJointInfo(self.body, index)
            name, link = info[1].decode(), info[12].decode()
            self.joint_index[name] = self.link_index[link] = index
            lower[name], upper[name], effort[name] = info[8], info[9], info[10]
        self._names = SIMULATED_JOINTS + tuple(GRIP_FOLLOWERS.values())
        self._indices = [self.joint_index[name] for name in self._names]
        self._offsets = np.array([errors.offsets.get(name, 0.0) for name in self._names])
        self._lower = np.array([lower[name] for name in self._names])
        self._upper = np.array([upper[name] for name in self._names])
        self._is_grip = np.array(["grip" in name for name in self._names])
        pad_torque = servos.grip_pad_force * servos.grip_pad_radius
        self._forces = [pad_torque if grip else effort[name] for name, grip in zip(self._names, self._is_grip)]
        self._gains = [servos.grip_position_gain if grip else servos.position_gain for grip in self._is_grip]
        self._velocity_gains = [1.0] * len(self._names)
        self._speed = np.where(self._is_grip, min(servos.grip_speed_limit, servos.speed_limit), servos.speed_limit)
        self._pressing = np.zeros(len(self._names), dtype=bool)
        self._leg_goals = dict.fromkeys(LEG_JOINTS, 0.0)
        self._set_materials(physics)
        self._set_self_collision()
        self._couple_fingers()
        self._setpoints = self._put(start)
        self._goals = self._setpoints.copy()
        self._previous = self._setpoints.copy()

    def _put(self, start: Mapping[str, float]) -> np.ndarray:
        """Place the joints without motion, before the world's time starts, and return their angles."""
        unknown = sorted(set(start) - set(SIMULATED_JOINTS))
        if unknown:
            raise SimulationError(f"start joints: unknown {', '.join(unknown)}; expected some of {', '.join(SIMULATED_JOINTS)}")
        angles = self._vector({name: start.get(name, 0.0) for name in SIMULATED_JOINTS})
        for index, angle in zip(self._indices, angles + self._offsets):
            self._client.resetJointState(self.body, index, angle)
        return angles

    def _vector(self, angles: Mapping[str, float]) -> np.ndarray:
        leaders = {follower: leader for leader, follower in GRIP_FOLLOWERS.items()}
        return np.array([angles[leaders.get(name, name)] for name in self._names])

    def _set_materials(self, physics: PhysicsSettings) -> None:
        for index in self.link_index.values():
            self._client.changeDynamics(self.body, index, linearDamping=0, angularDamping=0, jointDamping=0,
                                        restitution=0, lateralFriction=physics.table_friction)
        for name in (*GRIP_FOLLOWERS, *GRIP_FOLLOWERS.values()):
            index = self.joint_index[name]
            # The motor's rotor, seen through its gears, is far heavier to turn than the 13 g finger, and without it the
            # solver cannot balance 20 N on so light a link. Principal axis 3 is the finger's axis of rotation.
            across, along, _ = self._client.getDynamicsInfo(self.body, index)[2]
            # An anchor makes a sticking contact stick: otherwise the solver's remainders let the tube creep in the hand.
            self._client.changeDynamics(self.body, index, lateralFriction=physics.pad_friction, frictionAnchor=1,
                                        localInertiaDiagonal=(across, along, self._servos.grip_rotor_inertia))

    def _set_self_collision(self) -> None:
        forearms = [{f"{side}_arm_{suffix}_link" for suffix in _FOREARM} for side in "lr"]
        wanted = {frozenset((a, b)) for a in forearms[0] for b in forearms[1]}
        wanted |= {frozenset((a, b)) for a in forearms[0] | forearms[1] for b in _TRUNK}
        wanted |= {frozenset((f"{side}_arm_grip_link", f"{side}_arm_grip_1_link")) for side in "lr"}
        links = list(self.link_index)
        for first, a in enumerate(links):
            for b in links[first + 1:]:
                self._client.setCollisionFilterPair(self.body, self.body, self.link_index[a], self.link_index[b],
                                                    int(frozenset((a, b)) in wanted))

    def _couple_fingers(self) -> None:
        for leader, follower in GRIP_FOLLOWERS.items():
            gear = self._client.createConstraint(
                self.body, self.joint_index[leader], self.body, self.joint_index[follower], pybullet.JOINT_GEAR,
                [0, 0, 1], [0, 0, 0], [0, 0, 0])
            self._client.changeConstraint(gear, gearRatio=-1, maxForce=GEAR_FORCE, erp=GEAR_ERP)

    def set_goals(self, goals: Mapping[str, float]) -> None:
        """Set joint goals by the manager's names [rad]; the others keep theirs. Legs accept goals and stay where they are.

        Raises:
            SimulationError: a name that is no joint of the manager, or a value that is not finite.
        """
        for name, goal in goals.items():
            if name not in ALL_JOINTS:
                raise SimulationError(f"joint goal: unknown joint {name!r}; expected one of {', '.join(ALL_JOINTS)}")
            if not np.isfinite(goal):
                raise SimulationError(f"joint goal of {name}: is {goal}; expected a finite angle")
        for name, goal in goals.items():
            if name in self._leg_goals:
                self._leg_goals[name] = float(goal)
        for index, name in enumerate(self._names):
            leader = name[:-2] if name.endswith("_1") else name
            if leader in goals:
                self._goals[index] = goals[leader]

    def goals(self) -> dict[str, float]:
        """Return the commanded angle of each of the manager's joints [rad]."""
        return {**self._leg_goals, **{name: float(goal) for name, goal in zip(SIMULATED_JOINTS, self._goals)}}

    def begin_cycle(self) -> None:
        """Move the servos' set-points one control cycle toward the goals."""
        self._previous = self._setpoints
        reach = self._speed * self._cycle
        wanted = np.clip(np.clip(self._goals, self._lower, self._upper), self._previous - reach, self._previous + reach)
        # A blocked gripper pushes with its full force soon after; further ahead, it would only be late to open again.
        present = self._angles()
        lead = self._servos.grip_lead
        self._setpoints = np.where(self._is_grip, np.clip(wanted, present - lead, present + lead), wanted)
        self._let_go(self._is_grip & (wanted > present + PRESSING_LEAD))

    def _let_go(self, pressing: np.ndarray) -> None:
        """Forget the contacts of fingers that no longer press, by joint (n,) bool; the solver finds again those that are there.

        Bullet keeps an anchored contact's normal as it was in `base` when the pad first touched, however the hand has turned
        since. One that has come to point upward would carry the tube away on an opening finger.
        """
        for joint in np.flatnonzero(self._pressing & ~pressing):
            self._client.setCollisionFilterGroupMask(self.body, self._indices[joint], DEFAULT_GROUP, ALL_GROUPS)
        self._pressing = pressing

    def drive(self, share: float) -> None:
        """Command the servos to the set-point reached at `share` (0..1) of this cycle."""
        targets = self._offsets + self._previous + (self._setpoints - self._previous) * share
        self._client.setJointMotorControlArray(
            self.body, self._indices, pybullet.POSITION_CONTROL, targetPositions=targets.tolist(), forces=self._forces,
            positionGains=self._gains, velocityGains=self._velocity_gains)

    def servo_state(self) -> tuple[np.ndarray, ...]:
        """Return goals, set-points and those of the cycle before (n,) [rad], and which fingers press, for `set_servo_state`."""
        return self._goals.copy(), self._setpoints.copy(), self._previous.copy(), self._pressing.copy()

    def set_servo_state(self, state: tuple[np.ndarray, ...]) -> None:
        """Let the servos go on from a state as `servo_state` returned it."""
        self._goals, self._setpoints, self._previous, self._pressing = (values.copy() for values in state)

    def _angles(self) -> np.ndarray:
        return np.array([state[0] for state in self._client.getJointStates(self.body, self._indices)]) - self._offsets

    def positions(self) -> dict[str, float]:
        """Return the present angle of each of the manager's 31 joints [rad]; the legs, not simulated, are at 0."""
        return {**dict.fromkeys(LEG_JOINTS, 0.0), **dict(zip(SIMULATED_JOINTS, self._angles().tolist()))}

    def torques(self) -> dict[str, float]:
        """Return the torque each simulated joint's motor applied in the last physics step [N m]."""
        states = self._client.getJointStates(self.body, self._indices)
        return {name: state[3] for name, state in zip(SIMULATED_JOINTS, states)}

    def link_pose(self, link: str) -> np.ndarray:
        """Return the true (4, 4) pose of a link's frame in `base` [m]; raises SimulationError for an unknown link."""
        if link not in self.link_index:
            raise SimulationError(f"link {link!r}: unknown; expected one of {', '.join(self.link_index)}")
        pose = np.eye(4)
        if link != "base":
            state = self._client.getLinkState(self.body, self.link_index[link], computeForwardKinematics=True)
            pose[:3, :3] = np.reshape(self._client.getMatrixFromQuaternion(state[5]), (3, 3))
            pose[:3, 3] = state[4]
        return pose


def _description(errors: ArmErrors) -> str:
    """Return the path of the URDF to load: the robot as drawn, or one made for its errors."""
    if not errors.stretches:
        return str(resource_path(URDF))
    # PyBullet remembers files by name: a new robot needs a new one.
    path = scratch_folder() / f"robot_{next(_robot_numbers)}.urdf"
    path.write_text(stretch_links(resource_path(URDF).read_text(encoding="utf-8"), errors.stretches), encoding="utf-8")
    return str(path)
