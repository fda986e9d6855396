"""Where a ball is, by parallax and by size, against exact projection and against drawn noise."""

from __future__ import annotations

import numpy as np
import pytest
from ball_pictures import ball_picture

from dr_eureka.catching import localisation
from dr_eureka.catching.ball_finder import find_balls
from dr_eureka.catching.localisation import (
    LocalisationError,
    Rig,
    depth_resolution,
    eye_at,
    locate_by_parallax,
    locate_by_size,
    rig_at,
)
from dr_eureka.catching.saika import SaikaHead
from dr_eureka.catching.settings import SaikaSettings

SETTINGS = SaikaSettings.load()
HEAD = SaikaHead(SETTINGS)
TURNED = rig_at(SETTINGS, HEAD, neck=(0.2, -0.4), left_pan_tilt=(0.05, 0.1), right_pan_tilt=(-0.03, 0.0))
PLACE = np.array([0.02, 0.60, -0.05])


def in_camera(eye, place):
    return (np.linalg.inv(eye.base_from_camera) @ [*place, 1.0])[:3]


def pixel(eye, place):
    return eye.camera.project(in_camera(eye, place))


@pytest.mark.parametrize("rig", [rig_at(SETTINGS, HEAD), TURNED])
def test_parallax_undoes_projection(rig):
    place = PLACE + [0.0, 0.0, 0.2] if rig is not TURNED else PLACE
    found, _ = locate_by_parallax(pixel(rig.left, place), pixel(rig.right, place), rig)
    assert found == pytest.approx(place, abs=1e-9)


def test_parallax_between_parallel_cameras_is_the_papers_relation():
    rig = rig_at(SETTINGS, HEAD)
    left, right = pixel(rig.left, [0.0, 0.6, 0.15]), pixel(rig.right, [0.0, 0.6, 0.15])
    depth = SETTINGS.cameras.baseline_m * SETTINGS.cameras.focal_px / (left[0] - right[0])
    assert depth == pytest.approx(in_camera(rig.left, [0.0, 0.6, 0.15])[2])


def test_a_ball_that_falls_between_both_pictures_is_where_and_how_high_it_was_in_the_middle():
    fall = np.array([0.0, 0.0, 0.05])
    found, _ = locate_by_parallax(pixel(TURNED.left, PLACE + fall), pixel(TURNED.right, PLACE - fall), TURNED)
    assert found[:2] == pytest.approx(PLACE[:2], abs=1e-9)
    assert found[2] == pytest.approx(PLACE[2], abs=1e-9)


def test_the_covariance_of_parallax_is_that_of_drawn_pixel_noise():
    rng, left, right = np.random.default_rng(1), pixel(TURNED.left, PLACE), pixel(TURNED.right, PLACE)
    sigma = SETTINGS.cameras.centre_sigma_px
    drawn = [
        locate_by_parallax(left + rng.normal(0, sigma, 2), right + rng.normal(0, sigma, 2), TURNED)[0] for _ in range(600)
    ]
    _, covariance = locate_by_parallax(left, right, TURNED)
    deviations = np.sqrt(np.diag(np.cov(np.transpose(drawn))))
    assert np.sqrt(np.diag(covariance)) == pytest.approx(deviations, rel=0.15)


@pytest.mark.parametrize("eye", [TURNED.left, TURNED.right])
def test_size_undoes_projection(eye):
    size = SETTINGS.ball_diameter_m * SETTINGS.cameras.focal_px / in_camera(eye, PLACE)[2]
    found, _ = locate_by_size(pixel(eye, PLACE), size, eye)
    assert found == pytest.approx(PLACE, abs=1e-9)


def test_the_covariance_of_size_is_that_of_drawn_pixel_noise():
    rng, eye, cameras = np.random.default_rng(2), TURNED.left, SETTINGS.cameras
    size = SETTINGS.ball_diameter_m * cameras.focal_px / in_camera(eye, PLACE)[2]
    centres = pixel(eye, PLACE) + rng.normal(0, cameras.centre_sigma_px, (600, 2))
    sizes = size + rng.normal(0, cameras.diameter_sigma_px, 600)
    drawn = [locate_by_size(centre, diameter, eye)[0] for centre, diameter in zip(centres, sizes)]
    _, covariance = locate_by_size(pixel(eye, PLACE), size, eye)
    assert covariance == pytest.approx(np.cov(np.transpose(drawn)), abs=0.1 * covariance.max())


def test_a_ball_is_localised_from_pictures_by_both_methods():
    rig, place = rig_at(SETTINGS, HEAD), np.array([0.03, 0.65, 0.12])
    pictures = [ball_picture(SETTINGS, [in_camera(eye, place)], np.random.default_rng(3)) for eye in (rig.left, rig.right)]
    views = [find_balls(picture, SETTINGS)[0] for picture in pictures]
    by_parallax, _ = locate_by_parallax(views[0].centre_px, views[1].centre_px, rig)
    by_size, _ = locate_by_size(views[0].centre_px, views[0].diameter_px, rig.left)
    assert np.linalg.norm(by_parallax - place) < 0.002
    assert np.linalg.norm(by_size - place) < 0.003


def test_the_resolution_in_depth_is_the_step_to_one_pixel_more():
    depths = np.array([0.3, 0.8, 1.2])
    constant = SETTINGS.ball_diameter_m * SETTINGS.cameras.focal_px
    sizes = constant / depths
    assert depth_resolution(depths, SETTINGS) == pytest.approx(constant / sizes - constant / (sizes + 1.0))


@pytest.mark.parametrize("left, right, reason", [
    ((np.nan, 200.0), (300.0, 200.0), localisation.NOT_FINITE),
    ((320.0, 240.0), (320.0, 240.0), localisation.RAYS_DIVERGE),
    ((250.0, 240.0), (390.0, 240.0), localisation.RAYS_DIVERGE),
    ((400.0, 10.0), (250.0, 460.0), localisation.VIEWS_DISAGREE),
])
def test_views_that_show_no_place_are_refused_by_name(left, right, reason):
    with pytest.raises(LocalisationError) as refused:
        locate_by_parallax(np.array(left), np.array(right), rig_at(SETTINGS, HEAD))
    assert refused.value.reason == reason
    assert str(refused.value).startswith(reason)


def test_a_view_straight_down_is_refused_by_name():
    down = eye_at(SETTINGS, np.array([[1.0, 0, 0, 0], [0, -1.0, 0, 0.5], [0, 0, -1.0, 1.0], [0, 0, 0, 1.0]]))
    middle = (0.5 * (SETTINGS.cameras.width - 1), 0.5 * (SETTINGS.cameras.height - 1))
    with pytest.raises(LocalisationError) as refused:
        locate_by_parallax(middle, middle, Rig(down, down))
    assert refused.value.reason == localisation.RAYS_DIVERGE


@pytest.mark.parametrize("size, reason", [
    (0.0, localisation.NOT_A_SIZE), (-3.0, localisation.NOT_A_SIZE), (np.inf, localisation.NOT_FINITE)
])
def test_a_size_that_is_none_is_refused_by_name(size, reason):
    with pytest.raises(LocalisationError) as refused:
        locate_by_size((320.0, 240.0), size, eye_at(SETTINGS, HEAD.base_from_camera("left")))
    assert refused.value.reason == reason
