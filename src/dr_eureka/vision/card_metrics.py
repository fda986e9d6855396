"""Mean average precision of the card detector, as the paper's Figure 14 reports it."""

from __future__ import annotations

from typing import Sequence

import numpy as np

from dr_eureka.game.state import COLOURS
from dr_eureka.vision.card_detections import SeenBall


def box_overlap(first: Sequence[float], second: Sequence[float]) -> float:
    """Return the intersection over union of two square boxes (x, y, side), centres and sides in one unit."""
    spans = [
        max(0.0, min(first[i] + first[2] / 2, second[i] + second[2] / 2)
            - max(first[i] - first[2] / 2, second[i] - second[2] / 2))
        for i in (0, 1)
    ]
    shared = spans[0] * spans[1]
    return shared / (first[2] ** 2 + second[2] ** 2 - shared)


def average_precision(
    seen: Sequence[Sequence[SeenBall]], truth: Sequence[np.ndarray], colour: str, overlap: float = 0.5
) -> float:
    """Return the area under precision over recall for one colour (all-point, as PASCAL VOC since 2010).

    seen: detections of each image; truth: (n, 4) of each image: x, y, diameter, class index into COLOURS. NaN when the
    colour never occurs.
    """
    wanted = [t[t[:, 3] == COLOURS.index(colour)] for t in truth]
    total = sum(len(w) for w in wanted)
    if total == 0:
        return float("nan")
    taken = [np.zeros(len(w), bool) for w in wanted]
    ranked = sorted(
        ((ball, image) for image, balls in enumerate(seen) for ball in balls if ball.colour == colour),
        key=lambda pair: -pair[0].confidence,
    )
    hits = np.zeros(len(ranked))
    for rank, (ball, image) in enumerate(ranked):
        overlaps = [box_overlap((ball.x, ball.y, ball.diameter), box[:3]) for box in wanted[image]]
        best = int(np.argmax(overlaps)) if overlaps else -1
        if best >= 0 and overlaps[best] >= overlap and not taken[image][best]:
            taken[image][best] = True
            hits[rank] = 1
    recall = np.concatenate(([0.0], np.cumsum(hits) / total))
    precision = np.cumsum(hits) / np.arange(1, len(hits) + 1)
    envelope = np.maximum.accumulate(precision[::-1])[::-1] if len(precision) else precision
    return float(np.sum(np.diff(recall) * envelope))


def mean_average_precision(
    seen: Sequence[Sequence[SeenBall]], truth: Sequence[np.ndarray], overlap: float = 0.5
) -> float:
    """Return the mean of the three colours' average precisions."""
    return float(np.nanmean([average_precision(seen, truth, colour, overlap) for colour in COLOURS]))
