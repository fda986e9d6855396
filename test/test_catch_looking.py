"""A robot that looks at its own hand, and a ball measured at known places: what the benchmark `catch` builds on."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from dr_eureka.bench import catch_localisation, catch_looking, catch_places
from dr_eureka.bench.catch_looking import ErringSaika
from dr_eureka.bench.catch_places import draw_place, in_camera, measure, pixel_of
from dr_eureka.catching.localisation import rig_at
from dr_eureka.catching.saika import SaikaArm, SaikaHead
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.catching.unique_postures import PostureChooser
from dr_eureka.catching.working_area import WorkingArea
from dr_eureka.simulation.saika_settings import SaikaWorldSettings

SETTINGS = SaikaSettings.load()
WORLD = SaikaWorldSettings.load()
ARM = SaikaArm(SETTINGS)
PLACES = WorkingArea(SETTINGS.working_area, ARM).draw(40, np.random.default_rng(1))
POSTURES = PostureChooser(ARM).joints(PLACES)
RIG = rig_at(SETTINGS, SaikaHead(SETTINGS))


def test_a_robot_without_errors_sees_its_hand_where_the_model_has_it(monkeypatch):
    monkeypatch.setattr(catch_looking, "_OFFSET_RAD", 0.0)
    monkeypatch.setattr(catch_looking, "_BACKLASH_RAD", 0.0)
    looked = ErringSaika(SETTINGS, 1).look_at_hand(POSTURES)
    assert looked.unseen == 0
    assert np.linalg.norm(looked.samples.positions - PLACES, axis=1).max() < 0.003


def test_hidden_errors_move_the_hand_by_what_the_jacobian_says():
    saika = ErringSaika(SETTINGS, 2)
    moved = saika.hand(POSTURES) - PLACES
    flat = np.hstack([POSTURES, np.zeros((len(POSTURES), 1))])
    expected = ARM.chain.jacobian(flat)[:, :3, :4] @ saika._offsets
    assert 0.003 < np.linalg.norm(moved, axis=1).mean() < 0.08
    assert np.linalg.norm(moved - expected, axis=1).mean() < 0.5 * np.linalg.norm(moved, axis=1).mean()


def test_eyes_and_hand_share_the_necks_error_so_that_learning_by_looking_cancels_it():
    saika = ErringSaika(SETTINGS, 3)
    seen = saika.look_at_hand(POSTURES).samples.positions
    again = saika.as_seen(saika.hand(POSTURES))
    beside_the_truth = np.linalg.norm(again - saika.hand(POSTURES), axis=1)
    assert np.nanmean(np.linalg.norm(seen - again, axis=1)) < 0.5 * np.nanmean(beside_the_truth)


def test_drawn_places_are_whole_in_both_views():
    rng = np.random.default_rng(4)
    for _ in range(50):
        place = draw_place(SETTINGS, RIG, (0.3, 0.8), True, rng)
        depth = in_camera(RIG.left, place)[2]
        radius = 0.5 * SETTINGS.ball_diameter_m * SETTINGS.cameras.focal_px / depth
        assert 0.3 <= depth <= 0.8
        for eye in (RIG.left, RIG.right):
            column, row = pixel_of(eye, place)
            assert radius < column < SETTINGS.cameras.width - radius and radius < row < SETTINGS.cameras.height - radius


def test_rendered_balls_are_measured_within_the_papers_errors():
    world = dataclasses.replace(WORLD, sensor=dataclasses.replace(WORLD.sensor, renderer="tiny"))
    constant = SETTINGS.cameras.baseline_m * SETTINGS.cameras.focal_px
    for place in measure(SETTINGS, world, (0.4, 0.8), 2, 5, both=True):
        assert place.depth_by_parallax_m == pytest.approx(place.depth_m, abs=0.003)
        assert place.depth_by_size_m == pytest.approx(place.depth_m, abs=0.005)
        assert place.parallax_px == pytest.approx(constant / place.depth_m, abs=0.5)
        assert place.extra == 0


def test_a_lag_spoils_the_parallax_of_thrown_balls_but_not_of_falling_ones(monkeypatch):
    monkeypatch.setattr(catch_localisation, "_FLIGHTS", 40)
    rows = {row.name: row.value for row in catch_localisation._lag_rows(SETTINGS, WORLD, 1)}
    assert rows["falling ball, parallax, lag 33 ms: error in depth"] < 1.0
    assert rows["thrown ball, parallax, lag 33 ms: error in depth"] > 50.0
    assert rows["thrown ball, size, any lag: error in depth"] < 10.0
