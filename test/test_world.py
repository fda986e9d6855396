"""The simulated world against textbook physics: balls, tubes, and how a game stands at its start."""
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pybullet
import pytest
from pybullet_utils.bullet_client import BulletClient

from dr_eureka.game.state import TUBES, State
from dr_eureka.pieces import load_pieces
from dr_eureka.simulation.bodies import GRAVITY, BodyMaker, set_up_physics
from dr_eureka.simulation.placement import draw_placement
from dr_eureka.simulation.quiet import quiet_stdout
from dr_eureka.simulation.settings import SimulationError, load_world_settings
from dr_eureka.simulation.stage import Stage
from dr_eureka.simulation.tube_model import mass_properties
from dr_eureka.simulation.world import World

SETTINGS = load_world_settings()
PIECES = load_pieces()
STEP = SETTINGS.cycle / SETTINGS.physics.steps_per_cycle
EYE = np.array([0.068, 0.0, 1.2175])


@pytest.fixture
def world():
    world = World(SETTINGS, 1)
    yield world
    world.close()


@pytest.fixture
def bench():
    """An empty space with the world's physics."""
    with quiet_stdout():
        client = BulletClient(pybullet.DIRECT)
    set_up_physics(client, SETTINGS.physics, SETTINGS.cycle)
    yield client, BodyMaker(client, SETTINGS.physics, PIECES)
    client.disconnect()


def run(world, seconds):
    for _ in range(round(seconds / SETTINGS.cycle)):
        world.advance_cycle()


def position(client, body):
    return np.array(client.getBasePositionAndOrientation(body)[0])


@pytest.mark.parametrize("slope_deg", [5.0, 10.0])
def test_a_ball_rolls_down_a_tube_at_five_sevenths_g_sin(bench, slope_deg):
    client, bodies = bench
    slope = np.radians(slope_deg)
    tube = bodies.tube((0, 0, 1), pybullet.getQuaternionFromEuler((0, np.pi / 2 + slope, np.pi)), fixed=True)
    pose = bodies.tube_pose(tube)
    axis = pose[:3, 2]
    down = np.cross(axis, np.cross((0, 0, -1), axis))
    down /= np.linalg.norm(down)
    slack = PIECES.tube_bore / 2 - PIECES.ball_radius
    ball = bodies.ball(pose[:3, 3] + 0.02 * axis + slack * down, "R")
    along = []
    for _ in range(120):
        client.stepSimulation()
        along.append((position(client, ball) - pose[:3, 3]) @ axis)
    times = np.arange(1, 121) * STEP
    moving = slice(20, 120)
    acceleration = 2 * np.polyfit(times[moving], along[moving], 2)[0]
    resisted = SETTINGS.physics.rolling_resistance * np.cos(slope)
    assert acceleration == pytest.approx(5 / 7 * GRAVITY * (np.sin(slope) - resisted), rel=0.04)


def test_a_ball_falls_as_galileo_says(bench):
    client, bodies = bench
    ball = bodies.ball((0, 0, 2), "G")
    for _ in range(150):
        client.stepSimulation()
    time_s = 150 * STEP
    # Stepping by velocity first overshoots the parabola by half a step's worth.
    assert 2 - position(client, ball)[2] == pytest.approx(GRAVITY * time_s * (time_s + STEP) / 2, rel=1e-6)


def test_a_ball_bounces_off_the_table_with_the_product_of_both_restitutions(bench):
    client, bodies = bench
    bodies.furniture((0, 0, -0.05), (1, 1, 0.1), (1, 1, 1, 1))
    ball = bodies.ball((0, 0, 0.3), "P")
    speeds = []
    for _ in range(250):
        client.stepSimulation()
        speeds.append(client.getBaseVelocity(ball)[0][2])
    landing = int(np.argmin(speeds))
    ratio = max(speeds[landing:]) / -speeds[landing]
    expected = SETTINGS.physics.piece_restitution * SETTINGS.physics.table_restitution
    assert ratio == pytest.approx(expected, abs=0.02)


def test_a_tube_has_the_centre_of_mass_and_inertia_of_its_parts():
    com, (across, _, axial) = mass_properties(PIECES, 0.02)
    rng = np.random.default_rng(0)
    samples = rng.uniform((-0.018, -0.018, 0), (0.018, 0.018, PIECES.tube_height), (400_000, 3))
    radius = np.hypot(samples[:, 0], samples[:, 1])
    foot = (samples[:, 2] < PIECES.foot_thickness) & (radius < PIECES.foot_radius)
    wall = (samples[:, 2] >= PIECES.foot_thickness) & (radius > PIECES.tube_bore / 2) & (radius < PIECES.tube_outer_radius)
    solid = samples[foot | wall]
    x, y, z = (solid - (0, 0, com)).T
    assert z.mean() == pytest.approx(0.0, abs=3e-4)
    assert 0.02 * (x**2 + y**2).mean() == pytest.approx(axial, rel=0.01)
    assert 0.02 * (y**2 + z**2).mean() == pytest.approx(across, rel=0.01)


