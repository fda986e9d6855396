"""The benchmark `pour`: its kinds, its rows, and one real round trip of a pour on the rig."""

import numpy as np
import pytest

from dr_eureka.bench.pour import TABLE_2, as_pour_trials, rows_of, wide_rows
from dr_eureka.bench.pour_places import located_feet, nominal_feet, scattered
from dr_eureka.bench.pour_plots import _beside
from dr_eureka.bench.pour_rig import PourKind, PourRig
from dr_eureka.bench.pour_rounds import CONTROL, Trial, direct_kinds, fewer_kinds, lock_kinds
from dr_eureka.bench.pour_spread import NONE, STATED, mistimed
from dr_eureka.control.settings import ControlSettings
from dr_eureka.game.hands import HANDS
from dr_eureka.game.state import TUBES
from dr_eureka.pieces import load_pieces
from dr_eureka.resources import load_yaml
from dr_eureka.simulation.placement import draw_placement
from dr_eureka.simulation.settings import load_camera_settings, load_world_settings
from dr_eureka.simulation.stage import Stage
from dr_eureka.vision.tubes import TubeSettings

SETTINGS = ControlSettings.from_mapping(load_yaml(CONTROL), CONTROL)


def trial(kind, arrived=None, lost=0, code="OK", seconds=0.7):
    return Trial(kind, 0.01, code, kind.count if arrived is None else arrived, lost, seconds)


def row(rows, name):
    return next(row for row in rows if row.name == name)


def test_all_pours_of_table_2_and_all_locks_that_six_balls_allow_are_tried():
    kinds = direct_kinds("linear", "left")
    assert [(kind.held, kind.count) for kind in kinds[:6]] == list(TABLE_2)
    assert {(kind.held, kind.count) for kind in kinds[6:]} == {(4, 4), (3, 3), (2, 2), (1, 1)}
    locks = {(kind.hand, kind.held, kind.in_target) for kind in lock_kinds()}
    assert locks == {
        (hand, held, there)
        for hand in ("left", "right") for held in (1, 2, 3, 4) for there in (0, 1, 2, 3) if held + there <= 6
    }


def test_the_wide_spread_tries_every_lock_pour_within_eight_rounds():
    tried = [kind for number in range(8) for kind in fewer_kinds(number)]
    assert set(kind for kind in tried if kind.method == "lock") == set(lock_kinds())
    assert {(kind.held, kind.count) for kind in fewer_kinds(3) if kind.method == "linear"} == set(TABLE_2)


def test_tubes_that_stand_beside_their_places_are_located_by_the_robots_camera():
    world, camera, pieces = scattered(load_world_settings(), STATED), load_camera_settings(), load_pieces()
    stage = Stage(camera.renderer)
    try:
        seen = located_feet(world, 5, pieces, camera, TubeSettings.load(), stage)
    finally:
        stage.close()
    true, nominal = draw_placement(world, 5, np.zeros(3)).tubes, nominal_feet(world)
    assert seen.keys() == set(TUBES)
    for hand in HANDS:
        beside = np.abs(true[hand] - nominal[hand])[:2]
        assert beside.max() <= STATED.placement and beside.max() > 0.0015
        assert np.linalg.norm(seen[hand] - true[hand]) < 0.0015


def test_the_camera_beside_stands_level_before_the_robot_square_to_the_pour():
    pose, place = _beside(SETTINGS.pour_place), SETTINGS.pour_place
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    pours_towards = np.array([np.cos(place.plane_yaw), -np.sin(place.plane_yaw), 0.0])
    assert pose[:3, :3].T @ pours_towards == pytest.approx([-1.0, 0.0, 0.0])
    mouth = np.linalg.inv(pose) @ [*place.target_mouth, 1.0]
    assert mouth == pytest.approx([0.0, 0.0, 0.35, 1.0]) and pose[0, 3] > place.target_mouth[0] + 0.3


