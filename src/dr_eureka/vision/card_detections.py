"""From the detector's grid to a list of balls and feet: one of each, however many cells saw it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dr_eureka.game.state import COLOURS

_FOOT_SEPARATION = 0.08  # two feet cannot be closer than this share of the crop


@dataclass(frozen=True)
class SeenBall:
    """A ball in a crop: centre and diameter as fractions of the crop's side, colour letter, confidence 0..1."""

    x: float
    y: float
    diameter: float
    colour: str
    confidence: float


@dataclass(frozen=True)
class SeenFoot:
    """A tube's foot in a crop: centre as fractions of the crop's side, confidence 0..1."""

    x: float
    y: float
    confidence: float


@dataclass(frozen=True)
class CropDetections:
    """All that was seen in one crop, most confident first."""

    balls: tuple[SeenBall, ...]
    feet: tuple[SeenFoot, ...]


def collect(
    balls: np.ndarray,
    diameters: np.ndarray,
    class_scores: np.ndarray,
    feet: np.ndarray,
    threshold: float,
) -> CropDetections:
    """Return balls and feet above a confidence, with repeats dropped whatever their class (cells share an edge).

    balls (13, 13, 4), diameters (13, 13), class_scores (13, 13, 3), feet (13, 13, 3): as in GridDetections. A ball's
    confidence is its cell's confidence times its class score, as in YOLO.
    """
    seen_balls = []
    confidence = balls[..., 2] * class_scores.max(-1)
    for row, column in _strongest_first(confidence, threshold):
        x, y, _, kind = (float(v) for v in balls[row, column])
        diameter = float(diameters[row, column])
        if all(np.hypot(x - b.x, y - b.y) > 0.5 * max(diameter, b.diameter) for b in seen_balls):
            seen_balls.append(SeenBall(x, y, diameter, COLOURS[int(kind)], float(confidence[row, column])))
    seen_feet = []
    for row, column in _strongest_first(feet[..., 2], threshold):
        x, y, sure = (float(v) for v in feet[row, column])
        if all(np.hypot(x - f.x, y - f.y) > _FOOT_SEPARATION for f in seen_feet):
            seen_feet.append(SeenFoot(x, y, sure))
    return CropDetections(tuple(seen_balls), tuple(seen_feet))


def _strongest_first(confidence: np.ndarray, threshold: float) -> list[tuple[int, int]]:
    """Return the cells above a threshold, the most confident first."""
    cells = np.argwhere(confidence >= threshold)
    order = np.argsort(-confidence[tuple(cells.T)], kind="stable")
    return [tuple(cell) for cell in cells[order]]
