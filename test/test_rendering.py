"""The rendered camera against independent projections: pixels where the pinhole model says, walls one can see through."""
from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from dr_eureka.game.state import TUBES, State
from dr_eureka.pieces import load_pieces
from dr_eureka.simulation import rendering
from dr_eureka.simulation.placement import draw_placement
from dr_eureka.simulation.rendering import SceneTextures, egl_works
from dr_eureka.simulation.settings import SimulationError, load_camera_settings, load_world_settings
from dr_eureka.simulation.world import World
from dr_eureka.vision.aruco import detect_markers
from dr_eureka.vision.sheet_renderer import sheet_image

PIECES = load_pieces()
SHEET = SceneTextures(sheet_image(PIECES))
SHEET_PITCH = 0.87
# Largest corner error [px]; TinyRenderer takes the nearest texel of the sheet, OpenGL blends between them.
CORNER_ERROR = {"egl": 0.7, "tiny": 1.4}
RENDERERS = ["tiny", pytest.param("egl", marks=pytest.mark.skipif(not egl_works(), reason="no OpenGL by EGL here"))]


def looking_down(pitch=SHEET_PITCH, seed=3, start="RRGG||PP", textures=SHEET, **camera):
    settings = load_world_settings()
    settings = replace(settings, layout=replace(settings.layout, start_joints={**settings.layout.start_joints, "head_p": pitch}))
    return World(settings, seed, State.parse(start), textures, camera=replace(load_camera_settings(), **camera))


def project(world, points, camera=load_camera_settings()):
    """Project points in base to pixels with OpenCV's camera model."""
    base_from_camera = world.link_pose("cam_link")
    in_camera = (np.asarray(points, dtype=float) - base_from_camera[:3, 3]) @ base_from_camera[:3, :3]
    matrix = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    return cv2.projectPoints(in_camera, np.zeros(3), np.zeros(3), matrix, np.array(camera.distortion))[0].reshape(-1, 2)


def on_sheet(world, points_xy):
    points = np.column_stack([points_xy, np.full(len(points_xy), rendering.PAPER_LIFT), np.ones(len(points_xy))])
    return (points @ world.placement.base_from_sheet.T)[:, :3]


def refined_corners(image, expected):
    """Return where an image's corners are, searched sub-pixel near where they are expected."""
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    corners = expected.astype(np.float32).reshape(-1, 1, 2).copy()
    until = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-4)
    return cv2.cornerSubPix(grey, corners, (3, 3), (-1, -1), until).reshape(-1, 2)


def mean_colour(image, pixel, half=2):
    column, row = np.rint(pixel).astype(int)
    return image[row - half : row + half + 1, column - half : column + half + 1].reshape(-1, 3).mean(axis=0)


@pytest.mark.parametrize("renderer", RENDERERS)
def test_marker_corners_are_where_the_intrinsics_put_them(renderer):
    world = looking_down(renderer=renderer, noise=0.0)
    image = world.camera_image()
    found = detect_markers(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), PIECES.marker_dictionary)
    assert {2, 3} <= set(found)
    for marker in (2, 3):
        expected = project(world, on_sheet(world, PIECES.marker_corners(marker)))
        assert np.abs(np.asarray(found[marker]).reshape(4, 2) - expected).max() < 2.0
        assert np.linalg.norm(refined_corners(image, expected) - expected, axis=1).max() < CORNER_ERROR[renderer]
    world.close()


@pytest.mark.parametrize("renderer", RENDERERS)
def test_a_ball_is_seen_through_its_tube_in_its_own_colour(renderer):
    world = looking_down(renderer=renderer, noise=0.0)
    image = world.camera_image()
    for colour, centre in world.ball_positions():
        seen = mean_colour(image, project(world, [centre])[0], half=1)
        distances = {name: np.linalg.norm(_direction(seen) - _direction(np.array(rgb)))
                     for name, rgb in PIECES.ball_colours.items()}
        assert min(distances, key=distances.get) == colour
    world.close()


def _direction(colour):
    return colour / np.linalg.norm(colour)


