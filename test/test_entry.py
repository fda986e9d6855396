"""How commands end when nobody reads what they print, and on Ctrl-C."""
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from dr_eureka.cli.entry import run

ROOT = Path(__file__).resolve().parents[1]
COMMANDS = sorted(
    file.name
    for file in (ROOT / "scripts").iterdir()
    if not file.suffix and "from dr_eureka.cli" in file.read_text()
)


def run_unread(*words, **variables):
    """Run a command of the package whose stdout is a pipe that is closed before anything is written."""
    reading, writing = os.pipe()
    os.close(reading)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), **variables}
    try:
        command = [sys.executable, ROOT / "scripts" / words[0], *words[1:]]
        return subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, text=True, env=environment)
    finally:
        os.close(writing)


@pytest.mark.parametrize("words", [("plan_game", "RRP|PG|G"), ("plan_game", "--help"), ("measure_pours", "TRIALS")])
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_reader_that_stops_early_ends_a_command_quietly(tmp_path, words, unbuffered):
    trials = tmp_path / "pours.jsonl"
    trials.write_text('{"pour": "lock", "held": 1, "count": 1, "poured": 1, "lost": 0}\n')
    finished = run_unread(*(str(trials) if word == "TRIALS" else word for word in words), PYTHONUNBUFFERED=unbuffered)
    assert (finished.returncode, finished.stderr) == (128 + signal.SIGPIPE, "")


def test_another_pipe_that_breaks_is_no_reader_that_stopped():
    def breaks():
        raise BrokenPipeError("of a camera")

    with pytest.raises(BrokenPipeError, match="of a camera"):
        run(breaks)


def test_ctrl_c_ends_a_command_quietly():
    def interrupted():
        raise KeyboardInterrupt

    with pytest.raises(SystemExit) as ended:
        run(interrupted)
    assert ended.value.code == 130


@pytest.mark.parametrize("code", [0, 1, 2])
def test_a_command_ends_with_its_exit_code(code):
    with pytest.raises(SystemExit) as ended:
        run(lambda: code)
    assert ended.value.code == code


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_ends_in_the_one_way(name):
    lines = (ROOT / "scripts" / name).read_text().splitlines()
    assert lines[-1].strip().startswith("run(")
