"""The benchmark `catch`: its flights against the flights they are drawn from, its conditions, and its rows."""

from dataclasses import replace

import numpy as np
import pytest

from dr_eureka.bench import catch_curves, catch_prediction, catch_rates, catch_reach
from dr_eureka.bench.catch_flights import Step, draw_flight, follow
from dr_eureka.bench.catch_series import Outcome, Series, conditions_of, draw_ball, run_one, run_trial, throws_of
from dr_eureka.bench.report import BenchOptions
from dr_eureka.catching.ball_track import PAPER_THROWN
from dr_eureka.catching.catcher_settings import FALLING, THROWN, CatcherSettings
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.simulation.throws import load_throws

SAIKA, SETTINGS = SaikaSettings.load(), CatcherSettings.load()
PLANE = SETTINGS.stances[THROWN].plane


@pytest.fixture(scope="module")
def flight():
    return draw_flight(SAIKA, SETTINGS, seed=1, index=0)


def test_a_flight_ends_where_it_is_aimed_and_is_seen_by_both_cameras_in_turn(flight):
    np.testing.assert_allclose(flight.at(np.array([flight.time_s]))[0], flight.place, atol=1e-9)
    stamps = [view.time_s for view in flight.views]
    assert stamps == sorted(stamps) and stamps[-1] < flight.time_s
    for side in ("left", "right"):
        own = np.array([view.time_s for view in flight.views if view.side == side])
        np.testing.assert_allclose(np.diff(own), SAIKA.cameras.period_s, atol=1e-9)


def test_predictions_of_both_methods_come_from_the_fifth_point_on_and_end_near_the_truth(flight):
    for method in (SETTINGS.method, replace(SETTINGS.method, name=PAPER_THROWN)):
        steps = follow(flight, method, SAIKA, PLANE)
        assert steps[0].points >= 5 and steps[-1].points > 10
        assert steps[-1].place_m < 0.02 and steps[-1].time_s < 0.01


def test_rows_tell_medians_in_millimetres_and_milliseconds():
    steps = [Step(5, place, time, 0.01) for place, time in ((0.01, 0.001), (0.02, 0.002), (0.09, 0.009))]
    place, worst, time = catch_prediction._rows("x", steps)
    assert (place.value, place.unit, place.n) == (pytest.approx(20.0), "mm", 3)
    assert worst.value == pytest.approx(np.percentile([10, 20, 90], 90))
    assert (time.value, time.unit) == (pytest.approx(2.0), "ms")
    assert catch_prediction._rows("x", [])[0].value is None


def test_conditions_change_what_they_name_and_nothing_else():
    plain = conditions_of(Series(THROWN))
    assert (plain.saika, plain.world) == (SAIKA, plain.world)
    noisy = conditions_of(Series(THROWN, noise=10.0))
    assert noisy.world.sensor.centre_noise_px == pytest.approx(10.0 * plain.world.sensor.centre_noise_px)
    assert noisy.saika == SAIKA
    late = conditions_of(Series(THROWN, lag_s=0.03, latency_s=0.2))
    assert (late.saika.cameras.lag_s, late.latency_s) == (0.03, 0.2)
    slow = conditions_of(Series(THROWN, arm_speed=0.5))
    assert all(joint.speed == 0.5 * SAIKA.joints[name].speed for name, joint in slow.saika.joints.items())
    assert throws_of(Series(THROWN, flight_s=0.4)).flight_s == (0.4, 0.4)
    assert throws_of(Series(FALLING, drop_m=2.0)).from_z_m == (2.0, 2.0)
    assert throws_of(Series(THROWN)) == load_throws()[THROWN]


def test_shares_are_judged_by_their_goals(monkeypatch):
    def outcomes(series, options, count, label):
        return [Outcome(index > 0 or not series.feedback, "CAUGHT", 4, 3.5) for index in range(count)]

    monkeypatch.setattr(catch_rates, "run_series", outcomes)
    rows = {row.name: row for row in catch_rates._main_rows(THROWN, 0.95, BenchOptions(trials=10))}
    ours = rows["thrown, ours, feedback: caught"]
    assert (ours.value, ours.n, ours.ok) == (0.9, 10, False)
    assert rows["thrown, ours, feedback: robot and referee agree"].value == 0.9
    assert rows["thrown, ours, no feedback: caught"].value == 1.0
    assert rows["thrown, ours, feedback: largest joint speed"].value == 3.5


