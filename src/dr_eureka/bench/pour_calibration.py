"""When a direct pour must turn back so that just so many balls pass, found on the robot's own arms in simulation.

Over some grasps, drawn at the stated spread with the tubes in their places, every turn of a grid is tried with a full tube. For
each number of balls the turn is taken at which, and a little before and after, most grasps poured just so many. Where the first
ball that stays behind starts does not depend on how many there were above it, so that one search serves pours out of fuller and
emptier tubes.
"""
from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

import numpy as np

from dr_eureka.bench.pour_rig import PourKind, Poured, PourRig
from dr_eureka.bench.report import progress
from dr_eureka.control.codes import ControlError, EngineCode
from dr_eureka.control.settings import ControlSettings
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.hands import HANDS
from dr_eureka.game.state import TUBE_CAPACITY

# When to turn back: steps for linear, ms for profiled; finely where one ball more passes every few, coarsely where all do.
TURNS = {
    "profiled": (*range(70, 170, 2), *range(170, 400, 15)),
    "linear": (*range(135, 240, 3), *range(240, 400, 15)),
}
NO_TURNS: Mapping[str, Mapping[int, int]] = {method: {} for method in TURNS}
# A turn is judged with its neighbours, as a pour may be timed a little wrongly.
_WEIGHTS = np.array([1.0, 2.0, 3.0, 2.0, 1.0]) / 9.0
# So many turns of the grid later than need be all balls are given to pass: for grasps that are worse than any that was tried.
_ROOM = 2


class PourCalibrationError(DrEurekaError):
    """A pour that no turn can bring about, or notes of a search that cannot be read."""


@dataclass(frozen=True)
class Turn:
    """When to turn back, and the share of grasps with which just as many balls passed as were meant to."""

    at: int
    share: float


class Notes:
    """What was tried and how many balls passed, in a file of one JSON object a line, so that a search can go on later.

    `search`: a word for what is searched with; the first line tells it. A last line without its end was being written when a
    search was broken off: it is cut off. Raises PourCalibrationError for a file that holds something else, or notes of another
    search.
    """

    def __init__(self, file: Path | None, search: str):
        self._file = file
        self._arrived: dict[tuple[str, int, int], int] = {}
        if file is None:
            return
        if not file.exists() or file.stat().st_size == 0:
            file.write_text(json.dumps({"search": search}) + "\n", encoding="utf-8")
        whole, _, torn = file.read_bytes().rpartition(b"\n")
        for number, line in enumerate(whole.splitlines() or [b""], 1):
            try:
                note = json.loads(line)
                if number > 1:
                    self._arrived[note["pour"], note["grasp"], note["turn"]] = int(note["arrived"])
                elif note["search"] != search:
                    problem = f"{file}: notes of a search with another seed, or other settings; expected the same, or no file"
                    raise PourCalibrationError(problem)
            except (ValueError, TypeError, KeyError) as error:
                problem = f"{file}:{number}: {error!r}; expected a note of a search, or no file"
                raise PourCalibrationError(problem) from error
        if torn:
            os.truncate(file, len(whole) + 1)

    def arrived(self, method: str, grasp: int, turn: int, attempt: Callable[[], Poured]) -> int:
        """Return how many balls passed with that turn, -1 where one was lost or no pour was made, trying it if nobody has."""
        key = method, grasp, turn
        if key not in self._arrived:
            try:
                poured = attempt()
                self._arrived[key] = -1 if poured.lost or poured.code != EngineCode.OK else poured.arrived
            except ControlError:
                self._arrived[key] = -1
            if self._file is not None:
                with self._file.open("a", encoding="utf-8") as file:
                    note = {"pour": method, "grasp": grasp, "turn": turn, "arrived": self._arrived[key]}
                    file.write(json.dumps(note) + "\n")
        return self._arrived[key]


def search(make_rig: Callable[[int], PourRig], control: ControlSettings, grasps: int, notes: Notes) -> dict[str, dict[int, Turn]]:
    """Return by method, then by how many balls stay behind, when to turn back; raises PourCalibrationError.

    `make_rig`: gives the PourRig with the grasp of that number; it is only asked for where something is left to try.
    """
    arrived = {method: np.zeros((len(turns), grasps), dtype=int) for method, turns in TURNS.items()}
    for grasp in progress(iter(range(grasps)), grasps, "grasps"):
        rig = cache(partial(make_rig, grasp))
        for method, turns in TURNS.items():
            for row, turn in enumerate(turns):

                def attempt() -> Poured:
                    kind = PourKind(method, HANDS[grasp % len(HANDS)], TUBE_CAPACITY, TUBE_CAPACITY, 0)
                    return rig().pour(kind, told(control, {method: {0: turn}}))

                arrived[method][row, grasp] = notes.arrived(method, grasp, turn, attempt)
    return {method: best_turns(method, turns, arrived[method]) for method, turns in TURNS.items()}


def best_turns(method: str, turns: Sequence[int], arrived: np.ndarray) -> dict[int, Turn]:
    """Return when to turn back by how many balls stay behind, of a full tube; raises PourCalibrationError.

    `arrived` (k, n): how many balls passed at each of k turns with each of n grasps, -1 where one was lost. Of equally good
    turns in a row it is the middle one; where all balls shall pass, one soon after the first, as turning later only takes longer.
    """
    found = {}
    for staying in range(TUBE_CAPACITY):
        shares = np.mean(arrived == TUBE_CAPACITY - staying, axis=1)
        judged = np.convolve(np.pad(shares, len(_WEIGHTS) // 2, mode="edge"), _WEIGHTS, mode="valid")
        if shares.max() == 0.0:
            problem = f"{method}: no turn between {turns[0]} and {turns[-1]} leaves just {staying} of {TUBE_CAPACITY} balls behind"
            raise PourCalibrationError(f"{problem}; expected one that does")
        first = last = int(np.argmax(judged))
        while last + 1 < len(judged) and judged[last + 1] >= judged[first] - 1e-9:
            last += 1
        best = min(first + _ROOM, last) if staying == 0 else (first + last) // 2
        found[staying] = Turn(turns[best], float(shares[best]))
    return found


def told(control: ControlSettings, turns: Mapping[str, Mapping[int, int]]) -> ControlSettings:
    """Return settings of pours that turn back as they are told, by method and by how many balls stay behind."""
    if "profiled" in turns:
        seconds = {staying: turn / 1000.0 for staying, turn in turns["profiled"].items()}
        control = replace(control, profiled_pour=replace(control.profiled_pour, dip_seconds=seconds))
    if "linear" in turns:
        steps = {
            held: {held - staying: turn for staying, turn in sorted(turns["linear"].items(), reverse=True) if staying < held}
            for held in range(1, TUBE_CAPACITY + 1)
        }
        control = replace(control, linear_pour=replace(control.linear_pour, return_steps=steps))
    return control
