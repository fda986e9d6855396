"""Balls found in pictures whose truth is exact geometry, and in the simulator's."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from ball_pictures import ball_picture

from dr_eureka.catching.ball_finder import find_balls
from dr_eureka.catching.localisation import camera_model
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.vision.camera import CameraError

SETTINGS = SaikaSettings.load()
CAMERA = camera_model(SETTINGS.cameras)


def true_size(centre):
    return SETTINGS.ball_diameter_m * SETTINGS.cameras.focal_px / centre[2]


@pytest.mark.parametrize("centre", [
    (0.0, 0.0, 0.3), (0.08, -0.05, 0.35), (-0.2, 0.1, 0.8), (0.3, 0.25, 1.2), (0.1, -0.4, 2.5),
])
def test_middle_and_size_are_found_to_a_tenth_of_a_pixel(centre):
    (ball,) = find_balls(ball_picture(SETTINGS, [centre], np.random.default_rng(1)), SETTINGS)
    assert np.abs(np.array(ball.centre_px) - CAMERA.project(np.array(centre))).max() < 0.1
    assert abs(ball.diameter_px - true_size(centre)) < 0.15
    assert ball.confidence > 0.9


@pytest.mark.parametrize("column, row", [(5.0, 240.0), (636.0, 200.0), (300.0, 3.0), (320.0, 470.0), (25.0, 25.0)])
def test_a_ball_cut_by_the_pictures_edge_is_measured_by_the_outline_that_is_left(column, row):
    centre = 0.6 * CAMERA.rays(np.array([column, row]))
    (ball,) = find_balls(ball_picture(SETTINGS, [centre], np.random.default_rng(2)), SETTINGS)
    assert np.abs(np.array(ball.centre_px) - (column, row)).max() < 0.5
    assert abs(ball.diameter_px - true_size(centre)) < 1.0
    assert ball.confidence < 0.9


def test_a_sliver_at_the_pictures_edge_is_no_ball():
    centre = 0.6 * CAMERA.rays(np.array([-40.0, 240.0]))
    assert find_balls(ball_picture(SETTINGS, [centre], np.random.default_rng(3)), SETTINGS) == ()


def test_a_ball_half_behind_a_thing_is_measured_by_the_outline_that_is_left():
    centre = (0.02, 0.0, 0.5)
    picture = ball_picture(SETTINGS, [centre], np.random.default_rng(4))
    picture[260:, :] = (90, 95, 100)
    (ball,) = find_balls(picture, SETTINGS)
    assert np.abs(np.array(ball.centre_px) - CAMERA.project(np.array(centre))).max() < 0.5
    assert abs(ball.diameter_px - true_size(centre)) < 1.0


def test_two_balls_are_two_balls_the_nearer_first():
    centres = [(-0.2, 0.0, 1.0), (0.1, 0.05, 0.6)]
    found = find_balls(ball_picture(SETTINGS, centres, np.random.default_rng(5)), SETTINGS)
    assert len(found) == 2
    for ball, centre in zip(found, centres[::-1]):
        assert np.abs(np.array(ball.centre_px) - CAMERA.project(np.array(centre))).max() < 0.15


def test_of_a_ball_partly_behind_another_the_front_one_is_measured_well():
    centres = [(0.03, 0.0, 0.7), (0.0, 0.0, 0.6)]
    found = find_balls(ball_picture(SETTINGS, centres, np.random.default_rng(6)), SETTINGS)
    assert np.abs(np.array(found[0].centre_px) - CAMERA.project(np.array(centres[1]))).max() < 1.0
    assert abs(found[0].diameter_px - true_size(centres[1])) < 2.0


@pytest.mark.parametrize("light", [0.35, 0.6, 1.0])
def test_light_does_not_matter(light):
    picture = (ball_picture(SETTINGS, [(0.0, 0.0, 0.7)]) * light).astype(np.uint8)
    (ball,) = find_balls(picture, SETTINGS)
    assert abs(ball.diameter_px - true_size((0.0, 0.0, 0.7))) < 0.2


@pytest.mark.parametrize("colour", [
    (255, 255, 255), (20, 20, 20), (200, 40, 40), (60, 180, 60), (210, 160, 130), (133, 102, 71),
])
def test_balls_of_other_colours_are_no_balls(colour):
    assert find_balls(ball_picture(SETTINGS, [(0.0, 0.0, 0.6)], colour=colour), SETTINGS) == ()


def test_an_orange_box_is_no_ball():
    picture = ball_picture(SETTINGS, [])
    picture[150:200, 100:400] = SETTINGS.ball_finder.ball_rgb
    assert find_balls(picture, SETTINGS) == ()


@pytest.mark.parametrize("seed", range(12))
def test_shapes_of_the_balls_colour_are_at_worst_no_balls(seed):
    rng, picture = np.random.default_rng(seed), ball_picture(SETTINGS, [])
    for _ in range(4):
        corners = rng.integers(-100, 700, (rng.integers(3, 6), 2)).astype(np.int32)
        cv2.fillPoly(picture, [corners], SETTINGS.ball_finder.ball_rgb)
        cv2.line(picture, *map(tuple, rng.integers(0, 600, (2, 2)).tolist()), SETTINGS.ball_finder.ball_rgb, 4)
    for ball in find_balls(picture, SETTINGS):
        assert np.isfinite([*ball.centre_px, ball.diameter_px]).all()


def test_a_picture_full_of_the_balls_colour_holds_no_ball():
    picture = ball_picture(SETTINGS, [], background=SETTINGS.ball_finder.ball_rgb)
    assert find_balls(picture, SETTINGS) == ()


@pytest.mark.parametrize("value", [0, 255])
def test_an_empty_picture_holds_no_ball(value):
    assert find_balls(np.full((CAMERA.height, CAMERA.width, 3), value, np.uint8), SETTINGS) == ()


def test_noise_of_all_colours_holds_no_ball():
    noise = np.random.default_rng(7).integers(0, 256, (CAMERA.height, CAMERA.width, 3), dtype=np.uint8)
    assert find_balls(noise, SETTINGS) == ()


def test_a_picture_of_another_size_is_refused():
    with pytest.raises(CameraError, match="expected 480 rows x 640 columns"):
        find_balls(np.zeros((10, 10, 3), np.uint8), SETTINGS)
