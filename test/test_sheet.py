import cv2
import numpy as np
import pytest

from dr_eureka.pieces import load_pieces
from dr_eureka.vision.aruco import detect_markers
from dr_eureka.vision.camera import CameraModel
from dr_eureka.vision.edges import rising_edges
from dr_eureka.vision.level_fit import LevelFitError, fit_level_sheet
from dr_eureka.vision.marker_edges import refine_corners
from dr_eureka.vision.rectified import SheetGrid, paper_brightness, rectify
from dr_eureka.vision.sheet_renderer import sheet_image
from tube_scenes import Scene, draw

CAMERA = CameraModel.lab()


@pytest.fixture(scope="module")
def pieces():
    return load_pieces()


def seen_corners(scene, pieces, markers=(0, 1, 2, 3)):
    """Printed (n, 2) [m] and seen (n, 2) [px] corners, free of error."""
    printed = np.concatenate([pieces.marker_corners(marker) for marker in markers])
    on_sheet = np.column_stack([printed, np.zeros(len(printed)), np.ones(len(printed))])
    camera_from_sheet = np.linalg.inv(scene.base_from_camera) @ scene.base_from_sheet
    return printed, CAMERA.project((on_sheet @ camera_from_sheet.T)[:, :3])


def test_the_printed_sheet_carries_its_markers_where_the_pieces_say(pieces):
    corners = detect_markers(sheet_image(pieces, 2000), pieces.marker_dictionary)
    for marker in pieces.marker_centres:
        x = pieces.sheet_depth / 2 - (corners[marker][:, 1] + 0.5) / 2000
        y = pieces.sheet_width / 2 - (corners[marker][:, 0] + 0.5) / 2000
        assert np.allclose(np.column_stack([x, y]), pieces.marker_corners(marker), atol=0.0003)


def test_the_sheet_is_drawn_at_the_size_asked_for(pieces):
    assert sheet_image(pieces, 1000).shape == (260, 430)
    assert sheet_image(pieces, 2000).dtype == np.uint8


@pytest.mark.parametrize("markers", [(0, 1, 2, 3), (0, 2, 3), (1,)])
def test_the_level_fit_agrees_with_opencvs_pnp_on_perfect_corners(pieces, markers):
    scene = Scene(sheet=(0.47, 0.01, 0.4), height=0.79)
    printed, seen = seen_corners(scene, pieces, markers)
    fit = fit_level_sheet(printed, seen, CAMERA, scene.base_from_camera, 0.7, 0.1, 0.003)
    flat = np.column_stack([printed, np.zeros(len(printed))])
    _, turn, place = cv2.solvePnP(flat, seen, CAMERA.matrix, None)
    camera_from_sheet = np.eye(4)
    camera_from_sheet[:3, :3], camera_from_sheet[:3, 3] = cv2.Rodrigues(turn)[0], place.ravel()
    assert np.allclose(fit.base_from_sheet, scene.base_from_camera @ camera_from_sheet, atol=1e-4)
    assert np.allclose(fit.base_from_sheet, scene.base_from_sheet, atol=1e-8)


def test_the_stated_height_sigma_is_the_spread_of_fits_to_noisy_corners(pieces):
    scene, rng = Scene(), np.random.default_rng(2)
    printed, seen = seen_corners(scene, pieces)
    noisy = [seen + rng.normal(0, 0.2, seen.shape) for _ in range(150)]
    fits = [fit_level_sheet(printed, each, CAMERA, scene.base_from_camera, 0.77, 0.2, 0.003) for each in noisy]
    heights = [fit.base_from_sheet[2, 3] for fit in fits]
    assert np.std(heights) == pytest.approx(np.median([fit.covariance[0, 0] ** 0.5 for fit in fits]), rel=0.25)


def test_a_tilt_of_the_camera_that_the_joints_do_not_know_is_found(pieces):
    scene, believed = Scene(head_pitch=0.87), Scene(head_pitch=0.86)
    printed, seen = seen_corners(scene, pieces)
    fit = fit_level_sheet(printed, seen, CAMERA, believed.base_from_camera, 0.77, 0.1, 0.1)
    assert np.linalg.norm(fit.tilt) == pytest.approx(0.01, abs=1e-4)
    assert np.allclose(fit.base_from_camera[:3, :3], scene.base_from_camera[:3, :3], atol=2e-4)


