"""The command `measure_durations`: how long actions took in finished games, and the planner told so."""
from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Mapping, Optional

from dr_eureka.bench.durations import Duration, Key, measure, read_games, rewrite
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.planner_settings import PLANNER_FILE, load_planner_settings
from dr_eureka.resources import load_yaml, resource_path


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code, 2 for bad input."""
    try:
        arguments = _parser().parse_args(argv)
        games = [game for file in arguments.games for game in read_games(file)]
        known = load_yaml(PLANNER_FILE)["durations"]
        measured = {key: duration for key, duration in measure(games, arguments.pour).items() if _find(known, key)}
        print("\n".join(_lines(known, measured)))
        if arguments.write and measured:
            file = resource_path(PLANNER_FILE)
            file.write_text(rewrite(file.read_text(encoding="utf-8"), measured), encoding="utf-8")
    except (DrEurekaError, OSError) as error:
        print(f"measure_durations: {error}", file=sys.stderr)
        return 2
    return 0


def _find(known: Mapping[Any, Any], key: Key) -> Optional[Mapping[str, Any]]:
    """Return the figure at a place of the yaml, None where the planner has no use for one."""
    node: Any = known
    for name in key:
        node = node.get(name) if isinstance(node, Mapping) else None
    return node


def _lines(known: Mapping[Any, Any], measured: Mapping[Key, Duration]) -> list[str]:
    """Return a table of what the yaml says and what was measured."""
    lines = [f"{'duration':<36}{'yaml [s]':>10}{'trials':>8}{'games [s]':>12}{'trials':>8}"]
    for key, duration in sorted(measured.items(), key=str):
        figure = _find(known, key)
        name = " ".join(map(str, key))
        lines.append(
            f"{name:<36}{figure['seconds']:>10.2f}{figure.get('trials', 0):>8}{duration.seconds:>12.2f}{duration.trials:>8}"
        )
    return lines


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="measure_durations",
        description=f"Measure in finished games how long picks, places and pours take, beside what {PLANNER_FILE} says.",
    )
    parser.add_argument("games", metavar="GAME", nargs="+", type=Path, help="game.json of a game, or the folder it is in")
    methods = load_planner_settings().methods
    parser.add_argument("--pour", choices=methods, default=methods[0], help="how these games poured (default: %(default)s)")
    parser.add_argument("--write", action="store_true", help=f"write what was measured into {PLANNER_FILE}; comments stay")
    return parser
