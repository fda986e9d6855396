"""Grasp and pour geometry: distances between lips, mirror images, tubes that stay where the hand takes them."""

import numpy as np
import pytest

from dr_eureka.control.grasp import hand_for_tube, level_hand, tube_in_hand
from dr_eureka.control.pour_geometry import LipPlace, PourGeometry, PourPlace
from dr_eureka.kinematics.arms import mirror_transform
from dr_eureka.pieces import load_pieces

PIECES = load_pieces()
PLACE = PourPlace((0.45, 0.0, 1.05), np.radians(70), np.radians(120), np.radians(20), np.radians(-60))
LOCK = LipPlace("lock", distance=0.019, angle=np.radians(10))
DIRECT = LipPlace("direct", gap=0.006, inset=-0.0015)


def lowest_inner_lip(base_from_tube: np.ndarray) -> np.ndarray:
    """Find by search the lowest point of the bore's rim, for a tube lying roughly level."""
    points = rim_points(base_from_tube, 72001)
    return points[np.argmin(points[:, 2])]


def rim_points(base_from_tube: np.ndarray, count: int = 7201) -> np.ndarray:
    angles = np.linspace(0.0, 2.0 * np.pi, count)
    rim = np.stack([np.cos(angles), np.sin(angles)], axis=1) * PIECES.tube_bore / 2.0
    local = np.column_stack([rim, np.full(len(rim), PIECES.tube_height), np.ones(len(rim))])
    return (base_from_tube @ local.T).T[:, :3]


@pytest.mark.parametrize("elevation", [-12.0, 0.0, 12.0])
def test_the_locked_lip_is_19_mm_from_the_far_lip_at_every_elevation(elevation):
    geometry = PourGeometry(PLACE, LOCK, PIECES)
    lip = lowest_inner_lip(geometry.source(np.radians(elevation)))
    distances = np.linalg.norm(rim_points(geometry.target()) - lip, axis=1)
    assert distances.max() == pytest.approx(0.019, abs=2e-5)


def test_the_source_turns_about_its_lower_lip():
    geometry = PourGeometry(PLACE, DIRECT, PIECES)
    lips = [lowest_inner_lip(geometry.source(np.radians(angle))) for angle in (-20.0, -5.0, 10.0)]
    assert np.ptp(lips, axis=0).max() < 2e-5


def test_the_target_mouth_is_where_the_settings_say_and_leans_towards_the_source():
    pose = PourGeometry(PLACE, LOCK, PIECES).target()
    mouth = (pose @ [0.0, 0.0, PIECES.tube_height, 1.0])[:3]
    assert mouth == pytest.approx([0.45, 0.0, 1.05])
    assert np.degrees(np.arccos(pose[2, 2])) == pytest.approx(20.0)
    source_axis = PourGeometry(PLACE, LOCK, PIECES).source(0.0)[:3, 2]
    assert pose[:3, 2] @ source_axis < 0.0


def test_withdrawing_moves_the_lip_by_that_distance_without_turning():
    geometry = PourGeometry(PLACE, LOCK, PIECES)
    near, far = geometry.source(0.2, 0.0), geometry.source(0.2, 0.014)
    assert np.linalg.norm(near[:3, 3] - far[:3, 3]) == pytest.approx(0.014)
    assert np.allclose(near[:3, :3], far[:3, :3])


@pytest.mark.parametrize("turn", [0.0, 0.15, -0.1])
def test_turning_both_tubes_keeps_the_targets_mouth_and_how_the_tubes_are_to_one_another(turn):
    geometry = PourGeometry(PLACE, LOCK, PIECES)
    source, target = geometry.source(-0.1, 0.01, turn), geometry.target(turn)
    assert (target @ [0.0, 0.0, PIECES.tube_height, 1.0])[:3] == pytest.approx(PLACE.target_mouth)
    alone = np.linalg.inv(geometry.target()) @ geometry.source(-0.1, 0.01)
    assert np.linalg.inv(target) @ source == pytest.approx(alone, abs=1e-12)
    assert np.arcsin(source[2, 2]) == pytest.approx(-0.1 + turn)
    assert np.arcsin(target[2, 2]) == pytest.approx(PLACE.target_elevation - turn)


def test_all_poses_are_rigid_transforms_and_so_are_their_mirror_images():
    geometry = PourGeometry(PLACE, LOCK, PIECES)
    for pose in (geometry.target(), geometry.source(0.1, 0.01), mirror_transform(geometry.source(0.1))):
        rotation = pose[:3, :3]
        assert np.allclose(rotation @ rotation.T, np.eye(3)) and np.linalg.det(rotation) == pytest.approx(1.0)


def test_a_held_tube_comes_back_to_where_it_was_taken_from():
    hand = level_hand(np.array([0.44, 0.11, 0.81]), -0.5236, 0.019)
    foot = np.array([0.442, 0.111, 0.775])
    end_from_tube = tube_in_hand(hand, foot)
    tube = hand @ end_from_tube
    assert tube[:3, 2] == pytest.approx([0.0, 0.0, 1.0])
    assert np.allclose(hand_for_tube(tube, end_from_tube), hand)
    opening = hand[:3, 1]
    assert (tube[:3, 3] - hand[:3, 3]) @ opening == pytest.approx(0.0, abs=1e-12)
    along = hand[:3, 0]
    assert (tube[:3, 3] - foot) @ along == pytest.approx(0.0, abs=1e-12)


def test_a_tube_taken_with_a_tilted_hand_is_known_to_be_tilted_in_it():
    tilt = np.radians(3.0)
    hand = level_hand(np.array([0.44, 0.0, 0.81]), 0.0, 0.019)
    hand[:3, :3] = hand[:3, :3] @ np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    end_from_tube = tube_in_hand(hand, np.array([0.46, 0.0, 0.775]))
    assert np.degrees(np.arccos(end_from_tube[2, 2])) == pytest.approx(3.0)
    assert (hand @ end_from_tube)[:3, 2] == pytest.approx([0.0, 0.0, 1.0])
