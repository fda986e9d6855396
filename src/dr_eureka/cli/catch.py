"""What `scripts/catch` does: run catch.launch, and end with what became of the balls."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Optional

from dr_eureka.catching.catch_report import describe_ball
from dr_eureka.cli.entry import run
from dr_eureka.cli.launching import LaunchArgumentError, output_folder, read_arguments, run_launch

_LAUNCH_FILE = "catch.launch"
_RESULT_FILE = "catch.json"


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Let balls go with ARG:=VALUE words (default: the process's), print one line a ball, and return the exit code.

    0: each ball ended as it should; 1: not so; 2: a word is wrong, nothing was started.
    """
    try:
        values = read_arguments(_LAUNCH_FILE, sys.argv[1:] if argv is None else argv)
        out = output_folder(values.get("out"), "catches")
    except LaunchArgumentError as error:
        print(f"catch: {error}", file=sys.stderr)
        return 2
    began_s = time.time()
    code = run_launch("catch", _LAUNCH_FILE, {**values, "out": str(out)})
    return report(out / _RESULT_FILE, began_s, code)


def report(file: Path, since_s: float = 0.0, launch_code: int = 0) -> int:
    """Print one line a ball and a summary; return 0 only if each ended as it should.

    A file last written before `since_s` (Unix time) is that of an earlier session and does not count. `launch_code` is the
    exit code of the launch, for the message when it left no result.
    """
    # File systems keep coarser time than the clock: a file may look a little older than it is.
    if not file.exists() or file.stat().st_mtime < since_s - 0.1:
        problem = f"the launch ended (exit code {launch_code}) before it had a result; the reason stands above"
        print(f"catch: no {file}: {problem}", file=sys.stderr)
        return 1
    try:
        session = json.loads(file.read_text(encoding="utf-8"))
        lines = [f"catch: ball {number}: {describe_ball(ball)}" for number, ball in enumerate(session["balls"], 1)]
        summary = f"catch: {session['caught']} of {session['throws']} balls caught, aimed {session['aim']}; {file}"
    except (OSError, ValueError, KeyError, TypeError) as error:
        print(f"catch: {file}: is not the result of a session: {error!r}", file=sys.stderr)
        return 1
    print("\n".join([*lines, summary]))
    return 0 if session.get("ok") is True else 1


if __name__ == "__main__":
    run(main)
