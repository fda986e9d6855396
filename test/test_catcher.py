"""The catcher's decisions in a world without physics: where the basket goes, when, and what it says of each ball."""

from dataclasses import replace

import numpy as np
import pytest
from catch_stand_in import ARM, CYCLE_S, NETWORK, SETTINGS, StandIn, thrown_to

from dr_eureka.catching.arm_network import OutOfReachError
from dr_eureka.catching.ball_track import TWO_BALLS, View
from dr_eureka.catching.catch_report import CatchPhase, CatchReason, CatchResult
from dr_eureka.catching.catcher_settings import CONFIG, CatcherSettings, checked
from dr_eureka.catching.prediction import PredictionReason
from dr_eureka.catching.seen_ball import SeenBall
from dr_eureka.settings import SettingsError

THROWN, FALLING = (SETTINGS.stances[ball] for ball in ("thrown", "falling"))
PLACE = np.array([-0.35, 0.42, THROWN.height_m])


def moved(stand_in):
    """Return how far the arm's goals went from where it waits [rad]."""
    return float(np.abs(np.array(stand_in.goals) - stand_in.catcher.waiting.joints[2:7]).max())


def test_the_basket_goes_under_a_thrown_ball_and_the_ball_in_it_is_a_catch():
    stand_in = StandIn()
    report = stand_in.run(lambda t: [thrown_to(PLACE).at(t)], in_basket=True)
    assert (report.result, report.reason) == (CatchResult.CAUGHT, "")
    np.testing.assert_allclose(report.prediction.position, PLACE, atol=1e-3)
    assert report.moves > 5 and report.late_m < 0.005


def test_pictures_that_come_late_do_not_hide_the_ball_in_the_basket():
    report = StandIn(latency_s=0.2).run(lambda t: [thrown_to(PLACE).at(t)], in_basket=True)
    assert (report.result, report.reason) == (CatchResult.CAUGHT, "")


def test_the_basket_is_there_before_the_ball_comes():
    flight, stand_in = thrown_to(PLACE), StandIn()
    places = []

    def watched(elapsed_s):
        places.append((elapsed_s, stand_in.basket))
        return [flight.at(elapsed_s)]

    stand_in.run(watched)
    there = next(place for elapsed_s, place in places if elapsed_s > 0.68)
    np.testing.assert_allclose(there, PLACE, atol=0.005)


def test_a_ball_that_is_not_in_the_basket_was_missed():
    report = StandIn().run(lambda t: [thrown_to(PLACE).at(t)])
    assert (report.result, report.reason) == (CatchResult.MISSED, CatchReason.NOT_IN_BASKET)


def test_a_ball_faster_than_the_arm_was_missed_because_the_basket_was_late():
    report = StandIn(arm_speed_share=0.1).run(lambda t: [thrown_to((-0.44, 0.33, THROWN.height_m)).at(t)] if t > 0.3 else [])
    assert (report.result, report.reason) == (CatchResult.MISSED, CatchReason.TOO_LATE)


def test_a_falling_ball_is_caught_by_both_methods_that_know_how():
    above = np.array([-0.25, 0.43, FALLING.height_m + 0.85])
    for method in ("ballistic", "paper_falling"):
        stand_in = StandIn("falling", method=method)
        report = stand_in.run(lambda t: [above - [0.0, 0.0, 0.5 * 9.80665 * t * t]], in_basket=True)
        assert report.result == CatchResult.CAUGHT, method
        np.testing.assert_allclose(report.prediction.position, [*above[:2], FALLING.height_m], atol=0.003)


def test_the_paper_s_fit_refuses_a_falling_ball_and_nothing_moves():
    stand_in = StandIn("falling", method="paper_thrown")
    report = stand_in.run(lambda t: [np.array([-0.25, 0.43, 0.65 - 0.5 * 9.80665 * t * t])])
    assert (report.result, report.reason) == (CatchResult.NOT_PREDICTED, PredictionReason.DEPTH_CONSTANT)
    assert moved(stand_in) < 1e-9


def test_without_feedback_the_basket_is_sent_once():
    report = StandIn(feedback=False).run(lambda t: [thrown_to(PLACE).at(t)])
    assert report.moves == 1


