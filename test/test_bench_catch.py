"""The benchmark `catch`: its flights against the flights they are drawn from, its conditions, and its rows."""

from dataclasses import replace

import numpy as np
import pytest

from dr_eureka.bench import catch_prediction, catch_rates
from dr_eureka.bench.catch_flights import Step, draw_flight, follow
from dr_eureka.bench.catch_rates import Outcome, Series, conditions_of, run_one, throws_of
from dr_eureka.bench.report import BenchOptions
from dr_eureka.catching.ball_track import PAPER_THROWN
from dr_eureka.catching.catcher_settings import THROWN, CatcherSettings
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
    assert throws_of(Series(THROWN)) == load_throws()[THROWN]


def test_shares_are_judged_by_their_goals(monkeypatch):
    def outcomes(series, seed, count, processes, label):
        return [Outcome(index > 0 or not series.feedback, "CAUGHT", 4, 3.5) for index in range(count)]

    monkeypatch.setattr(catch_rates, "run_series", outcomes)
    rows = {row.name: row for row in catch_rates._main_rows(THROWN, 0.95, BenchOptions(trials=10))}
    ours = rows["thrown, ours, feedback: caught"]
    assert (ours.value, ours.n, ours.ok) == (0.9, 10, False)
    assert rows["thrown, ours, feedback: robot and referee agree"].value == 0.9
    assert rows["thrown, ours, no feedback: caught"].value == 1.0
    assert rows["thrown, ours, feedback: largest joint speed"].value == 3.5


def test_one_thrown_ball_is_caught_in_the_simulated_world():
    outcome = run_one(Series(THROWN, to_the_end=True), seed=1, index=0)
    assert outcome.caught and outcome.said == "CAUGHT" and outcome.moves > 5


def test_every_row_of_the_rates_has_a_name_of_its_own_and_the_curves_are_drawn(monkeypatch, tmp_path):
    monkeypatch.setattr(catch_rates, "run_series", lambda series, *_: [Outcome(True, "OUT_OF_REACH", 0, 1.0)] * 4)
    rows = catch_rates.rows(BenchOptions(trials=4, out=tmp_path))
    names = [row.name for row in rows]
    assert len(set(names)) == len(names)
    assert {row.name: row.value for row in rows}["thrown beyond the reach: robot says OUT_OF_REACH"] == 1.0
    assert [row.name for row in rows if row.goal is not None and not row.ok] == []
    assert (tmp_path / "catch_breakdown.png").stat().st_size > 10_000