def test_rows_count_what_went_right_beside_the_paper():
    three_of_four = PourKind("linear", "left", 4, 3, 0)
    trials = [trial(three_of_four)] * 7 + [trial(three_of_four, arrived=4)] * 2 + [trial(three_of_four, lost=1)]
    trials += [trial(PourKind("profiled", "right", 4, 1, 0), seconds=0.6), trial(PourKind("lock", "left", 1, 1, 3))]
    rows = rows_of(trials)
    linear = row(rows, "linear: 3 of 4")
    assert (linear.value, linear.n, linear.paper, linear.ok) == (0.7, 10, 0.8, False)
    assert row(rows, "lock from the left: 1 of 1 into 3").ok
    assert row(rows, "profiled: ready to ready, simulated time").value == pytest.approx(0.6)
    assert (row(rows, "balls lost").value, row(rows, "balls lost").ok) == (1, False)
    assert row(wide_rows(trials), "wide spread: linear: 3 of 4").value == 0.7


def test_a_pour_that_was_refused_is_not_right_and_named():
    kind = PourKind("profiled", "left", 2, 1, 0)
    refused = Trial(kind, 0.0, "TUBE_SLIPPED")
    rows = rows_of([refused, trial(kind)])
    assert row(rows, "profiled: 1 of 2").value == 0.5
    assert row(rows, "refused or broken off: TUBE_SLIPPED").value == 0.5
    assert [(told.poured, told.lost) for told in as_pour_trials([refused, trial(kind)])] == [(1, 0)]


def test_a_pour_that_was_broken_off_is_not_right_and_what_became_of_its_balls_counts():
    kind = PourKind("lock", "left", 2, 1, 3)
    slipped = [trial(kind, code="TUBE_SLIPPED"), trial(kind, arrived=-3, lost=5, code="TUBE_SLIPPED")]
    rows = rows_of(slipped)
    assert row(rows, "lock from the left: 1 of 2 into 3").value == 0.0
    assert row(rows, "balls lost").value == 5
    assert row(rows, "refused or broken off: TUBE_SLIPPED").value == 1.0
    assert [(told.poured, told.lost) for told in as_pour_trials(slipped)] == [(1, 0), (0, 2)]


def test_timing_errors_stay_within_the_spread_and_differ_from_trial_to_trial():
    rng = np.random.default_rng(3)
    shifts = []
    for _ in range(50):
        late = mistimed(SETTINGS, STATED, rng, 4, 3)
        frames = zip(late.lock_pour.keyframes, SETTINGS.lock_pour.keyframes)
        shifts += [ours.seconds - theirs.seconds for ours, theirs in frames]
        shifts += [late.profiled_pour.dip_seconds[k] - SETTINGS.profiled_pour.dip_seconds[k] for k in range(4)]
        turns = [settings.linear_pour.step_seconds * settings.linear_pour.return_steps[4][3] for settings in (late, SETTINGS)]
        shifts.append(turns[0] - turns[1])
    assert max(map(abs, shifts)) <= STATED.timing and np.std(shifts) == pytest.approx(STATED.timing / np.sqrt(3.0), rel=0.15)
    assert mistimed(SETTINGS, NONE, rng, 4, 3) == SETTINGS


def test_pours_on_the_rig_share_a_grasp_move_just_the_balls_meant_and_repeat():
    rig = PourRig(SETTINGS, load_world_settings(), load_pieces(), NONE, 3, Stage(None))
    kind = PourKind("profiled", "left", 4, 2, 1)
    first = rig.pour(kind)
    assert (first.arrived, first.lost) == (2, 0) and first.seconds < 0.8
    end = rig.world.tube_pose("left")
    rig.pour(PourKind("profiled", "left", 3, 1, 0))
    assert rig.pour(kind) == first
    # Bullet remembers how hard things pressed on one another a little differently.
    np.testing.assert_allclose(rig.world.tube_pose("left"), end, atol=1e-3)