def test_a_prediction_that_is_unsure_moves_the_basket_part_of_the_way_only():
    waiting = np.array(THROWN.ready_m)
    # Five points leave the depth unsure, and know where the ball goes sideways.
    for away, least, most in ((np.array([0.0, 0.08, 0.0]), 0.3, 0.9), (np.array([0.1, 0.0, 0.0]), 0.95, 1.0)):
        flight, stand_in, baskets = thrown_to(waiting + away), StandIn(feedback=False), []

        def watched(elapsed_s):
            baskets.append(stand_in.basket)
            return [flight.at(elapsed_s)]

        stand_in.run(watched)
        share = np.dot(baskets[int(0.69 * 60)] - waiting, away) / np.dot(away, away)
        assert least < share < most


@pytest.mark.parametrize(
    "place", [(0.6, 0.4, -0.30), (-0.2, 1.1, -0.30), (-1.0, 0.4, -0.30)], ids=["right", "short", "left"]
)
def test_a_ball_out_of_reach_is_called_so_and_the_arm_stays(place):
    stand_in = StandIn()
    report = stand_in.run(lambda t: [thrown_to(place).at(t)])
    assert (report.result, report.moves) == (CatchResult.OUT_OF_REACH, 0)
    assert moved(stand_in) < 1e-9


@pytest.mark.parametrize("in_basket, result", [(True, CatchResult.CAUGHT), (False, CatchResult.OUT_OF_REACH)])
def test_a_ball_that_turns_out_to_be_beyond_reach_is_looked_for_in_the_basket_that_was_sent(in_basket, result):
    stand_in, places = StandIn(), []

    class OnceInReach:
        """The network, for which every place but the first is out of reach."""

        def joints(self, position):
            places.append(position)
            if len(places) > 2:
                raise OutOfReachError("beyond")
            return NETWORK.joints(position)

    stand_in.catcher._inverse = OnceInReach()
    report = stand_in.run(lambda t: [thrown_to(PLACE).at(t)], in_basket)
    assert (report.result, report.moves) == (result, 1)


def test_joints_keep_their_speed_limits_and_a_ball_is_carried_slowly():
    stand_in = StandIn()
    stand_in.run(lambda t: [thrown_to(PLACE).at(t)], in_basket=True)
    speeds = np.abs(np.diff(stand_in.goals, axis=0)).max(axis=1) / CYCLE_S
    assert 1.0 < speeds.max() <= ARM.speed.max() + 1e-9
    judging = int((0.1 + 0.7 + SETTINGS.judging.after_s) / CYCLE_S) + 3
    assert 0.1 < speeds[judging:].max() <= SETTINGS.judging.carry_share * ARM.speed.max() + 1e-9


def test_a_ball_that_leaves_the_view_before_the_fifth_point_moves_nothing():
    stand_in = StandIn()
    report = stand_in.run(lambda t: [thrown_to(PLACE).at(t)] if t < 0.06 else [])
    assert (report.result, report.reason) == (CatchResult.NOT_PREDICTED, PredictionReason.TOO_FEW_POINTS)
    assert moved(stand_in) < 1e-9 and report.prediction is None


def test_a_ball_that_leaves_the_view_later_is_caught_by_the_last_prediction():
    report = StandIn().run(lambda t: [thrown_to(PLACE).at(t)] if t < 0.35 else [], in_basket=True)
    assert report.result == CatchResult.CAUGHT
    np.testing.assert_allclose(report.prediction.position, PLACE, atol=2e-3)


def test_two_balls_at_once_move_nothing():
    stand_in = StandIn()
    report = stand_in.run(lambda t: [thrown_to(PLACE).at(t), thrown_to((-0.1, 0.42, -0.3), start=(-0.4, 2.0, 0.1)).at(t)])
    assert (report.result, report.reason) == (CatchResult.NOT_PREDICTED, TWO_BALLS)
    assert moved(stand_in) < 1e-9


def test_a_second_ball_does_not_lead_away_from_the_first():
    other = thrown_to((0.0, 0.42, -0.3), start=(-0.4, 2.0, 0.4))
    report = StandIn().run(lambda t: [thrown_to(PLACE).at(t)] + ([other.at(t - 0.15)] if t > 0.15 else []), in_basket=True)
    assert report.result == CatchResult.CAUGHT
    np.testing.assert_allclose(report.prediction.position, PLACE, atol=2e-3)


