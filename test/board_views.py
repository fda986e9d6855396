"""Pictures of a ChArUco board as a camera of known calibration sees it, drawn by tracing every pixel's ray to the board."""

from functools import lru_cache

import cv2
import numpy as np

from dr_eureka.vision.calibration_views import CalibrationSettings
from dr_eureka.vision.camera import LAB_DISTORTION, LAB_MATRIX, CameraModel

BOARD = CalibrationSettings.load().board
LAB = CameraModel.lab(distorted=True)
# The same lens before a sensor with pixels of twice the size: a quarter of the work to draw.
SMALL = CameraModel(320, 240, np.diag([0.5, 0.5, 1.0]) @ np.array(LAB_MATRIX), LAB_DISTORTION)

PIXELS_PER_METRE = 4000
_FINER = 2


@lru_cache(maxsize=2)
def fine_rays(camera):
    """Return the rays of a picture _FINER times as fine; shrinking it blurs as a sensor's pixels do."""
    rows, columns = np.mgrid[: camera.height * _FINER, : camera.width * _FINER]
    return camera.rays((np.stack([columns, rows], axis=-1) + 0.5) / _FINER - 0.5)


@lru_cache(maxsize=2)
def board_texture(board):
    """Return the printed board, grey uint8, row 0 at its top."""
    size = [round(count * board.square_side * PIXELS_PER_METRE) for count in (board.rows, board.columns)]
    texture = np.full(size, 255, np.uint8)
    for left, top, width, height in board.black_rectangles():
        edges = np.rint(np.array([left, top, left + width, top + height]) * PIXELS_PER_METRE).astype(int)
        texture[edges[1] : edges[3], edges[0] : edges[2]] = 0
    return texture


def board_picture(board, camera, turn, middle, noise=2.0, seed=0):
    """Return (height, width, 3) uint8 rgb of the board on grey ground.

    Args:
        turn: (3,) rotation vector from the board's frame to the optical frame [rad].
        middle: (3,) place of the board's middle in the optical frame [m].
        noise: standard deviation of the pixels' noise [grey levels].
    """
    rotation = cv2.Rodrigues(np.asarray(turn, float))[0]
    extent = np.array([board.columns, board.rows]) * board.square_side
    rays = fine_rays(camera) @ rotation
    offset = rotation.T @ np.asarray(middle, float)
    on_board = rays[..., :2] * (offset[2] / rays[..., 2:]) - offset[:2] + extent / 2
    maps = (on_board * PIXELS_PER_METRE - 0.5).astype(np.float32)
    fine = cv2.remap(board_texture(board), maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderValue=120)
    grey = cv2.resize(fine, (camera.width, camera.height), interpolation=cv2.INTER_AREA).astype(float)
    grey = 30 + 0.8 * grey + np.random.default_rng(seed).normal(0.0, noise, grey.shape)
    return np.repeat(np.clip(grey, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


def good_poses():
    """Return ten (turn, middle) that a person would choose: near, tilted to all sides, out to every corner."""
    tilts = [(0.5, 0), (-0.5, 0), (0, 0.5), (0, -0.5), (0.4, 0.4), (-0.4, 0.4), (0.4, -0.4), (-0.4, -0.4), (0.1, 0)]
    tilts.append((0, 0.6))
    sideways = [0, 0, -0.06, 0.06, -0.09, 0.09, -0.09, 0.09, 0, -0.05]
    down = [-0.05, 0.05, 0, 0, -0.06, -0.06, 0.06, 0.06, 0, 0.04]
    return [
        ((*tilt, 0.3 * (index % 3 - 1)), (x, y, 0.36)) for index, (tilt, x, y) in enumerate(zip(tilts, sideways, down))
    ]


@lru_cache(maxsize=2)
def good_pictures(board, camera):
    """Return the pictures of `good_poses`; one tuple for all tests that ask with the same camera object."""
    return tuple(board_picture(board, camera, *pose, seed=seed) for seed, pose in enumerate(good_poses()))
