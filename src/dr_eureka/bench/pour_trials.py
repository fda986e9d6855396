"""How pours end, counted over trials, for config/planner.yaml.

A file of trials has one JSON object a line, such as

    {"pour": "profiled", "held": 4, "count": 2, "poured": 2, "lost": 0}

for a profiled pour of 2 balls out of a tube with 4, of which 2 arrived and none fell beside the tubes.
"""
from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

from dr_eureka.bench.planner_file import Figure, Key
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.planner_settings import load_planner_settings
from dr_eureka.game.state import TUBE_CAPACITY
from dr_eureka.settings import build

_BALLS = {"min": 0, "max": TUBE_CAPACITY}
_WRONG = ("fewer", "more", "lost")


class PourTrialError(DrEurekaError):
    """A file, or a line of it, that tells of no pour."""


@dataclass(frozen=True)
class PourTrial:
    """A pour of `count` balls out of a tube with `held`, by one of the ways to pour: how many arrived, how many were lost."""

    pour: str
    held: int = field(metadata=_BALLS)
    count: int = field(metadata=_BALLS)
    poured: int = field(metadata=_BALLS)
    lost: int = field(metadata=_BALLS)

    def as_line(self) -> str:
        """Return the trial as one line of JSON."""
        return json.dumps(asdict(self)) + "\n"

    @property
    def ending(self) -> str:
        """What the planner calls such an ending: lost, intended, fewer or more; the last two, however many balls."""
        if self.lost:
            return "lost"
        if self.poured == self.count:
            return "intended"
        return "fewer" if self.poured < self.count else "more"


def read_trials(file: Path) -> list[PourTrial]:
    """Return the trials in a file; raises PourTrialError or SettingsError naming file and line."""
    try:
        lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise PourTrialError(f"{file}: cannot be read: {error.strerror}; expected pours, one JSON object a line") from error
    return [_trial(line, f"{file}:{number}") for number, line in enumerate(lines, 1)]


def _trial(line: str, where: str) -> PourTrial:
    try:
        trial = build(PourTrial, json.loads(line), where)
    except ValueError as error:
        raise PourTrialError(f"{where}: {error}; expected a pour as a JSON object") from error
    methods = load_planner_settings().methods
    if trial.pour not in methods:
        raise PourTrialError(f"{where}: pour is {trial.pour!r}; expected {' or '.join(methods)}")
    if not (1 <= trial.count <= trial.held and trial.poured + trial.lost <= trial.held):
        balls = f"{trial.count} of {trial.held} balls, {trial.poured} poured and {trial.lost} lost"
        raise PourTrialError(f"{where}: {balls}; expected no more than the tube held, and at least one to pour")
    return trial


def shares(trials: Iterable[PourTrial]) -> dict[Key, Figure]:
    """Return the share of each ending and the number of trials, by the place in config/planner.yaml.

    Shares are rounded to 0.0001, the intended ones so that all add up to 1; an ending that was never seen is not named. A lock-pour
    of several balls is one of single balls after the other: where it was not tried, it ends as they do.
    """
    endings: dict[Key, Counter[str]] = defaultdict(Counter)
    for trial in trials:
        endings["outcomes", trial.pour, trial.held, trial.count][trial.ending] += 1
    figures = {}
    for key, seen in endings.items():
        figures[key] = _figure({name: seen[name] / seen.total() for name in _WRONG}, seen.total())
    for held in range(2, TUBE_CAPACITY + 1):
        for count in range(2, held + 1):
            key = "outcomes", "lock", held, count
            single = [figures.get(("outcomes", "lock", held - poured, 1)) for poured in range(count)]
            if key not in figures and all(single):
                figures[key] = _in_a_row(single, empties=count == held)
    return figures


def _figure(wrong: Mapping[str, float], trials: int) -> Figure:
    """Return the shares of endings, given those of the wrong ones."""
    named = {name: round(share, 4) for name, share in wrong.items() if round(share, 4)}
    return {"intended": round(1.0 - sum(named.values()), 4), **named, "trials": trials}


def _in_a_row(pours: Sequence[Figure], empties: bool) -> Figure:
    """Return how pours in a row end: as intended when all do, else as the first that does not.

    In a row that empties the tube, a ball too many comes early and not too many in the end.
    """
    well, wrong = 1.0, dict.fromkeys(("fewer", "lost") if empties else _WRONG, 0.0)
    for pour in pours:
        for name in wrong:
            wrong[name] += well * pour.get(name, 0.0)
        well *= pour["intended"]
    return _figure(wrong, min(pour["trials"] for pour in pours))
