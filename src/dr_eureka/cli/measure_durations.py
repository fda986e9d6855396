"""The command `measure_durations`: how long actions took in finished games, and the planner told so."""
from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Optional

from dr_eureka.bench.durations import GameFileError, measure, read_games
from dr_eureka.bench.planner_file import Figure, Key, figure_at, write
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.planner_settings import PLANNER_FILE
from dr_eureka.resources import load_yaml


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code, 2 for bad input."""
    arguments = _parser().parse_args(argv)
    try:
        content = load_yaml(PLANNER_FILE)
        games = [game for file in arguments.games for game in read_games(file)]
        measured = {key: figure for key, figure in measure(games).items() if figure_at(content, key)}
        if not measured:
            raise GameFileError("no duration can be told from these games; expected some in which the robot poured")
        print("\n".join(_lines(content, measured)))
        if arguments.write:
            write(measured)
            print(f"written into {PLANNER_FILE}")
    except DrEurekaError as error:
        print(f"measure_durations: {error}", file=sys.stderr)
        return 2
    return 0


def _lines(content: Mapping[str, Any], measured: Mapping[Key, Figure]) -> list[str]:
    """Return a table of what the yaml says and what was measured."""
    lines = [f"{'duration':<36}{'yaml [s]':>10}{'trials':>8}{'games [s]':>12}{'trials':>8}{'failed':>8}"]
    for key, figure in sorted(measured.items(), key=str):
        name = " ".join(map(str, key[1:]))
        told = figure_at(content, key)
        failed = f"{figure['failed']:>8}" if "failed" in figure else ""
        lines.append(
            f"{name:<36}{told['seconds']:>10.2f}{told.get('trials', 0):>8}{figure['seconds']:>12.2f}{figure['trials']:>8}{failed}"
        )
    return lines


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="measure_durations",
        description=f"Measure in finished games how long picks, places and pours take, beside what {PLANNER_FILE} says.",
    )
    parser.add_argument("games", metavar="GAME", nargs="+", type=Path, help="game.json of a game, or the folder it is in")
    parser.add_argument("--write", action="store_true", help=f"write what was measured into {PLANNER_FILE}; comments stay")
    return parser
