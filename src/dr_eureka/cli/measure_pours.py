"""The command `measure_pours`: how pours ended in trials, and the planner told so."""
from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Optional

from dr_eureka.bench.planner_file import Figure, Key, figure_at, write
from dr_eureka.bench.pour_trials import PourTrialError, read_trials, shares
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.planner_settings import PLANNER_FILE
from dr_eureka.resources import load_yaml

_ENDINGS = ("intended", "fewer", "more", "lost")


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code, 2 for bad input."""
    arguments = _parser().parse_args(argv)
    try:
        measured = shares(trial for file in arguments.trials for trial in read_trials(file))
        if not measured:
            raise PourTrialError("no pour in any of the files; expected one JSON object a line")
        print("\n".join(_lines(load_yaml(PLANNER_FILE), measured)))
        if arguments.write:
            write(measured)
            print(f"written into {PLANNER_FILE}")
    except DrEurekaError as error:
        print(f"measure_pours: {error}", file=sys.stderr)
        return 2
    return 0


def _lines(content: Mapping[str, Any], measured: Mapping[Key, Figure]) -> list[str]:
    """Return a table of what the yaml says and what was measured, two lines a kind of pour."""
    lines = [f"{'pour':<34}{''.join(f'{ending:>10}' for ending in _ENDINGS)}{'trials':>8}"]
    for key, figure in sorted(measured.items()):
        _, method, held, count = key
        for source, told in (("yaml", figure_at(content, key)), ("trials", figure)):
            name = f"{method}, {count} of {held} balls: {source}"
            shares_told = "".join(f"{told.get(ending, 0.0):>10.4f}" for ending in _ENDINGS)
            lines.append(f"{name:<34}{shares_told}{told.get('trials', 0):>8}")
    return lines


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="measure_pours",
        description=f"Count how pours ended in trials, beside the shares that {PLANNER_FILE} says.",
        epilog='A line of TRIALS is one pour: {"pour": "profiled", "held": 4, "count": 2, "poured": 2, "lost": 0} for a '
        "profiled pour of 2 balls out of a tube that held 4, of which 2 arrived and none fell beside the tubes.",
    )
    parser.add_argument("trials", metavar="TRIALS", nargs="+", type=Path, help="file of pours, one JSON object a line")
    parser.add_argument("--write", action="store_true", help=f"write what was counted into {PLANNER_FILE}; comments stay")
    return parser
