"""The robot as a hand-eye calibration commands it, over the control engine's service and the camera's topic."""

from __future__ import annotations

import time
from typing import Callable, Mapping, Optional

import rosgraph
import rospy
from sensor_msgs.msg import JointState

from dr_eureka.behaviour.arm_calibration import View
from dr_eureka.control.codes import EngineCode, EngineState
from dr_eureka.errors import DrEurekaError
from dr_eureka.nodes.engine_client import EngineClient
from dr_eureka.nodes.sight import Sight, SightSettings
from dr_eureka.resources import load_yaml
from dr_eureka.vision.camera import CameraModel

_SERVICE_LIMIT_S = 10.0
_MOVE_LIMIT_S = 60.0
_PICTURE_LIMIT_S = 30.0
_POLL_S = 0.02
# Every joint is so near to its goal [rad] at the end of a motion; before, the engine's last report may be of an older one.
_ARRIVED_RAD = 0.03
_SIGHT = "config/dr_eureka_main.yaml"
_SIGHT_KEYS = ("image_max_age", "pose_limit", "still_window", "still_tolerance", "history")
_FOLDER_PARAMETER = "control_engine/node/arm_calibration"


class RobotError(DrEurekaError):
    """The robot does not answer, move or see as it should."""


class RosCalibrationRobot:
    """A `behaviour.arm_calibration.CalibrationRobot` on the topics of a robotis manager, real or simulated."""

    def __init__(self, camera: str, calibration: Optional[CameraModel], settle_seconds: float):
        """Connect to the running robot; raises RobotError when there is no ROS master.

        `camera` is the namespace of the camera's topics, `calibration` counts instead of its camera_info where there is
        one, `settle_seconds` is how long the robot rests after each motion.
        """
        if not rosgraph.is_master_online():
            raise RobotError(f"no ROS master at {rosgraph.get_master_uri()}; start the robot by calibrate_arm.launch first")
        remapped = [f"camera/{topic}:={camera}/{topic}" for topic in ("image_raw", "camera_info")]
        rospy.init_node("calibrate_arm", argv=remapped, anonymous=True, disable_signals=True)
        self._settle_seconds = settle_seconds
        self._joints: dict[str, float] = {}
        self._engine = EngineClient(_SERVICE_LIMIT_S)
        sight = load_yaml(_SIGHT)["node"]
        self._sight = Sight(SightSettings(backlog=1, **{key: sight[key] for key in _SIGHT_KEYS}), "raw", calibration)
        rospy.Subscriber("robotis/present_joint_states", JointState, self._on_joints, queue_size=1, tcp_nodelay=True)
        self._sight.open(True)

    @property
    def calibration_folder(self) -> Optional[str]:
        """Where the running control engine looks for calibrations; None when it looks nowhere."""
        return rospy.get_param(_FOLDER_PARAMETER, "") or None

    def move(self, goals: Mapping[str, float]) -> None:
        """Bring joints to positions [rad] and wait until they rest there; raises RobotError."""
        answer = self._engine.move_joints(goals)
        if answer.code != EngineCode.OK:
            raise RobotError(f"the control engine refuses to move: {answer.code}, {answer.message}")
        asked_s = time.monotonic()
        self._wait(lambda: self._arrived(goals, asked_s), _MOVE_LIMIT_S, "the arm did not get to where it was sent")
        settled_s = rospy.get_time() + self._settle_seconds
        self._wait(lambda: rospy.get_time() >= settled_s, _MOVE_LIMIT_S, "robot time stands still")

    def look(self) -> View:
        """Return the first picture taken after now; raises RobotError."""
        now_s, views = rospy.get_time(), []

        def seen() -> bool:
            frame = self._sight.take()
            if frame is not None and frame.stamp_s > now_s:
                views.append(View(frame.image, frame.camera, frame.base_from_camera, dict(self._joints)))
            return bool(views)

        self._wait(seen, _PICTURE_LIMIT_S, "no picture")
        return views[0]

    def close(self) -> None:
        """Let go of the robot."""
        rospy.signal_shutdown("calibrated")

    def _on_joints(self, state: JointState) -> None:
        if len(state.name) == len(state.position):
            self._joints = dict(zip(state.name, state.position))

    def _arrived(self, goals: Mapping[str, float], asked_s: float) -> bool:
        view, joints = self._engine.view, self._joints
        if view is None or view.heard_wall_s <= asked_s:
            return False
        if view.state == EngineState.FAULT:
            raise RobotError(f"the control engine stopped: {view.code}, {view.message}")
        near = all(name in joints and abs(joints[name] - goal) < _ARRIVED_RAD for name, goal in goals.items())
        return near and view.state == EngineState.DONE

    def _wait(self, until: Callable[[], bool], limit_s: float, problem: str) -> None:
        end_s = time.monotonic() + limit_s
        while not until():
            if rospy.is_shutdown() or time.monotonic() > end_s:
                raise RobotError(f"{problem} within {limit_s:g} s; camera: {self._sight.problem}")
            time.sleep(_POLL_S)
