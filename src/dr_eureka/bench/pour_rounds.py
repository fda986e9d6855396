"""Rounds of pours: in each, the tubes are grasped once and every kind of pour is tried from there.

Each round has its own random numbers, drawn from seed and number, so that the outcome does not depend on how many processes
share the work. The rounds of one kind of pour are independent of one another.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import chain

import numpy as np

from dr_eureka.bench.pour_places import PourPlacesError, located_feet, scattered
from dr_eureka.bench.pour_rig import PourKind, PourRig
from dr_eureka.bench.pour_spread import Spread, mistimed
from dr_eureka.bench.workers import shared_out
from dr_eureka.control.codes import ControlError, EngineCode
from dr_eureka.control.settings import ControlSettings
from dr_eureka.game.hands import HANDS
from dr_eureka.game.state import BALLS_PER_COLOUR, COLOURS, TUBE_CAPACITY
from dr_eureka.pieces import Pieces, load_pieces
from dr_eureka.resources import load_yaml
from dr_eureka.simulation.settings import CameraSettings, WorldSettings, load_camera_settings, load_world_settings
from dr_eureka.simulation.stage import Stage
from dr_eureka.vision.tubes import TubeSettings

CONTROL = "config/control_engine.yaml"
BALLS = BALLS_PER_COLOUR * len(COLOURS)


@dataclass(frozen=True)
class Trial:
    """A pour that was tried: how far off [rad] the tube that was poured from was put in the hand, and what became of it.

    `code`: the engine's, or one of TubeResult where the tubes were not located. Without `arrived` it did not begin.
    """

    kind: PourKind
    tilt: float
    code: str
    arrived: int | None = None
    lost: int = 0
    seconds: float = 0.0

    @property
    def right(self) -> bool:
        """Whether it was carried out, just as many balls arrived as were meant to, and none was lost."""
        return self.code == EngineCode.OK and self.arrived == self.kind.count and self.lost == 0


def lock_kinds() -> list[PourKind]:
    """Return the lock-pours out of 1 to 4 balls into 0 to 3 that six balls allow, by either hand."""
    return [
        PourKind("lock", hand, held, 1, there)
        for hand in HANDS for held in range(1, TUBE_CAPACITY + 1) for there in range(min(TUBE_CAPACITY, BALLS + 1 - held))
    ]


def direct_kinds(method: str, hand: str) -> list[PourKind]:
    """Return the pours of Table 2, then those of all balls, into an empty tube."""
    every = [PourKind(method, hand, held, count, 0) for held in range(TUBE_CAPACITY, 0, -1) for count in range(1, held + 1)]
    return sorted(every, key=lambda kind: kind.held == kind.count)


def run_rounds(
    spread: Spread, seed: int, rounds: int, kinds_of: Callable[[int], list[PourKind]], processes: int | None, label: str
) -> list[Trial]:
    """Return the trials of so many rounds, in order.

    `kinds_of`: the kinds of pours that a round of that number tries; `processes`: how many work, by default one a core.
    """
    tried = shared_out(partial(_round, spread, seed, kinds_of), range(rounds), processes, label, _prepare)
    return list(chain.from_iterable(tried))


@dataclass(frozen=True, eq=False)
class _Bench:
    control: ControlSettings
    world: WorldSettings
    pieces: Pieces
    camera: CameraSettings
    tubes: TubeSettings
    stage: Stage
    seeing_stage: Stage


_bench: _Bench | None = None


def _prepare() -> None:
    """Load this process's settings, once."""
    global _bench
    if _bench is None:
        control = ControlSettings.from_mapping(load_yaml(CONTROL), CONTROL)
        camera = load_camera_settings()
        stages = Stage(None), Stage(camera.renderer)
        _bench = _Bench(control, load_world_settings(), load_pieces(), camera, TubeSettings.load(), *stages)


def every_kind(number: int) -> list[PourKind]:
    """Return all kinds of pours: the direct ones by one hand, which changes from round to round, the lock-pours by both."""
    hand = HANDS[number % len(HANDS)]
    return [*direct_kinds("profiled", hand), *direct_kinds("linear", hand), *lock_kinds()]


def fewer_kinds(number: int) -> list[PourKind]:
    """Return the pours of Table 2 and one in four of the lock-pours, other ones from round to round, by one hand."""
    hand = HANDS[number % len(HANDS)]
    direct = [kind for method in ("profiled", "linear") for kind in direct_kinds(method, hand) if kind.held > kind.count]
    locks = [kind for kind in lock_kinds() if kind.hand == hand]
    return [*direct, *locks[number // len(HANDS) % 4 :: 4]]


def _round(spread: Spread, seed: int, kinds_of: Callable[[int], list[PourKind]], number: int) -> list[Trial]:
    kinds, rng, bench = kinds_of(number), np.random.default_rng((seed, number, 5)), _bench
    world, world_seed = scattered(bench.world, spread), seed * 1_000_003 + number
    try:
        feet = located_feet(world, world_seed, bench.pieces, bench.camera, bench.tubes, bench.seeing_stage)
        rig = PourRig(bench.control, world, bench.pieces, spread, world_seed, bench.stage, feet=feet)
    except PourPlacesError as error:
        return [Trial(kind, 0.0, error.result) for kind in kinds]
    except ControlError as error:
        return [Trial(kind, 0.0, error.code) for kind in kinds]
    trials = []
    for kind in kinds:
        settings = mistimed(bench.control, spread, rng, kind.held, kind.count)
        try:
            poured = rig.pour(kind, settings)
        except ControlError as error:
            trials.append(Trial(kind, rig.tilts[kind.hand], error.code))
        else:
            trials.append(Trial(kind, rig.tilts[kind.hand], poured.code, poured.arrived, poured.lost, poured.seconds))
    return trials
