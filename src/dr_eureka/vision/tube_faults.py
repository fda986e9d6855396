"""Why other than three tubes were located: a name for what is wrong, so that a person knows what to put right."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Iterator

import cv2
import numpy as np

from dr_eureka.vision.aruco import find_markers
from dr_eureka.vision.rectified import SheetGrid

# One dictionary of each family; OpenCV's smaller ones of a family are the beginnings of these.
_OTHER_DICTIONARIES = (
    "DICT_4X4_1000", "DICT_5X5_1000", "DICT_6X6_1000", "DICT_7X7_1000", "DICT_ARUCO_ORIGINAL",
    "DICT_APRILTAG_16h5", "DICT_APRILTAG_25h9", "DICT_APRILTAG_36h10", "DICT_APRILTAG_36h11",
)
_OPENING = np.ones((5, 5), np.uint8)
_RING = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)


@dataclass(frozen=True)
class FaultSettings:
    """What counts as lying on the sheet; config/dr_eureka_main.yaml gives meaning and unit of each key."""

    margin_m: float = field(metadata={"min": 0.0, "max": 0.3})
    darkest: float = field(metadata={"min": 0.01, "max": 1.0})
    smallest_saturation: float = field(metadata={"min": 0.01, "max": 1.0})
    smallest_feet: float = field(metadata={"min": 0.01})
    largest_feet: float = field(metadata={"min": 0.01})
    edge_m: float = field(metadata={"min": 0.0, "max": 0.05})


@dataclass(frozen=True)
class Litter:
    """What lies on the sheet besides standing tubes: areas of the largest of its kind, as multiples of a foot's disc.

    `black`: like a fallen tube's foot and tape; `behind`: the same, seen through another tube; `cover`: anything larger, or
    that reaches in over the sheet's edge, as a hand does.
    """

    black: float
    behind: float
    cover: float


def other_dictionary(grey: np.ndarray, wanted: str, ids: set[int]) -> str | None:
    """Return the dictionary of which at least two of the sheet's ids are in the picture, None if there is none.

    One may be a chance likeness; two of a handful of ids among hundreds are not.
    """
    for name in _OTHER_DICTIONARIES:
        if name != wanted and len(ids & set(find_markers(grey, name).corners)) >= 2:
            return name
    return None


def litter_on_sheet(
    rectified_rgb: np.ndarray,
    brightness: np.ndarray,
    feet: np.ndarray,
    camera_in_sheet: np.ndarray,
    grid: SheetGrid,
    settings: FaultSettings,
) -> Litter:
    """Measure what is neither paper nor print nor one of the standing tubes.

    Args:
        rectified_rgb: (rows, columns, 3) uint8 on `grid`.
        brightness: (rows, columns) float32 on `grid`, markers wiped out.
        feet: (n, 2) located feet in the sheet frame [m].
        camera_in_sheet: (3,) the camera's place in the sheet frame [m].
    """
    strongest, weakest = rectified_rgb.max(axis=2), rectified_rgb.min(axis=2)
    coloured = (strongest - weakest) > settings.smallest_saturation * np.maximum(strongest, 1)
    black = brightness < settings.darkest
    pieces = grid.pieces
    inside = _inside(grid, settings.edge_m)
    # A wall may tint what is behind it, and its balls are coloured; black is only its foot with the tape.
    feet_seen = _seen_tubes(feet, pieces.foot_thickness + pieces.tape_height, camera_in_sheet, grid, settings.edge_m)
    tubes_seen = _seen_tubes(feet, pieces.tube_height, camera_in_sheet, grid, settings.edge_m)
    border = cv2.dilate((~inside).astype(np.uint8), _OPENING) > 0
    areas = {"black": 0.0, "behind": 0.0, "cover": 0.0}
    for mask, is_black in ((black & inside & ~feet_seen, True), ((black | coloured) & inside & ~tubes_seen, False)):
        for piece, area in _parts(mask, np.pi * (pieces.foot_radius * grid.pixels_per_metre) ** 2):
            kind = None
            if area > settings.largest_feet or (area > settings.smallest_feet and border[piece].any()):
                kind = "cover"
            elif is_black and area > settings.smallest_feet:
                kind = "behind" if tubes_seen[piece].mean() > 0.5 else "black"
            if kind:
                areas[kind] = max(areas[kind], area)
    return Litter(**areas)


def _parts(mask: np.ndarray, unit: float) -> Iterator[tuple[np.ndarray, float]]:
    """Yield each connected part of a mask, as a mask, and its area in units; thin lines, as blur leaves them, are none."""
    opened = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, _OPENING)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(opened)
    for label in range(1, count):
        yield labels == label, stats[label, cv2.CC_STAT_AREA] / unit


def _inside(grid: SheetGrid, edge_m: float) -> np.ndarray:
    """Return where a picture on `grid` shows the sheet, less a strip along its edge, (rows, columns) bool."""
    columns, rows = grid.size
    pixels = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1)
    half = np.array([grid.pieces.sheet_depth, grid.pieces.sheet_width]) / 2 - edge_m
    return (np.abs(grid.points(pixels)) < half).all(axis=-1)


def _seen_tubes(feet: np.ndarray, height: float, camera_in_sheet: np.ndarray, grid: SheetGrid, margin: float) -> np.ndarray:
    """Return where standing tubes are seen up to a height [m], with a margin [m] round them, (rows, columns) bool."""
    covered = np.zeros(grid.size[::-1], np.uint8)
    radius = grid.pieces.foot_radius + margin
    circle = radius * np.column_stack([np.cos(_RING), np.sin(_RING)])
    for foot in feet:
        points = np.concatenate([np.column_stack([foot + circle, np.full(len(_RING), z)]) for z in (0.0, height)])
        # Where the camera's ray through a point of the tube meets the sheet's plane.
        shadow = camera_in_sheet + (points - camera_in_sheet) * (camera_in_sheet[2] / (camera_in_sheet[2] - points[:, 2:]))
        cv2.fillConvexPoly(covered, cv2.convexHull(np.rint(grid.pixels(shadow[:, :2])).astype(np.int32)), 1)
    return covered > 0