def test_one_corner_far_off_hardly_moves_the_fit(pieces):
    scene = Scene()
    printed, seen = seen_corners(scene, pieces)
    seen[5] += (6.0, -4.0)
    fit = fit_level_sheet(printed, seen, CAMERA, scene.base_from_camera, 0.7, 0.1, 0.003)
    assert np.allclose(fit.base_from_sheet, scene.base_from_sheet, atol=5e-4)


def test_points_above_the_horizon_are_no_level_sheet(pieces):
    printed, seen = seen_corners(Scene(), pieces)
    with pytest.raises(LevelFitError, match="horizon"):
        fit_level_sheet(printed, seen - (0, 2000), CAMERA, Scene().base_from_camera, 0.7, 0.1, 0.003)


def test_refined_corners_are_within_a_fifth_of_a_pixel_even_behind_a_wall(pieces):
    scene = Scene(tubes=np.array([[0.02, 0.12], [-0.035, 0.0], [0.02, -0.12]]), balls=("R", "GG", "P"))
    _, seen = seen_corners(scene, pieces)
    grey = cv2.cvtColor(draw(scene, pieces, CAMERA), cv2.COLOR_RGB2GRAY).astype(np.float32)
    rng = np.random.default_rng(4)
    for true in seen.reshape(4, 4, 2):
        refined = refine_corners(grey, true + rng.normal(0, 1.0, 2), 5.0, 12.0)
        assert np.abs(refined - true).max() < 0.3


def test_no_corners_are_made_up_where_there_is_no_marker(pieces):
    grey = np.full((480, 640), 200, np.float32)
    square = np.array([[100, 100], [180, 100], [180, 180], [100, 180]], float)
    assert refine_corners(grey, square, 5.0, 12.0) is None


def test_a_blurred_edge_is_found_to_a_twentieth_of_a_pixel():
    offsets = np.arange(-6, 6.01, 0.25)
    true = np.linspace(-2.3, 2.3, 24)
    profiles = 20 + 180 / (1 + np.exp(-(offsets - true[:, None]) / 0.3))
    found, places = rising_edges(profiles.astype(np.float32), offsets, 1.5, 50.0)
    assert found.all()
    assert np.abs(places - true).max() < 0.05


def test_a_falling_edge_is_none():
    offsets = np.arange(-6, 6.01, 0.25)
    assert not rising_edges(200.0 - 100.0 * (offsets > 0)[None], offsets, 1.5, 50.0)[0].any()


def test_grid_pixels_and_sheet_points_are_each_others_inverse(pieces):
    grid = SheetGrid(pieces, 2000)
    assert grid.size == (860, 520)
    assert np.allclose(grid.pixels([pieces.sheet_depth / 2, pieces.sheet_width / 2]), (-0.5, -0.5))
    points = np.random.default_rng(3).uniform(-0.1, 0.1, (4, 5, 2))
    assert np.allclose(grid.points(grid.pixels(points)), points)


def test_the_rectified_picture_is_the_printed_sheet(pieces):
    scene, grid = Scene(tubes=np.empty((0, 2)), sheet=(0.47, 0.0, 0.1)), SheetGrid(pieces, 1000)
    image = cv2.cvtColor(draw(scene, pieces, CAMERA), cv2.COLOR_RGB2GRAY)
    seen = rectify(image, CAMERA, np.linalg.inv(scene.base_from_camera) @ scene.base_from_sheet, grid)
    assert np.corrcoef(seen.ravel(), sheet_image(pieces, 1000).ravel())[0, 1] > 0.97


def test_paper_is_one_and_print_zero_in_slanting_light(pieces):
    grid = SheetGrid(pieces, 1000)
    lit = (sheet_image(pieces, 1000) * np.linspace(0.3, 0.9, 430) + 10).astype(np.uint8)
    brightness = paper_brightness(lit, grid, (0, 1, 3), 0.002, 25.0)
    assert np.median(brightness[:, 80:350]) == pytest.approx(1.0, abs=0.05)
    lit[120:140, 200:220] = 10
    assert paper_brightness(lit, grid, (0, 1, 3), 0.002, 25.0)[125:135, 205:215].max() < 0.05


def test_a_picture_without_contrast_has_no_paper(pieces):
    assert paper_brightness(np.full((260, 430), 90, np.uint8), SheetGrid(pieces, 1000), (0, 1, 2, 3), 0.002, 25.0) is None
