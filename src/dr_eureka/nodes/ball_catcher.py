"""ROS node that catches balls with Saika's basket: finds them in pictures, predicts their path, moves the arm."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field
from functools import partial
from typing import Optional

import numpy as np
import rospy
from sensor_msgs.msg import Image, JointState

from dr_eureka import msg
from dr_eureka.bags.images import ImageError, rgb_from_image
from dr_eureka.behaviour.head_history import HeadHistory
from dr_eureka.catching.arm_network import SaikaNetwork
from dr_eureka.catching.ball_finder import find_balls
from dr_eureka.catching.ball_track import METHODS, View
from dr_eureka.catching.catcher import Catcher
from dr_eureka.catching.catcher_settings import BALLS, CatcherSettings, checked
from dr_eureka.catching.description import SIDES
from dr_eureka.catching.posture import CAMERA_JOINTS
from dr_eureka.catching.saika import JOINTS, NECK, SaikaHead
from dr_eureka.catching.seen_ball import SeenBall
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.nodes import catch_messages
from dr_eureka.nodes.parameters import private_parameters, refuse_rest, take, take_choice
from dr_eureka.nodes.runner import run_node
from dr_eureka.settings import build
from dr_eureka.vision.camera import CameraError

NAME = "ball_catcher"
_COMPLAINT_S = 5.0


@dataclass(frozen=True)
class BallCatcherNodeSettings:
    """The `node:` block of config/ball_catcher.yaml."""

    status_period: float = field(metadata={"min": 0.01, "max": 10.0})
    history: float = field(metadata={"min": 0.1, "max": 60.0})
    silence: float = field(metadata={"min": 0.1, "max": 60.0})


class BallCatcher:
    """Puts Saika's basket where the ball will come down.

    ROS Publishers:
        * **saika/set_joint_states** (sensor_msgs/JointState): goals of neck, arms and cameras, stamped with the joint state
          that they answer
        * **~balls** (dr_eureka/SeenBalls): what was found in each picture
        * **~status** (dr_eureka/CatchStatus): on change and at 2 Hz, latched
    ROS Subscribers:
        * **saika/present_joint_states** (sensor_msgs/JointState): each is answered
        * **left_camera/image_raw**, **right_camera/image_raw** (sensor_msgs/Image; rgb8, bgr8)
    ROS Parameters:
        * **~ball** (str): which ball to expect, thrown or falling
        * **~method** (str): ballistic, paper_thrown or paper_falling
        * **~feedback** (bool): move the basket again whenever the prediction improves
        * catcher, node: see config/ball_catcher.yaml
    """

    def __init__(self, catcher: Catcher, saika: SaikaSettings, settings: BallCatcherNodeSettings):
        self._catcher, self._saika, self._settings = catcher, saika, settings
        self._head = SaikaHead(saika)
        self._history = HeadHistory((*JOINTS[NECK], *CAMERA_JOINTS), settings.history)
        # Pictures and joint states come in threads of their own.
        self._lock = threading.Lock()
        self._problems: dict[str, str] = {}
        self._heard_s = time.monotonic()
        self._told: Optional[tuple] = None
        self._told_s = 0.0
        self._stamp = rospy.Time()
        self._goals = rospy.Publisher("saika/set_joint_states", JointState, queue_size=10)
        self._balls = rospy.Publisher("~balls", msg.SeenBalls, queue_size=20)
        self._status = rospy.Publisher("~status", msg.CatchStatus, queue_size=10, latch=True)
        for side in SIDES:
            topic, react = f"{side}_camera/image_raw", partial(self._on_picture, side)
            rospy.Subscriber(topic, Image, react, queue_size=5, tcp_nodelay=True)
        rospy.Subscriber("saika/present_joint_states", JointState, self._on_joints, queue_size=10, tcp_nodelay=True)

    def serve(self) -> int:
        """Say now and then how it stands, until shut down; return the exit code."""
        while not rospy.is_shutdown():
            with self._lock:
                self._tell()
            time.sleep(self._settings.status_period)
        return 0

    def _on_joints(self, state: JointState) -> None:
        angles = dict(zip(state.name, state.position))
        missing = [name for name in JOINTS if not np.isfinite(angles.get(name, np.nan))]
        if len(state.name) != len(state.position) or missing:
            self._note("joints", f"joint state without a finite angle of {', '.join(missing) or 'each name'}: ignored")
            return
        with self._lock:
            self._problems.pop("joints", None)
            self._heard_s, self._stamp = time.monotonic(), state.header.stamp
            self._history.add(state.header.stamp.to_sec(), angles)
            posture = self._catcher.step(state.header.stamp.to_sec(), np.array([angles[name] for name in JOINTS]))
            goals = posture.by_name()
            command = JointState(name=list(goals), position=list(goals.values()))
            command.header.stamp = state.header.stamp
            self._goals.publish(command)
            self._tell()

    def _on_picture(self, side: str, picture: Image) -> None:
        stamp_s, balls, problem = picture.header.stamp.to_sec(), (), ""
        try:
            balls = find_balls(rgb_from_image(picture), self._saika)
        except (ImageError, CameraError) as error:
            problem = str(error)
        with self._lock:
            where = self._history.at(stamp_s)
            if not problem and where is None:
                problem = f"no joint state of the picture's time {stamp_s:.3f} s"
            if not problem:
                self._problems.pop(side, None)
                self._see(side, stamp_s, balls, where)
        if problem:
            self._note(side, f"picture of {side}_camera: {problem}")
        self._balls.publish(catch_messages.seen_to_message(picture.header, side, balls, problem))

    def _see(self, side: str, stamp_s: float, balls: tuple[SeenBall, ...], head: np.ndarray) -> None:
        angles = dict(zip((*JOINTS[NECK], *CAMERA_JOINTS), head))
        pan_tilt = np.array([angles[f"{side}_camera_{axis}"] for axis in ("pan", "tilt")])
        self._catcher.see(View(stamp_s, side, balls, self._head.base_from_camera(side, pan_tilt, head[:2])))

    def _note(self, what: str, problem: str) -> None:
        with self._lock:
            self._problems[what] = problem
        rospy.logwarn_throttle(_COMPLAINT_S, problem)

    def _tell(self) -> None:
        """Publish the status if it changed or is due again."""
        silence_s = time.monotonic() - self._heard_s
        if silence_s > self._settings.silence:
            topic = rospy.resolve_name("saika/present_joint_states")
            self._problems["joints"] = f"no message on {topic} for {silence_s:.0f} s"
        now = (self._catcher.phase, len(self._catcher.reports), tuple(self._problems.values()))
        if now == self._told and time.monotonic() - self._told_s < self._settings.status_period:
            return
        if self._told is not None and now[1] > self._told[1]:
            rospy.loginfo("ball %d: %s", now[1], self._catcher.reports[-1].describe())
        self._told, self._told_s = now, time.monotonic()
        self._status.publish(catch_messages.status_to_message(self._catcher, "; ".join(now[2]), self._stamp))


def _serve() -> int:
    parameters = private_parameters()
    where = f"{rospy.get_name()} parameters"
    node_settings = build(BallCatcherNodeSettings, take(parameters, "node"), f"{where} node")
    settings = checked(build(CatcherSettings, take(parameters, "catcher"), f"{where} catcher"), f"{where} catcher")
    ball, method = take_choice(parameters, "ball", BALLS), take_choice(parameters, "method", METHODS)
    feedback = take_choice(parameters, "feedback", (False, True))
    refuse_rest(parameters)
    saika = SaikaSettings.load()
    catcher = Catcher(settings.with_method(method), saika, SaikaNetwork.load(saika), ball, feedback)
    return BallCatcher(catcher, saika, node_settings).serve()


def main() -> int:
    """Run the node and return its exit code."""
    return run_node(NAME, BallCatcher.__doc__, _serve)
