"""One arm as the skills see it: where its hand is, and trajectories that bring it elsewhere."""

from __future__ import annotations

from typing import Mapping, Sequence

import numpy as np

from dr_eureka.control.arm_calibration import ArmCalibration
from dr_eureka.control.codes import ControlError
from dr_eureka.control.trajectory import JointTrajectory, MotionLimits
from dr_eureka.kinematics.arms import arm_joint_names, mirror
from dr_eureka.kinematics.hybrid import HybridSettings, HybridSolver, IkCode, IkResult
from dr_eureka.kinematics.network import ArmNetwork
from dr_eureka.kinematics.transforms import rotation_about, rotation_vector, transform

_TURN_SPACING = 0.15  # [rad] between solved poses where the hand turns


class Arm:
    """Plan joint trajectories for one hand; angles in rad as the robot reports them, poses of the end link in `base` (4, 4).

    Poses are where the hand really is or shall be: what the arm's calibration sets right is set right here, for every skill.
    """

    def __init__(
        self,
        hand: str,
        settings: HybridSettings,
        network: ArmNetwork | None,
        calibration: ArmCalibration | None = None,
    ):
        self.hand = hand
        self.joints = arm_joint_names(hand)
        self._calibration = calibration or ArmCalibration(hand)
        self.chain = self._calibration.chain()
        self._offsets = np.array(self._calibration.joint_offsets)
        self._solver = HybridSolver(self.chain, network, settings)

    def posture(self, left_posture: Sequence[float]) -> np.ndarray:
        """Return a posture given for the left arm as this arm's joint angles (7,)."""
        posture = np.asarray(left_posture, dtype=float)
        return posture if self.hand == "left" else mirror(posture)

    def positions(self, joints: Mapping[str, float]) -> np.ndarray:
        """Pick this arm's joint angles (7,) out of all joints'."""
        return np.array([joints[name] for name in self.joints])

    def as_drawn(self, angles: np.ndarray) -> np.ndarray:
        """Return the angles (7,) at which an arm as drawn stands as this one does; lengths of links apart."""
        return angles + self._offsets

    def stretches(self) -> dict[str, float]:
        """Return how much farther [m] each joint sits from the one before it (the first: from base) than drawn."""
        return dict(zip(self.joints, self._calibration.link_stretches))

    def pose(self, joints: Mapping[str, float]) -> np.ndarray:
        """Return base_from_end (4, 4) for measured joints."""
        return self.forward(self.positions(joints))

    def forward(self, angles: np.ndarray) -> np.ndarray:
        """Return base_from_end (4, 4) for this arm's joint angles (7,)."""
        return self._calibration.reached(self.chain.forward(angles))

    def solve(
        self, start: np.ndarray, base_from_end: np.ndarray, code: str, what: str, rest: np.ndarray | None = None
    ) -> np.ndarray:
        """Return joint angles (7,) for a hand pose; raise ControlError with `code`, naming `what` could not be reached."""
        result = self._solver.solve(start, self._calibration.commanded(base_from_end), rest=rest)
        return self._checked(result, base_from_end, code, what)

    def path(
        self, start: np.ndarray, poses: Sequence[np.ndarray], code: str, what: str, rest: np.ndarray | None = None
    ) -> np.ndarray:
        """Return joint angles (k, 7) through neighbouring hand poses, without jumps; raises as `solve`."""
        results = self._solver.solve_path(start, [self._calibration.commanded(pose) for pose in poses], rest=rest)
        return np.array([self._checked(result, pose, code, what) for result, pose in zip(results, poses)])

    def _checked(self, result: IkResult, base_from_end: np.ndarray, code: str, what: str) -> np.ndarray:
        if result.code != IkCode.CONVERGED:
            place = f"end link at {np.round(base_from_end[:3, 3], 3).tolist()} m in base"
            raise ControlError(code, f"{self.hand} hand cannot reach {what}, {place}: {result.code}, {result.reason}")
        return result.joints

    def move(self, start: np.ndarray, end: np.ndarray, limits: MotionLimits, at_least: float = 0.0) -> JointTrajectory:
        """Return a straight joint-space trajectory that takes `at_least` [s]."""
        return JointTrajectory.within(np.array([start, end]), limits, at_least=at_least)

    def glide(
        self,
        start: np.ndarray,
        end: np.ndarray,
        spacing: float,
        limits: MotionLimits,
        code: str,
        what: str,
        rest: np.ndarray | None = None,
        hand_speed: float = np.inf,
    ) -> JointTrajectory:
        """Return a trajectory on which the hand goes straight and turns evenly to a pose (4, 4); raises as `solve`.

        The hand goes at most at `hand_speed` [m/s]. Poses are solved every `spacing` [m] of the way. At a constant height the
        hand passes over standing tubes, which a straight line in joint space does not promise.
        """
        begin = self.forward(start)
        shift = end[:3, 3] - begin[:3, 3]
        turn = rotation_vector(end[:3, :3] @ begin[:3, :3].T)
        angle = float(np.linalg.norm(turn))
        steps = max(2, int(np.ceil(np.linalg.norm(shift) / spacing)), int(np.ceil(angle / _TURN_SPACING)))
        axis = turn / angle if angle > 1e-9 else np.array([0.0, 0.0, 1.0])
        last = self.solve(start, end, code, what, rest)
        points = [start]
        for share in np.linspace(0.0, 1.0, steps + 1)[1:]:
            # Guessing near the straight line in joint space keeps the arm's spare freedom from wandering on the way.
            guess = start + share * (last - start)
            pose = transform(rotation_about(axis, share * angle) @ begin[:3, :3], begin[:3, 3] + share * shift)
            result = self._solver.solve(guess, self._calibration.commanded(pose), rest=guess, restarts=0)
            points.append(self._checked(result, pose, code, what))
        share_speed = hand_speed / max(float(np.linalg.norm(shift)), 1e-6)
        return JointTrajectory.within(np.array(points), limits, share_speed)

    def line(
        self,
        start: np.ndarray,
        translation: np.ndarray,
        spacing: float,
        hand_speed: float,
        limits: MotionLimits,
        code: str,
        what: str,
    ) -> JointTrajectory:
        """Return a trajectory that moves the hand straight by a translation (3,) [m], not turning it; else as `glide`."""
        end = self.forward(start)
        end[:3, 3] += translation
        return self.glide(start, end, spacing, limits, code, what, start, hand_speed)
