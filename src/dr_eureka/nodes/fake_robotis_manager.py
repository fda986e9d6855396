"""ROS node that stands in for THORMANG3's robotis manager and its camera: PyBullet behind the robot's own topics."""

from __future__ import annotations

import queue
from dataclasses import dataclass, field
from functools import partial
from threading import Event
from typing import Callable, Optional, Sequence

import rospy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState
from std_msgs.msg import String

from dr_eureka import msg, srv
from dr_eureka.behaviour.report import Phase
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.state import State
from dr_eureka.nodes import messages
from dr_eureka.nodes.images import compressed_from_rgb, image_from_rgb, info_from_camera
from dr_eureka.nodes.lock_step import LockStep
from dr_eureka.nodes.pace import Pace
from dr_eureka.nodes.parameters import private_parameters, refuse_rest, take, take_count, take_number, take_state, take_state_unless
from dr_eureka.nodes.runner import run_node
from dr_eureka.pieces import load_pieces
from dr_eureka.settings import build
from dr_eureka.simulation.camera_model import camera_model
from dr_eureka.simulation.card_holder import CardChange, CardHolder
from dr_eureka.simulation.faults import Fault, PourSpoiler
from dr_eureka.simulation.joints import ALL_JOINTS
from dr_eureka.simulation.manager import Refusal, RobotisManager
from dr_eureka.simulation.rendering import SceneTextures
from dr_eureka.simulation.settings import CameraSettings, SimulationError, WorldSettings
from dr_eureka.simulation.world import World
from dr_eureka.vision.camera import CameraModel
from dr_eureka.vision.card_renderer import render_card
from dr_eureka.vision.sheet_renderer import sheet_image

NAME = "fake_robotis_manager"
_SHOW_LIMIT_S = 10.0
# While the robot waits for a person's word about the card, the person leaves it where it is.
_CARD_PHASES = (Phase.LOOKING_FOR_CARD, Phase.WAITING_FOR_CONFIRMATION)


@dataclass(frozen=True)
class ManagerNodeSettings:
    """The `node:` block of config/fake_robotis_manager.yaml."""

    clock_cycles: int = field(metadata={"min": 1, "max": 125})
    jpeg_quality: int = field(metadata={"min": 1, "max": 100})
    camera_rate: float = field(metadata={"min": 0.1, "max": 125.0})
    referee_rate: float = field(metadata={"min": 0.1, "max": 125.0})
    answer_limit: float = field(metadata={"min": 0.0, "max": 60.0})


