"""The balls read in standing tubes, against drawn scenes and the simulator's pictures with known contents."""

import cv2
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
from dr_eureka.vision.contents_state import consistent_states, settle
from dr_eureka.vision.sheet_renderer import sheet_image
from dr_eureka.vision.tubes import TubePlace

PIECES = load_pieces()
CAMERA = CameraModel.lab()
MAIN = "config/dr_eureka_main.yaml"
SETTINGS = build(ContentsSettings, load_yaml(MAIN)["contents"], f"{MAIN} contents")
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


@pytest.mark.parametrize("balls, lost", [(("RR", "GG", "P"), "P"), (("RR", "G", "P"), "GP"), (("", "GG", "PP"), "RR")])
def test_balls_that_are_in_no_tube_are_missed(balls, lost):
    reading = read(Scene(balls=balls))
    assert (reading.result, reading.state) == (ContentsResult.BALL_MISSING, None)
    assert reading.reason == f"{'|'.join(balls)}: {lost} in no tube"
    assert [reading.tubes[name].colours for name in TUBES] == list(balls)


def test_more_balls_of_a_colour_than_there_are_is_unreadable():
    reading = read(Scene(balls=("RR", "GG", "RP")))
    assert (reading.result, reading.state) == (ContentsResult.UNREADABLE, None)
    assert "3 R balls, expected 2" in reading.reason


def look_at(image, scene, held=None):
    places = {name: place for name, place in places_of(scene.tubes_in_base).items() if name not in (held or {})}
    return read_contents(
        image, CAMERA, scene.base_from_camera, places, PIECES, SETTINGS, scene.base_from_sheet, held or {}
    )


def covered(scene, name, low, high, colour=(62, 64, 68)):
    """The scene with a hand before one tube, between two heights [m] of its axis."""
    image = draw(scene, PIECES, CAMERA)
    foot = scene.tubes_in_base[TUBES.index(name)]
    ends = np.array([foot + (0, 0, low), foot + (0, 0, high)])
    pixels = CAMERA.project(np.column_stack([ends, np.ones(2)]) @ np.linalg.inv(scene.base_from_camera).T[:, :3])
    (column, bottom), (_, top) = np.rint(pixels).astype(int)
    image[top:bottom, column - 30 : column + 30] = colour
    return image


def test_a_covered_tube_is_unsure():
    scene = Scene(balls=("RR", "GG", "PP"))
    reading = look_at(covered(scene, "center", 0.02, 0.12), scene)
    assert (reading.result, reading.state) == (ContentsResult.UNSURE, None)
    assert "center tube is covered" in reading.reason
    assert "?" in reading.tubes["center"].colours and reading.tubes["left"].colours == "RR"


def test_a_covered_ball_below_another_is_told_by_elimination():
    scene = Scene(balls=("RGG", "RP", "P"))
    reading = look_at(covered(scene, "left", 0.008, 0.046), scene)
    assert (reading.result, reading.state) == (ContentsResult.UNSURE, None)  # two are covered: RG or GR
    assert reading.tubes["left"].colours == "??G"
    reading = look_at(covered(scene, "left", 0.008, 0.025), scene)
    assert (reading.result, reading.state) == (ContentsResult.OK, "RGG|RP|P")


def test_a_ball_beside_the_tubes_is_found():
    scene = Scene(balls=("RR", "GG", "P"))
    image = draw(scene, PIECES, CAMERA)
    spot = np.array([0.50, 0.05, 0.775 + PIECES.ball_radius])
    in_camera = np.linalg.inv(scene.base_from_camera) @ [*spot, 1.0]
    column, row = np.rint(CAMERA.project(in_camera[:3])).astype(int)
    radius = round(CAMERA.matrix[0, 0] * PIECES.ball_radius / in_camera[2])
    cv2.circle(image, (column, row), radius, PIECES.ball_colours["P"], -1)
    reading = look_at(image, scene)
    assert (reading.result, [ball.colour for ball in reading.loose]) == (ContentsResult.BALL_MISSING, ["P"])
    assert np.linalg.norm(reading.loose[0].position - spot) < 0.003


