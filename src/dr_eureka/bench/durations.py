"""How long the robot's actions take, measured in finished games, for config/planner.yaml."""
from __future__ import annotations

import io
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import accumulate, groupby
from pathlib import Path
from typing import Any, Union

import numpy as np
from ruamel.yaml import YAML
from scipy.linalg import null_space

from dr_eureka.errors import DrEurekaError

#: Place of a figure under `durations:` in config/planner.yaml, such as ("pick", "from_home", "left", "center").
Key = tuple[Union[str, int], ...]
UPRIGHT: Key = ("upright",)
HOME: Key = ("home",)
# Between two strategies the robot looks at the tubes; within one, an action begins when the last one ends.
_LONGEST_PAUSE_S = 1.0


class GameFileError(DrEurekaError):
    """A file that is no record of a finished game."""


@dataclass(frozen=True)
class Duration:
    """A mean duration [s] in so many actions."""

    seconds: float
    trials: int


def read_games(file: Path) -> list[dict[str, Any]]:
    """Return the games in a `game.json`, or in the one in a folder. Raises GameFileError."""
    file = file / "game.json" if file.is_dir() else file
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        games = content.get("games", [content])
        for game in games:
            for action in game["actions"]:
                action["kind"], action["hand"], action["tube"], float(action["start"]), float(action["end"])
    except OSError as error:
        raise GameFileError(f"{file}: cannot be read: {error.strerror}; expected the game.json of a game") from error
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise GameFileError(f"{file}: {type(error).__name__} {error}; expected the game.json of a game") from error
    return games


def measure(games: Iterable[Mapping[str, Any]], method: str) -> dict[Key, Duration]:
    """Return the mean durations of what was done in games that poured by `method`, by their place in the yaml.

    What a game tells as one action may be two: a place right after a pour begins with bringing the tubes upright, a
    strategy's last place ends with the hands at home, a pour begins with bringing the tubes together unless they are. These
    parts are told apart by least squares; those that cannot be told apart are left out. So is a game's last action unless
    the game was solved, for it may be unfinished.
    """
    samples: list[tuple[tuple[Key, ...], float]] = []
    for game in games:
        timed = [action for actions in _strategies(game["actions"]) for action in _timed(actions, method)]
        samples += timed if game.get("solved") else timed[:-1]
    keys = sorted({part for parts, _ in samples for part in parts}, key=str)
    if not keys:
        return {}
    seen = np.array([[key in parts for key in keys] for parts, _ in samples], float)
    means, *_ = np.linalg.lstsq(seen, np.array([seconds for _, seconds in samples]), rcond=None)
    told_apart = np.abs(null_space(seen)).sum(axis=1) < 1e-6
    trials = seen.sum(axis=0).astype(int)
    return {key: Duration(float(mean), int(n)) for key, mean, n, apart in zip(keys, means, trials, told_apart) if apart}


def rewrite(text: str, durations: Mapping[Key, Duration]) -> str:
    """Return the text of config/planner.yaml with durations [s, rounded to 10 ms] and trials replaced, comments kept."""
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = 4096
    content = yaml.load(text)
    for key, duration in durations.items():
        node = content["durations"]
        for name in key:
            node = node[name]
        node["seconds"], node["trials"] = round(duration.seconds, 2), duration.trials
    stream = io.StringIO()
    yaml.dump(content, stream)
    return stream.getvalue()


def _strategies(actions: list[Mapping[str, Any]]) -> Iterator[list[Mapping[str, Any]]]:
    """Yield actions in groups between which the robot looked and all tubes stood on the table."""
    pauses = [later["start"] - earlier["end"] > _LONGEST_PAUSE_S for earlier, later in zip(actions, actions[1:])]
    numbers = accumulate(pauses, initial=0)
    for _, group in groupby(zip(numbers, actions), key=lambda pair: pair[0]):
        yield [action for _, action in group]


def _timed(actions: list[Mapping[str, Any]], method: str) -> Iterator[tuple[tuple[Key, ...], float]]:
    """Yield of each action what it was made of, and its duration [s]."""
    placed: set[str] = set()
    before: Mapping[str, Any] = {}
    for action in actions:
        kind, hand, tube = action["kind"], action["hand"], action["tube"]
        again = kind == before.get("kind") == "pour" and before["hand"] == hand
        parts: list[Key] = [UPRIGHT] if before.get("kind") == "pour" and not again else []
        if kind == "pick":
            parts.append(("pick", "after_place" if hand in placed else "from_home", hand, tube))
        elif kind == "place":
            placed.add(hand)
            parts += [("place", hand, tube)] + ([HOME] if action is actions[-1] else [])
        else:
            parts += [("pour", method, action["count"])] + ([] if again else [("ready", tube)])
        yield tuple(parts), action["end"] - action["start"]
        before = action
