"""ROS node around the control engine: answers every joint state with joint goals, takes strategies by service."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field

import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerResponse

from dr_eureka import msg, srv
from dr_eureka.control.arm_calibration import calibration_file, load_calibration
from dr_eureka.control.codes import POUR_METHODS, ControlError, EngineCode
from dr_eureka.control.engine import ControlEngine, EngineStatus
from dr_eureka.control.settings import ControlSettings
from dr_eureka.game.hands import HANDS
from dr_eureka.kinematics.network import ArmNetwork
from dr_eureka.nodes import messages
from dr_eureka.nodes.folders import resolve
from dr_eureka.nodes.parameters import private_parameters, take
from dr_eureka.nodes.runner import run_node
from dr_eureka.pieces import load_pieces
from dr_eureka.settings import build

NAME = "control_engine"
_WATCH_PERIOD_S = 0.05


@dataclass(frozen=True)
class EngineNodeSettings:
    """The `node:` block of config/control_engine.yaml; wall times [s]."""

    joint_states_timeout: float = field(metadata={"min": 0.02, "max": 60.0})
    status_period: float = field(metadata={"min": 0.01, "max": 1.0})
    wait_for_plans: bool
    default_pour: str = field(metadata={"choices": POUR_METHODS})
    arm_calibration: str


class ControlEngineNode:
    """Moves the robot's upper body through the robotis manager, in module `none`.

    ROS Publishers:
        * **robotis/set_joint_states** (sensor_msgs/JointState): goals, stamped with the state they answer
        * **robotis/enable_ctrl_module** (std_msgs/String): `none`, once, latched
        * **~status** (dr_eureka/EngineStatus): on change and at 10 Hz, latched
    ROS Subscribers:
        * **robotis/present_joint_states** (sensor_msgs/JointState): 125 Hz; every one is answered
    ROS Services:
        * **~execute_strategy** (dr_eureka/ExecuteStrategy), **~go_on** (dr_eureka/GoOn),
          **~get_joint** (dr_eureka/GetJoint), **~set_joints** (dr_eureka/SetJoints), **~stop** (std_srvs/Trigger)
    """

    def __init__(self, engine: ControlEngine, settings: EngineNodeSettings):
        self._engine = engine
        self._settings = settings
        self._lock = threading.Lock()
        self._joints: dict[str, float] = {}
        self._stamp = rospy.Time()
        self._heard_s: float | None = None
        self._strategy_id = 0
        self._published: tuple[EngineStatus, int] | None = None
        self._published_s = 0.0
        self._status = rospy.Publisher("~status", msg.EngineStatus, queue_size=10, latch=True)
        self._goals = rospy.Publisher("robotis/set_joint_states", JointState, queue_size=10)
        # Latched, so that a manager that starts later also gives the joints to module none; the goals are kept.
        self._module = rospy.Publisher("robotis/enable_ctrl_module", String, queue_size=1, latch=True)
        self._module.publish("none")
        rospy.Service("~execute_strategy", srv.ExecuteStrategy, self._execute_strategy)
        rospy.Service("~go_on", srv.GoOn, self._go_on)
        rospy.Service("~get_joint", srv.GetJoint, self._get_joint)
        rospy.Service("~set_joints", srv.SetJoints, self._set_joints)
        rospy.Service("~stop", Trigger, self._stop)
        rospy.Subscriber("robotis/present_joint_states", JointState, self._on_joints, queue_size=10, tcp_nodelay=True)

    def serve(self) -> int:
        """Watch that joint states arrive, until shut down; return the exit code."""
        while not rospy.is_shutdown():
            if self._lock.acquire(timeout=self._settings.status_period):
                try:
                    self._check_alive()
                    self._publish_status()
                finally:
                    self._lock.release()
            else:
                # A cycle waits for a plan, which may take seconds on a busy machine: the engine is alive all the same.
                self._publish_status()
            time.sleep(_WATCH_PERIOD_S)
        return 0

    def _check_alive(self) -> None:
        silence_s = time.monotonic() - self._heard_s if self._heard_s is not None else 0.0
        if silence_s > self._settings.joint_states_timeout and self._engine.status.code != EngineCode.JOINT_STATES_LOST:
            topic = rospy.resolve_name("robotis/present_joint_states")
            self._engine.lose(f"no message on {topic} for {silence_s:.2f} s; holding")
            rospy.logerr("%s", self._engine.status.message)

    def _on_joints(self, state: JointState) -> None:
        if len(state.position) != len(state.name):
            rospy.logwarn_throttle(5.0, f"joint state has {len(state.name)} names, {len(state.position)} positions: ignored")
            return
        with self._lock:
            self._joints = dict(zip(state.name, state.position))
            self._stamp = state.header.stamp
            goals = self._engine.tick(state.header.stamp.to_sec(), self._joints)
            # After the tick, not before: one that waits for a plan may take longer than the timeout.
            self._heard_s = time.monotonic()
            command = JointState(name=list(goals), position=list(goals.values()))
            command.velocity = command.effort = [0.0] * len(goals)
            command.header.stamp = state.header.stamp
            self._goals.publish(command)
            self._publish_status()

    def _publish_status(self) -> None:
        """Publish the engine's status if it changed or is due again."""
        now = (self._engine.status, self._strategy_id)
        if now == self._published and time.monotonic() - self._published_s < self._settings.status_period:
            return
        self._published, self._published_s = now, time.monotonic()
        message = messages.engine_status_to_message(*now, self._stamp)
        if self._engine.status.paused:
            held = self._engine.body.held_poses()
            message.held = [messages.held_tube_to_message(tube, pose) for tube, pose in held.items()]
        self._status.publish(message)

    def _execute_strategy(self, request: srv.ExecuteStrategyRequest) -> srv.ExecuteStrategyResponse:
        tubes = messages.tubes_from_messages(request.tubes)
        actions = [messages.action_from_message(action) for action in request.actions]
        with self._lock:
            try:
                if len(request.balls) != len(request.tubes):
                    problem = f"{len(request.balls)} numbers of balls for {len(request.tubes)} tubes, expected one each"
                    raise ControlError(EngineCode.INVALID_VALUE, problem)
                # rospy hands a uint8[] over as bytes.
                balls = dict(zip((tube.name for tube in request.tubes), bytes(request.balls)))
                pour = request.pour or self._settings.default_pour
                self._engine.start(actions, tubes, balls, pour, request.pause_after_pours, request.hands_at_once)
            except ControlError as error:
                return srv.ExecuteStrategyResponse(messages.engine_code_number(error.code), error.message, self._strategy_id)
            self._strategy_id += 1
            self._publish_status()
            rospy.loginfo("strategy %d: %d actions", self._strategy_id, len(actions))
            return srv.ExecuteStrategyResponse(msg.EngineStatus.OK, "", self._strategy_id)

    def _go_on(self, request: srv.GoOnRequest) -> srv.GoOnResponse:
        with self._lock:
            try:
                self._engine.go_on(request.put_down)
            except ControlError as error:
                return srv.GoOnResponse(messages.engine_code_number(error.code), error.message)
            self._publish_status()
            return srv.GoOnResponse(msg.EngineStatus.OK, "")

    def _get_joint(self, request: srv.GetJointRequest) -> srv.GetJointResponse:
        with self._lock:
            joints = self._joints
        if not joints:
            return srv.GetJointResponse(msg.EngineStatus.NO_JOINT_STATES, 0.0, "no joint state has been received yet")
        if request.name not in joints:
            problem = f"joint {request.name!r}, expected one of {', '.join(sorted(joints))}"
            return srv.GetJointResponse(msg.EngineStatus.UNKNOWN_JOINT, 0.0, problem)
        return srv.GetJointResponse(msg.EngineStatus.OK, joints[request.name], "")

    def _set_joints(self, request: srv.SetJointsRequest) -> srv.SetJointsResponse:
        with self._lock:
            try:
                if len(request.positions) != len(request.names):
                    problem = f"{len(request.positions)} positions for {len(request.names)} names, expected one each"
                    raise ControlError(EngineCode.INVALID_VALUE, problem)
                self._engine.move_joints(dict(zip(request.names, request.positions)), request.duration)
            except ControlError as error:
                return srv.SetJointsResponse(messages.engine_code_number(error.code), error.message)
            self._publish_status()
            return srv.SetJointsResponse(msg.EngineStatus.OK, "")

    def _stop(self, _: object) -> TriggerResponse:
        with self._lock:
            self._engine.stop()
            self._publish_status()
            return TriggerResponse(True, self._engine.status.message)


def _serve() -> int:
    parameters = private_parameters()
    where = f"{rospy.get_name()} parameters"
    node_settings = build(EngineNodeSettings, take(parameters, "node"), f"{where} node")
    calibrations = {}
    if node_settings.arm_calibration:
        folder = resolve(node_settings.arm_calibration)
        calibrations = {hand: load_calibration(folder, hand) for hand in HANDS}
        found = [hand for hand in HANDS if calibration_file(folder, hand).exists()]
        rospy.loginfo("arm calibrations in %s: %s", folder, ", ".join(found) or "none, the arms are taken to be as drawn")
    settings = ControlSettings.from_mapping(parameters, where)
    engine = ControlEngine(settings, load_pieces(), ArmNetwork.load(), calibrations, node_settings.wait_for_plans)
    return ControlEngineNode(engine, node_settings).serve()


def main() -> int:
    """Run the node and return its exit code."""
    return run_node(NAME, ControlEngineNode.__doc__, _serve)
