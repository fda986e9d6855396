"""Transforms against scipy's rotations and against their own inverses."""
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dr_eureka.kinematics import transforms


@pytest.fixture
def rng():
    return np.random.default_rng(7)


def test_rpy_and_quaternions_agree_with_scipy(rng):
    for reference in Rotation.random(200, random_state=7):
        matrix = reference.as_matrix()
        quaternion = reference.as_quat() * np.sign(reference.as_quat()[3])
        np.testing.assert_allclose(transforms.matrix_to_quaternion(matrix), quaternion, atol=1e-12)
        np.testing.assert_allclose(transforms.quaternion_to_matrix(3.0 * quaternion), matrix, atol=1e-12)
        np.testing.assert_allclose(transforms.matrix_to_rpy(matrix), reference.as_euler("xyz"), atol=1e-9)
        np.testing.assert_allclose(transforms.rpy_to_matrix(reference.as_euler("xyz")), matrix, atol=1e-12)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_rpy_at_gimbal_lock_still_gives_back_the_rotation(pitch):
    matrix = transforms.rpy_to_matrix([0.4, pitch, -1.1])
    np.testing.assert_allclose(transforms.rpy_to_matrix(transforms.matrix_to_rpy(matrix)), matrix, atol=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-8, 1e-6, 1e-3, 0.5, 3.0, np.pi - 1e-2, np.pi - 1e-4, np.pi - 1e-9, np.pi])
def test_the_rotation_vector_survives_a_round_trip_up_to_half_a_turn(rng, angle):
    for axis in np.vstack([np.eye(3), rng.normal(size=(20, 3))]):
        axis = axis / np.linalg.norm(axis)
        rotation = Rotation.from_rotvec(angle * axis).as_matrix()
        vector = transforms.rotation_vector(rotation)
        assert np.linalg.norm(vector) == pytest.approx(angle, abs=1e-9)
        np.testing.assert_allclose(transforms.rotation_from_vector(vector), rotation, atol=1e-9)


def test_rotation_about_takes_an_axis_of_any_length():
    np.testing.assert_allclose(transforms.rotation_about([0, 0, 5], np.pi / 2) @ [1, 0, 0], [0, 1, 0], atol=1e-15)


def test_invert_undoes_a_transform_and_a_stack_of_them():
    stack = np.array(
        [transforms.transform(rotation.as_matrix(), [0.1, -2.0, 3.0]) for rotation in Rotation.random(5, random_state=1)]
    )
    np.testing.assert_allclose(transforms.invert(stack) @ stack, np.broadcast_to(np.eye(4), (5, 4, 4)), atol=1e-14)
    np.testing.assert_allclose(transforms.invert(stack[2]), np.linalg.inv(stack[2]), atol=1e-14)


def test_the_batched_maps_agree_with_the_single_ones(rng):
    vectors = np.vstack([np.zeros(3), 1e-9 * np.ones(3), rng.uniform(-1.7, 1.7, (100, 3))])
    rotations = transforms.rotations_from_vectors(vectors)
    np.testing.assert_allclose(rotations, Rotation.from_rotvec(vectors).as_matrix(), atol=1e-12)
    np.testing.assert_allclose(transforms.rotation_vectors(rotations), vectors, atol=1e-9)
