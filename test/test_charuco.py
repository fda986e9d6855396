"""The calibration board: what is printed black, where its corners are, and that a picture of it shows them there."""

import numpy as np
import pytest
from board_views import BOARD, LAB, PIXELS_PER_METRE, board_texture, good_pictures, good_poses
from scipy.spatial.transform import Rotation

from dr_eureka.vision.charuco import BoardError, CharucoBoard, find_board


def test_the_corners_of_the_drawn_board_are_found_where_they_are_printed():
    texture = np.pad(board_texture(BOARD), 60, constant_values=255)
    view = find_board(texture, BOARD)
    assert sorted(view.ids) == list(range(BOARD.corner_count))
    printed = BOARD.corner_points(view.ids)[:, :2] * PIXELS_PER_METRE + 60 - 0.5
    assert np.abs(view.pixels - printed).max() < 0.3


def test_the_corners_of_tilted_boards_are_found_where_the_camera_projects_them():
    for picture, (turn, middle) in zip(good_pictures(BOARD, LAB)[:4], good_poses()):
        view = find_board(picture[..., 0], BOARD)
        centred = BOARD.corner_points(view.ids) - (3.5 * 0.036, 2.5 * 0.036, 0.0)
        expected = LAB.project(Rotation.from_rotvec(turn).apply(centred) + middle)
        errors = np.linalg.norm(view.pixels - expected, axis=1)
        assert len(errors) >= 12
        assert np.sqrt(np.mean(errors**2)) < 0.15


def test_half_of_the_board_is_black_where_no_marker_is():
    rectangles = BOARD.black_rectangles()
    squares = rectangles[np.isclose(rectangles[:, 2], BOARD.square_side)]
    assert len(squares) == 18
    assert np.allclose(squares[0], (0, 0, 0.036, 0.036))
    assert np.allclose((rectangles[:, :2] + rectangles[:, 2:]).max(axis=0), (0.252, 0.180))


@pytest.mark.parametrize(
    "rows, marker, reason", [(6, 0.028, "odd number of rows"), (5, 0.036, "less than the squares' 0.036 m")]
)
def test_a_board_that_cannot_be_printed_is_refused(rows, marker, reason):
    with pytest.raises(BoardError, match=reason):
        CharucoBoard(7, rows, 0.036, marker, "DICT_5X5_50")
