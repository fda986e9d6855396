"""Run game.launch as `scripts/play` does: with a master of its own, leaving no process behind, ending with the verdict.

Takes part in no ROS graph itself and imports nothing of ROS.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Optional

from dr_eureka.cli.verdict import report

_PR_SET_CHILD_SUBREAPER = 36  # <linux/prctl.h>
_POLL_S = 0.1


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Play, print one line a game, and return 0 only if the referee calls all of them solved."""
    parser = argparse.ArgumentParser(prog="play", description="Run game.launch and say how the games ended.")
    parser.add_argument("out", type=Path, help="folder for game.json")
    parser.add_argument("launch_arguments", nargs="*", help="ARG:=VALUE for game.launch")
    parser.add_argument("--games", type=int, default=1, help="how many games there should be (default: 1)")
    arguments = parser.parse_args(argv)
    master = own_master_uri(os.environ.get("ROS_MASTER_URI", "http://localhost:11311"))
    command = ["roslaunch", "--no-summary", "--skip-log-check", "dr_eureka", "game.launch", f"out:={arguments.out}"]
    began_s = time.time()
    code = run_family([*command, *arguments.launch_arguments], {**os.environ, "ROS_MASTER_URI": master})
    return report(arguments.out, arguments.games, began_s, code)


def own_master_uri(uri: str) -> str:
    """Return the master's address, with a free port instead of one that is taken on this machine.

    A game joined to somebody else's master would mix its topics with theirs. A master elsewhere is the robot's: kept.
    """
    match = re.fullmatch(r"http://(?:localhost|127\.0\.0\.1):(\d+)/?", uri)
    if not match or not _answers(int(match[1])):
        return uri
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        own = f"http://localhost:{free.getsockname()[1]}"
    print(f"play: port {match[1]} is taken; this game's master is {own}", flush=True)
    return own


def run_family(command: Sequence[str], environment: Mapping[str, str], grace_s: float = 5.0) -> int:
    """Run a command and return its exit code; whatever it started and left running is ended, too.

    roslaunch leaves its master behind when a required node dies before the last node is started. Leftovers have `grace_s`
    of wall time to end before they are killed. SIGTERM reaches the command as the SIGINT that roslaunch stops at.
    """
    stop = threading.Event()
    previous = {
        # Ctrl-C reaches the whole foreground group; roslaunch needs the time to stop its nodes.
        signal.SIGINT: signal.signal(signal.SIGINT, lambda *_: None),
        signal.SIGTERM: signal.signal(signal.SIGTERM, lambda *_: stop.set()),
    }
    try:
        ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1)
        process = subprocess.Popen(command, env=environment)
        while process.poll() is None:
            if stop.is_set():
                process.send_signal(signal.SIGINT)
                stop.clear()
            stop.wait(_POLL_S)
        _end_children(grace_s)
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
    return process.returncode


def _end_children(grace_s: float) -> None:
    """End every process that is, by adoption, a child of this one: with SIGTERM, and after the grace with SIGKILL."""
    deadline_s = time.monotonic() + grace_s
    while children := _children():
        number = signal.SIGTERM if time.monotonic() < deadline_s else signal.SIGKILL
        for child in children:
            os.kill(child, number)
        time.sleep(_POLL_S)
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass


def _children() -> list[int]:
    """Return the processes whose parent is this one, from /proc."""
    children = []
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            # The parent follows the name, which stands in parentheses and may hold anything, and the state.
            parent = int(file.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
        if parent == os.getpid():
            children.append(int(file.parent.name))
    return children


def _answers(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


if __name__ == "__main__":
    sys.exit(main())
