"""What `scripts/play` and `scripts/replay` say about a game, and with what exit code."""

import json
import os

import pytest

from dr_eureka.cli.verdict import report, report_replay

GAME = {
    "seed": 3, "start": "RR|GG|PP", "goal": "RRG|G|PP", "verdict": "SOLVED", "solved": True, "balls_lost": 0,
    "pours": 1, "replans": 0, "simulated_seconds": 61.2, "wall_seconds": 70.6,
}


def write(folder, **changes):
    file = folder / "game.json"
    file.write_text(json.dumps({**GAME, **changes}))
    return file


def test_a_solved_game_is_one_line_and_exit_0(tmp_path, capsys):
    file = write(tmp_path)
    assert report(tmp_path) == 0
    assert capsys.readouterr().out == (
        f"play: SOLVED: RR|GG|PP to RRG|G|PP, pours 1, 61 s simulated, 71 s of wall time; {file}\n"
    )


def test_the_referee_decides_and_not_the_robot(tmp_path, capsys):
    write(tmp_path, solved=False, balls_lost=1)
    assert report(tmp_path) == 1
    assert "NOT SOLVED: RR|GG|PP to RRG|G|PP, robot says SOLVED, pours 1, balls lost 1" in capsys.readouterr().out


def test_without_a_referee_nothing_counts_as_solved(tmp_path, capsys):
    write(tmp_path, solved=None, balls_lost=None)
    assert report(tmp_path) == 1
    assert "NOT JUDGED" in capsys.readouterr().out


def test_a_failed_game_says_why(tmp_path, capsys):
    write(tmp_path, solved=False, goal=None, verdict="NO_CARD", message="no card for 10 s")
    assert report(tmp_path) == 1
    assert "NOT SOLVED: RR|GG|PP to an unknown goal, robot says NO_CARD (no card for 10 s), pours 1" in capsys.readouterr().out


def test_all_of_several_games_must_be_solved(tmp_path, capsys):
    write(tmp_path, games=[GAME, GAME])
    assert report(tmp_path, games_wanted=2) == 0
    assert capsys.readouterr().out.count("play: SOLVED") == 2
    write(tmp_path, games=[GAME, {**GAME, "solved": False}])
    assert report(tmp_path, games_wanted=2) == 1


def test_a_session_that_broke_off_is_not_solved(tmp_path, capsys):
    write(tmp_path)
    assert report(tmp_path, games_wanted=2) == 1
    assert "1 of 2 games were played" in capsys.readouterr().err


def test_no_game_is_one_line_with_the_exit_code_of_the_launch(tmp_path, capsys):
    assert report(tmp_path, launch_code=7) == 1
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1
    assert f"no game.json in {tmp_path}: the launch ended (exit code 7)" in captured.err


def test_the_result_of_an_earlier_game_does_not_count(tmp_path):
    os.utime(write(tmp_path), (1000, 1000))
    assert report(tmp_path, since_s=1001) == 1
    assert report(tmp_path, since_s=999) == 0


@pytest.mark.parametrize("content", ["{", "[]", "null", '{"games": 3}', '{"games": []}'])
def test_a_broken_result_is_named(tmp_path, capsys, content):
    (tmp_path / "game.json").write_text(content)
    assert report(tmp_path) == 1
    assert "game.json: " in capsys.readouterr().err


def test_a_replay_that_found_everything_is_one_line_and_exit_0(tmp_path, capsys):
    file = write(tmp_path, verdict="REPLAYED", solved=None)
    assert report_replay(tmp_path) == 0
    assert capsys.readouterr().out == f"replay: REPLAYED: RR|GG|PP to RRG|G|PP, plan and tubes found; {file}\n"


def test_a_replay_that_did_not_says_why(tmp_path, capsys):
    file = write(tmp_path, verdict="NO_CARD", solved=None, message="no card for 10 s")
    assert report_replay(tmp_path) == 1
    assert capsys.readouterr().err == f"replay: NOT REPLAYED: NO_CARD (no card for 10 s); {file}\n"


def test_a_replay_without_a_new_result_is_one_line_and_exit_1(tmp_path, capsys):
    os.utime(write(tmp_path, verdict="REPLAYED"), (1000, 1000))
    assert report_replay(tmp_path, since_s=1001, launch_code=7) == 1
    assert f"replay: no game.json in {tmp_path}: the launch ended (exit code 7)" in capsys.readouterr().err