class FakeRobotisManager:
    """Simulates robot, table, tubes and balls in control cycles of 8 ms.

    Bullet and its renderer are used by the thread that calls `run` alone; callbacks only leave notes for it.

    ROS Publishers:
        * **robotis/present_joint_states**, **robotis/goal_joint_states** (sensor_msgs/JointState): 125 Hz
        * **robotis/present_joint_ctrl_modules** (dr_eureka/JointCtrlModule): after each change of modules
        * **camera/image_raw** (sensor_msgs/Image), **camera/image_raw/compressed** (sensor_msgs/CompressedImage),
          **camera/camera_info** (sensor_msgs/CameraInfo): while subscribed to
        * **referee** (dr_eureka/Referee): the truth, latched; for people and tests
        * **/clock** (rosgraph_msgs/Clock)
    ROS Subscribers:
        * **robotis/set_joint_states** (sensor_msgs/JointState)
        * **robotis/enable_ctrl_module**, **robotis/set_control_mode** (std_msgs/String)
        * **robotis/set_joint_ctrl_modules** (dr_eureka/JointCtrlModule)
        * **dr_eureka_main/status** (dr_eureka/GameStatus): a card is shown when the robot looks for one
    ROS Services:
        * **~show_card** (dr_eureka/ShowCard)
        * **~spoil_pour** (dr_eureka/SpoilPour): let the next pour go wrong; for tests only
    ROS Parameters:
        * **~start** (str): state of the tubes; **~seed** (int): draws everything random
        * **~card** (str): state on the first card, or `random`: drawn from the seed
        * **~realtime_factor** (float): robot seconds per second; 0: as fast as possible
        * world, camera, node: see config/fake_robotis_manager.yaml
    """

    def __init__(self, world: World, start: State, camera: CameraModel, cards: CardHolder, seed: int, pace: Pace,
                 cycle_s: float, settings: ManagerNodeSettings):
        self._world = world
        self._start = start
        self._spoiler = PourSpoiler(world, load_pieces())
        self._camera = camera
        self._cards = cards
        self._seed = seed
        self._pace = pace
        self._cycle_s = cycle_s
        self._settings = settings
        self._manager = RobotisManager()
        self._notes: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._cycle = 0
        self._last_verdict: Optional[msg.Referee] = None
        self._present = rospy.Publisher("robotis/present_joint_states", JointState, queue_size=10)
        self._goal = rospy.Publisher("robotis/goal_joint_states", JointState, queue_size=10)
        self._modules = rospy.Publisher("robotis/present_joint_ctrl_modules", msg.JointCtrlModule, queue_size=10)
        self._image = rospy.Publisher("camera/image_raw", Image, queue_size=2)
        self._packed_image = rospy.Publisher("camera/image_raw/compressed", CompressedImage, queue_size=2)
        self._info = rospy.Publisher("camera/camera_info", CameraInfo, queue_size=2)
        self._referee = rospy.Publisher("referee", msg.Referee, queue_size=10, latch=True)
        # rospy listens for the clock at the root, whatever the namespace.
        self._clock = rospy.Publisher("/clock", Clock, queue_size=1)
        self._commands = rospy.Subscriber(
            "robotis/set_joint_states", JointState, lambda command: self._lock_step.on_command(command), tcp_nodelay=True
        )
        self._lock_step = LockStep(settings.answer_limit, lambda: self._commands.get_num_connections() > 0)
        self._listen("robotis/enable_ctrl_module", String, self._enable_module)
        self._listen("robotis/set_control_mode", String, self._set_control_mode)
        self._listen("robotis/set_joint_ctrl_modules", msg.JointCtrlModule, self._set_joint_modules)
        self._listen("dr_eureka_main/status", msg.GameStatus, self._follow_game)
        rospy.Service("~show_card", srv.ShowCard, self._show_card)
        rospy.Service("~spoil_pour", srv.SpoilPour, self._spoil_pour)

    def _listen(self, topic: str, kind: type, react: Callable) -> None:
        """Subscribe to a topic whose messages are dealt with between two cycles."""
        rospy.Subscriber(topic, kind, lambda message: self._notes.put(partial(react, message)), queue_size=10)

    def run(self) -> int:
        """Simulate until shut down; return the exit code."""
        while not rospy.is_shutdown():
            self._world.advance_cycle()
            self._cycle += 1
            fault = self._spoiler.step()
            if fault:
                rospy.logwarn("spoilt a pour as asked: %s", fault.name)
            # From whole nanoseconds, so that an answer's stamp compares equal.
            stamp = rospy.Time(0, self._cycle * round(self._cycle_s * 1e9))
            self._lock_step.expect(stamp.to_nsec())
            self._publish_joints(stamp)
            if self._due(1.0 / (self._settings.clock_cycles * self._cycle_s)):
                self._clock.publish(Clock(stamp))
            if self._due(self._settings.camera_rate):
                self._publish_image(stamp)
            if self._due(self._settings.referee_rate):
                self._publish_verdict(stamp)
            while not self._notes.empty():
                self._notes.get()()
            for command in self._lock_step.take():
                self._apply(command)
            self._pace.keep(self._cycle * self._cycle_s)
        return 0

    def _due(self, rate_hz: float) -> bool:
        return self._cycle % max(1, round(1.0 / (rate_hz * self._cycle_s))) == 0

    def _publish_joints(self, stamp: rospy.Time) -> None:
        for publisher, true in ((self._present, self._world.joint_positions()), (self._goal, self._world.joint_goals())):
            angles = self._spoiler.noticed(true)
            state = JointState(name=list(ALL_JOINTS), position=[angles[name] for name in ALL_JOINTS])
            # The stock robot reads neither velocity nor effort, but sends them at full length.
            state.velocity = state.effort = [0.0] * len(ALL_JOINTS)
            state.header.stamp = stamp
            publisher.publish(state)

    def _publish_image(self, stamp: rospy.Time) -> None:
        if self._info.get_num_connections():
            self._info.publish(info_from_camera(self._camera, stamp, messages.CAMERA_FRAME))
        raw, packed = self._image.get_num_connections(), self._packed_image.get_num_connections()
        if not raw and not packed:
            return
        rgb = self._world.camera_image()
        if raw:
            self._image.publish(image_from_rgb(rgb, stamp, messages.CAMERA_FRAME))
        if packed:
            self._packed_image.publish(compressed_from_rgb(rgb, stamp, messages.CAMERA_FRAME, self._settings.jpeg_quality))

    def _publish_verdict(self, stamp: rospy.Time) -> None:
        verdict = self._world.referee()
        ruling = msg.Referee(
            state=verdict.state or "",
            balls_lost=verdict.balls_lost,
            tubes_standing=[name for name, stands in verdict.tubes_standing.items() if stands],
        )
        ruling.header.stamp = stamp
        self._referee.publish(ruling)

    def _apply(self, command: JointState) -> None:
        goals, refusals = self._manager.set_joint_states(command.name, command.position)
        self._log("set_joint_states", refusals)
        if goals:
            self._world.set_joint_goals(self._spoiler.pushed(goals))

    @staticmethod
    def _log(topic: str, refusals: Sequence[Refusal]) -> None:
        """Say loudly what the real manager would ignore, or crash at."""
        for refusal in refusals:
            rospy.logerr_throttle_identical(1.0, f"{topic}: {refusal}")

    def _enable_module(self, message: String) -> None:
        self._log("enable_ctrl_module", self._manager.enable_ctrl_module(message.data))
        self._publish_modules()

    def _set_control_mode(self, message: String) -> None:
        self._log("set_control_mode", self._manager.set_control_mode(message.data))

    def _set_joint_modules(self, message: msg.JointCtrlModule) -> None:
        self._log("set_joint_ctrl_modules", self._manager.set_joint_ctrl_modules(message.joint_name, message.module_name))
        self._publish_modules()

    def _publish_modules(self) -> None:
        modules = self._manager.joint_modules()
        self._modules.publish(msg.JointCtrlModule(joint_name=list(modules), module_name=list(modules.values())))

    def _follow_game(self, status: msg.GameStatus) -> None:
        try:
            report = messages.report_from_message(status)
            present = State.parse(report.start) if report.start else self._start
            change = self._cards.follow(report.phase in _CARD_PHASES, report.game, present)
        except DrEurekaError as error:
            rospy.logerr_throttle_identical(1.0, f"dr_eureka_main/status: {error}")
            return
        if change:
            self._hold_up(change)

    def _hold_up(self, change: CardChange) -> None:
        if change.state is None:
            self._world.show_card(None)
            return
        rospy.loginfo("showing the card %s", change.state)
        self._world.show_card(render_card(str(change.state), self._seed * 1000 + change.number))

    def _show_card(self, request: srv.ShowCardRequest) -> srv.ShowCardResponse:
        try:
            state = State.parse(request.state) if request.state else None
        except DrEurekaError as error:
            return srv.ShowCardResponse(False, str(error))
        shown = Event()

        def show() -> None:
            self._hold_up(CardChange(state, 0))
            shown.set()

        self._notes.put(show)
        if not shown.wait(_SHOW_LIMIT_S):
            return srv.ShowCardResponse(False, f"the simulation did not react within {_SHOW_LIMIT_S:g} s")
        return srv.ShowCardResponse(True, "")

    def _spoil_pour(self, request: srv.SpoilPourRequest) -> srv.SpoilPourResponse:
        try:
            if len(request.joints) != len(request.offsets):
                sizes = f"{len(request.joints)} joints and {len(request.offsets)} offsets"
                raise SimulationError(f"jog: {sizes}; expected one each")
            fault = Fault(request.fault, dict(zip(request.joints, request.offsets)), request.seconds)
        except DrEurekaError as error:
            return srv.SpoilPourResponse(False, str(error))
        self._notes.put(partial(self._spoiler.spoil_next_pour, fault))
        return srv.SpoilPourResponse(True, "")


def _serve() -> int:
    parameters = private_parameters()
    where = f"{rospy.get_name()} parameters"
    node_settings = build(ManagerNodeSettings, take(parameters, "node"), f"{where} node")
    world_settings = build(WorldSettings, take(parameters, "world"), f"{where} world")
    camera = build(CameraSettings, take(parameters, "camera"), f"{where} camera")
    start, card = take_state(parameters, "start"), take_state_unless(parameters, "card", "random")
    seed = take_count(parameters, "seed", least=0)
    pace = Pace(take_number(parameters, "realtime_factor", least=0.0))
    refuse_rest(parameters)
    textures = SceneTextures(sheet=sheet_image(load_pieces()))
    world = World(world_settings, seed, start, textures, camera=camera)
    try:
        return FakeRobotisManager(
            world, start, camera_model(camera), CardHolder(seed, card), seed, pace, world_settings.cycle, node_settings
        ).run()
    finally:
        world.close()


def main() -> int:
    """Run the node and return its exit code."""
    return run_node(NAME, FakeRobotisManager.__doc__, _serve)