def test_equal_seeds_end_alike_to_the_last_digit_and_others_do_not():
    series = Series(THROWN, to_the_end=True)
    one, again, other = (run_trial(series, seed, 0, draw_ball(series, 1, 0)) for seed in (1, 1, 2))
    predicted, predicted_again, predicted_other = (trial.report.prediction for trial in (one, again, other))
    assert (one.verdict, one.joint_speed, one.report.moves) == (again.verdict, again.joint_speed, again.report.moves)
    assert predicted.time_s == predicted_again.time_s != predicted_other.time_s
    np.testing.assert_array_equal(predicted.position, predicted_again.position)


def test_balls_about_the_reach_come_down_in_it_and_all_about_it():
    stated, wide = load_throws()[FALLING], Series(FALLING, wide=True)
    places = np.array([draw_ball(wide, 1, index).aim for index in range(300)])
    assert places[:, 0].min() < stated.x_m[0] - 0.1 and places[:, 0].max() > stated.x_m[1] + 0.1
    assert places[:, 1].min() < stated.y_m[0] - 0.1 and places[:, 1].max() > stated.y_m[1] + 0.1
    np.testing.assert_allclose(places[:, 2], stated.height_m)


def test_the_area_in_which_balls_are_caught_is_the_share_of_the_area_over_which_they_were_drawn():
    inside, outside = (-0.2, 0.4), (0.1, 0.6)
    ends = ((True, "CAUGHT", inside), (True, "CAUGHT", outside), (False, "OUT_OF_REACH", outside), (False, "MISSED", inside))
    outcomes = [Outcome(caught, said, 0, 1.0, place) for caught, said, place in ends]
    area, within, told = catch_reach.rows_of(THROWN, outcomes, load_throws()[THROWN])
    assert area.value == pytest.approx(0.5 * 0.78 * 0.44) and area.interval95[0] < area.value < area.interval95[1]
    assert (within.value, within.n) == (0.5, 2)
    assert (told.value, told.n) == (0.5, 2)


def test_one_thrown_ball_is_caught_in_the_simulated_world():
    outcome = run_one(Series(THROWN, to_the_end=True), seed=1, index=0)
    assert outcome.caught and outcome.said == "CAUGHT" and outcome.moves > 5


def test_a_ball_that_no_camera_sees_ends_when_it_is_on_the_floor():
    series = Series(FALLING, to_the_end=True)
    throw = draw_ball(series, 1, 0)
    behind = replace(throw, position=throw.position * [1.0, -3.0, 1.0])
    trial = run_trial(series, 1, 0, behind)
    assert (trial.verdict, trial.report) == ("MISSED", None)


def test_every_row_has_a_name_of_its_own_and_curves_and_areas_are_drawn(monkeypatch, tmp_path):
    tried = []

    def outcomes(series, *_):
        tried.append(series)
        return [Outcome(True, "OUT_OF_REACH", 0, 1.0, (-0.2, 0.4))] * 4

    rows = []
    for part in (catch_rates, catch_reach, catch_curves):
        monkeypatch.setattr(part, "run_series", outcomes)
        rows += part.rows(BenchOptions(trials=4, out=tmp_path))
    names = [row.name for row in rows]
    assert len(set(names)) == len(names)
    assert {row.name: row.value for row in rows}["thrown beyond the reach: robot says OUT_OF_REACH"] == 1.0
    assert [row.name for row in rows if row.goal is not None and not row.ok] == []
    for file in ("catch_breakdown.png", "catch_reach.png"):
        assert (tmp_path / file).stat().st_size > 10_000
    asked = {THROWN: ("noise", "lag_s", "flight_s"), FALLING: ("noise", "lag_s", "drop_m")}
    for ball, condition in ((ball, condition) for ball, conditions in asked.items() for condition in conditions):
        changed = {(series.feedback, getattr(series, condition)) for series in tried if series.ball == ball}
        assert len({value for feedback, value in changed if feedback}) >= 5
        assert {value for feedback, value in changed if feedback} == {value for feedback, value in changed if not feedback}
