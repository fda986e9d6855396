import cv2
import numpy as np
import pytest

from dr_eureka.vision.aruco import (
    ArucoError,
    detect_markers,
    find_charuco_corners,
    find_markers,
    marker_image,
    module_rectangles,
)

DICTIONARY = "DICT_4X4_1000"


def page(*placed, side=96, size=(480, 640)):
    """White page with markers (id, row, column) of `side` px."""
    image = np.full(size, 255, np.uint8)
    for marker, row, column in placed:
        image[row : row + side, column : column + side] = marker_image(marker, side)
    return image


def test_each_marker_of_the_sheet_is_found_where_it_was_drawn():
    corners = detect_markers(page((0, 40, 50), (1, 40, 400), (2, 300, 50), (3, 300, 400)), DICTIONARY)
    assert sorted(corners) == [0, 1, 2, 3]
    expected = np.array([[400, 300], [496, 300], [496, 396], [400, 396]]) - 0.5
    assert np.allclose(corners[3], expected, atol=0.3)


@pytest.mark.parametrize("quarter_turns", [0, 1, 2, 3])
def test_corners_start_at_the_markers_own_top_left_however_it_lies(quarter_turns):
    image = np.ascontiguousarray(np.rot90(page((7, 100, 200), size=(400, 400)), quarter_turns))
    corners = detect_markers(image, DICTIONARY)[7]
    square = np.array([[200, 100], [296, 100], [296, 196], [200, 196]]) - 200.0
    for _ in range(quarter_turns):
        # A quarter turn to the left takes (x right, y down) to (y, -x).
        square = np.column_stack([square[:, 1], -square[:, 0]])
    assert np.allclose(corners, square + 199.5, atol=0.6)


def test_a_marker_seen_twice_is_reported_and_left_out():
    detection = find_markers(page((5, 40, 50), (5, 300, 400), (6, 40, 400)), DICTIONARY)
    assert detection.duplicates == (5,)
    assert list(detection.corners) == [6]


def test_a_blank_page_and_markers_of_another_dictionary_give_nothing():
    assert detect_markers(page(), DICTIONARY) == {}
    assert detect_markers(page((0, 40, 50), (1, 40, 400)), "DICT_6X6_250") == {}


def test_the_drawn_marker_is_the_printed_one_at_any_size():
    exact = marker_image(2, 60)
    modules = exact.reshape(6, 10, 6, 10)
    assert np.ptp(modules, axis=(1, 3)).max() == 0
    assert exact[0].max() == 0 and exact[:, 0].max() == 0
    odd = marker_image(2, 47)
    assert odd.shape == (47, 47)
    assert np.abs(cv2.resize(exact, (47, 47), interpolation=cv2.INTER_AREA).astype(int) - odd).max() <= 2


@pytest.mark.parametrize("image", [np.zeros((4, 4, 3), np.uint8), np.zeros((9, 9)), np.zeros((0, 5), np.uint8), None])
def test_what_is_no_grey_picture_is_refused(image):
    with pytest.raises(ArucoError):
        find_markers(image, DICTIONARY)


def test_an_unknown_dictionary_is_refused_with_the_valid_ones_named():
    with pytest.raises(ArucoError, match="'DICT_5X4_9' is unknown, expected one of .*DICT_4X4_1000"):
        detect_markers(page(), "DICT_5X4_9")


@pytest.mark.parametrize("marker, side", [(-1, 60), (1000, 60), (3, 0)])
def test_a_marker_that_cannot_be_drawn_is_refused(marker, side):
    with pytest.raises(ArucoError):
        marker_image(marker, side)


def test_module_rectangles_draw_the_marker():
    drawn = np.full((70, 70), 255, np.uint8)
    for left, top, width, height in module_rectangles(11, 70.0, "DICT_5X5_50").astype(int):
        drawn[top : top + height, left : left + width] = 0
    assert np.array_equal(drawn, marker_image(11, 70, "DICT_5X5_50"))


def test_a_charuco_board_without_any_marker_in_view_gives_no_corners():
    ids, corners = find_charuco_corners(page(), (7, 5), 0.75, "DICT_5X5_50")
    assert ids.shape == (0,) and corners.shape == (0, 2)


@pytest.mark.parametrize(
    "squares, share, dictionary, reason",
    [
        ((7, 4), 0.75, "DICT_5X5_50", "7x4 squares, expected .* an odd number of rows"),
        ((7, 5), 1.0, "DICT_5X5_50", "1 times as wide as their squares"),
        ((11, 11), 0.75, "DICT_5X5_50", "60 markers, expected at most the 50 of DICT_5X5_50"),
        ((7, 5), 0.75, "DICT_9X9_1", "'DICT_9X9_1' is unknown"),
    ],
)
def test_a_charuco_board_that_cannot_be_is_refused(squares, share, dictionary, reason):
    with pytest.raises(ArucoError, match=reason):
        find_charuco_corners(page(), squares, share, dictionary)
