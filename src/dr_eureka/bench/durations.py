"""How long the robot's actions take, measured in finished games, for config/planner.yaml."""
from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from itertools import accumulate, groupby
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import null_space

from dr_eureka.bench.planner_file import Figure, Key
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.planner_settings import load_planner_settings

# Between two strategies the robot looks at the tubes on the table; within one, a pick begins when the last action ends.
_LONGEST_PAUSE_S = 1.0


class GameFileError(DrEurekaError):
    """A file that is no record of a finished game."""


def read_games(file: Path) -> list[dict[str, Any]]:
    """Return the games in a `game.json`, or in the one in a folder. Raises GameFileError."""
    file = file / "game.json" if file.is_dir() else file
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        games = content.get("games", [content])
        for game in games:
            for action in game["actions"]:
                action["kind"], action["hand"], action["tube"], float(action["start"]), float(action["end"])
                if action["kind"] == "pour":
                    action["count"]
    except OSError as error:
        raise GameFileError(f"{file}: cannot be read: {error.strerror}; expected the game.json of a game") from error
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise GameFileError(f"{file}: {type(error).__name__} {error}; expected the game.json of a game") from error
    methods = load_planner_settings().methods
    for game in games:
        if game.get("pour") not in methods:
            told = f"pour is {game['pour']!r}" if "pour" in game else "it does not tell how it poured"
            raise GameFileError(f"{file}: {told}; expected a game whose pour is {' or '.join(methods)}")
    return games


def measure(games: Iterable[Mapping[str, Any]]) -> dict[Key, Figure]:
    """Return mean durations [s, rounded to 10 ms] and in how many actions, by their place in config/planner.yaml.

    Actions that a fault ended do not count; how many picks and places that were stands beside those that went well.

    What a game tells as one action may be two: a place right after a pour begins with bringing the tubes upright, a
    strategy's last place ends with the hands at home, a pour begins with bringing the tubes together unless they are. These
    parts are told apart by least squares; those that cannot be told apart are left out. So are a game's last actions unless
    the game was solved, for they may be unfinished.
    """
    samples: list[tuple[tuple[Key, ...], float]] = []
    failed: Counter[Key] = Counter()
    for game in games:
        timed = [action for actions in _strategies(game["actions"]) for action in _timed(actions, game["pour"])]
        last = None if game.get("solved") else max((start for start, *_ in timed), default=None)
        samples += [(parts, seconds) for start, parts, seconds, well in timed if well and start != last]
        failed.update(part for _, parts, _, well in timed if not well for part in parts)
    keys = sorted({part for parts, _ in samples for part in parts}, key=str)
    if not keys:
        return {}
    seen = np.array([[key in parts for key in keys] for parts, _ in samples], float)
    means, *_ = np.linalg.lstsq(seen, np.array([seconds for _, seconds in samples]), rcond=None)
    told_apart = np.abs(null_space(seen)).sum(axis=1) < 1e-6
    trials = seen.sum(axis=0).astype(int)
    figures = {}
    for key, mean, count, apart in zip(keys, means, trials, told_apart):
        if apart:
            figure = {"seconds": round(float(mean), 2), "trials": int(count)}
            figures["durations", *key] = {**figure, "failed": failed[key]} if key[0] in ("pick", "place") else figure
    return figures


def _strategies(actions: list[Mapping[str, Any]]) -> Iterator[list[Mapping[str, Any]]]:
    """Yield actions in groups before each of which the robot looked and all tubes stood on the table.

    It also looks at the tubes in its hands, after a pour, but no pick follows that.
    """
    begins = [
        later["kind"] == "pick" and later["start"] - earlier["end"] > _LONGEST_PAUSE_S
        for earlier, later in zip(actions, actions[1:])
    ]
    numbers = accumulate(begins, initial=0)
    for _, group in groupby(zip(numbers, actions), key=lambda pair: pair[0]):
        yield [action for _, action in group]


def _timed(actions: list[Mapping[str, Any]], method: str) -> Iterator[tuple[float, tuple[Key, ...], float, bool]]:
    """Yield of each action its start [s], what it was made of, by its place under `durations`, its duration [s], and whether it went
    well.

    Actions of both hands at once begin and end together; each counts as lasting that long.
    """
    placed: set[str] = set()
    before: Mapping[str, Any] = {}
    for start, at_once in groupby(actions, key=lambda action: action["start"]):
        under_way = list(at_once)
        for action in under_way:
            kind, hand, tube = action["kind"], action["hand"], action["tube"]
            again = kind == before.get("kind") == "pour" and before["hand"] == hand
            parts: list[Key] = [("upright", method)] if before.get("kind") == "pour" and not again else []
            if kind == "pick":
                parts.append(("pick", "after_place" if hand in placed else "from_home", hand, tube))
            elif kind == "place":
                placed.add(hand)
                parts += [("place", hand, tube)] + ([("home",)] if actions[-1] in under_way else [])
            else:
                parts += [("pour", method, action["count"])] + ([] if again else [("ready", method, tube)])
            yield start, tuple(parts), action["end"] - start, not action.get("failed", False)
        before = under_way[-1]
