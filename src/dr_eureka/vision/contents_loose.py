"""Balls that lie beside the tubes, on the sheet or near it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Iterable

import cv2
import numpy as np

from dr_eureka.pieces import Pieces
from dr_eureka.vision.camera import CameraModel
from dr_eureka.vision.contents_levels import ContentsSettings, TubeView, ball_chromas

_AREA_SHARES = (0.4, 1.6)  # of the disc of a ball there; some of it may be in shade or in glare
_LONGEST_ASPECT = 1.7
_OUTLINE_PX = 5


@dataclass(frozen=True, eq=False)
class LooseBall:
    """A ball's letter and where its centre is, (3,) in `base` [m], taken to lie at the sheet's height."""

    colour: str
    position: np.ndarray


def find_loose_balls(
    image_rgb: np.ndarray,
    camera: CameraModel,
    base_from_camera: np.ndarray,
    base_from_sheet: np.ndarray,
    tubes: Iterable[TubeView],
    pieces: Pieces,
    settings: ContentsSettings,
) -> tuple[LooseBall, ...]:
    """Find pieces of a ball's colour and size outside of the tubes' outlines, on the sheet or `loose_margin_m` round it."""
    colour_of, letters = _ball_coloured(image_rgb, pieces, settings)
    for view in tubes:
        if len(view.outline):
            cv2.fillConvexPoly(colour_of, view.outline, 0)
            cv2.polylines(colour_of, [view.outline], True, 0, _OUTLINE_PX)
    found = []
    for number, letter in enumerate(letters, start=1):
        count, _, stats, centroids = cv2.connectedComponentsWithStats((colour_of == number).astype(np.uint8))
        for label in range(1, count):
            place = _place(centroids[label], camera, base_from_camera, base_from_sheet, pieces, settings)
            if place is None:
                continue
            depth = (np.linalg.inv(base_from_camera) @ [*place, 1.0])[2]
            disc = np.pi * (camera.matrix[0, 0] * pieces.ball_radius / depth) ** 2
            width, height = stats[label, cv2.CC_STAT_WIDTH], stats[label, cv2.CC_STAT_HEIGHT]
            area = stats[label, cv2.CC_STAT_AREA]
            round_enough = max(width, height) <= _LONGEST_ASPECT * min(width, height)
            if round_enough and _AREA_SHARES[0] * disc <= area <= _AREA_SHARES[1] * disc:
                found.append(LooseBall(letter, place))
    return tuple(found)


def _ball_coloured(image_rgb: np.ndarray, pieces: Pieces, settings: ContentsSettings) -> tuple[np.ndarray, list[str]]:
    """Return 1 + the index of each pixel's ball colour, 0 for none, (height, width) uint8; and the letters."""
    bare = ball_chromas(pieces)
    letters = list(bare)
    smooth = cv2.blur(image_rgb, (3, 3)).astype(np.float32)
    chroma = smooth / np.maximum(smooth.sum(axis=2, keepdims=True), 1.0) - np.float32(1 / 3)
    strength = np.linalg.norm(chroma, axis=2)
    along = np.stack([chroma @ (bare[letter] / np.linalg.norm(bare[letter])).astype(np.float32) for letter in letters])
    nearest = along.argmax(axis=0)
    lengths = np.array([np.linalg.norm(bare[letter]) for letter in letters], np.float32)
    good = along.max(axis=0) > settings.smallest_resemblance * strength
    good &= strength > settings.smallest_saturation * lengths[nearest]
    good &= smooth.max(axis=2) > settings.darkest_ball
    return np.where(good, nearest + 1, 0).astype(np.uint8), letters


def _place(
    pixel: np.ndarray,
    camera: CameraModel,
    base_from_camera: np.ndarray,
    base_from_sheet: np.ndarray,
    pieces: Pieces,
    settings: ContentsSettings,
) -> np.ndarray | None:
    """Return where a pixel's ray is a ball's radius above the sheet, (3,) in `base` [m]; None beyond the margin."""
    ray = base_from_camera[:3, :3] @ camera.rays(pixel)
    if ray[2] > -1e-3:
        return None
    centre = base_from_camera[:3, 3]
    point = centre + ray * ((base_from_sheet[2, 3] + pieces.ball_radius - centre[2]) / ray[2])
    in_sheet = np.linalg.inv(base_from_sheet) @ [*point, 1.0]
    half = np.array([pieces.sheet_depth, pieces.sheet_width]) / 2 + settings.loose_margin_m
    return point if (np.abs(in_sheet[:2]) < half).all() else None
