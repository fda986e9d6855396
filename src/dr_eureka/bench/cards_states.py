"""Every state of the game shown to the card reader in random scenes, and what it made of them.

Each trial has its own random numbers, drawn from the seed, the series, the state and the view: a trial can be drawn again
alone, and the outcome does not depend on how many processes share the work.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain

import cv2
import numpy as np

from dr_eureka.bench.workers import shared_out
from dr_eureka.game.state import all_states
from dr_eureka.vision.card_scenes import CardScene, random_scene
from dr_eureka.vision.card_views import HELD_OUT_VIEWS, ViewRanges
from dr_eureka.vision.cards import CardReader, CardResult

STATES = tuple(str(state) for state in all_states())
# What issue and paper ask for: sides of 80 to 320 px, tilts to 45 degrees, half to twice the light, 5 px of motion blur.
ASKED_VIEWS = ViewRanges(
    side_px=((80.0, 320.0),), turn=((-math.pi, math.pi),), tilt=((0.0, math.pi / 4),), exposure=((0.5, 2.0),),
    motion_px=((1.0, 5.0),),
)
_UPSIDE_DOWN_WITHIN = math.radians(20)


@dataclass(frozen=True)
class Series:
    """One table: a name, the views and the look of cards that its trials are drawn from, and its share of the trials."""

    name: str
    ranges: ViewRanges
    look: str
    views_a_state: int  # of each state, unless told otherwise
    judged: bool  # against the goals


SERIES = (
    Series("any turn", ASKED_VIEWS, "real", 5, True),
    Series(
        "upside down",
        replace(ASKED_VIEWS, turn=((math.pi - _UPSIDE_DOWN_WITHIN, math.pi + _UPSIDE_DOWN_WITHIN),)),
        "real", 5, True,
    ),
    Series("outside training", HELD_OUT_VIEWS, "held_out", 1, False),
)


@dataclass(frozen=True)
class Trial:
    """One scene and what was read in it; figures of the view as in View, spacing in card sides."""

    state: str
    view: int
    result: str
    read: str | None
    confidence: float
    spacing: float
    turn: float
    tilt: float
    side_px: float
    exposure: float
    motion_px: float
    defocus_px: float

    @property
    def right(self) -> bool:
        """OK, and the state that was shown."""
        return self.result == CardResult.OK and self.read == self.state

    @property
    def wrong(self) -> bool:
        """OK, and another state: what must not be."""
        return self.result == CardResult.OK and self.read != self.state

    @property
    def empty(self) -> str:
        """Which tube is empty: none, left, centre or right."""
        tubes = self.state.split("|")
        return ("left", "centre", "right")[tubes.index("")] if "" in tubes else "none"


def scene_of(series: Series, seed: int, state: str, view: int) -> CardScene:
    """Return the scene of one trial; the same for the same arguments."""
    rng = np.random.default_rng((seed, SERIES.index(series), STATES.index(state), view))
    return random_scene(state, rng, series.ranges, series.look)


def run_trials(
    series: Series, seed: int, views: int, processes: int | None = None, states: Sequence[str] = STATES
) -> list[Trial]:
    """Read every state in so many random scenes and return the trials, by state and view.

    processes: how many work, by default one a core. Raises WeightsError or SettingsError as CardReader does.
    """
    work = partial(_read_state, series, seed, views)
    _prepare()  # here too: weights that cannot be loaded are told as an error, not as a worker that dies
    groups = shared_out(work, states, processes, f"cards, {series.name}", _prepare, at_a_time=4)
    return list(chain.from_iterable(groups))


_reader: CardReader | None = None


def _prepare() -> None:
    """Load this process's reader, once; each process keeps to one core."""
    global _reader
    cv2.setNumThreads(1)
    if _reader is None:
        _reader = CardReader.load()


def _read_state(series: Series, seed: int, views: int, state: str) -> list[Trial]:
    trials = []
    for view in range(views):
        scene = scene_of(series, seed, state, view)
        reading = _reader.read(scene.image)
        trials.append(Trial(
            state, view, reading.result, reading.state, reading.confidence, scene.drawing.style.tube_spacing,
            scene.view.turn, scene.view.tilt, scene.view.side_px, scene.view.exposure, scene.view.motion_px,
            scene.view.defocus_px,
        ))
    return trials
