"""When a direct pour must turn back so that just so many balls pass, found on the robot's own arms in simulation.

How many balls pass grows with the time until the tube turns back. For each number of balls the search finds, by bisection, when it
is first reached; between that and the next one's, in the middle, is where a pour stands farthest from going wrong.
"""
from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from dr_eureka.bench.pour_rig import PourKind, PourRig
from dr_eureka.control.settings import ControlSettings
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.state import TUBE_CAPACITY

# Of the searches: earliest and latest turn and how finely it is found, in steps for linear and in ms for profiled.
LINEAR_STEPS = (60, 330, 3)
PROFILED_MS = (40, 400, 2)
# Nothing goes wrong with a later turn where all balls shall pass: so much later than the last one needs.
LATER_FOR_ALL = 1.5


class PourCalibrationError(DrEurekaError):
    """A pour that no turn can bring about, or notes of a search that cannot be read."""


class Notes:
    """What was tried and how many balls passed, kept in a file of one JSON object a line, so that a search can go on later."""

    def __init__(self, file: Path | None):
        self._file = file
        self._arrived: dict[tuple[str, int, int], int] = {}
        if file is not None and file.exists():
            for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
                try:
                    note = json.loads(line)
                    self._arrived[note["pour"], note["held"], note["turn"]] = note["arrived"]
                except (ValueError, TypeError, KeyError) as error:
                    raise PourCalibrationError(f"{file}:{number}: {error!r}; expected a note of a search, or no file") from error

    def arrived(self, method: str, held: int, turn: int, attempt: Callable[[], int]) -> int:
        """Return how many of `held` balls passed with that turn, trying it if nobody has."""
        key = method, held, turn
        if key not in self._arrived:
            self._arrived[key] = attempt()
            if self._file is not None:
                with self._file.open("a", encoding="utf-8") as file:
                    file.write(json.dumps({"pour": method, "held": held, "turn": turn, "arrived": self._arrived[key]}) + "\n")
        return self._arrived[key]


def linear_steps(rig: PourRig, control: ControlSettings, notes: Notes) -> dict[int, dict[int, int]]:
    """Return the return step by balls before and balls to pour; raises PourCalibrationError."""

    def attempt(held: int, turn: int) -> int:
        linear = replace(control.linear_pour, return_steps={held: {held: turn}})
        return rig.pour(PourKind("linear", "left", held, held, 0), replace(control, linear_pour=linear)).arrived

    found = {}
    for held in range(1, TUBE_CAPACITY + 1):
        turns = _turns(lambda turn: notes.arrived("linear", held, turn, lambda: attempt(held, turn)), held, *LINEAR_STEPS)
        found[held] = {count: round(turn) for count, turn in turns.items()}
    return found


def profiled_seconds(rig: PourRig, control: ControlSettings, notes: Notes) -> dict[int, float]:
    """Return how long [s] the dip lasts by the number of balls that stay behind; raises PourCalibrationError."""

    def attempt(turn: int) -> int:
        profiled = replace(control.profiled_pour, dip_seconds={0: turn / 1000.0})
        return rig.pour(PourKind("profiled", "left", TUBE_CAPACITY, TUBE_CAPACITY, 0), replace(control, profiled_pour=profiled)).arrived

    turns = _turns(lambda turn: notes.arrived("profiled", TUBE_CAPACITY, turn, lambda: attempt(turn)), TUBE_CAPACITY, *PROFILED_MS)
    return {staying: round(turns[TUBE_CAPACITY - staying] / 1000.0, 4) for staying in range(TUBE_CAPACITY)}


def _turns(arrived: Callable[[int], int], held: int, first: int, last: int, resolution: int) -> Mapping[int, float]:
    """Return the turn for each number of balls to pour, 1 to `held`."""
    edges = {count: _edge(arrived, count, first, last, resolution) for count in range(1, held + 1)}
    return {
        count: LATER_FOR_ALL * edge if count == held else (edge + edges[count + 1]) / 2.0 for count, edge in edges.items()
    }


def _edge(arrived: Callable[[int], int], count: int, too_early: int, late_enough: int, resolution: int) -> float:
    """Return the turn from which on at least `count` balls pass, halving what is left of the range until it is found."""
    if arrived(late_enough) < count:
        raise PourCalibrationError(f"turning at {late_enough}, fewer than {count} balls pass; expected that all do by then")
    low, high = too_early // resolution, late_enough // resolution
    while high - low > 1:
        middle = (low + high) // 2
        if arrived(middle * resolution) >= count:
            high = middle
        else:
            low = middle
    return (low + high) * resolution / 2.0
