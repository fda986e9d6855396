"""ROS node that stands in for Saika, both cameras and the person who throws: PyBullet behind the robot's own topics."""

from __future__ import annotations

import json
import queue
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Optional

import numpy as np
import rospy
from geometry_msgs.msg import Point, Vector3
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image, JointState

from dr_eureka import msg
from dr_eureka.catching.catch_report import describe_ball
from dr_eureka.catching.catcher_settings import BALLS
from dr_eureka.catching.description import SIDES
from dr_eureka.catching.localisation import camera_model
from dr_eureka.catching.posture import CAMERA_JOINTS
from dr_eureka.catching.saika import JOINTS
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.errors import DrEurekaError
from dr_eureka.nodes import catch_messages
from dr_eureka.nodes.folders import output_folder
from dr_eureka.nodes.images import image_from_rgb, info_from_camera
from dr_eureka.nodes.lock_step import LockStep
from dr_eureka.nodes.messages import BASE_FRAME
from dr_eureka.nodes.pace import Pace
from dr_eureka.nodes.parameters import (
    ParameterError,
    private_parameters,
    refuse_rest,
    take,
    take_choice,
    take_count,
    take_number,
)
from dr_eureka.nodes.runner import run_node
from dr_eureka.settings import build
from dr_eureka.simulation.catch_session import NO_BALL, CatchSession, SessionSettings
from dr_eureka.simulation.saika import CatchVerdict, SaikaWorld
from dr_eureka.simulation.throws import AIMS, build_throws

NAME = "fake_saika"
FILE = "catch.json"
_LINGER_S = 1.0
_CONNECT_S = 0.2


@dataclass(frozen=True)
class FakeSaikaSettings:
    """The `node:` block of config/fake_saika.yaml."""

    cycle: float = field(metadata={"min": 0.001, "max": 0.05})
    picture_delay: float = field(metadata={"min": 0.0, "max": 1.0})
    clock_cycles: int = field(metadata={"min": 1, "max": 125})
    answer_limit: float = field(metadata={"min": 0.0, "max": 60.0})
    ready_limit: float = field(metadata={"min": 0.1, "max": 600.0})
    pause: float = field(metadata={"min": 0.0, "max": 60.0})
    flight_limit: float = field(metadata={"min": 1.0, "max": 60.0})


