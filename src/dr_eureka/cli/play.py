"""What `scripts/play` does: run game.launch, and end with the referee's verdict."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from typing import Optional

from dr_eureka.cli.entry import run
from dr_eureka.cli.launching import LaunchArgumentError, output_folder, read_arguments, run_launch
from dr_eureka.cli.verdict import report

_FILE = "game.launch"


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Play with ARG:=VALUE words (default: the process's), print one line a game, and return the exit code.

    0: the referee calls all games solved; 1: not so; 2: a word is wrong, nothing was started.
    """
    try:
        values = read_arguments(_FILE, sys.argv[1:] if argv is None else argv)
        games = values.get("games", "1")
        if not games.isdecimal():
            raise LaunchArgumentError(f"games: is '{games}'; expected a whole number")
        out = output_folder(values.get("out"), "games")
    except LaunchArgumentError as error:
        print(f"play: {error}", file=sys.stderr)
        return 2
    began_s = time.time()
    code = run_launch("play", _FILE, {**values, "out": str(out)})
    return report(out, int(games), began_s, code)


if __name__ == "__main__":
    run(main)
