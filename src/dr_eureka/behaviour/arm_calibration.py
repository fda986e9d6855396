"""The course of a hand-eye calibration: look at the sheet, then show the hand all over the place."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Callable, Mapping, Protocol

import cv2
import numpy as np

from dr_eureka.behaviour.observation import Gaze
from dr_eureka.control.arm import Arm
from dr_eureka.control.arm_calibration import ArmCalibrationError
from dr_eureka.control.codes import EngineCode
from dr_eureka.control.hand_eye import HandEyeSettings, SeenHand, reference_poses
from dr_eureka.control.settings import ControlSettings
from dr_eureka.game.hands import HANDS
from dr_eureka.pieces import Pieces
from dr_eureka.resources import load_yaml
from dr_eureka.settings import build
from dr_eureka.vision.hand_marker import HandMarkerError, locate_hand
from dr_eureka.vision.sheet import SheetError, SheetSettings, locate_sheet

CONFIG = "config/calibrate_arm.yaml"


@dataclass(frozen=True)
class ArmCalibrationSettings:
    """How a calibration goes; see the comments in config/calibrate_arm.yaml."""

    sheet_gaze: Gaze
    hand_gaze: Gaze
    hand_gaze_turn: float = field(metadata={"min": -1.0, "max": 1.0})
    pictures: int = field(metadata={"min": 1, "max": 20})
    settle_seconds: float = field(metadata={"min": 0.0, "max": 10.0})
    fewest_seen: float = field(metadata={"min": 0.1, "max": 1.0})
    hand_eye: HandEyeSettings

    @classmethod
    def load(cls, path: str = CONFIG) -> ArmCalibrationSettings:
        """Read the settings; raises ResourceError or SettingsError naming the file and the key."""
        return build(cls, load_yaml(path), path)


@dataclass(frozen=True, eq=False)
class View:
    """A picture and the robot at its moment: camera (`vision.camera.CameraModel`), its pose (4, 4), joints by name [rad]."""

    image: np.ndarray
    camera: Any
    base_from_camera: np.ndarray
    joints: Mapping[str, float]


class CalibrationRobot(Protocol):
    """The robot as a calibration commands it; both calls raise DrEurekaError when the robot cannot."""

    def move(self, goals: Mapping[str, float]) -> None:
        """Bring joints to positions [rad] and wait until they are there."""

    def look(self) -> View:
        """Take a picture with everything at rest."""


class HandShow:
    """Collects what `control.hand_eye` needs to calibrate one arm of a robot (paper 3.2).

    The head camera sees where the marker on the hand is, the joints tell where the hand should be. What the robot
    believes of its camera is corrected first, by the sheet, which lies level: just as when the game locates the tubes.
    """

    def __init__(
        self, robot: CalibrationRobot, hand: str, control: ControlSettings, sheet: SheetSettings, pieces: Pieces,
        settings: ArmCalibrationSettings,
    ):
        self._robot = robot
        self._hand = hand
        self._control = control
        self._sheet = sheet
        self._pieces = pieces
        self._settings = settings
        self._arms = {side: Arm(side, control.kinematics, None) for side in HANDS}

    def collect(self, tell: Callable[[str], None]) -> list[SeenHand]:
        """Move through the reference points and return what was seen; `tell` gets a line on each. Raises DrEurekaError."""
        camera_from_true = self._look_at_sheet()
        tell("the sheet is seen")
        looks = self._show_hand(camera_from_true, tell)
        self._go_home({})
        return looks

    def _go_home(self, more: Mapping[str, float]) -> None:
        goals = dict(more)
        for arm in self._arms.values():
            goals |= dict(zip(arm.joints, arm.posture(self._control.postures.home).tolist()))
        self._robot.move(goals)

    def _look_at_sheet(self) -> np.ndarray:
        """Return the pose (4, 4) of the true camera in the frame where the joints put it."""
        gaze = self._settings.sheet_gaze
        self._go_home({"head_y": gaze.head_y, "head_p": gaze.head_p})
        view = self._robot.look()
        grey = cv2.cvtColor(view.camera.undistort(view.image), cv2.COLOR_RGB2GRAY)
        try:
            pose = locate_sheet(grey, view.camera.without_distortion(), view.base_from_camera, self._pieces, self._sheet)
        except SheetError as error:
            raise ArmCalibrationError(f"the sheet must be in view, as for a game: {error}") from error
        return np.linalg.inv(view.base_from_camera) @ pose.fit.base_from_camera

    def _show_hand(self, camera_from_true: np.ndarray, tell: Callable[[str], None]) -> list[SeenHand]:
        settings, arm = self._settings, self._arms[self._hand]
        turn = settings.hand_gaze_turn if self._hand == "left" else -settings.hand_gaze_turn
        self._robot.move({"head_y": settings.hand_gaze.head_y + turn, "head_p": settings.hand_gaze.head_p})
        rest = arm.posture(self._control.postures.pick)
        poses = reference_poses(self._hand, settings.hand_eye, self._control.pick)
        looks, unseen, problem = [], 0, ""
        for number, pose in enumerate(poses, start=1):
            what = f"reference point {number}"
            joints = arm.solve(rest, pose, EngineCode.UNREACHABLE_TUBE, what, rest)
            self._robot.move(dict(zip(arm.joints, joints.tolist())))
            try:
                looks += [self._see_hand(camera_from_true) for _ in range(settings.pictures)]
                tell(f"{what} of {len(poses)} is seen")
            except HandMarkerError as error:
                unseen, problem = unseen + 1, str(error)
                tell(f"{what} of {len(poses)} is left out: {error}")
        if len(poses) - unseen < settings.fewest_seen * len(poses):
            seen = f"{len(poses) - unseen} of {len(poses)} places"
            raise ArmCalibrationError(f"the hand was made out at {seen}, last problem: {problem}")
        return looks

    def _see_hand(self, camera_from_true: np.ndarray) -> SeenHand:
        view, arm = self._robot.look(), self._arms[self._hand]
        base_from_camera = view.base_from_camera @ camera_from_true
        expected = np.linalg.inv(base_from_camera) @ arm.pose(view.joints)
        camera_from_end = locate_hand(view.image, view.camera, self._pieces, self._hand, expected)
        return SeenHand(arm.positions(view.joints), base_from_camera @ camera_from_end)