class FakeSaika:
    """Simulates robot, cameras and balls; lets a ball go whenever the robot watches for one, and tells how each ended.

    Time stands still until ball_catcher is there. Ends when all balls have: exit code 0 when each ended as it should (caught, or called out of reach when it was).

    ROS Publishers:
        * **saika/present_joint_states** (sensor_msgs/JointState): 125 Hz
        * **left_camera/image_raw**, **right_camera/image_raw** (sensor_msgs/Image) with **…/camera_info**
          (sensor_msgs/CameraInfo): 30 Hz each
        * **catch_referee** (dr_eureka/CatchReferee): the truth, latched; for people and tests
        * **/clock** (rosgraph_msgs/Clock)
    ROS Subscribers:
        * **saika/set_joint_states** (sensor_msgs/JointState)
        * **ball_catcher/status** (dr_eureka/CatchStatus): when the robot watches, and what it says of the ball
        * **ball_catcher/balls** (dr_eureka/SeenBalls): pictures are answered before time goes on
    ROS Parameters:
        * **~ball** (str): which balls, thrown or falling; **~throws** (int): how many; **~aim** (str): reach or beyond
        * **~seed** (int): draws everything random
        * **~realtime_factor** (float): robot seconds per second; 0: as fast as possible
        * **~out** (str): folder for `catch.json`, made when missing
        * balls, node: see config/fake_saika.yaml
    """

    def __init__(
        self, world: SaikaWorld, session: CatchSession, saika: SaikaSettings, pace: Pace, settings: FakeSaikaSettings
    ):
        self._world, self._session, self._pace, self._settings = world, session, pace, settings
        self._camera = camera_model(saika.cameras)
        self._cycle = 0
        self._exposures = {side: world.next_exposure(side) for side in SIDES}
        self._pictures: list[tuple[float, str, float, np.ndarray]] = []
        self._notes: queue.SimpleQueue[msg.CatchStatus] = queue.SimpleQueue()
        self._ruling: Optional[msg.CatchReferee] = None
        self._present = rospy.Publisher("saika/present_joint_states", JointState, queue_size=10)
        self._images = {side: rospy.Publisher(f"{side}_camera/image_raw", Image, queue_size=5) for side in SIDES}
        self._infos = {side: rospy.Publisher(f"{side}_camera/camera_info", CameraInfo, queue_size=5) for side in SIDES}
        self._referee = rospy.Publisher("catch_referee", msg.CatchReferee, queue_size=10, latch=True)
        # rospy listens for the clock at the root, whatever the namespace.
        self._clock = rospy.Publisher("/clock", Clock, queue_size=1)
        limit_s = settings.answer_limit
        self._joint_step: LockStep[JointState] = LockStep(limit_s, lambda: self._commands.get_num_connections() > 0)
        self._picture_step: LockStep[msg.SeenBalls] = LockStep(limit_s, lambda: self._seen.get_num_connections() > 0)
        self._commands = rospy.Subscriber(
            "saika/set_joint_states", JointState, self._joint_step.on_command, tcp_nodelay=True
        )
        self._seen = rospy.Subscriber("ball_catcher/balls", msg.SeenBalls, self._picture_step.on_command, tcp_nodelay=True)
        self._statuses = rospy.Subscriber("ball_catcher/status", msg.CatchStatus, self._notes.put, queue_size=50)

    def run(self) -> None:
        """Simulate until all balls have ended, or shut down."""
        self._await_robot()
        while not rospy.is_shutdown() and not self._session.over:
            self._cycle += 1
            end_s = self._cycle * self._settings.cycle
            self._advance_to(end_s)
            # From whole nanoseconds, so that an answer's stamp compares equal.
            stamp = rospy.Time(0, self._cycle * round(self._settings.cycle * 1e9))
            if self._cycle % self._settings.clock_cycles == 0:
                self._clock.publish(Clock(stamp))
            self._joint_step.expect(stamp.to_nsec())
            self._publish_joints(stamp)
            for command in self._joint_step.take():
                self._apply(command)
            while self._pictures and self._pictures[0][0] <= end_s:
                self._publish_picture(*self._pictures.pop(0)[1:])
            self._judge(end_s, stamp)
            self._pace.keep(end_s)

    def _await_robot(self) -> None:
        """Wait until the robot sees, hears and speaks. Time begins then: how fast its node starts changes nothing."""
        ends = (self._present, *self._images.values(), self._commands, self._seen, self._statuses)
        while not rospy.is_shutdown() and not all(end.get_num_connections() for end in ends):
            try:
                self._session.hear(catch_messages.word_from_message(self._notes.get(timeout=_CONNECT_S)))
            except queue.Empty:
                rospy.loginfo_once("time begins when ball_catcher is there")
        self._joint_step.rely_on_answers()
        self._picture_step.rely_on_answers()

    def _advance_to(self, end_s: float) -> None:
        """Go on to a time, taking the pictures that are due before."""
        while True:
            side = min(self._exposures, key=self._exposures.get)
            if self._exposures[side] > end_s:
                break
            self._world.step(self._exposures[side] - self._world.time_s)
            taken_s, rgb = self._world.capture(side)
            self._pictures.append((taken_s + self._settings.picture_delay, side, taken_s, rgb))
            self._exposures[side] = self._world.next_exposure(side)
        self._world.step(end_s - self._world.time_s)

    def _publish_joints(self, stamp: rospy.Time) -> None:
        angles = [*self._world.joints(), *(angle for side in SIDES for angle in self._world.camera_pan_tilt(side))]
        state = JointState(name=[*JOINTS, *CAMERA_JOINTS], position=angles)
        state.header.stamp = stamp
        self._present.publish(state)

    def _publish_picture(self, side: str, taken_s: float, rgb: np.ndarray) -> None:
        """Publish a picture, and wait until the robot has looked at it: time stands still meanwhile."""
        stamp, frame = rospy.Time(0, round(taken_s * 1e9)), f"{side}_camera"
        self._picture_step.expect(stamp.to_nsec())
        self._infos[side].publish(info_from_camera(self._camera, stamp, frame))
        self._images[side].publish(image_from_rgb(rgb, stamp, frame))
        self._picture_step.take()

    def _apply(self, command: JointState) -> None:
        goals = dict(zip(command.name, command.position))
        try:
            if set(goals) != {*JOINTS, *CAMERA_JOINTS}:
                wrong = ", ".join(sorted(set(goals) ^ {*JOINTS, *CAMERA_JOINTS}))
                raise ParameterError(f"joints missing or unknown: {wrong}; expected all of Saika's")
            self._world.command([goals[name] for name in JOINTS])
            self._world.aim_cameras(*([goals[f"{side}_camera_{axis}"] for axis in ("pan", "tilt")] for side in SIDES))
        except DrEurekaError as error:
            rospy.logerr_throttle_identical(1.0, f"set_joint_states: {error}")

    def _judge(self, now_s: float, stamp: rospy.Time) -> None:
        """Take the robot's word, let the next ball go, publish the referee's ruling when it changes."""
        while not self._notes.empty():
            self._session.hear(catch_messages.word_from_message(self._notes.get()))
        released = self._session.released
        truth: Optional[CatchVerdict] = self._world.referee() if released else None
        verdict = truth.result if truth else NO_BALL
        ended = len(self._session.results)
        throw = self._session.step(now_s, verdict)
        if throw is not None:
            self._world.throw_ball(throw.position, throw.velocity)
        if len(self._session.results) > ended:
            rospy.loginfo("ball %d of %d: %s", ended + 1, self._session.throws, describe_ball(self._session.results[-1]))
        if self._ruling is None or (verdict, released) != (self._ruling.verdict, self._ruling.throws):
            self._ruling = msg.CatchReferee(verdict=verdict, throws=released)
            self._ruling.header.stamp, self._ruling.header.frame_id = stamp, BASE_FRAME
            if truth is not None:
                self._ruling.position, self._ruling.velocity = Point(*truth.ball_position), Vector3(*truth.ball_velocity)
            self._referee.publish(self._ruling)


