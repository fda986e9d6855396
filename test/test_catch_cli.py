"""What `scripts/catch` says of a finished session, and its exit code."""

import json

import pytest

from dr_eureka.cli.catch import main, report

BALL = {"verdict": "CAUGHT", "robot": "CAUGHT", "reason": "", "velocity_m_s": [0.0, -3.0, 4.0], "ok": True}


def written(tmp_path, **changes):
    session = {"aim": "reach", "throws": 1, "caught": 1, "ok": True, "balls": [BALL], **changes}
    file = tmp_path / "catch.json"
    file.write_text(json.dumps(session))
    return file


def test_a_session_in_which_all_was_right_is_exit_code_0(tmp_path, capsys):
    file = written(tmp_path)
    assert report(file) == 0
    assert capsys.readouterr().out.splitlines() == [
        "catch: ball 1: CAUGHT: robot says CAUGHT; let go at 5.0 m/s", f"catch: 1 of 1 balls caught, aimed reach; {file}",
    ]


def test_a_session_in_which_not_all_was_right_is_exit_code_1(tmp_path, capsys):
    ball = {**BALL, "verdict": "MISSED", "robot": "MISSED", "reason": "TOO_LATE", "ok": False}
    assert report(written(tmp_path, ok=False, caught=0, balls=[ball])) == 1
    assert "MISSED: robot says MISSED (TOO_LATE)" in capsys.readouterr().out


@pytest.mark.parametrize("content", ["", "[]", '{"balls": 3}', '{"balls": [{}], "caught": 1, "throws": 1, "aim": "reach"}'])
def test_a_file_that_is_no_result_is_named(tmp_path, capsys, content):
    file = tmp_path / "catch.json"
    file.write_text(content)
    assert report(file) == 1
    error = capsys.readouterr().err
    assert str(file) in error and len(error.splitlines()) == 1


def test_an_old_or_missing_file_does_not_count(tmp_path, capsys):
    file = written(tmp_path)
    assert report(file, since_s=file.stat().st_mtime + 10.0, launch_code=1) == 1
    assert report(tmp_path / "none.json") == 1
    assert "the reason stands above" in capsys.readouterr().err


@pytest.mark.parametrize("word", ["throw:=5", "throws", "seed=3"])
def test_a_wrong_word_starts_nothing(word, capsys):
    assert main([word]) == 2
    assert "catch: " in capsys.readouterr().err
