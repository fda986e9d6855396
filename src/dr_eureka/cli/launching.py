"""Run a launch file as a command: arguments checked, with a master of its own, leaving no process behind.

Takes part in no ROS graph itself and imports nothing of ROS.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import re
import signal
import socket
import subprocess
import tempfile
import threading
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Optional

from dr_eureka.errors import DrEurekaError
from dr_eureka.resources import resource_path

_CHOICES = {"robot": ("sim", "real")}
_PR_SET_CHILD_SUBREAPER = 36  # <linux/prctl.h>
_POLL_S = 0.1


class LaunchArgumentError(DrEurekaError):
    """A word of the command line is no argument of the launch file, or has a value that cannot be."""


def read_arguments(file: str, words: Sequence[str]) -> dict[str, str]:
    """Return the values of ARG:=VALUE words by name; roslaunch itself takes any name and ignores those it does not know.

    Raises LaunchArgumentError for a word that the launch file `file` of this package has no argument for.
    """
    declared = ElementTree.parse(resource_path("launch") / file).getroot().findall("arg")
    known = [element.get("name") for element in declared if element.get("value") is None]
    values = {}
    for word in words:
        name, assigned, value = word.partition(":=")
        if not assigned:
            raise LaunchArgumentError(f"'{word}': expected ARG:=VALUE, where ARG is one of {', '.join(known)}")
        if name not in known:
            raise LaunchArgumentError(f"'{name}' is not an argument of {file}; expected one of {', '.join(known)}")
        if value not in _CHOICES.get(name, (value,)):
            raise LaunchArgumentError(f"{name}: is '{value}'; expected one of {', '.join(_CHOICES[name])}")
        values[name] = value
    return values


def output_folder(given: Optional[str], kind: str) -> Path:
    """Return the folder for results, made when missing: the one given, or a new one under ROS_HOME/dr_eureka/`kind`.

    Raises LaunchArgumentError when it cannot be made.
    """
    try:
        if given is not None:
            folder = Path(given).expanduser().absolute()
            folder.mkdir(parents=True, exist_ok=True)
            return folder
        parent = Path(os.environ.get("ROS_HOME") or Path.home() / ".ros").absolute() / "dr_eureka" / kind
        parent.mkdir(parents=True, exist_ok=True)
        return Path(tempfile.mkdtemp(prefix=time.strftime("%Y%m%d-%H%M%S-"), dir=parent))
    except OSError as error:
        raise LaunchArgumentError(f"out: {error.filename}: {error.strerror}; expected a folder that can be made") from error


def run_launch(program: str, file: str, values: Mapping[str, str]) -> int:
    """Run a launch file of this package until it ends and return roslaunch's exit code."""
    master = own_master_uri(program, os.environ.get("ROS_MASTER_URI", "http://localhost:11311"))
    words = [f"{name}:={value}" for name, value in values.items()]
    command = ["roslaunch", "--no-summary", "--skip-log-check", "dr_eureka", file, *words]
    return run_family(command, {**os.environ, "ROS_MASTER_URI": master})


def own_master_uri(program: str, uri: str) -> str:
    """Return the master's address, with a free port instead of one that is taken on this machine.

    A game joined to somebody else's master would mix its topics with theirs. A master elsewhere is the robot's: kept.
    """
    match = re.fullmatch(r"http://(?:localhost|127\.0\.0\.1):(\d+)/?", uri)
    if not match or not _answers(int(match[1])):
        return uri
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        own = f"http://localhost:{free.getsockname()[1]}"
    print(f"{program}: port {match[1]} is taken; the master of this launch is {own}", flush=True)
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

