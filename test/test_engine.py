"""The control engine against an ideal robot: joints that are where they were told, fingers that stop on a tube."""

import math
import threading
import time

import numpy as np
import pytest

from dr_eureka.control.codes import ControlError, EngineCode, EngineState
from dr_eureka.control.engine import ControlEngine
from dr_eureka.control.port import CONTROLLED_JOINTS
from dr_eureka.control.settings import ControlSettings
from dr_eureka.game.actions import Action, actions_for
from dr_eureka.game.state import Pour
from dr_eureka.pieces import load_pieces
from dr_eureka.resources import load_yaml

WHERE = "config/control_engine.yaml"
PLACES = {"left": (0.44, 0.11, 0.775), "center": (0.44, 0.0, 0.775), "right": (0.44, -0.11, 0.775)}
BALLS = {"left": 2, "center": 2, "right": 2}
CYCLE = 0.008
ON_TUBE = 0.959


def make_engine(**options) -> ControlEngine:
    return ControlEngine(ControlSettings.from_mapping(load_yaml(WHERE), WHERE), load_pieces(), **options)


class IdealRobot:
    """Joints follow at once; fingers stop at `finger_stop` rad, those of hands in `empty` do not."""

    def __init__(self, engine: ControlEngine, finger_stop: float = ON_TUBE):
        self.engine, self.finger_stop, self.time = engine, finger_stop, 0.0
        self.joints = dict.fromkeys(CONTROLLED_JOINTS, 0.0)
        self.history = [dict(self.joints)]
        self.empty: set[str] = set()
        self.cycle()

    def _stopped(self, name: str, angle: float) -> float:
        stops = name.endswith("grip") and name[0] not in {hand[0] for hand in self.empty}
        return min(angle, self.finger_stop) if stops else angle

    def cycle(self) -> None:
        seen = {name: self._stopped(name, angle) for name, angle in self.joints.items()}
        self.joints = self.engine.tick(self.time, seen)
        self.history.append(dict(self.joints))
        self.time += CYCLE

    def run(self, seconds: float = 120.0) -> str:
        end = self.time + seconds
        while self.time < end and self.engine.status.state == EngineState.BUSY:
            self.cycle()
        return self.engine.status.state


TWO_POURS = [Pour("left", "right", 1), Pour("center", "right", 1)]


@pytest.mark.parametrize("put_down", [False, True])
def test_the_engine_holds_both_tubes_after_a_pour_until_it_is_told_what_to_do(put_down):
    engine = make_engine()
    robot = IdealRobot(engine)
    actions = actions_for(TWO_POURS)
    engine.start(actions, PLACES, BALLS, pause_after_pours=True)
    while not engine.status.paused:
        assert engine.status.state == EngineState.BUSY, engine.status
        robot.cycle()
    assert actions[engine.status.action_index].kind == "pour"
    held = engine.body.held_poses()
    assert sorted(held) == ["left", "right"]
    leaning = np.arcsin(held["right"][2, 2])
    assert leaning == pytest.approx(engine.settings.pour_place.target_elevation, abs=1e-3) and abs(held["left"][2, 2]) < 0.3
    for _ in range(100):
        robot.cycle()
    np.testing.assert_allclose([engine.body.held_poses()[name] for name in held], list(held.values()), atol=1e-6)
    engine.go_on(put_down)
    with pytest.raises(ControlError, match="no pour waits"):
        engine.go_on(put_down)
    assert robot.run() == EngineState.DONE, engine.status
    assert not engine.status.paused and not engine.body.held
    pours = [actions[index].kind for index, _, _ in engine.durations].count("pour")
    assert pours == (1 if put_down else 2)
    for tube, foot in PLACES.items():
        assert engine.body.places[tube] == pytest.approx(foot, abs=1e-3)


@pytest.mark.parametrize("method", ["lock", "linear", "profiled"])
@pytest.mark.parametrize("source, target", [("left", "right"), ("center", "left"), ("right", "center")])
def test_a_pour_between_any_two_tubes_runs_to_its_end_and_puts_both_back(method, source, target):
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.start(actions_for([Pour(source, target, 1)]), PLACES, BALLS, method)
    assert robot.run() == EngineState.DONE, engine.status
    assert not engine.body.held
    for tube, foot in PLACES.items():
        assert engine.body.places[tube] == pytest.approx(foot, abs=1e-3)


