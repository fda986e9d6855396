"""The balls read in standing tubes, against drawn scenes and the simulator's pictures with known contents."""

import numpy as np
import pytest
from tube_scenes import Scene, draw

from dr_eureka.game.state import TUBES, State, all_states
from dr_eureka.kinematics.arms import base_from_camera
from dr_eureka.pieces import load_pieces
from dr_eureka.resources import load_yaml
from dr_eureka.settings import build
from dr_eureka.simulation.rendering import SceneTextures
from dr_eureka.simulation.settings import load_camera_settings, load_world_settings
from dr_eureka.simulation.world import World
from dr_eureka.vision.camera import CameraModel
from dr_eureka.vision.contents import ContentsResult, ContentsSettings, read_contents
from dr_eureka.vision.sheet_renderer import sheet_image
from dr_eureka.vision.tubes import TubePlace

PIECES = load_pieces()
CAMERA = CameraModel.lab()
SETTINGS = build(ContentsSettings, load_yaml("config/dr_eureka_main.yaml")["contents"], "config/dr_eureka_main.yaml contents")
NOMINAL = np.array([[-0.035, 0.11], [-0.035, 0.0], [-0.035, -0.11]])


def places_of(positions):
    return {name: TubePlace(position, 0.0005) for name, position in zip(TUBES, positions)}


def read(scene, camera=CAMERA, shift=(0.0, 0.0, 0.0)):
    places = places_of(scene.tubes_in_base + np.array(shift))
    return read_contents(draw(scene, PIECES, camera), camera, scene.base_from_camera, places, PIECES, SETTINGS)


@pytest.mark.parametrize("seed", range(6))
def test_drawn_tubes_are_read_under_any_light(seed):
    rng = np.random.default_rng(seed)
    state = all_states()[rng.integers(1710)]
    scene = Scene(
        tubes=NOMINAL + rng.uniform(-0.008, 0.008, (3, 2)),
        balls=state.tubes,
        sheet=(0.475, 0.0, rng.uniform(-0.07, 0.07)),
        light=rng.uniform(0.45, 1.0),
        noise=rng.uniform(0.0, 6.0),
        seed=seed,
    )
    reading = read(scene)
    assert (reading.result, reading.state, reading.reason) == (ContentsResult.OK, str(state), "")
    assert reading.confidence > 0.2


def test_places_a_few_millimetres_off_do_not_matter():
    scene = Scene(balls=("RPGR", "", "GP"))
    for shift in ((0.003, 0.003, 0.0), (-0.003, 0.003, 0.0), (0.0, -0.003, 0.002)):
        assert read(scene, shift=shift).state == "RPGR||GP"


def test_lens_distortion_is_allowed_for():
    assert read(Scene(balls=("RP", "GRG", "P")), camera=CameraModel.lab(distorted=True)).state == "RP|GRG|P"


@pytest.mark.parametrize("balls", [("RR", "GG", "P"), ("RR", "GG", "RP"), ("RR", "G", "PP")])
def test_balls_that_are_no_state_of_the_game_are_not_read(balls):
    reading = read(Scene(balls=balls))
    assert (reading.result, reading.state) == (ContentsResult.UNREADABLE, None)
    assert "expected 2" in reading.reason


def test_a_tube_beyond_the_pictures_edge_is_out_of_view():
    reading = read(Scene(), shift=(0.0, 0.3, 0.0))
    assert (reading.result, reading.state) == (ContentsResult.OUT_OF_VIEW, None)
    assert "left tube" in reading.reason


@pytest.mark.parametrize("level", [0, 255])
def test_a_black_or_white_picture_has_no_balls_in_it(level):
    image = np.full((480, 640, 3), level, np.uint8)
    scene = Scene()
    reading = read_contents(image, CAMERA, scene.base_from_camera, places_of(scene.tubes_in_base), PIECES, SETTINGS)
    assert reading.result == ContentsResult.UNREADABLE


def test_the_simulators_tubes_are_read():
    state = State.parse("RPGR||GP")
    textures = SceneTextures(sheet=sheet_image(PIECES))
    world = World(load_world_settings(), 5, state, textures, camera=load_camera_settings())
    try:
        world.set_joint_goals({"head_p": 0.87})
        for _ in range(125):
            world.advance_cycle()
        places = places_of([world.tube_pose(name)[:3, 3] for name in TUBES])
        pose = base_from_camera(world.joint_positions())
        reading = read_contents(world.camera_image(), CAMERA, pose, places, PIECES, SETTINGS)
    finally:
        world.close()
    assert (reading.result, reading.state) == (ContentsResult.OK, str(state))
