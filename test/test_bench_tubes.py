"""The benchmark `tubes`: its rows against figures worked out by hand, and one scene of each series judged for real."""

import numpy as np
import pytest

from dr_eureka.bench.tubes import contents_rows, place_rows
from dr_eureka.bench.tubes_scenes import APART_M, APART_RAD, SERIES, Eyes, Trial, judge, take_shot
from dr_eureka.simulation.settings import load_camera_settings
from dr_eureka.simulation.stage import Stage
from dr_eureka.vision.tubes import TubeResult


def trial(index=0, result="OK", errors=(0.1, 0.2, 0.3), state="RR|GG|PP", contents="OK", read="RR|GG|PP"):
    located = result == TubeResult.OK
    return Trial(
        index, result, "", errors if located else None, (0.3,) * 3 if located else (), state, contents if located else "",
        read if located else None, 0.5, 40.0, 5.0,
    )


def by_name(rows):
    return {row.name: row for row in rows}


def test_place_rows_count_what_was_located_and_judge_the_errors():
    hidden = trial(result="TUBE_HIDDEN")
    rows = by_name(place_rows("s", [trial(), trial(errors=(1.0, 2.0, 6.0)), hidden, hidden]))
    assert rows["s: three tubes located"].value == 0.5
    assert rows["s: result TUBE_HIDDEN"].value == 0.5
    mean, p99 = rows["s: error of a tube's axis"], rows["s: error, 99th percentile"]
    assert (mean.value, mean.n, mean.ok) == (pytest.approx((0.2 + 3.0) / 2), 2, False)
    assert (p99.value, p99.n, p99.ok) == (pytest.approx(np.percentile([0.1, 0.2, 0.3, 1, 2, 6], 99)), 6, False)
    assert rows["s: processor time to locate, median"].value == 40.0
    assert rows["s: processor time of a frame, median"].value == 45.0


def test_place_rows_of_nothing_located_are_short_of_the_goal():
    rows = by_name(place_rows("s", [trial(result="NO_SHEET")]))
    assert (rows["s: error of a tube's axis"].value, rows["s: error of a tube's axis"].ok) == (None, False)
    assert "s: error, 99th percentile" not in rows


def test_a_state_that_was_not_read_is_neither_right_nor_wrong():
    unsure, wrong = trial(contents="UNSURE", read=None), trial(read="RR|GP|GP")
    rows = by_name(contents_rows("s", [trial(), unsure, wrong, trial(result="NO_SHEET")]))
    exact, other = rows["s: exact state of three tubes"], rows["s: another state than the true one"]
    assert (exact.value, exact.n, exact.ok) == (0.25, 4, False)
    assert (other.value, other.n, other.ok) == (0.25, 4, False)
    assert rows["s: contents UNSURE"].value == 0.25


def test_a_series_that_is_not_judged_has_no_goal_for_its_states():
    row = by_name(contents_rows("s", [trial()], judged=False))["s: exact state of three tubes"]
    assert (row.value, row.goal, row.ok) == (1.0, None, None)


@pytest.fixture(scope="module")
def stage():
    stage = Stage(load_camera_settings().renderer)
    yield stage
    stage.close()


@pytest.mark.parametrize("series", SERIES[1:], ids=lambda series: series.name)
def test_a_scene_of_each_series_is_drawn_as_promised_and_seen_through(stage, series):
    shot = take_shot(stage, series, seed=1, index=3)
    gaps = [np.linalg.norm(a - b) for i, a in enumerate(shot.feet) for b in shot.feet[:i]]
    directions = np.arctan2(shot.feet[:, 1], shot.feet[:, 0])
    assert min(gaps) > APART_M - 1e-3 and np.abs(np.diff(directions)).min() > APART_RAD - 1e-3
    assert shot.camera.is_distorted == series.distorted
    judged = judge(Eyes.load(), shot, 3)
    assert (judged.result, judged.contents, judged.right) == ("OK", "OK", True)
    assert max(judged.errors_mm) < 1.0


def test_a_scene_is_the_same_whatever_was_drawn_on_its_stage_before(stage):
    after_others = take_shot(stage, SERIES[1], seed=1, index=5)
    new = Stage(load_camera_settings().renderer)
    alone = take_shot(new, SERIES[1], seed=1, index=5)
    new.close()
    np.testing.assert_array_equal(alone.image, after_others.image)
    np.testing.assert_array_equal(alone.feet, after_others.feet)
    assert alone.state == after_others.state