def test_commands_keep_range_speed_and_are_finite_during_a_whole_pour():
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.start(actions_for([Pour("left", "right", 1)]), PLACES, BALLS)
    robot.run()
    names = sorted(engine.ranges)
    commands = np.array([[row[name] for name in names] for row in robot.history])
    assert np.isfinite(commands).all()
    low, high = np.array([engine.ranges[name] for name in names]).T
    assert (commands[2:] >= low - 1e-9).all() and (commands[2:] <= high + 1e-9).all()
    assert np.abs(np.diff(commands, axis=0)).max() <= 3.4 * CYCLE + 1e-9


def test_two_pours_of_the_same_kind_follow_without_raising_the_tubes():
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.start(actions_for([Pour("left", "right", 1), Pour("left", "right", 1)]), PLACES, BALLS)
    robot.run()
    pours = [end - start for index, start, end in engine.durations if index in (2, 3)]
    assert engine.status.state == EngineState.DONE
    assert pours[1] < pours[0] - 0.5


def test_fingers_that_close_on_nothing_end_the_strategy_and_the_robot_holds():
    engine = make_engine()
    robot = IdealRobot(engine, finger_stop=9.9)
    engine.start(actions_for([Pour("left", "right", 1)]), PLACES, BALLS)
    assert robot.run() == EngineState.FAULT
    assert engine.status.code == EngineCode.GRASP_EMPTY
    held = dict(robot.joints)
    for _ in range(50):
        robot.cycle()
    assert robot.joints == held


@pytest.mark.parametrize("at_once", [False, True])
def test_after_a_hand_closed_on_nothing_the_other_tube_is_put_back_and_a_new_strategy_may_begin(at_once):
    engine = make_engine()
    robot = IdealRobot(engine)
    robot.empty = {"right"}
    engine.start(actions_for([Pour("left", "right", 1)]), PLACES, BALLS, hands_at_once=at_once)
    assert robot.run() == EngineState.FAULT
    assert engine.status.code == EngineCode.GRASP_EMPTY and "right hand closed on tube 'right'" in engine.status.message
    assert not engine.body.held
    for hand in ("left", "right"):
        home = engine.body.arms[hand].posture(engine.settings.postures.home)
        np.testing.assert_allclose(engine.body.commanded(hand), home, atol=1e-6)
    assert engine.body.places["left"] == pytest.approx(PLACES["left"], abs=1e-3)
    robot.empty = set()
    engine.start(actions_for([Pour("left", "right", 1)]), PLACES, BALLS)
    assert robot.run() == EngineState.DONE, engine.status


@pytest.mark.parametrize("moment", [2, 3])
def test_after_a_tube_slipped_out_of_a_hand_the_other_is_put_back(moment):
    engine = make_engine()
    robot = IdealRobot(engine)
    actions = actions_for([Pour("left", "right", 1)])
    engine.start(actions, PLACES, BALLS)
    while engine.status.action_index < moment:
        robot.cycle()
    robot.empty = {"left"}
    assert robot.run() == EngineState.FAULT
    assert engine.status.code == EngineCode.TUBE_SLIPPED, engine.status
    assert not engine.body.held and "right" in engine.body.places


@pytest.mark.parametrize("lost", ["left", "right"])
def test_nothing_is_poured_once_a_tube_has_slipped_out_of_a_hand(lost):
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.start(actions_for([Pour("left", "right", 1)] * 2), PLACES, BALLS, pause_after_pours=True)
    while not engine.status.paused:
        robot.cycle()
    began = len(robot.history)
    robot.empty = {lost}
    engine.go_on(put_down=False)
    assert robot.run() == EngineState.FAULT
    assert engine.status.code == EngineCode.TUBE_SLIPPED and "before the pour" in engine.status.message
    axis_up = [engine.body.arms["left"].pose(row)[2, 2] for row in robot.history[began:]]
    # A pour would bring the mouth below the foot.
    assert min(axis_up) > 0.5 * axis_up[0] > 0.1