def test_an_outlier_does_not_move_the_basket_away():
    def wrong_once(view):
        if view.balls and 0.45 < view.time_s < 0.465:
            return replace(view, balls=(SeenBall((20.0, 30.0), 90.0, 0.5),))
        return view

    clean, spoilt = StandIn(), StandIn(alter=wrong_once)
    for stand_in in (clean, spoilt):
        stand_in.run(lambda t: [thrown_to(PLACE).at(t)])
    assert spoilt.catcher.refusals[PredictionReason.OUTLIER] == 1
    count = min(len(clean.goals), len(spoilt.goals))
    assert np.abs(np.array(clean.goals[:count]) - np.array(spoilt.goals[:count])).max() < 0.05


def test_views_without_a_time_or_from_the_past_are_refused_by_name():
    def stamped_wrongly(view):
        stamp = {0: view.time_s, 1: float("nan"), 2: 0.0}[int(view.time_s * 60.0) % 3]
        return replace(view, time_s=stamp)

    stand_in = StandIn(alter=stamped_wrongly)
    report = stand_in.run(lambda t: [thrown_to(PLACE).at(t)])
    refusals = stand_in.catcher.refusals
    assert refusals[PredictionReason.NOT_FINITE] > 5 and refusals[PredictionReason.STAMP_NOT_RISING] > 5
    # The third of the views that is left tells the path.
    np.testing.assert_allclose(report.prediction.position, PLACE, atol=2e-3)
    assert np.abs(np.diff(stand_in.goals, axis=0)).max() <= ARM.speed.max() * CYCLE_S + 1e-9


def test_views_none_of_which_has_a_time_move_nothing_and_are_counted_by_name():
    stand_in = StandIn(alter=lambda view: replace(view, time_s=float("nan")))
    assert stand_in.run(lambda t: [thrown_to(PLACE).at(t)], limit_s=1.0) is None
    assert (stand_in.catcher.phase, set(stand_in.catcher.refusals)) == (CatchPhase.WATCHING, {PredictionReason.NOT_FINITE})
    assert moved(stand_in) < 1e-9


def test_a_seen_ball_without_size_or_place_is_refused_by_name():
    nowhere, nothing = SeenBall((float("nan"), 1.0), 30.0, 1.0), SeenBall((9.0, 9.0), 0.0, 1.0)
    for ball, reason in ((nowhere, "NOT_FINITE"), (nothing, "NOT_A_SIZE")):
        stand_in = StandIn(alter=lambda view: replace(view, balls=(ball,) if view.balls else ()))
        report = stand_in.run(lambda t: [thrown_to(PLACE).at(t)])
        assert (report.result, report.reason) == (CatchResult.NOT_PREDICTED, reason)
        assert moved(stand_in) < 1e-9


def test_it_gets_ready_again_and_catches_the_next_ball():
    stand_in = StandIn()
    first = stand_in.run(lambda t: [thrown_to(PLACE).at(t)])
    for _ in range(500):
        stand_in.now_s += CYCLE_S
        stand_in.advance()
    assert stand_in.catcher.phase == CatchPhase.WATCHING
    second = stand_in.run(lambda t: [thrown_to((-0.1, 0.38, THROWN.height_m)).at(t)], in_basket=True)
    assert [first.result, second.result] == [CatchResult.MISSED, CatchResult.CAUGHT]


def test_after_a_gap_between_joint_states_the_arm_does_not_leap():
    stand_in = StandIn()
    flight = thrown_to(PLACE)
    stand_in.run(lambda t: [flight.at(t)], limit_s=0.25)
    stand_in.now_s += 3.0
    before = stand_in.joints.copy()
    stand_in.advance()
    np.testing.assert_allclose(stand_in.goals[-1], before[2:7], atol=1e-9)


def test_balls_seen_before_it_is_ready_are_not_followed():
    stand_in = StandIn()
    stand_in.catcher.see(View(0.0, "left", (SeenBall((320.0, 240.0), 30.0, 1.0),), np.eye(4)))
    assert stand_in.catcher.phase == CatchPhase.GETTING_READY and stand_in.catcher.track is None


def test_the_shipped_settings_have_a_stance_for_each_kind_of_ball():
    settings = CatcherSettings.load()
    assert set(settings.stances) == {"thrown", "falling"}
    with pytest.raises(SettingsError, match="stances"):
        checked(replace(settings, stances={"thrown": settings.stances["thrown"]}), CONFIG)
