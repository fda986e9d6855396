"""Saika's simulated world against closed forms: flight, joints, cameras, and the referee."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from dr_eureka.catching.arm_network import SaikaNetwork
from dr_eureka.catching.ball_finder import find_balls
from dr_eureka.catching.localisation import rig_at
from dr_eureka.catching.saika import JOINTS, LEFT_ARM, NECK, SaikaArm, SaikaHead
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.simulation.saika import CAUGHT, FLYING, MISSED, SaikaWorld
from dr_eureka.simulation.saika_settings import SaikaWorldSettings
from dr_eureka.simulation.settings import SimulationError

SETTINGS = SaikaSettings.load()
WORLD = SaikaWorldSettings.load()
PLACE = np.array([-0.2, 0.42, -0.2])


def ready(place=PLACE, neck=(0.0, 0.0)):
    joints = np.zeros(12)
    joints[NECK], joints[LEFT_ARM] = neck, SaikaNetwork.load(SETTINGS).joints(place)
    return joints


@pytest.fixture
def make_world():
    worlds = []

    def make(*args, **kwargs):
        worlds.append(SaikaWorld(SETTINGS, *args, **kwargs))
        return worlds[-1]

    yield make
    for world in worlds:
        world.close()


def run_out(world, seconds=2.0):
    """Go on until the referee decides; return its word."""
    while world.time_s < seconds:
        world.step(0.05)
        if world.referee().result != FLYING:
            break
    return world.referee().result


def test_a_thrown_ball_flies_as_gravity_has_it(make_world):
    world, start, velocity = make_world(1), np.array([0.5, 2.0, 0.0]), np.array([-0.4, -2.5, 2.0])
    world.throw_ball(start, velocity)
    world.step(0.5)
    flown = world.referee()
    assert flown.ball_position == pytest.approx(start + 0.5 * velocity - [0.0, 0.0, 0.5 * 9.81 * 0.25], abs=0.003)
    assert flown.ball_velocity == pytest.approx(velocity - [0.0, 0.0, 9.81 * 0.5], abs=0.001)


def test_drag_slows_a_falling_ball_as_its_closed_form_says(make_world):
    drag = 0.47
    physics = dataclasses.replace(WORLD.physics, drag_coefficient=drag)
    world = make_world(1, world=dataclasses.replace(WORLD, physics=physics))
    world.drop_ball((0.0, 2.0, 0.0))
    world.step(0.45)
    constant = 0.5 * 1.2 * drag * np.pi * 0.035**2 / WORLD.physics.ball_mass_kg
    terminal = np.sqrt(9.81 / constant)
    assert world.referee().ball_velocity[2] == pytest.approx(-terminal * np.tanh(9.81 * 0.45 / terminal), abs=0.002)


@pytest.mark.parametrize("sideways", [(0.0, 0.0), (0.02, 0.0), (0.0, -0.02), (-0.012, 0.012)])
def test_a_ball_that_falls_into_the_basket_rests_there_and_is_caught(make_world, sideways):
    world = make_world(1, start=ready())
    world.drop_ball(PLACE + [*sideways, 0.85])
    assert world.referee().result == FLYING
    assert run_out(world) == CAUGHT
    assert world.referee().ball_position[2] < PLACE[2]


@pytest.mark.parametrize("sideways", [(0.12, 0.0), (0.0, 0.12), (-0.12, 0.0)])
def test_a_ball_beside_the_basket_is_missed(make_world, sideways):
    world = make_world(1, start=ready())
    world.drop_ball(PLACE + [*sideways, 0.85])
    assert run_out(world) == MISSED


def test_a_caught_ball_stays_in_a_basket_that_moves_gently(make_world):
    world = make_world(1, start=ready())
    world.drop_ball(PLACE + [0.0, 0.0, 0.85])
    run_out(world)
    begin, end = ready(), ready(PLACE + [0.1, 0.03, 0.05])
    for share in np.linspace(0.0, 1.0, 200):
        world.command(begin + share * (end - begin))
        world.step(0.005)
    world.step(0.5)
    assert world.referee().result == CAUGHT


def test_joints_go_to_their_goals_at_their_speed_and_not_beyond_their_limits(make_world):
    world = make_world(1)
    goals = np.zeros(12)
    goals[JOINTS.index("left_elbow")], goals[JOINTS.index("neck_tilt")] = 1.0, -5.0
    world.command(goals)
    world.step(0.1)
    assert world.joints()[JOINTS.index("left_elbow")] == pytest.approx(0.1 * SETTINGS.joints["elbow"].speed, abs=0.03)
    world.step(0.9)
    assert world.joints()[JOINTS.index("left_elbow")] == pytest.approx(1.0, abs=0.002)
    assert world.joints()[JOINTS.index("neck_tilt")] == pytest.approx(np.radians(-60.0), abs=0.002)


def test_cameras_turn_in_the_head(make_world):
    world = make_world(1)
    world.aim_cameras((0.1, 0.2), (-0.1, 0.3))
    world.step(0.5)
    assert world.camera_pan_tilt("left") == pytest.approx([0.1, 0.2], abs=0.002)
    assert world.camera_pan_tilt("right") == pytest.approx([-0.1, 0.3], abs=0.002)


def test_the_right_camera_takes_its_pictures_a_lag_after_the_left(make_world):
    world, times = make_world(1), {"left": [], "right": []}
    for _ in range(20):
        side = min(times, key=world.next_exposure)
        world.step(world.next_exposure(side) - world.time_s)
        times[side].append(world.time_s)
    cameras = SETTINGS.cameras
    assert np.diff(times["left"]) == pytest.approx(cameras.period_s, abs=0.0011)
    count = min(map(len, times.values()))
    lags = np.array(times["right"][:count]) - np.array(times["left"][:count])
    assert lags == pytest.approx(cameras.lag_s, abs=0.0011)


def test_equal_seeds_see_alike_and_others_do_not(make_world):
    seen = []
    for seed in (1, 1, 2):
        world = make_world(seed)
        world.drop_ball((0.0, 0.8, 0.2))
        seen.append((world.next_exposure("left"), world.observe("left")))
    assert seen[0] == seen[1] != seen[2]


def test_the_analytic_camera_sees_balls_where_projection_has_them(make_world):
    world = make_world(3)
    world.drop_ball((0.05, 0.8, 0.25))
    world.drop_ball((0.0, 0.6, 0.15), ball=1)
    stamp, balls = world.observe("right")
    eye = rig_at(SETTINGS, SaikaHead(SETTINGS)).right
    camera_from_base = np.linalg.inv(eye.base_from_camera)
    assert stamp == 0.0 and len(balls) == 2
    for ball, place in zip(balls, [(0.0, 0.6, 0.15), (0.05, 0.8, 0.25)]):
        in_camera = camera_from_base @ [*place, 1.0]
        assert ball.centre_px == pytest.approx(eye.camera.project(in_camera[:3]), abs=5 * WORLD.sensor.centre_noise_px)
        assert ball.diameter_px == pytest.approx(0.07 * 820.0 / in_camera[2], abs=5 * WORLD.sensor.diameter_noise_px)


@pytest.mark.parametrize("place", [(0.0, -1.0, 0.2), (2.0, 0.8, 0.2), (0.0, 0.8, -0.4), (0.0, 30.0, 0.2)])
def test_a_ball_behind_beside_below_or_too_far_is_not_seen(make_world, place):
    world = make_world(1)
    world.drop_ball(place)
    assert world.observe("left")[1] == ()


def test_a_rendered_ball_is_found_where_the_analytic_camera_has_it(make_world):
    sensor = dataclasses.replace(WORLD.sensor, renderer="tiny")
    world = make_world(4, rendered=True, world=dataclasses.replace(WORLD, sensor=sensor))
    world.drop_ball((0.03, 0.7, 0.2))
    (found,), (expected,) = find_balls(world.capture("left")[1], SETTINGS), world.observe("left")[1]
    assert found.centre_px == pytest.approx(expected.centre_px, abs=0.6)
    assert found.diameter_px == pytest.approx(expected.diameter_px, abs=0.8)


def test_without_pictures_a_capture_is_refused(make_world):
    with pytest.raises(SimulationError, match="made without pictures"):
        make_world(1).capture("left")


@pytest.mark.parametrize("joints", [[0.0] * 11, [np.nan] * 12, [[0.0] * 12]])
def test_joints_that_are_none_are_refused(make_world, joints):
    with pytest.raises(SimulationError, match="expected 12 finite angles"):
        make_world(1).command(joints)


def test_balls_that_are_nowhere_or_skip_a_number_are_refused(make_world):
    world = make_world(1)
    with pytest.raises(SimulationError, match="referee: no ball"):
        world.referee()
    for place, ball in (((np.nan, 0.0, 0.0), 0), ((0.0, 1.0, 0.0), 2)):
        with pytest.raises(SimulationError, match="expected a number up to 0, finite values"):
            world.drop_ball(place, ball)


def test_the_basket_is_as_wide_as_the_settings_say(make_world):
    """A ball fits with 25 mm to spare on every side of a level rim, and not with 30."""
    arm, joints = SaikaArm(SETTINGS), ready()
    level = arm.forward(joints[LEFT_ARM])
    assert level[2, 2] > 0.97
    spare = 0.5 * (SETTINGS.basket_diameter_m - SETTINGS.ball_diameter_m)
    assert spare == pytest.approx(0.025)
    world = make_world(1, start=joints)
    world.drop_ball(level[:3, 3] + 0.9 * spare * level[:3, 0] + [0.0, 0.0, 0.1])
    world.step(0.16)
    assert world.referee().ball_position[2] < level[2, 3]
