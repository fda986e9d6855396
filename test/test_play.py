"""Running a launch for one game: its own master, and nothing left running."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from dr_eureka.cli.play import own_master_uri

SOURCE = Path(__file__).resolve().parent.parent / "src"


def run_family(script, *, interrupt_after=None):
    """Run a shell script under `run_family` in a fresh process; return its exit code and what it printed."""
    program = f"import os, sys; from dr_eureka.cli.play import run_family; sys.exit(run_family({['sh', '-c', script]!r}, os.environ, grace_s=1.0))"
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
    assert own_master_uri(uri) == uri


def test_a_taken_port_is_left_to_its_owner(capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        uri = f"http://127.0.0.1:{taken.getsockname()[1]}/"
        own = own_master_uri(uri)
    assert own.startswith("http://localhost:") and own != uri
    assert own in capsys.readouterr().out


@pytest.mark.parametrize("uri", ["http://robot:11311", "http://10.0.0.5:11311/"])
def test_a_master_elsewhere_is_kept(uri):
    assert own_master_uri(uri) == uri
