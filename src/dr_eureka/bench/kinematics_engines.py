"""The arms in other people's libraries: forward kinematics and inverse kinematics of PyBullet and of KDL."""

from __future__ import annotations

import copy
import tempfile
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pybullet
import PyKDL
from pybullet_utils.bullet_client import BulletClient

from dr_eureka.kinematics.arms import BASE_LINK, URDF, arm_chain, arm_joint_names
from dr_eureka.kinematics.chain import Chain
from dr_eureka.kinematics.transforms import matrix_to_quaternion, quaternion_to_matrix, transform
from dr_eureka.resources import resource_path
from dr_eureka.simulation.quiet import quiet_stdout

# PyBullet's own 20 iterations end millimetres away. Its variant with limits and rest posture does so after any number: what
# it adds to respect them keeps pulling the hand off the target.
_BULLET_ITERATIONS = 500
_BULLET_RESIDUAL = 1e-5
_KDL_ITERATIONS = 100  # KDL's own default
_KDL_TOLERANCE = 1e-5  # KDL's own default is 1e-6; TRAC-IK's comparison took 1e-5


class BulletArm:
    """An arm alone in PyBullet, all other joints of the robot held at zero."""

    def __init__(self, side: str) -> None:
        """Load the robot's URDF without what does not lead to the hand."""
        with quiet_stdout():
            self._client = BulletClient(pybullet.DIRECT)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "arm.urdf"
            file.write_text(_arm_alone(side), encoding="utf-8")
            with quiet_stdout():
                self._body = self._client.loadURDF(str(file), useFixedBase=True)
        info = [self._client.getJointInfo(self._body, index) for index in range(self._client.getNumJoints(self._body))]
        number = {joint[1].decode(): joint[0] for joint in info}
        self._joints = [number[name] for name in arm_joint_names(side)]
        self._tip = next(joint[0] for joint in info if joint[12].decode() == f"{side[0]}_arm_end_link")

    def forward(self, joints: np.ndarray) -> np.ndarray:
        """Return base_from_end (4, 4) [m] of joints (7,) [rad]."""
        self._put(joints)
        state = self._client.getLinkState(self._body, self._tip, computeForwardKinematics=True)
        return transform(quaternion_to_matrix(state[5]), state[4])

    def solve(self, start: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Return joints (7,) [rad] for a pose (4, 4), from start (7,), by PyBullet's damped least squares: no limits."""
        self._put(start)
        place, turn = target[:3, 3].tolist(), matrix_to_quaternion(target).tolist()
        return np.array(
            self._client.calculateInverseKinematics(
                self._body, self._tip, place, turn, maxNumIterations=_BULLET_ITERATIONS, residualThreshold=_BULLET_RESIDUAL
            )
        )

    def _put(self, joints: np.ndarray) -> None:
        for index, angle in zip(self._joints, joints.tolist()):
            self._client.resetJointState(self._body, index, angle)


class KdlArm:
    """An arm as a KDL chain."""

    def __init__(self, side: str) -> None:
        chain = arm_chain(side)
        self._kdl = _kdl_chain(chain)
        self._forward = PyKDL.ChainFkSolverPos_recursive(self._kdl)
        self._velocity = PyKDL.ChainIkSolverVel_pinv(self._kdl)
        self._jacobian = PyKDL.ChainJntToJacSolver(self._kdl)
        self._solver = PyKDL.ChainIkSolverPos_NR_JL(
            self._kdl, _jnt_array(chain.lower), _jnt_array(chain.upper), self._forward, self._velocity,
            _KDL_ITERATIONS, _KDL_TOLERANCE,
        )

    def forward(self, joints: np.ndarray) -> np.ndarray:
        """Return base_from_end (4, 4) [m] of joints (7,) [rad]."""
        frame = PyKDL.Frame()
        self._forward.JntToCart(_jnt_array(joints), frame)
        return np.array([[frame[row, column] for column in range(4)] for row in range(3)] + [[0.0, 0.0, 0.0, 1.0]])

    def jacobian(self, joints: np.ndarray) -> np.ndarray:
        """Return the geometric Jacobian (6, 7) of joints (7,) [rad], rows linear then angular."""
        jacobian = PyKDL.Jacobian(len(joints))
        self._jacobian.JntToJac(_jnt_array(joints), jacobian)
        return np.array([[jacobian[row, column] for column in range(len(joints))] for row in range(6)])

    def solve(self, start: np.ndarray, target: np.ndarray) -> np.ndarray:
        """Return joints (7,) [rad] for a pose (4, 4), from start (7,), by KDL's Newton-Raphson with joint limits."""
        found = PyKDL.JntArray(len(start))
        self._solver.CartToJnt(_jnt_array(start), _frame(target), found)
        return np.array(list(found))


def _arm_alone(side: str) -> str:
    """Return the robot's URDF cut down to the links between `base` and the arm's end, with the torso's joint fixed."""
    robot = ElementTree.parse(resource_path(URDF)).getroot()
    above = {joint.find("child").get("link"): joint for joint in robot.findall("joint")}
    alone, link = ElementTree.Element("robot", name="arm"), f"{side[0]}_arm_end_link"
    links = [link]
    while link != BASE_LINK:
        joint = copy.deepcopy(above[link])
        if joint.get("name") not in arm_joint_names(side):
            joint.set("type", "fixed")
        alone.append(joint)
        link = joint.find("parent").get("link")
        links.append(link)
    for name in links:
        ElementTree.SubElement(alone, "link", name=name)
    return ElementTree.tostring(alone, encoding="unicode")


def _kdl_chain(chain: Chain) -> PyKDL.Chain:
    result = PyKDL.Chain()
    axes, origins, tip = chain.geometry()
    for name, axis, origin in zip(chain.joint_names, axes, origins):
        turned = _frame(origin)
        joint = PyKDL.Joint(name, turned.p, turned.M * PyKDL.Vector(*axis), PyKDL.Joint.RotAxis)
        result.addSegment(PyKDL.Segment(name, joint, turned))
    result.addSegment(PyKDL.Segment("tip", PyKDL.Joint("tip", PyKDL.Joint.Fixed), _frame(tip)))
    return result


def _frame(pose: np.ndarray) -> PyKDL.Frame:
    return PyKDL.Frame(PyKDL.Rotation(*pose[:3, :3].ravel().tolist()), PyKDL.Vector(*pose[:3, 3].tolist()))


def _jnt_array(values: np.ndarray) -> PyKDL.JntArray:
    array = PyKDL.JntArray(len(values))
    for index, value in enumerate(values.tolist()):
        array[index] = value
    return array
