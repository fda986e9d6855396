"""Mean average precision of both card detectors on cards drawn as none of their training was (paper section 4.1).

The crops are cut out as the finder cuts them, from cards of the look `held_out` in HELD_OUT_VIEWS: two figures of each
drawing outside training's range, and one of size, tilt, light, motion blur, noise and compression outside of its own.
With everything in the drawing and two of the view outside, the first choice, neither network comes near the goal, and
on some crops a person does not either: `far` crops are measured beside, without judging.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from dr_eureka.bench.cards_states import STATES
from dr_eureka.bench.report import Row, progress
from dr_eureka.game.state import COLOUR_NAMES, COLOURS
from dr_eureka.vision.card_detections import CropDetections, collect
from dr_eureka.vision.card_metrics import match_balls, weighted_precision
from dr_eureka.vision.card_renderer import draw_card
from dr_eureka.vision.card_scenes import rectified_sample
from dr_eureka.vision.card_style import sample_style
from dr_eureka.vision.card_views import FAR_VIEWS, HELD_OUT_VIEWS

if TYPE_CHECKING:
    from dr_eureka.vision.card_network import CardNetwork

CROPS, FAR_CROPS = 1000, 300
LEAST_MAP, MOST_BEHIND = 0.99, 0.005
TITLES = {"eureka": "YOLO-Dr. Eureka", "tiny": "YOLOv2-tiny"}
PAPER_MAP = 0.952  # of both networks
_LEAST_CONFIDENCE = 0.05
_TEXTURE_PX = 256
_RESAMPLINGS = 1000
_CROPS, _BOOTSTRAP = 100, 101  # what random numbers are for: each use has its own


@dataclass(frozen=True)
class Crop:
    """A held-out crop (416, 416, 3) uint8 RGB; balls (6, 4): x, y, diameter as shares of the crop, and the class index."""

    image: np.ndarray
    balls: np.ndarray


@dataclass(frozen=True)
class HeldOut:
    """What is on the held-out crops, balls (6, 4) of each as in Crop, and what each network sees there."""

    truth: list[np.ndarray]
    seen: dict[str, list[CropDetections]]


def held_out_crop(seed: int, index: int, far: bool = False) -> Crop:
    """Return one crop of a random state; the same for the same arguments."""
    rng = np.random.default_rng((seed, _CROPS, index))
    state = STATES[rng.integers(len(STATES))]
    drawing = draw_card(state, rng, _TEXTURE_PX, sample_style(rng, "far" if far else "held_out"))
    image, balls, _ = rectified_sample(drawing, rng, FAR_VIEWS if far else HELD_OUT_VIEWS)
    return Crop(image, balls)


def detect_held_out(networks: Mapping[str, CardNetwork], seed: int, count: int, far: bool = False) -> HeldOut:
    """Return what networks see on so many crops, from a confidence on that is low enough for mAP."""
    found = HeldOut([], {model: [] for model in networks})
    for index in progress(range(count), count, "held-out crops"):
        crop = held_out_crop(seed, index, far)
        found.truth.append(crop.balls)
        for model, network in networks.items():
            grid = network.detect(crop.image)
            arrays = (a[0].numpy() for a in (grid.balls, grid.diameters, grid.class_scores, grid.feet))
            found.seen[model].append(collect(*arrays, threshold=_LEAST_CONFIDENCE))
    return found


def map_rows(found: HeldOut, seed: int) -> list[Row]:
    """Return mAP@0.5 of each colour and their mean for each network, and how far ours is behind.

    Intervals: bootstrap over crops, both networks on the same ones.
    """
    rows, draws, figures, n = [], {}, {}, len(found.truth)
    weights = np.random.default_rng((seed, _BOOTSTRAP)).multinomial(n, np.full(n, 1 / n), _RESAMPLINGS)
    for model in TITLES:
        balls, by_colour = [crop.balls for crop in found.seen[model]], []
        for colour in COLOURS:
            matches, total = match_balls(found.truth, balls, colour)
            drawn = np.array([weighted_precision(matches, total, w) for w in weights])
            by_colour.append((weighted_precision(matches, total, np.ones(n, int)), drawn))
            rows.append(_map_row(f"AP@0.5 {COLOUR_NAMES[colour]}, {TITLES[model]}", *by_colour[-1], n))
        figures[model] = float(np.mean([value for value, _ in by_colour]))
        draws[model] = np.mean([drawn for _, drawn in by_colour], axis=0)
        rows.append(_map_row(f"mAP@0.5, {TITLES[model]}", figures[model], draws[model], n, paper=PAPER_MAP))
    ahead, interval = figures["eureka"] - figures["tiny"], _interval(draws["eureka"] - draws["tiny"])
    met = ahead >= -MOST_BEHIND
    rows.append(Row("mAP@0.5, ours less YOLOv2-tiny", ahead, "share", n, interval, 0.0, f">= -{MOST_BEHIND}", met))
    return rows


def far_rows(found: HeldOut, seed: int) -> list[Row]:
    """Return the mean mAP@0.5 of each network, and how far ours is behind, on far crops; not judged."""
    return [
        replace(row, name=f"{row.name}, far outside training", paper=None, goal=None, ok=None)
        for row in map_rows(found, seed) if row.name.startswith("mAP")
    ]


def _map_row(name: str, value: float, drawn: np.ndarray, n: int, paper: float | None = None) -> Row:
    return Row(name, value, "share", n, _interval(drawn), paper, f">= {LEAST_MAP}", value >= LEAST_MAP)


def _interval(drawn: np.ndarray) -> tuple[float, float]:
    low, high = np.percentile(drawn, (2.5, 97.5))
    return float(low), float(high)
