"""Calibration from drawn views of the board: the camera that drew them comes out, and weak sets of views are refused."""

from dataclasses import replace

import numpy as np
import pytest
from board_views import BOARD, LAB, SMALL, board_picture, good_pictures
from scipy.spatial.transform import Rotation

from dr_eureka.vision.calibration import CalibrationError, fit_camera, weaknesses
from dr_eureka.vision.calibration_views import CalibrationSettings, ViewCollection
from dr_eureka.vision.charuco import BoardView

SETTINGS = CalibrationSettings.load()


def collected(pictures):
    collection = ViewCollection(SETTINGS)
    assert [collection.offer(picture) for picture in pictures] == [None] * len(pictures)
    return collection


def judged(collection):
    calibration = fit_camera(collection.views, BOARD, collection.size)
    return calibration, weaknesses(calibration, collection, SETTINGS)


@pytest.fixture(scope="module")
def good_collection():
    return collected(good_pictures(BOARD, LAB))


def test_the_camera_that_took_good_views_comes_out(good_collection):
    calibration, reasons = judged(good_collection)
    assert reasons == ()
    assert calibration.rms_px < 0.15
    assert np.allclose(np.diag(calibration.camera.matrix), np.diag(LAB.matrix), rtol=0.003)
    assert np.allclose(calibration.camera.matrix[:2, 2], LAB.matrix[:2, 2], atol=3.0)
    rows, columns = np.mgrid[20:480:40, 20:640:40]
    pixels = np.stack([columns.ravel(), rows.ravel()], axis=-1).astype(float)
    found, true = (camera.rays(pixels) for camera in (calibration.camera, LAB))
    found, true = (rays / np.linalg.norm(rays, axis=1, keepdims=True) for rays in (found, true))
    # What counts is the angles between pixels; coefficients trade off against one another and against a turned camera.
    turn, _ = Rotation.align_vectors(true, found)
    assert np.median(np.linalg.norm(turn.apply(found) - true, axis=1)) < 0.0005


def test_calibrations_from_noisy_corners_scatter_as_the_standard_deviations_claim_or_less(good_collection):
    rng = np.random.default_rng(5)
    fits = []
    for _ in range(20):
        views = [
            BoardView(view.ids, view.pixels + rng.normal(0, 0.2, view.pixels.shape))
            for view in good_collection.views
        ]
        fits.append(fit_camera(views, BOARD, good_collection.size))
    spread = np.std([np.diag(fit.camera.matrix)[:2] for fit in fits], axis=0)
    claimed = np.mean([fit.focal_sigmas for fit in fits], axis=0)
    # OpenCV 4.6 claims half too much, 4.10 what it is.
    assert np.all((0.4 < spread / claimed) & (spread / claimed < 1.4))


def test_too_few_views_are_refused_with_their_number():
    _, reasons = judged(collected(good_pictures(BOARD, SMALL)[:4]))
    assert reasons[0] == "4 of at least 8 views"


def test_two_views_fit_no_camera():
    collection = collected(good_pictures(BOARD, SMALL)[:2])
    with pytest.raises(CalibrationError, match="2 of at least 3 views"):
        fit_camera(collection.views, BOARD, collection.size)


def test_boards_all_parallel_to_the_picture_are_refused():
    places = [(x, y, depth) for depth in (0.36, 0.42) for x in (-0.06, 0.06) for y in (-0.04, 0.04)]
    _, reasons = judged(collected([board_picture(BOARD, SMALL, (0, 0, 0), place, seed=3) for place in places]))
    assert any("tilted alike in all views" in reason for reason in reasons)


def test_boards_all_tilted_the_same_way_are_refused_however_they_are_turned_on_the_table():
    pictures = []
    for spin in np.linspace(0.0, 3.0, 8):
        turn = Rotation.from_rotvec((0.5, 0, 0)) * Rotation.from_rotvec((0, 0, spin))
        pictures.append(board_picture(BOARD, SMALL, turn.as_rotvec(), (0.02 * np.cos(5 * spin), 0, 0.4)))
    _, reasons = judged(collected(pictures))
    assert any("tilted alike in all views" in reason for reason in reasons)


def test_a_board_that_stays_in_the_middle_is_refused():
    tilts = [(0.5, 0, 0), (-0.5, 0, 0), (0, 0.5, 0), (0, -0.5, 0), (0.4, 0.4, 0), (-0.4, 0.4, 0.5), (0.4, -0.4, 0.5)]
    tilts.append((0, 0, 0.7))
    _, reasons = judged(collected([board_picture(BOARD, SMALL, tilt, (0, 0, 0.55)) for tilt in tilts]))
    assert any(reason.startswith("corners cover") and "toward the edges" in reason for reason in reasons)


def test_another_board_than_the_one_described_is_refused():
    collection = collected(good_pictures(BOARD, SMALL))
    collection.views[:] = [BoardView(view.ids[::-1], np.roll(view.pixels, 3, axis=0)) for view in collection.views]
    _, reasons = judged(collection)
    assert any("is the board the one described" in reason for reason in reasons)


def test_uncertain_figures_are_named_where_nothing_plainer_is_wrong(good_collection):
    calibration, _ = judged(good_collection)
    strict = replace(SETTINGS, largest_focal_sigma=1e-4, largest_centre_sigma=1e-4)
    reasons = weaknesses(calibration, good_collection, strict)
    assert [reason.split(" known to ")[0] for reason in reasons] == ["focal lengths", "optical centre"]
    unknown = replace(calibration, focal_sigmas=np.array([np.nan, 1.0]))
    assert weaknesses(unknown, good_collection, SETTINGS)[0].startswith("focal lengths known to nan")


def test_only_a_view_that_differs_counts_and_in_motion_only_one_at_rest():
    first, second = good_pictures(BOARD, SMALL)[:2]
    collection = ViewCollection(SETTINGS)
    assert collection.offer(first) is None
    assert collection.offer(first) == "like a view before"
    assert collection.offer(second, moving=True) == "the board moves"
    assert collection.offer(second, moving=True) is None
    assert len(collection.views) == 2


def test_what_is_no_view_is_left_out_with_the_reason():
    collection = ViewCollection(SETTINGS)
    picture = good_pictures(BOARD, SMALL)[0]
    assert collection.offer(np.full_like(picture, 255)).startswith("0 of the board's corners seen, expected at least 8")
    assert collection.offer(picture[:200]) == "320x200 px, expected 320x240 like the first picture"