def test_no_ball_is_found_beside_the_tubes_where_none_is():
    scene = Scene(balls=("RR", "GG", "P"))
    assert look_at(draw(scene, PIECES, CAMERA), scene).loose == ()


def test_a_held_tube_is_read_where_the_joints_say_it_is():
    """The drawn centre tube stands; the reader is told that it is held there, and that the hand may be dark."""
    scene = Scene(balls=("RR", "GP", "GP"))
    pose = np.eye(4)
    pose[:3, 3] = scene.tubes_in_base[1]
    reading = look_at(draw(scene, PIECES, CAMERA), scene, {"center": pose})
    assert (reading.result, reading.state) == (ContentsResult.OK, "RR|GP|GP")
    # What the hand covers of it is not known, be it empty or not.
    reading = look_at(covered(scene, "center", 0.02, 0.12), scene, {"center": pose})
    assert reading.result == ContentsResult.UNSURE


def test_low_down_in_a_hand_nothing_is_taken_for_empty_however_bright_the_hand_is():
    scene = Scene(balls=("RR", "GP", "GP"))
    pose = np.eye(4)
    pose[:3, 3] = scene.tubes_in_base[0]
    reading = look_at(covered(scene, "left", 0.0, 0.047, colour=(140, 142, 146)), scene, {"left": pose})
    assert reading.tubes["left"].colours == "??"
    assert look_at(draw(scene, PIECES, CAMERA), scene, {"left": pose}).tubes["left"].colours == "RR"


def test_a_tube_of_which_nothing_is_known_is_unsure():
    scene = Scene(balls=("RR", "GG", "PP"))
    places = places_of(scene.tubes_in_base)
    del places["right"]
    reading = read_contents(draw(scene, PIECES, CAMERA), CAMERA, scene.base_from_camera, places, PIECES, SETTINGS)
    assert (reading.result, reading.tubes["right"].colours) == (ContentsResult.UNSURE, "????")


@pytest.mark.parametrize(
    "labels, settled",
    [("R?  ", "R?  "), ("R ? ", "R   "), ("????", "????"), (" ???", "    "), (" RG?", "?RG?"), ("R G ", "R?G ")],
)
def test_above_an_empty_place_is_nothing_and_below_a_ball_is_another(labels, settled):
    assert settle(labels) == settled


def test_consistent_states_agree_with_brute_force():
    rng = np.random.default_rng(8)
    for _ in range(30):
        state = all_states()[rng.integers(1710)]
        labels = {}
        for name in TUBES:
            full = state.tube(name).ljust(4)
            hidden = rng.random(4) < 0.25
            labels[name] = settle("".join("?" if hide else ball for ball, hide in zip(full, hidden)))
        fits = {
            str(other) for other in all_states()
            if all(label in ("?", ball) for name in TUBES for label, ball in zip(labels[name], other.tube(name).ljust(4)))
            and all(not other.tube(name) or labels[name][len(other.tube(name)) - 1] != "?" for name in TUBES)
        }
        assert {str(each) for each in consistent_states(labels)} == fits
        seen_tops = all(not state.tube(name) or labels[name][len(state.tube(name)) - 1] != "?" for name in TUBES)
        assert (str(state) in fits) == seen_tops


def test_a_tube_beyond_the_pictures_edge_is_out_of_view():
    reading = read(Scene(), shift=(0.0, 0.3, 0.0))
    assert (reading.result, reading.state) == (ContentsResult.OUT_OF_VIEW, None)
    assert "left tube" in reading.reason


@pytest.mark.parametrize("level", [0, 255])
def test_a_black_or_white_picture_has_no_balls_in_it(level):
    image = np.full((480, 640, 3), level, np.uint8)
    scene = Scene()
    reading = read_contents(image, CAMERA, scene.base_from_camera, places_of(scene.tubes_in_base), PIECES, SETTINGS)
    assert (reading.result, reading.state) == (ContentsResult.BALL_MISSING, None)


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
