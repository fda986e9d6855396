"""The pieces of the game fit each other and the sheet."""

import numpy as np
import pytest

from dr_eureka.pieces import Pieces, load_pieces
from dr_eureka.resources import load_yaml
from dr_eureka.settings import SettingsError, build


@pytest.fixture(scope="module")
def pieces():
    return load_pieces()


def test_the_wall_surrounds_the_bore(pieces):
    assert pieces.tube_outer_radius == pytest.approx(0.0143)
    assert pieces.ball_radius == pytest.approx(0.011)


def test_balls_pass_the_bore_one_at_a_time_and_four_fit(pieces):
    assert pieces.ball_diameter < pieces.tube_bore < 2 * pieces.ball_diameter
    assert pieces.tube_floor + 4 * pieces.ball_diameter <= pieces.tube_height


def test_there_are_three_colours_of_balls(pieces):
    assert sorted(pieces.ball_colours) == ["G", "P", "R"]


def test_markers_lie_on_the_sheet_with_a_white_rim(pieces):
    for marker in pieces.marker_centres:
        reach = np.abs(pieces.marker_corners(marker)).max(axis=0)
        assert np.all(reach < [pieces.sheet_depth / 2, pieces.sheet_width / 2])


def test_the_robot_sees_marker_0_far_left_and_3_near_right(pieces):
    centres = pieces.marker_centres
    assert centres[0][0] > 0 and centres[0][1] > 0
    assert centres[3][0] < 0 and centres[3][1] < 0


def test_marker_corners_run_from_the_top_left_clockwise_as_printed(pieces):
    top_left, top_right, bottom_right, bottom_left = pieces.marker_corners(1)
    assert top_left == pytest.approx([0.125, -0.14])
    assert top_right == pytest.approx([0.125, -0.21])
    assert bottom_right == pytest.approx([0.055, -0.21])
    assert bottom_left == pytest.approx([0.055, -0.14])


def test_a_marker_that_is_not_on_the_sheet_is_refused(pieces):
    with pytest.raises(KeyError):
        pieces.marker_corners(4)


def test_a_negative_length_is_refused():
    mapping = {**load_yaml("config/pieces.yaml"), "tube_bore": -0.02}
    with pytest.raises(SettingsError, match="tube_bore: is -0.02; expected a number from"):
        build(Pieces, mapping, "config/pieces.yaml")
