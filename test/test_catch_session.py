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


def word(time_s, phase, balls=0, result="", moves=0):
    return RobotWord(time_s, phase, balls, result, "", moves)


def watching(time_s, balls=0, result=""):
    return word(time_s, CatchPhase.WATCHING, balls, result)


def following(time_s):
    return word(time_s, CatchPhase.FOLLOWING)


def said(time_s, result, balls, moves=3):
    return word(time_s, CatchPhase.GETTING_READY, balls, result, moves)


def go_on(play, now_s, verdict, *words):
    """Have the session hear the words, and go on."""
    for each in words:
        play.hear(each)
    return play.step(now_s, verdict)


def flying(throws=1, aim=REACH):
    """Return a session whose first ball was let go at 0.4 s."""
    play = session(throws, aim)
    assert go_on(play, 0.0, NO_BALL, watching(0.0)) is None
    assert go_on(play, 0.4, NO_BALL) is not None
    return play


def session(throws=2, aim=REACH):
    return CatchSession(throws, aim, KINDS["thrown"], SessionSettings(5.0, 0.3, 8.0), np.random.default_rng(1))


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
    assert go_on(play, 0.0, NO_BALL) is None
    assert go_on(play, 1.0, NO_BALL, watching(1.0)) is None
    assert go_on(play, 1.2, NO_BALL, following(1.2)) is None
    assert go_on(play, 1.25, NO_BALL, watching(1.25)) is None
    assert go_on(play, 1.5, NO_BALL, watching(1.5)) is None
    assert go_on(play, 1.56, NO_BALL) is not None and play.released == 1


@pytest.mark.parametrize("delay_s", [0.0, 0.008, 0.1, 0.25])
def test_when_a_ball_goes_does_not_depend_on_how_fast_words_travel(delay_s):
    words = [following(0.0), watching(1.0), following(1.4), said(2.0, CatchResult.CAUGHT, 1), watching(2.5, 1)]
    play, released_s = session(), []
    for cycle in range(500):
        now_s = 0.008 * cycle
        while words and words[0].time_s + delay_s <= now_s:
            play.hear(words.pop(0))
        if play.step(now_s, FLYING if play.released and now_s < 1.8 else CAUGHT) is not None:
            released_s.append(round(now_s, 3))
    assert released_s == [1.304, 2.8]


def test_a_robot_that_is_still_being_started_has_all_the_time():
    play = session()
    assert go_on(play, 0.0, NO_BALL) is None and go_on(play, 1000.0, NO_BALL) is None
    assert play.results == []


def test_a_session_ends_when_robot_and_referee_have_spoken_of_every_ball():
    play = flying(throws=2)
    go_on(play, 0.9, FLYING, following(0.9))
    go_on(play, 1.4, CAUGHT, following(1.4))
    assert play.results == []
    go_on(play, 2.4, CAUGHT, said(2.4, CatchResult.CAUGHT, 1))
    assert [result["verdict"] for result in play.results] == [CAUGHT] and not play.over
    # The next ball goes only when the robot watches again, and its old word does not count for it.
    go_on(play, 3.0, CAUGHT, watching(3.0, 1, CatchResult.CAUGHT))
    assert go_on(play, 3.4, CAUGHT, watching(3.4, 1, CatchResult.CAUGHT)) is not None
    go_on(play, 3.5, MISSED, watching(3.5, 1, CatchResult.CAUGHT))
    assert not play.over
    go_on(play, 5.0, MISSED, said(5.0, CatchResult.MISSED, 2))
    assert play.over and not play.ok
    mapping = play.as_mapping()
    assert (mapping["caught"], [ball["ok"] for ball in mapping["balls"]]) == (1, [True, False])
    assert describe_ball(mapping["balls"][0]).startswith("CAUGHT: robot says CAUGHT")


@pytest.mark.parametrize("truth, result, ok", [
    (CAUGHT, CatchResult.CAUGHT, True), (CAUGHT, CatchResult.MISSED, False), (MISSED, CatchResult.CAUGHT, False),
    (MISSED, CatchResult.OUT_OF_REACH, False),
])
def test_a_ball_in_reach_must_be_caught_and_the_robot_must_know(truth, result, ok):
    play = flying()
    go_on(play, 2.0, truth, said(2.0, result, 1))
    assert play.ok == ok


@pytest.mark.parametrize("result, moves, ok", [
    (CatchResult.OUT_OF_REACH, 0, True), (CatchResult.OUT_OF_REACH, 2, False), (CatchResult.MISSED, 0, False),
])
def test_a_ball_beyond_reach_must_be_called_so_without_a_move(result, moves, ok):
    play = flying(aim=BEYOND)
    go_on(play, 2.0, MISSED, said(2.0, result, 1, moves))
    assert play.ok == ok


def test_a_robot_that_says_nothing_or_never_gets_ready_does_not_hold_the_session_up():
    play = flying(throws=2)
    go_on(play, 8.5, FLYING, following(8.5))
    assert (play.results[0]["verdict"], play.results[0]["robot"]) == (MISSED, None)
    go_on(play, 9.0, MISSED, following(9.0))
    go_on(play, 14.1, MISSED, following(14.1))
    assert play.over and not play.ok and play.results[1]["verdict"] == NOT_THROWN and play.released == 1
    assert "robot says nothing" in describe_ball(play.results[1])
