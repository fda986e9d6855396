"""Cards are found by their black ground in a white border, at any size, turn and tilt."""
import cv2
import numpy as np
import pytest

from dr_eureka.vision.aruco import marker_image
from dr_eureka.vision.card_finder import coloured_share, find_candidates, rectify
from dr_eureka.vision.card_renderer import draw_card
from dr_eureka.vision.card_scenes import paste_card
from dr_eureka.vision.card_views import ViewRanges, card_corners, sample_view
from dr_eureka.vision.cards import CardSettings

FINDER = CardSettings.load().finder


def ground_corners(corners, border):
    """Return where a card's black ground ends in the picture, for its outer corners (4, 2)."""
    inside = np.array([[(border, border), (1 - border, border), (1 - border, 1 - border), (border, 1 - border)]])
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
    return cv2.perspectiveTransform(inside, cv2.getPerspectiveTransform(square, corners.astype(np.float32)))[0]


@pytest.mark.parametrize("background", [0, 110, 245])
@pytest.mark.parametrize("side", [80, 160, 320])
def test_a_cards_ground_is_found_to_two_pixels_on_any_ground(side, background):
    rng = np.random.default_rng(side + background)
    ranges = ViewRanges(side_px=((side, side + 0.01),), tilt=((0.0, 0.7),))
    drawing = draw_card("RGPR|GP|", rng, 384)
    image = np.full((480, 640, 3), background, np.uint8)
    corners = card_corners(sample_view(rng, ranges)) + (320, 240)
    paste_card(image, drawing, corners)
    expected = ground_corners(corners, drawing.style.border)
    best = find_candidates(image, FINDER)[0]
    distances = np.linalg.norm(best.ground[:, None] - expected[None], axis=2)
    assert distances.min(axis=0).max() < 2.0
    assert sorted(distances.argmin(axis=1)) == [0, 1, 2, 3]


def test_corners_run_clockwise():
    image = np.zeros((300, 300, 3), np.uint8)
    image[50:250, 50:250], image[65:235, 65:235] = 255, 20
    (x0, y0), (x1, y1), (x2, y2), _ = find_candidates(image, FINDER)[0].ground
    assert (x1 - x0) * (y2 - y1) - (y1 - y0) * (x2 - x1) > 0  # y points down


def test_a_cut_out_card_fills_the_crop_and_the_homography_says_where_a_pixel_goes():
    image = np.zeros((300, 300, 3), np.uint8)
    ground = np.array([(100, 80), (200, 90), (190, 200), (95, 190)], float)
    crop, homography = rectify(image, ground)
    assert crop.shape == (416, 416, 3)
    upper_left = cv2.perspectiveTransform(ground[None, :1], homography)[0, 0]
    assert upper_left == pytest.approx((0.065 * 416 - 0.5,) * 2, abs=1e-3)


@pytest.mark.parametrize("level", [0, 90, 255])
def test_an_empty_picture_holds_no_candidate(level):
    assert find_candidates(np.full((480, 640, 3), level, np.uint8), FINDER) == []


def test_a_white_sheet_or_a_dark_box_with_one_dark_side_is_no_candidate():
    image = np.full((480, 640, 3), 30, np.uint8)
    image[100:250, 100:250] = 250
    image[300:450, 300:450] = 250
    image[320:430, 300:430] = 10
    assert find_candidates(image, FINDER) == []


def test_a_marker_is_not_coloured_and_a_card_is():
    marker = cv2.copyMakeBorder(marker_image(2, 360), 28, 28, 28, 28, cv2.BORDER_CONSTANT, value=255)
    warm_light = np.array((1.0, 0.9, 0.75))
    assert coloured_share((marker[..., None] * warm_light).astype(np.uint8)) < FINDER.least_coloured
    card = cv2.resize(draw_card("R|GPR|GP", np.random.default_rng(1), 208).image, (416, 416))
    assert coloured_share(card) > 2 * FINDER.least_coloured
