"""How pours end, counted over trials, for config/planner.yaml.

A file of trials has one JSON object a line, such as

    {"pour": "profiled", "held": 4, "count": 2, "poured": 2, "lost": 0}

for a profiled pour of 2 balls out of a tube with 4, of which 2 arrived and none fell beside the tubes.
"""
from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path

from dr_eureka.bench.planner_file import Figure, Key
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.planner_settings import load_planner_settings
from dr_eureka.game.state import TUBE_CAPACITY
from dr_eureka.settings import build

_BALLS = {"min": 0, "max": TUBE_CAPACITY}


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

    Shares are rounded to 0.0001, the intended ones so that all add up to 1; an ending that was never seen is not named.
    """
    endings: dict[Key, Counter[str]] = defaultdict(Counter)
    for trial in trials:
        endings["outcomes", trial.pour, trial.held, trial.count][trial.ending] += 1
    figures = {}
    for key, seen in endings.items():
        wrong = {name: round(seen[name] / seen.total(), 4) for name in ("fewer", "more", "lost") if seen[name]}
        figures[key] = {"intended": round(1.0 - sum(wrong.values()), 4), **wrong, "trials": seen.total()}
    return figures