@pytest.mark.parametrize("renderer", RENDERERS)
def test_a_tubes_foot_is_black_and_the_empty_wall_lets_the_sheet_through(renderer):
    world = looking_down(renderer=renderer, noise=0.0)
    image = world.camera_image()
    for name in TUBES:
        pose = world.tube_pose(name)
        toward_robot = pose[:3, 3] + [-PIECES.foot_radius + 0.001, 0.0, PIECES.foot_thickness / 2]
        assert mean_colour(image, project(world, [toward_robot])[0], half=0).max() < 60
    wall = world.tube_pose("center")[:3, 3] + [-PIECES.tube_outer_radius, 0.0, 0.07]
    assert mean_colour(image, project(world, [wall])[0]).min() > 120
    world.close()


def card_points(placement, points_xy):
    local = np.column_stack([points_xy, np.zeros(len(points_xy)), np.ones(len(points_xy))])
    return (local @ placement.base_from_card.T)[:, :3]


def test_the_card_is_wholly_in_view_for_every_seed():
    world = looking_down(pitch=0.5, renderer="tiny")
    settings, eye = load_world_settings(), world.link_pose("cam_link")[:3, 3]
    half = PIECES.card_side / 2
    for seed in range(200):
        placement = draw_placement(settings, seed, eye)
        pixels = project(world, card_points(placement, [(-half, half), (half, half), (half, -half), (-half, -half)]))
        assert (pixels > 5).all() and (pixels < (634, 474)).all()
        toward_eye = eye - placement.base_from_card[:3, 3]
        assert placement.base_from_card[:3, 2] @ toward_eye > np.cos(np.radians(29)) * np.linalg.norm(toward_eye)
    world.close()


@pytest.mark.parametrize("renderer", RENDERERS)
def test_the_card_shows_its_picture_upright_until_it_is_taken_away(renderer):
    picture = np.full((200, 200, 3), 255, np.uint8)
    picture[:100, :100] = (255, 0, 0)
    picture[:100, 100:] = (0, 160, 0)
    picture[100:, :100] = (0, 0, 255)
    world = looking_down(pitch=0.5, textures=SceneTextures(card=picture), renderer=renderer, noise=0.0)
    quarter = PIECES.card_side / 4
    middles = [(-quarter, quarter), (quarter, quarter), (-quarter, -quarter), (quarter, -quarter)]
    pixels = project(world, card_points(world.placement, middles))
    shown = [mean_colour(world.camera_image(), pixel) for pixel in pixels]
    assert [int(colour.argmax()) for colour in shown[:3]] == [0, 1, 2]
    assert shown[3].min() > 80
    world.show_card(None)
    gone = [mean_colour(world.camera_image(), pixel) for pixel in pixels]
    assert np.ptp(gone, axis=0).max() < 40
    world.show_card(picture[:, ::-1])
    assert int(mean_colour(world.camera_image(), pixels[1]).argmax()) == 0
    world.close()


def test_lens_distortion_moves_the_corners_as_opencvs_model_says():
    camera = replace(load_camera_settings(), distortion=(0.09185878, -0.06354207, 0.00779513, -0.00322328, -0.36163446))
    world = looking_down(renderer="tiny", noise=0.0, distortion=camera.distortion)
    image = world.camera_image()
    for marker in (2, 3):
        points = on_sheet(world, PIECES.marker_corners(marker))
        expected = project(world, points, camera)
        assert np.linalg.norm(expected - project(world, points), axis=1).max() > 1.0
        assert np.linalg.norm(refined_corners(image, expected) - expected, axis=1).max() < CORNER_ERROR["tiny"]
    world.close()


def test_equal_seeds_see_equal_pictures_with_noise_that_changes_from_frame_to_frame():
    first, second = (looking_down(renderer="tiny") for _ in range(2))
    pictures = [(a.camera_image(), b.camera_image()) for a, b in [(first, second)] * 2]
    assert all(np.array_equal(a, b) for a, b in pictures)
    difference = pictures[0][0].astype(float) - pictures[1][0]
    assert 0.5 < difference.std() < 2 * load_camera_settings().noise
    first.close(), second.close()


def test_without_opengl_the_choice_auto_falls_back_and_egl_is_refused(monkeypatch):
    monkeypatch.setattr(rendering, "egl_works", lambda: False)
    world = looking_down(renderer="auto")
    assert world.camera_image().shape == (480, 640, 3)
    world.close()
    with pytest.raises(SimulationError, match="egl does not work here"):
        looking_down(renderer="egl")


def test_a_world_without_a_camera_says_so():
    world = World(load_world_settings(), 1)
    with pytest.raises(SimulationError, match="made without one"):
        world.camera_image()
    world.close()
