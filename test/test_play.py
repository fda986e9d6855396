"""`scripts/play` and `scripts/replay`: arguments checked before anything starts, a master of its own, nothing left running."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from dr_eureka.cli import play, replay
from dr_eureka.cli.launching import own_master_uri, read_arguments

SOURCE = Path(__file__).resolve().parent.parent / "src"


def run_family(script, *, interrupt_after=None):
    """Run a shell script under `run_family` in a fresh process; return its exit code and what it printed."""
    program = f"import os, sys; from dr_eureka.cli.launching import run_family; sys.exit(run_family({['sh', '-c', script]!r}, os.environ, grace_s=1.0))"
    environment = {**os.environ, "PYTHONPATH": str(SOURCE)}
    process = subprocess.Popen([sys.executable, "-c", program], env=environment, stdout=subprocess.PIPE, text=True)
    line = process.stdout.readline()
    if interrupt_after:
        process.send_signal(interrupt_after)
    rest, _ = process.communicate(timeout=20)
    return process.returncode, line + rest


def is_running(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def test_the_exit_code_is_the_commands_own():
    assert run_family("exit 3")[0] == 3


def test_what_the_command_leaves_running_is_ended():
    code, printed = run_family("setsid sleep 60 & echo $!; exit 0")
    assert code == 0
    assert not is_running(int(printed))


def test_what_ignores_a_polite_end_is_ended_all_the_same():
    began = time.monotonic()
    code, printed = run_family("""setsid sh -c 'trap "" TERM; echo $$; while :; do sleep 0.2; done' & sleep 0.5""")
    assert code == 0
    assert not is_running(int(printed))
    assert time.monotonic() - began < 10


def test_sigterm_lets_the_command_stop_in_its_own_way():
    code, printed = run_family("""trap 'echo stopped; kill %1; exit 5' INT; echo ready; sleep 30 & wait""", interrupt_after=signal.SIGTERM)
    assert printed == "ready\nstopped\n"
    assert code == 5


def test_a_free_port_is_kept():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        uri = f"http://localhost:{free.getsockname()[1]}"
    assert own_master_uri("play", uri) == uri


def test_a_taken_port_is_left_to_its_owner(capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        uri = f"http://127.0.0.1:{taken.getsockname()[1]}/"
        own = own_master_uri("play", uri)
    assert own.startswith("http://localhost:") and own != uri
    assert own in capsys.readouterr().out


@pytest.mark.parametrize("uri", ["http://robot:11311", "http://10.0.0.5:11311/"])
def test_a_master_elsewhere_is_kept(uri):
    assert own_master_uri("play", uri) == uri


@pytest.mark.parametrize(
    "command, words, complaint",
    [
        (play, ["sed:=3"], "play: 'sed' is not an argument of game.launch; expected one of robot, goal, start, games, "),
        (play, ["seed=3"], "play: 'seed=3': expected ARG:=VALUE, where ARG is one of robot, "),
        (play, ["robot:=rael"], "play: robot: is 'rael'; expected one of sim, real"),
        (play, ["games:=two"], "play: games: is 'two'; expected a whole number"),
        (play, ["out:=/dev/null/x"], "play: out: /dev/null/x: Not a directory; expected a folder"),
        (replay, [], "replay: no recording given; expected BAG"),
        (replay, ["rate:=2"], "replay: no recording given; expected BAG"),
        (replay, ["none.bag"], "none.bag: no such file; expected a bag"),
        (replay, ["game.bag", "bag:=other.bag"], "replay: bag: is given twice"),
        (replay, ["game.bag", "seed:=3"], "replay: 'seed' is not an argument of replay.launch; expected one of bag, "),
        (replay, ["game.bag", "file:=game.bag"], "replay: 'file' is not an argument of replay.launch"),
    ],
)
def test_a_wrong_word_is_one_line_and_starts_nothing(command, words, complaint, monkeypatch, capsys):
    monkeypatch.setattr(command, "run_launch", lambda *_: pytest.fail("something was started"))
    assert command.main(words) == 2
    captured = capsys.readouterr().err
    assert complaint in captured and captured.count("\n") == 1


def test_what_a_launch_file_declares_is_taken():
    assert read_arguments("game.launch", ["robot:=real", "goal:=RRGG||PP"]) == {"robot": "real", "goal": "RRGG||PP"}


def test_a_recording_is_meant_from_where_the_person_is(tmp_path, monkeypatch):
    given = {}
    monkeypatch.setattr(replay, "run_launch", lambda _, file, values: given.update(values, file=file) or 1)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    (tmp_path / "a game.bag").touch()
    assert replay.main(["a game.bag", "rate:=2"]) == 1
    assert (given["file"], given["bag"], given["rate"]) == ("replay.launch", str(tmp_path / "a game.bag"), "2")
    assert Path(given["out"]).parent == tmp_path / "dr_eureka" / "replays"