@pytest.mark.parametrize("moment", [2, 3])
def test_tubes_that_slipped_out_of_both_hands_are_a_fault_with_that_name(moment):
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.start(actions_for([Pour("left", "right", 1)]), PLACES, BALLS)
    while engine.status.action_index < moment:
        robot.cycle()
    robot.empty = {"left", "right"}
    assert robot.run() == EngineState.FAULT
    assert engine.status.code == EngineCode.TUBE_SLIPPED, engine.status
    assert not engine.body.held and engine.body.pour_ready is None


@pytest.mark.parametrize("finger_stop", [0.8, 1.06])
def test_fingers_that_stop_where_no_tube_stops_them_lift_nothing(finger_stop):
    engine = make_engine()
    robot = IdealRobot(engine, finger_stop)
    engine.start([Action("pick", "left", "left")], PLACES, BALLS)
    assert robot.run() == EngineState.FAULT
    assert engine.status.code == EngineCode.GRASP_EMPTY
    assert f"fingers at {finger_stop:.3f} rad, expected 0.900 to 1.030" in engine.status.message
    heights = [engine.body.arms["left"].pose(row)[2, 3] for row in robot.history if row["l_arm_grip"] == engine.settings.grip.closed]
    assert heights == pytest.approx([PLACES["left"][2] + engine.settings.pick.grip_height] * len(heights), abs=1e-3)
    assert heights and not engine.body.held and engine.body.places["left"] == pytest.approx(PLACES["left"])


@pytest.mark.parametrize("foot", [(0.9, 0.1, 0.775), (0.44, -0.5, 0.775)])
def test_a_tube_out_of_reach_is_named(foot):
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.start([Action("pick", "left", "left")], {"left": foot}, BALLS)
    assert robot.run() == EngineState.FAULT
    assert engine.status.code == EngineCode.UNREACHABLE_TUBE
    assert "'left'" in engine.status.message


def test_a_place_that_is_not_finite_is_refused():
    with pytest.raises(ControlError) as caught:
        make_engine().start([Action("pick", "left", "left")], {"left": (math.nan, 0.0, 0.7)}, BALLS)
    assert caught.value.code == EngineCode.INVALID_VALUE


def test_a_second_strategy_is_refused_while_busy():
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.start([Action("pick", "left", "left")], PLACES, BALLS)
    robot.cycle()
    with pytest.raises(ControlError) as caught:
        engine.start([], PLACES, BALLS)
    assert caught.value.code == EngineCode.BUSY


@pytest.mark.parametrize("seed", range(3))
def test_a_stop_brakes_in_the_next_cycle_from_any_point_of_a_strategy_and_then_holds(seed):
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.start(actions_for([Pour("left", "right", 1)]), PLACES, BALLS, hands_at_once=bool(seed % 2))
    for _ in range(int(np.random.default_rng(seed).integers(60, 1200))):
        robot.cycle()
    names = [*engine.body.arms["left"].joints, *engine.body.arms["right"].joints]
    first = len(robot.history) - 2
    engine.stop()
    assert engine.status.code == EngineCode.STOPPED
    for _ in range(30):
        robot.cycle()
    goals = np.array([[row[name] for name in names] for row in robot.history[first:]])
    steps = np.abs(np.diff(goals, axis=0)).max(axis=1)
    # 0.05 s brake 1.5 rad/s at 30 rad/s^2.
    assert steps[1] < steps[0] or steps[0] < 1e-6
    assert (steps[9:] == 0.0).all()
    assert engine.status.code == EngineCode.STOPPED


def test_a_cycle_does_not_wait_for_a_motion_that_is_being_planned_and_a_stop_leaves_it(monkeypatch):
    engine = make_engine(wait_for_plans=False)
    robot = IdealRobot(engine)
    may_plan, real_hit = threading.Event(), engine.body.hit

    def slow_hit(motion):
        assert may_plan.wait(10.0)
        return real_hit(motion)

    monkeypatch.setattr(engine.body, "hit", slow_hit)
    engine.move_joints({"head_p": 0.5}, 0.5)
    before = dict(robot.joints)
    for _ in range(20):
        robot.cycle()
    assert robot.joints == before and engine.status.state == EngineState.BUSY
    engine.stop()
    assert engine.status.code == EngineCode.STOPPED
    may_plan.set()
    engine.move_joints({"head_p": 0.2}, 0.5)
    while engine.status.state == EngineState.BUSY:
        robot.cycle()
        time.sleep(0.0005)
    assert engine.status.state == EngineState.DONE and robot.joints["head_p"] == pytest.approx(0.2)