@pytest.mark.parametrize("start", ["RR|GG|PP", "RRGG||PP", "RGPR||PG"])
def test_a_world_starts_at_rest_with_the_balls_asked_for(start):
    world = World(SETTINGS, 7, State.parse(start))
    assert world.time_s == 0.0
    before = world.ball_positions()
    run(world, 0.4)
    verdict = world.referee()
    assert verdict.state == start and verdict.balls_lost == 0 and all(verdict.tubes_standing.values())
    moved = [np.linalg.norm(a[1] - b[1]) for a, b in zip(before, world.ball_positions())]
    assert max(moved) < 0.001
    world.close()


def test_tubes_stand_where_they_were_placed_and_only_touch_the_board(world):
    for name in TUBES:
        assert world.tube_pose(name)[:3, 3] == pytest.approx(world.placement.tubes[name], abs=1e-4)
    touching = {pair for pair in world.contacts() if "ball" not in pair}
    assert touching == {("board", f"tube_{name}") for name in TUBES}


@pytest.mark.parametrize("friction, restitution", [(0.5, 1.5), (1.2, 0.8)])
def test_ball_on_tube_differs_from_the_settings_by_just_the_factors_of_its_world(bench, friction, restitution):
    client, _ = bench
    maker, physics = BodyMaker(client, SETTINGS.physics, PIECES, friction, restitution), SETTINGS.physics
    ball, tube = maker.ball((0.0, 0.0, 1.0), "R"), maker.tube((0.0, 0.0, 0.0), fixed=True)
    # 1: sliding friction, 5: restitution, 6: rolling friction
    of_ball, of_tube = (client.getDynamicsInfo(body, -1) for body in (ball, tube))
    assert of_ball[1] * of_tube[1] == pytest.approx(friction * physics.piece_friction**2)
    assert of_ball[5] * of_tube[5] == pytest.approx(restitution * physics.piece_restitution**2)
    assert of_ball[6] * of_tube[1] == pytest.approx(physics.rolling_resistance * PIECES.ball_radius)


def test_placements_stay_within_their_scatter_and_differ_by_seed():
    scatter, layout = SETTINGS.scatter, SETTINGS.layout
    placements = [draw_placement(SETTINGS, seed, EYE) for seed in range(100)]
    for placement in placements:
        offset = placement.base_from_sheet[:3, 3] - layout.sheet_centre
        yaw = np.arctan2(placement.base_from_sheet[1, 0], placement.base_from_sheet[0, 0])
        assert np.abs(offset).max() <= scatter.sheet and offset[2] == 0.0 and abs(yaw) <= scatter.sheet_yaw
        for name in TUBES:
            in_sheet = np.linalg.inv(placement.base_from_sheet) @ [*placement.tubes[name], 1.0]
            assert np.abs(in_sheet[:2] - layout.tubes_in_sheet[name]).max() <= scatter.tubes + 1e-12
        assert abs(placement.friction - 1) <= scatter.materials and abs(placement.restitution - 1) <= scatter.materials
        assert placement.base_from_card[:3, :3] @ placement.base_from_card[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)
    assert len({tuple(placement.tubes["left"]) for placement in placements}) == 100


def moved_world(seed, stage=None):
    """Return the numbers of a world after some motion."""
    world = World(SETTINGS, seed, stage=stage)
    for cycle in range(60):
        world.set_joint_goals({"l_arm_sh_p1": 0.5689 - 0.004 * cycle, "head_p": 0.01 * cycle, "r_arm_grip": 1.0})
        world.advance_cycle()
    state = [*world.joint_positions().values()] + [x for _, centre in world.ball_positions() for x in centre]
    state += [x for name in TUBES for x in world.tube_pose(name).ravel()]
    world.close()
    return state


def test_equal_seeds_and_commands_give_equal_worlds():
    assert moved_world(5) == moved_world(5)
    assert moved_world(5) != moved_world(6)


@pytest.mark.parametrize("most_worlds", [64, 1])
def test_a_stage_carries_nothing_from_one_world_to_the_next(monkeypatch, most_worlds):
    monkeypatch.setattr("dr_eureka.simulation.stage.MOST_WORLDS", most_worlds)
    stage = Stage(None)
    assert [moved_world(seed, stage) for seed in (6, 5)] == [moved_world(seed) for seed in (6, 5)]
    stage.close()
    stage.close()


def test_a_layout_without_all_tubes_and_a_start_with_unknown_joints_are_refused():
    layout = SETTINGS.layout
    with pytest.raises(SimulationError, match="expected left, center, right"):
        World(replace(SETTINGS, layout=replace(layout, tubes_in_sheet={"left": (0.0, 0.1)})), 1)
    with pytest.raises(SimulationError, match="unknown l_arm_thumb_y"):
        World(replace(SETTINGS, layout=replace(layout, start_joints={"l_arm_thumb_y": 0.1})), 1)


def test_closing_a_world_twice_is_harmless():
    world = World(SETTINGS, 1)
    world.close()
    world.close()
