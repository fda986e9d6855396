"""The exact-state table as rows: how often the card reader was right, wrong, or refused, in all and by what it was shown."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from dr_eureka.bench.cards_states import Series, Trial
from dr_eureka.bench.report import Row, share_row
from dr_eureka.vision.cards import CardResult

LEAST_RIGHT, MOST_WRONG = 0.995, 0.0005
_REFUSALS = (CardResult.NO_CARD, CardResult.SEVERAL_CARDS, CardResult.UNREADABLE)


@dataclass(frozen=True)
class Bin:
    """Trials alike in one respect: what is written on them, and which they are."""

    label: str
    trials: tuple[Trial, ...]


@dataclass(frozen=True)
class _Quantity:
    """A figure of a trial to break down by, its unit, and the edges of its bins, the same in every run."""

    name: str
    unit: str
    of: Callable[[Trial], float]
    edges: Sequence[float]


# Over what ASKED_VIEWS and the real look draw; size and light, which are drawn evenly in ratio, in bins of equal ratio.
_QUANTITIES = (
    _Quantity("spacing", "of side", lambda trial: trial.spacing, np.linspace(0.19, 0.34, 6)),
    _Quantity("turn", "deg", lambda trial: math.degrees(trial.turn) % 360.0, np.linspace(0, 360, 9)),
    _Quantity("tilt", "deg", lambda trial: math.degrees(trial.tilt), np.linspace(0, 45, 6)),
    _Quantity("size", "px", lambda trial: trial.side_px, np.geomspace(80, 320, 6)),
    _Quantity("light", "x", lambda trial: trial.exposure, np.geomspace(0.5, 2, 6)),
    _Quantity("motion blur", "px", lambda trial: trial.motion_px, np.linspace(0, 5, 6)),
    _Quantity("defocus", "px", lambda trial: trial.defocus_px, np.linspace(0, 1.2, 5)),
)


def state_rows(series: Series, trials: Sequence[Trial]) -> list[Row]:
    """Return the shares right, wrong and refused of a series in all and, when it is judged, by each thing that varies.

    A part has a row of what was wrong only when something was.
    """
    n = len(trials)
    right, wrong = sum(t.right for t in trials), sum(t.wrong for t in trials)
    goals = (f">= {LEAST_RIGHT}", f"<= {MOST_WRONG}") if series.judged else (None, None)
    verdicts = (right >= LEAST_RIGHT * n, wrong <= MOST_WRONG * n) if series.judged else (None, None)
    name = f"exact state, {series.name}"
    rows = [
        share_row(f"{name}: OK and right", right, n, goal=goals[0], ok=verdicts[0]),
        share_row(f"{name}: OK and wrong", wrong, n, goal=goals[1], ok=verdicts[1]),
    ]
    rows += [share_row(f"{name}: {result}", sum(t.result == result for t in trials), n) for result in _REFUSALS]
    if not series.judged:
        return rows
    for factor, bins in breakdown(trials).items():
        for part in filter(lambda part: part.trials, bins):
            place = f"{name}, {factor} {part.label}"
            rows.append(share_row(f"{place}: OK and right", sum(t.right for t in part.trials), len(part.trials)))
            if wrong_here := sum(t.wrong for t in part.trials):
                rows.append(share_row(f"{place}: OK and wrong", wrong_here, len(part.trials)))
    return rows


def breakdown(trials: Sequence[Trial]) -> dict[str, list[Bin]]:
    """Return for each thing that varies the trials in bins of equal width or ratio; a bin may be empty.

    Which tube is empty has a bin each: none, left, centre, right.
    """
    empty = [Bin(word, tuple(t for t in trials if t.empty == word)) for word in ("none", "left", "centre", "right")]
    parts = {"empty tube": empty}
    for quantity in _QUANTITIES:
        parts[quantity.name] = _in_bins(trials, quantity)
    return parts


def _in_bins(trials: Sequence[Trial], quantity: _Quantity) -> list[Bin]:
    """Return the trials by bin; what lies outside of all, as rounding may have it, in the first or last."""
    edges = quantity.edges
    index = np.clip(np.searchsorted(edges, [quantity.of(trial) for trial in trials], "right") - 1, 0, len(edges) - 2)
    return [
        Bin(f"{low:.3g}..{high:.3g} {quantity.unit}", tuple(t for t, place in zip(trials, index) if place == i))
        for i, (low, high) in enumerate(zip(edges, edges[1:]))
    ]