def test_a_motion_into_a_collision_is_refused_before_it_begins():
    engine = make_engine()
    robot = IdealRobot(engine)
    before = dict(robot.joints)
    engine.move_joints({"l_arm_sh_p1": 1.3}, 2.0)
    assert robot.run() == EngineState.FAULT
    assert engine.status.code == EngineCode.COLLISION
    assert "l_arm" in engine.status.message and "table" in engine.status.message
    assert robot.joints == before


@pytest.mark.parametrize("spoil", [lambda j: j.pop("l_arm_el_y"), lambda j: j.update(l_arm_el_y=math.nan)])
def test_a_joint_state_that_lacks_a_joint_ends_in_a_fault_that_names_it(spoil):
    engine = make_engine()
    robot = IdealRobot(engine)
    joints = dict(robot.joints)
    spoil(joints)
    goals = engine.tick(1.0, joints)
    assert engine.status.code == EngineCode.INVALID_VALUE and "l_arm_el_y" in engine.status.message
    assert all(math.isfinite(goal) for goal in goals.values())


def test_a_hand_stopped_low_beside_a_tube_finds_home_without_touching_it():
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.start([Action("pick", "right", "center")], PLACES, BALLS)
    # The fingers open on the way and begin to close when the hand is low.
    while robot.joints["r_arm_grip"] < 0.7:
        robot.cycle()
    engine.stop()
    for _ in range(10):
        robot.cycle()
    engine.move_joints({"r_arm_grip": engine.settings.grip.open}, 0.5)
    robot.run()
    low = engine.body.arms["right"].pose(robot.joints)[2, 3]
    engine.start([], PLACES, BALLS)
    assert robot.run() == EngineState.DONE, engine.status
    assert engine.body.arms["right"].pose(robot.joints)[2, 3] > low + 0.1


def test_a_joint_that_does_not_follow_is_a_tracking_error():
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.start([Action("pick", "left", "left")], PLACES, BALLS)
    stuck = 0.0
    while engine.status.state == EngineState.BUSY and robot.time < 30.0:
        robot.joints = engine.tick(robot.time, robot.joints | {"l_arm_sh_r": stuck})
        robot.time += CYCLE
    assert engine.status.code == EngineCode.TRACKING_ERROR and "l_arm_sh_r" in engine.status.message


@pytest.mark.parametrize(
    "name, goal, code",
    [("l_arm_thumb", 0.1, EngineCode.UNKNOWN_JOINT), ("head_p", math.nan, EngineCode.INVALID_VALUE), ("head_p", 3.0, EngineCode.OUT_OF_LIMITS)],
)
def test_a_joint_goal_without_sense_is_refused_by_code(name, goal, code):
    engine = make_engine()
    IdealRobot(engine)
    with pytest.raises(ControlError) as caught:
        engine.move_joints({name: goal}, 1.0)
    assert caught.value.code == code


def test_a_request_to_move_nothing_is_refused():
    engine = make_engine()
    IdealRobot(engine)
    with pytest.raises(ControlError) as caught:
        engine.move_joints({}, math.nan)
    assert caught.value.code == EngineCode.INVALID_VALUE


@pytest.mark.parametrize(
    "balls, words",
    [
        ({"left": 1, "right": 0}, r"action 2 .*: the tube will hold 1 balls by then, the other one have room for 4"),
        ({"left": 3, "right": 3}, r"action 2 .*: the tube will hold 3 balls by then, the other one have room for 1"),
        ({"left": 3, "right": 1}, r"action 3 .*: the tube will hold 1 balls by then, the other one have room for 1"),
        ({}, r"action 2 .*: the tube will hold 0 balls by then, the other one have room for 4"),
    ],
)
def test_a_pour_of_more_balls_than_there_are_or_have_room_is_refused_before_anything_moves(balls, words):
    engine = make_engine()
    IdealRobot(engine)
    with pytest.raises(ControlError, match=words) as caught:
        engine.start(actions_for([Pour("left", "right", 2)] * 2), PLACES, balls)
    assert caught.value.code == EngineCode.INVALID_ACTION and engine.status.state == EngineState.IDLE


