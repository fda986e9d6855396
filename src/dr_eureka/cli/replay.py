"""What `scripts/replay` does: run replay.launch on a recording, and end with whether card, plan and tubes were found."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Optional

from dr_eureka.cli.entry import run
from dr_eureka.cli.launching import LaunchArgumentError, output_folder, read_arguments, run_launch
from dr_eureka.cli.verdict import report_replay

_FILE = "replay.launch"


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Replay with the words BAG [ARG:=VALUE ...] (default: the process's), print one line, and return the exit code.

    0: goal, plan and tubes were found; 1: not so; 2: a word is wrong, nothing was started.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    try:
        if not words or ":=" in words[0]:
            raise LaunchArgumentError("no recording given; expected BAG [ARG:=VALUE ...]")
        values = read_arguments(_FILE, words[1:])
        if "bag" in values:
            raise LaunchArgumentError("bag: is given twice; expected the recording as first word only")
        bag = Path(words[0]).expanduser().absolute()
        if not bag.is_file():
            raise LaunchArgumentError(f"{bag}: no such file; expected a bag recorded with record:=true")
        out = output_folder(values.get("out"), "replays")
    except LaunchArgumentError as error:
        print(f"replay: {error}", file=sys.stderr)
        return 2
    began_s = time.time()
    code = run_launch("replay", _FILE, {**values, "bag": str(bag), "out": str(out)})
    return report_replay(out, began_s, code)


if __name__ == "__main__":
    run(main)
