"""Mean average precision of the card detector, as the paper's Figure 14 reports it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Sequence

import numpy as np

from dr_eureka.game.state import COLOURS
from dr_eureka.vision.card_detections import SeenBall


@dataclass(frozen=True)
class Match:
    """A ball as detected: in which crop, how sure, and whether it is one that is there."""

    crop: int
    confidence: float
    hit: bool


def box_overlap(first: Sequence[float], second: Sequence[float]) -> float:
    """Return the intersection over union of two square boxes (x, y, side), centres and sides in one unit."""
    spans = [
        max(0.0, min(first[i] + first[2] / 2, second[i] + second[2] / 2)
            - max(first[i] - first[2] / 2, second[i] - second[2] / 2))
        for i in (0, 1)
    ]
    shared = spans[0] * spans[1]
    return shared / (first[2] ** 2 + second[2] ** 2 - shared)


def match_balls(
    truth: Sequence[np.ndarray], seen: Sequence[Sequence[SeenBall]], colour: str, overlap: float = 0.5
) -> tuple[list[Match], np.ndarray]:
    """Return the detections of one colour, the surest first, and how many such balls each crop has (n,).

    Each detection takes the ball that it overlaps most, if no surer one has.
    """
    matches, total = [], np.zeros(len(truth), int)
    for index, (balls, found) in enumerate(zip(truth, seen)):
        wanted = balls[balls[:, 3] == COLOURS.index(colour)]
        total[index] = len(wanted)
        taken: set[int] = set()
        for ball in sorted((b for b in found if b.colour == colour), key=lambda b: -b.confidence):
            overlaps = [box_overlap((ball.x, ball.y, ball.diameter), box[:3]) for box in wanted]
            best = int(np.argmax(overlaps)) if overlaps else -1
            hit = best >= 0 and overlaps[best] >= overlap and best not in taken
            taken |= {best} if hit else set()
            matches.append(Match(index, ball.confidence, hit))
    return sorted(matches, key=lambda match: -match.confidence), total


def weighted_precision(matches: Sequence[Match], total: np.ndarray, weights: np.ndarray) -> float:
    """Return the average precision when each crop counts so many times; with all ones that of the crops as they are.

    matches: the surest first; total, weights: (n,) balls of the colour in each crop, and how often it counts.
    """
    if not matches:
        return 0.0
    times = weights[[match.crop for match in matches]]
    hits = np.cumsum(times * [match.hit for match in matches])
    precision = hits / np.maximum(np.cumsum(times), 1)
    envelope = np.maximum.accumulate(precision[::-1])[::-1]
    recall = np.concatenate(([0.0], hits / (total @ weights)))
    return float(np.sum(np.diff(recall) * envelope))


def average_precision(
    seen: Sequence[Sequence[SeenBall]], truth: Sequence[np.ndarray], colour: str, overlap: float = 0.5
) -> float:
    """Return the area under precision over recall for one colour (all-point, as PASCAL VOC since 2010).

    seen: detections of each image; truth: (n, 4) of each image: x, y, diameter, class index into COLOURS. NaN when the
    colour never occurs.
    """
    matches, total = match_balls(truth, seen, colour, overlap)
    return weighted_precision(matches, total, np.ones(len(truth), int)) if total.any() else float("nan")


def mean_average_precision(
    seen: Sequence[Sequence[SeenBall]], truth: Sequence[np.ndarray], overlap: float = 0.5
) -> float:
    """Return the mean of the three colours' average precisions."""
    return float(np.nanmean([average_precision(seen, truth, colour, overlap) for colour in COLOURS]))