@pytest.mark.parametrize(
    "action, word",
    [(Action("throw", "left", "left"), "throw"), (Action("pick", "middle", "left"), "middle"), (Action("place", "left", "foo"), "foo")],
)
def test_an_action_without_sense_is_refused_before_anything_moves(action, word):
    with pytest.raises(ControlError, match=word) as caught:
        make_engine().start([action], PLACES, BALLS)
    assert caught.value.code == EngineCode.INVALID_ACTION


def test_an_unexpected_error_is_a_fault_and_never_success(monkeypatch):
    engine = make_engine()
    robot = IdealRobot(engine)
    monkeypatch.setattr(engine.body.arms["left"], "glide", lambda *args: 1 / 0)
    engine.start([Action("pick", "left", "left")], PLACES, BALLS)
    assert robot.run() == EngineState.FAULT
    assert engine.status.code == EngineCode.INTERNAL_ERROR and "ZeroDivisionError" in engine.status.message


def test_a_gap_in_the_joint_states_delays_a_motion_and_never_makes_it_jump():
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.move_joints({"head_p": 0.8}, 1.0)
    for _ in range(40):
        robot.cycle()
    before = robot.joints["head_p"]
    robot.time += 5.0
    robot.cycle()
    assert 0.0 < robot.joints["head_p"] - before <= 3.4 * 0.016
    assert robot.run() == EngineState.DONE and robot.joints["head_p"] == pytest.approx(0.8)


def test_before_the_first_joint_state_nothing_is_moved_and_the_engine_is_not_ready():
    engine = make_engine()
    assert (engine.status.state, engine.status.code) == (EngineState.IDLE, EngineCode.NO_JOINT_STATES)
    with pytest.raises(ControlError, match="no joint state has been received") as refused:
        engine.move_joints({"head_p": 0.5}, 1.0)
    assert refused.value.code == EngineCode.NO_JOINT_STATES
    IdealRobot(engine).cycle()
    assert (engine.status.code, engine.status.message) == (EngineCode.OK, "ready")


def test_after_lost_joint_states_the_robot_holds_where_it_is_found():
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.lose("no joint states")
    assert engine.tick(9.0, robot.joints | {"l_arm_sh_r": 0.7})["l_arm_sh_r"] == pytest.approx(0.7)
    assert engine.status.code == EngineCode.JOINT_STATES_LOST


def test_a_hand_stopped_with_a_tube_must_be_opened_before_the_next_strategy():
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.start([Action("pick", "left", "left")], PLACES, BALLS)
    while "left" not in engine.body.held:
        robot.cycle()
    engine.stop()
    with pytest.raises(ControlError, match="left fingers"):
        engine.start([Action("pick", "right", "right")], PLACES, BALLS)
    engine.move_joints({"l_arm_grip": 0.5}, 1.0)
    robot.run()
    engine.start([Action("pick", "right", "right")], PLACES, BALLS)
    assert robot.run() == EngineState.DONE, engine.status


def test_a_pour_that_was_stopped_leaves_no_way_back_to_a_later_strategy():
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.start(actions_for([Pour("left", "right", 1)]), PLACES, BALLS)
    while engine.body.pour_ready is None:
        robot.cycle()
    engine.stop()
    for _ in range(10):
        robot.cycle()
    assert engine.body.upright
    engine.move_joints({"l_arm_grip": 0.5, "r_arm_grip": 0.5}, 1.0)
    robot.run()
    engine.start([], PLACES, BALLS)
    assert engine.body.pour_ready is None and not engine.body.upright


def test_no_strategy_starts_with_the_torso_turned():
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.move_joints({"torso_y": 0.3}, 1.0)
    robot.run()
    with pytest.raises(ControlError, match="torso_y"):
        engine.start([Action("pick", "left", "left")], PLACES, BALLS)


def test_the_head_goes_where_it_is_told():
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.move_joints({"head_p": 0.87, "head_y": 0.1}, 1.0)
    assert robot.run() == EngineState.DONE
    assert robot.joints["head_p"] == pytest.approx(0.87) and robot.joints["head_y"] == pytest.approx(0.1)
