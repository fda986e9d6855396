"""Balls that are let go: where they come down, when the next one goes, and how each end is judged."""

import numpy as np
import pytest

from dr_eureka.catching.catch_report import CatchPhase, CatchResult, RobotWord, describe_ball
from dr_eureka.catching.prediction import GRAVITY_M_S2
from dr_eureka.settings import SettingsError
from dr_eureka.simulation.catch_session import NO_BALL, NOT_THROWN, CatchSession, SessionSettings
from dr_eureka.simulation.saika import CAUGHT, FLYING, MISSED
from dr_eureka.simulation.settings import SimulationError
from dr_eureka.simulation.throws import BEYOND, REACH, build_throws, draw_throw, load_throws

KINDS = load_throws()
WATCHING = RobotWord(CatchPhase.WATCHING)
FOLLOWING = RobotWord(CatchPhase.FOLLOWING)


def session(throws=2, aim=REACH):
    return CatchSession(throws, aim, KINDS["thrown"], SessionSettings(5.0, 0.3, 8.0), np.random.default_rng(1))


def said(result, balls, moves=3):
    return RobotWord(CatchPhase.GETTING_READY, balls, result, "", moves)


@pytest.mark.parametrize("aim", [REACH, BEYOND])
@pytest.mark.parametrize("kind", ["thrown", "falling"])
def test_a_ball_comes_down_where_it_is_aimed(kind, aim):
    settings, rng = KINDS[kind], np.random.default_rng(3)
    for _ in range(50):
        throw = draw_throw(settings, aim, rng)
        t = max(np.roots([-0.5 * GRAVITY_M_S2, throw.velocity[2], throw.position[2] - settings.height_m]).real)
        place = throw.position + throw.velocity * t - [0.0, 0.0, 0.5 * GRAVITY_M_S2 * t * t]
        np.testing.assert_allclose(place, throw.aim, atol=1e-3)
        assert settings.y_m[0] <= place[1] <= settings.y_m[1]
        assert (settings.x_m[0] <= place[0] <= settings.x_m[1]) == (aim == REACH)
        if kind == "falling":
            np.testing.assert_array_equal(throw.velocity, 0.0)
            assert settings.from_z_m[0] <= throw.position[2] - settings.height_m <= settings.from_z_m[1]
        else:
            assert settings.from_y_m[0] <= throw.position[1] <= settings.from_y_m[1]


def test_equal_seeds_give_equal_balls():
    first, second = (draw_throw(KINDS["thrown"], REACH, np.random.default_rng(9)) for _ in range(2))
    np.testing.assert_array_equal(first.velocity, second.velocity)


@pytest.mark.parametrize("mapping", [{}, None, {"thrown": {"x_m": [0, 1]}}])
def test_kinds_of_balls_that_are_none_are_refused(mapping):
    with pytest.raises((SimulationError, SettingsError)):
        build_throws(mapping, "here")


def test_a_ball_goes_when_the_robot_has_watched_for_a_while():
    play = session()
    assert play.step(0.0, None, NO_BALL) is None
    assert play.step(1.0, WATCHING, NO_BALL) is None
    assert play.step(1.2, FOLLOWING, NO_BALL) is None
    assert play.step(1.25, WATCHING, NO_BALL) is None
    assert play.step(1.5, WATCHING, NO_BALL) is None
    assert play.step(1.56, WATCHING, NO_BALL) is not None and play.released == 1


def test_a_robot_that_is_still_being_started_has_all_the_time():
    play = session()
    assert play.step(0.0, None, NO_BALL) is None and play.step(1000.0, None, NO_BALL) is None
    assert play.results == []


def test_a_session_ends_when_robot_and_referee_have_spoken_of_every_ball():
    play = session()
    play.step(0.0, WATCHING, NO_BALL)
    assert play.step(0.4, WATCHING, NO_BALL) is not None
    play.step(0.9, FOLLOWING, FLYING)
    play.step(1.4, FOLLOWING, CAUGHT)
    assert play.results == []
    play.step(2.4, said(CatchResult.CAUGHT, 1), CAUGHT)
    assert [result["verdict"] for result in play.results] == [CAUGHT] and not play.over
    # The next ball goes only when the robot watches again, and its old word does not count for it.
    play.step(3.0, RobotWord(CatchPhase.WATCHING, 1, CatchResult.CAUGHT), CAUGHT)
    assert play.step(3.4, RobotWord(CatchPhase.WATCHING, 1, CatchResult.CAUGHT), CAUGHT) is not None
    play.step(3.5, RobotWord(CatchPhase.WATCHING, 1, CatchResult.CAUGHT), MISSED)
    assert not play.over
    play.step(5.0, said(CatchResult.MISSED, 2), MISSED)
    assert play.over and not play.ok
    mapping = play.as_mapping()
    assert (mapping["caught"], [ball["ok"] for ball in mapping["balls"]]) == (1, [True, False])
    assert describe_ball(mapping["balls"][0]).startswith("CAUGHT: robot says CAUGHT")


@pytest.mark.parametrize("truth, word, ok", [
    (CAUGHT, CatchResult.CAUGHT, True), (CAUGHT, CatchResult.MISSED, False), (MISSED, CatchResult.CAUGHT, False),
    (MISSED, CatchResult.OUT_OF_REACH, False),
])
def test_a_ball_in_reach_must_be_caught_and_the_robot_must_know(truth, word, ok):
    play = session(throws=1)
    play.step(0.0, WATCHING, NO_BALL)
    play.step(0.4, WATCHING, NO_BALL)
    play.step(2.0, said(word, 1), truth)
    assert play.ok == ok


@pytest.mark.parametrize("word, moves, ok", [
    (CatchResult.OUT_OF_REACH, 0, True), (CatchResult.OUT_OF_REACH, 2, False), (CatchResult.MISSED, 0, False),
])
def test_a_ball_beyond_reach_must_be_called_so_without_a_move(word, moves, ok):
    play = session(throws=1, aim=BEYOND)
    play.step(0.0, WATCHING, NO_BALL)
    play.step(0.4, WATCHING, NO_BALL)
    play.step(2.0, said(word, 1, moves), MISSED)
    assert play.ok == ok


def test_a_robot_that_says_nothing_or_never_gets_ready_does_not_hold_the_session_up():
    play = session()
    play.step(0.0, WATCHING, NO_BALL)
    play.step(0.4, WATCHING, NO_BALL)
    play.step(8.5, FOLLOWING, FLYING)
    assert (play.results[0]["verdict"], play.results[0]["robot"]) == (MISSED, None)
    play.step(9.0, FOLLOWING, MISSED)
    play.step(14.1, FOLLOWING, MISSED)
    assert play.over and not play.ok and play.results[1]["verdict"] == NOT_THROWN and play.released == 1
    assert "robot says nothing" in describe_ball(play.results[1])
