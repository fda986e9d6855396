"""Homogeneous transforms and rotations as numpy arrays.

`b_from_a` is the 4x4 matrix that carries points given in frame a into frame b. Roll, pitch, yaw are URDF's fixed-axis
angles, R = Rz(yaw) Ry(pitch) Rx(roll); quaternions are ROS's order x, y, z, w. Metres and radians.
"""

from __future__ import annotations

import math
from typing import Sequence

import numpy as np

_SMALL_ANGLE = 1e-7  # [rad] below this, first-order series are exact to double precision


def transform(rotation: np.ndarray | None = None, translation: Sequence[float] | None = None) -> np.ndarray:
    """Build a 4x4 transform from a (3, 3) rotation and a (3,) translation [m]; identity for what is left out."""
    result = np.eye(4)
    if rotation is not None:
        result[:3, :3] = rotation
    if translation is not None:
        result[:3, 3] = translation
    return result


def invert(b_from_a: np.ndarray) -> np.ndarray:
    """Return a_from_b of rigid transforms (..., 4, 4), by transposing the rotation."""
    matrix = np.asarray(b_from_a, dtype=float)
    rotation = np.swapaxes(matrix[..., :3, :3], -1, -2)
    result = np.zeros_like(matrix)
    result[..., :3, :3] = rotation
    result[..., :3, 3] = -(rotation @ matrix[..., :3, 3:])[..., 0]
    result[..., 3, 3] = 1.0
    return result


def skew(vector: Sequence[float]) -> np.ndarray:
    """Return the (3, 3) matrix whose product with v is the cross product of `vector` and v."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rotation_about(axis: Sequence[float], angle: float) -> np.ndarray:
    """Return the (3, 3) rotation by `angle` [rad] about `axis` (3,), which need not be of unit length (Rodrigues)."""
    unit = np.asarray(axis, dtype=float)
    unit = unit / np.linalg.norm(unit)
    cross = skew(unit)
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)


def rotation_from_vector(vector: Sequence[float]) -> np.ndarray:
    """Return the (3, 3) rotation of a rotation vector (3,) [rad] (exponential map)."""
    angle = math.sqrt(float(np.dot(vector, vector)))
    if angle < _SMALL_ANGLE:
        return np.eye(3) + skew(vector)
    return rotation_about(vector, angle)


def rotation_vector(rotation: np.ndarray) -> np.ndarray:
    """Return the rotation vector (3,) [rad] of a (3, 3) rotation (logarithmic map), its length within [0, pi].

    Near pi the antisymmetric part vanishes, so the axis comes from the symmetric part there.
    """
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = np.asarray(rotation, dtype=float)[:3, :3].tolist()
    x, y, z = r21 - r12, r02 - r20, r10 - r01
    twice_sine = math.sqrt(x * x + y * y + z * z)
    angle = math.atan2(twice_sine, r00 + r11 + r22 - 1.0)
    if angle < _SMALL_ANGLE:
        return np.array([0.5 * x, 0.5 * y, 0.5 * z])
    if math.pi - angle > 1e-3:
        scale = angle / twice_sine
        return np.array([scale * x, scale * y, scale * z])
    quaternion = matrix_to_quaternion(rotation)
    norm = math.sqrt(float(np.dot(quaternion[:3], quaternion[:3])))
    return quaternion[:3] * (2.0 * math.atan2(norm, quaternion[3]) / norm)


def rpy_to_matrix(rpy: Sequence[float]) -> np.ndarray:
    """Return the (3, 3) rotation of fixed-axis roll, pitch, yaw [rad] (URDF's `rpy`)."""
    roll, pitch, yaw = rpy
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def matrix_to_rpy(rotation: np.ndarray) -> np.ndarray:
    """Return fixed-axis roll, pitch, yaw (3,) [rad] of a (3, 3) rotation; roll is set to 0 at pitch +-90 degrees."""
    matrix = np.asarray(rotation, dtype=float)
    cos_pitch = math.hypot(matrix[0, 0], matrix[1, 0])
    pitch = math.atan2(-matrix[2, 0], cos_pitch)
    if cos_pitch < 1e-9:
        return np.array([0.0, pitch, math.atan2(-matrix[0, 1], matrix[1, 1])])
    return np.array([math.atan2(matrix[2, 1], matrix[2, 2]), pitch, math.atan2(matrix[1, 0], matrix[0, 0])])


def quaternion_to_matrix(quaternion_xyzw: Sequence[float]) -> np.ndarray:
    """Return the (3, 3) rotation of a quaternion x, y, z, w of any non-zero length."""
    x, y, z, w = np.asarray(quaternion_xyzw, dtype=float) / np.linalg.norm(quaternion_xyzw)
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def matrix_to_quaternion(rotation: np.ndarray) -> np.ndarray:
    """Return the unit quaternion x, y, z, w with w >= 0 of a (3, 3) rotation (Shepperd: divide by the largest part)."""
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = np.asarray(rotation, dtype=float)[:3, :3].tolist()
    squares = (1.0 + r00 - r11 - r22, 1.0 - r00 + r11 - r22, 1.0 - r00 - r11 + r22, 1.0 + r00 + r11 + r22)
    largest = max(range(4), key=squares.__getitem__)
    if largest == 0:
        parts = (squares[0], r01 + r10, r02 + r20, r21 - r12)
    elif largest == 1:
        parts = (r01 + r10, squares[1], r12 + r21, r02 - r20)
    elif largest == 2:
        parts = (r02 + r20, r12 + r21, squares[2], r10 - r01)
    else:
        parts = (r21 - r12, r02 - r20, r10 - r01, squares[3])
    quaternion = np.array(parts)
    quaternion /= np.linalg.norm(quaternion)
    return -quaternion if quaternion[3] < 0.0 else quaternion


def rotation_vectors(rotations: np.ndarray) -> np.ndarray:
    """Return the rotation vectors (n, 3) [rad] of rotations (n, 3, 3) of at most some three radians, all at once."""
    sines = 0.5 * np.stack(
        [
            rotations[:, 2, 1] - rotations[:, 1, 2],
            rotations[:, 0, 2] - rotations[:, 2, 0],
            rotations[:, 1, 0] - rotations[:, 0, 1],
        ],
        axis=1,
    )
    length = np.linalg.norm(sines, axis=1)
    angle = np.arctan2(length, 0.5 * (np.trace(rotations, axis1=1, axis2=2) - 1.0))
    scale = np.divide(angle, length, out=np.ones_like(angle), where=length > _SMALL_ANGLE)
    return sines * scale[:, None]


def rotations_from_vectors(vectors: np.ndarray) -> np.ndarray:
    """Return the rotations (n, 3, 3) of rotation vectors (n, 3) [rad], all at once."""
    angle = np.linalg.norm(vectors, axis=1)
    safe = np.maximum(angle, _SMALL_ANGLE)
    cross = np.zeros((len(vectors), 3, 3))
    cross[:, 2, 1], cross[:, 0, 2], cross[:, 1, 0] = vectors.T
    cross -= cross.transpose(0, 2, 1)
    sine = (np.sin(safe) / safe)[:, None, None]
    cosine = (0.5 * (np.sin(0.5 * safe) / (0.5 * safe)) ** 2)[:, None, None]
    return np.eye(3) + sine * cross + cosine * (cross @ cross)