def _serve() -> int:
    parameters = private_parameters()
    where = f"{rospy.get_name()} parameters"
    settings = build(FakeSaikaSettings, take(parameters, "node"), f"{where} node")
    kinds = build_throws(take(parameters, "balls"), f"{where} balls")
    ball, aim = take_choice(parameters, "ball", BALLS), take_choice(parameters, "aim", AIMS)
    seed, throws = take_count(parameters, "seed", least=0), take_count(parameters, "throws", least=1)
    pace = Pace(take_number(parameters, "realtime_factor", least=0.0))
    folder = output_folder(str(take(parameters, "out")))
    refuse_rest(parameters)
    file = folder / FILE
    # The result of an earlier session must not be taken for this one's.
    file.unlink(missing_ok=True)
    saika = SaikaSettings.load()
    limits = SessionSettings(settings.ready_limit, settings.pause, settings.flight_limit)
    session = CatchSession(throws, aim, kinds[ball], limits, np.random.default_rng([seed, 2]))
    world = SaikaWorld(saika, seed, rendered=True)
    try:
        FakeSaika(world, session, saika, pace, settings).run()
    finally:
        world.close()
    _write(file, {"seed": seed, "ball": ball, **session.as_mapping()})
    rospy.loginfo("%d of %d balls caught; %s; wrote %s", session.as_mapping()["caught"], throws,
                  "each ended as it should" if session.ok else "not each ended as it should", file)
    time.sleep(_LINGER_S)
    return 0 if session.ok else 1


def _write(file: Path, content: dict) -> None:
    try:
        file.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise ParameterError(f"{file}: cannot be written: {error.strerror}") from error


def main() -> int:
    """Run the node and return its exit code."""
    return run_node(NAME, FakeSaika.__doc__, _serve)
