"""The command `benchmark`: measure the papers' figures and our own, as a table, as JSON, and as plots."""
from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Optional

from dr_eureka.errors import DrEurekaError

if TYPE_CHECKING:
    from dr_eureka.bench.report import BenchOptions, Row

# In the order in which `all` runs them; each is a module of dr_eureka.bench with run(options) -> rows.
NAMES = ("cards", "planner", "human", "tubes", "kinematics", "pour", "game", "catch")


class UnknownBenchmark(DrEurekaError):
    """A name that is no benchmark's."""


class OutputError(DrEurekaError):
    """A place where no result can be written."""


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code.

    0 when all was measured and no figure fell short of its goal; 1 when one did or could not be measured; 2 for bad input.
    """
    arguments = _parser().parse_args(argv)
    try:
        names = chosen(arguments.what)
        _check_places(arguments.json, arguments.out)
    except DrEurekaError as error:
        print(f"benchmark: {error}", file=sys.stderr)
        return 2
    # numpy and scipy take a second to import: only once the arguments are known to be good
    from dr_eureka.bench.report import BenchOptions

    options = BenchOptions(arguments.seed, arguments.trials, arguments.out, arguments.processes)
    measured: dict[str, list[Row]] = {}
    failed = False
    for name in names:
        try:
            measured[name] = import_module(f"dr_eureka.bench.{name}").run(options)
        except DrEurekaError as error:
            print(f"benchmark {name}: {error}", file=sys.stderr)
            failed = True
            continue
        _print_table(name, measured[name])
        # Written after each: what was measured in an hour is not lost with what comes next.
        if arguments.json:
            arguments.json.write_text(json.dumps(as_document(measured, options), indent=1, allow_nan=False) + "\n")
    short = any(row.short for rows in measured.values() for row in rows)
    return 1 if failed or short else 0


def available() -> tuple[str, ...]:
    """Return the names of the benchmarks that there are."""
    return tuple(name for name in NAMES if find_spec(f"dr_eureka.bench.{name}"))


def chosen(words: Sequence[str]) -> tuple[str, ...]:
    """Return the benchmarks that words ask for, `all` being all there are. Raises UnknownBenchmark naming the valid ones."""
    valid = available()
    for word in words:
        if word not in (*valid, "all"):
            raise UnknownBenchmark(f"there is no benchmark {word!r}; expected some of {', '.join(valid)}, or all")
    return tuple(name for name in valid if name in words or "all" in words)


def as_document(measured: dict[str, list[Row]], options: BenchOptions) -> dict[str, Any]:
    """Return what `--json` writes: what was measured, seed, machine, and one mapping a row."""
    from dr_eureka.bench.machine import describe_machine

    return {
        "what": " ".join(measured),
        "seed": options.seed,
        "machine": describe_machine(),
        "rows": [{"what": name, **row.as_mapping()} for name, rows in measured.items() for row in rows],
    }


def _check_places(json_file: Path | None, out: Path | None) -> None:
    """Make the folder of plots. Raises OutputError where nothing can be written: better now than after an hour."""
    if json_file is not None and (json_file.is_dir() or not json_file.parent.is_dir()):
        raise OutputError(f"--json {json_file}: expected a file in a folder that exists")
    if out is not None:
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"--out {out}: {error.strerror}; expected a folder or a place for a new one") from error


def _print_table(name: str, rows: Sequence[Row]) -> None:
    from dr_eureka.bench.report import table_lines

    print(name)
    print("\n".join(f"  {line}" for line in table_lines(rows)))
    short = sum(row.short for row in rows)
    judged = short + sum(bool(row.ok) for row in rows)
    print(f"  {judged - short} of {judged} goals met\n", flush=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="benchmark",
        description="Measure what the robot's parts can do: a table on stdout, one row a figure.",
        epilog=f"WHAT is {', '.join(available())}, or all. Exit code 0: measured, and every goal met; 1: a figure falls "
        "short of its goal (SHORT in the table, ok false in the JSON) or could not be measured; 2: bad arguments.",
    )
    parser.add_argument("what", metavar="WHAT", nargs="+", help="what to measure")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the rows there too, with seed and machine")
    parser.add_argument("--seed", type=_whole(0), default=1, help="seed of all that is drawn (default: %(default)s)")
    parser.add_argument("--trials", type=_whole(1), metavar="N", help="how often to try, instead of each one's own number")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="write plots there; made when missing")
    parser.add_argument("--processes", type=_whole(1), metavar="N",
                        help="share the work among so many (default: one a core); only times depend on it")
    return parser


def _whole(least: int):
    """Return an argparse type for whole numbers from `least` on."""

    def parse(word: str) -> int:
        try:
            value = int(word)
        except ValueError:
            value = least - 1
        if value < least:
            raise argparse.ArgumentTypeError(f"{word!r} is no whole number from {least} on")
        return value

    return parse
