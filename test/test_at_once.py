"""Both hands at once: together where nothing is in the way, one after the other where it is, and quicker than one by one."""

import numpy as np
import pytest
from test_engine import BALLS, CYCLE, PLACES, IdealRobot, make_engine

from dr_eureka.control.codes import EngineCode, EngineState
from dr_eureka.game.actions import Action, actions_for
from dr_eureka.game.state import Pour

PICKS = [Action("pick", "left", "left"), Action("pick", "right", "right")]


def play(actions, places=PLACES, at_once=True, method="lock"):
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.start(actions, places, BALLS, method, hands_at_once=at_once)
    robot.run()
    return engine, robot


def moving_cycles(robot, hand):
    """Return in which cycles (k,) an arm moved."""
    names = [name for name in robot.history[0] if name.startswith(f"{hand[0]}_arm") and not name.endswith("grip")]
    goals = np.array([[row[name] for name in names] for row in robot.history[1:]])
    return np.abs(np.diff(goals, axis=0)).max(axis=1) > 1e-6


def test_two_tubes_are_picked_at_once_in_the_time_of_one():
    together, robot = play(PICKS)
    apart, _ = play(PICKS, at_once=False)
    assert together.status.state == apart.status.state == EngineState.DONE
    assert together.status.at_once == 2 and apart.status.at_once == 1
    assert {hand: held.tube for hand, held in together.body.held.items()} == {"left": "left", "right": "right"}
    (first, second), one_by_one = together.durations, apart.durations
    assert first[1:] == second[1:]
    assert first[2] - first[1] <= max(end - start for _, start, end in one_by_one) + 2 * CYCLE
    left, right = (moving_cycles(robot, hand) for hand in ("left", "right"))
    assert (left & right).sum() > 0.8 * left.sum()


def test_a_whole_pour_with_both_hands_at_once_puts_all_tubes_back():
    engine, _ = play(actions_for([Pour("center", "right", 1)]))
    assert engine.status.state == EngineState.DONE, engine.status
    assert len(engine.durations) == 5 and not engine.body.held
    for tube, foot in PLACES.items():
        assert engine.body.places[tube] == pytest.approx(foot, abs=1e-3)


def side_by_side(gap):
    """Return places of two tubes that far apart [m], the third out of the way."""
    return {"left": (0.44, 0.2, 0.775), "center": (0.44, gap / 2, 0.775), "right": (0.44, -gap / 2, 0.775)}


@pytest.mark.parametrize("gap, at_once", [(0.10, True), (0.08, False)])
def test_where_both_hands_would_be_in_one_anothers_way_one_goes_after_the_other(gap, at_once):
    engine, robot = play([Action("pick", "left", "center"), Action("pick", "right", "right")], side_by_side(gap))
    assert engine.status.state == EngineState.DONE, engine.status
    assert sorted(held.tube for held in engine.body.held.values()) == ["center", "right"]
    start, end = (int(time / CYCLE) for time in engine.durations[0][1:])
    left, right = (moving_cycles(robot, hand)[start:end] for hand in ("left", "right"))
    # Where they take turns, a hand may still be slowing down in the cycle in which the other sets off.
    assert ((left & right).sum() > 100) if at_once else ((left & right).sum() <= 2)


@pytest.mark.parametrize("left, center, in_turn", [
    ((0.428, 0.103), (0.448, 0.002), True), ((0.450, 0.104), (0.443, 0.008), True), ((0.44, 0.11), (0.44, 0.0), False),
])
def test_tubes_that_would_meet_on_the_way_to_a_pour_go_there_one_after_the_other(left, center, in_turn):
    places = PLACES | {"left": (*left, 0.775), "center": (*center, 0.775)}
    engine, robot = play(actions_for([Pour("left", "center", 1)]), places, method="profiled")
    assert engine.status.state == EngineState.DONE, engine.status
    start, end = (int(time / CYCLE) for time in next(times for index, *times in engine.durations if index == 2))
    both = np.sum(moving_cycles(robot, "left")[start:end] & moving_cycles(robot, "right")[start:end])
    assert both <= 2 if in_turn else both > 50


def test_tubes_too_near_for_two_hands_are_refused_with_the_names_of_what_would_touch():
    engine, _ = play([Action("pick", "left", "center"), Action("pick", "right", "right")], side_by_side(0.06))
    assert (engine.status.state, engine.status.code) == (EngineState.FAULT, EngineCode.COLLISION)
    assert "l_arm_grip" in engine.status.message and "r_arm_grip" in engine.status.message


def test_a_hand_that_cannot_reach_its_tube_ends_both():
    engine, _ = play(PICKS, PLACES | {"right": (0.9, -0.11, 0.775)})
    assert (engine.status.state, engine.status.code) == (EngineState.FAULT, EngineCode.UNREACHABLE_TUBE)
    assert "right hand" in engine.status.message and not engine.body.held


def test_actions_that_one_hand_or_one_tube_shares_are_never_at_once():
    actions = [Action("pick", "left", "center"), Action("place", "left", "center"), Action("pick", "right", "center")]
    engine, robot = play(actions)
    assert engine.status.state == EngineState.DONE, engine.status
    starts = [start for _, start, _ in engine.durations]
    assert len(set(starts)) == 3
