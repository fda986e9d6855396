"""The search for when a direct pour turns back, on tubes that pour as a table says, and its notes."""

import json

import numpy as np
import pytest

from dr_eureka.bench import pour_calibration, pour_rig
from dr_eureka.bench.pour_calibration import TURNS, Notes, PourCalibrationError, best_turns, search, told
from dr_eureka.bench.pour_rig import Poured
from dr_eureka.cli import calibrate_pours
from dr_eureka.control.codes import ControlError, EngineCode
from dr_eureka.control.settings import ControlSettings
from dr_eureka.resources import load_yaml, resource_path

WHERE = "config/control_engine.yaml"
CONTROL = ControlSettings.from_mapping(load_yaml(WHERE), WHERE)
# From when on so many balls of four pass, with a tube that leans as it is believed to: ms of the dip, and steps.
EDGES = {"profiled": (80.5, 105.5, 125.5, 144.5), "linear": (140.5, 164.5, 181.5, 196.5)}
# How much later with each grasp.
SHIFTS = (-4, 0, 4, 0)


class TableRig:
    """Lets as many balls pass as the table of a grasp says; counts how often it was asked."""

    pours = 0

    def __init__(self, grasp: int):
        self._shift = SHIFTS[grasp % len(SHIFTS)]

    def pour(self, kind, settings):
        TableRig.pours += 1
        turn = 1000.0 * settings.profiled_pour.dip_seconds[0]
        if kind.method == "linear":
            turn = settings.linear_pour.return_steps[kind.held][kind.count]
        return Poured(sum(turn >= edge + self._shift for edge in EDGES[kind.method]), 0, 1.0)


def test_a_pour_turns_back_where_most_grasps_pour_just_so_many():
    found = search(TableRig, CONTROL, 4, Notes(None, ""))
    for method, edges in EDGES.items():
        for staying in (1, 2, 3):
            first, last = edges[3 - staying] + max(SHIFTS), edges[4 - staying] + min(SHIFTS)
            assert first < found[method][staying].at < last
            assert found[method][staying].at == pytest.approx((first + last) / 2.0, abs=3.0)
            assert found[method][staying].share == 1.0
        assert edges[3] + max(SHIFTS) < found[method][0].at < edges[3] + max(SHIFTS) + 20.0


def test_balls_that_were_lost_count_against_a_turn():
    turns, arrived = (100, 110, 120, 130, 140), np.array([[1, 1], [2, 2], [2, -1], [3, 3], [4, 4]])
    found = best_turns("linear", turns, arrived)
    assert (found[2].at, found[2].share) == (110, 1.0) and found[1].at == 130


def test_settings_told_of_turns_have_them_for_every_number_of_balls():
    steps, seconds = {0: 300, 1: 210, 2: 180, 3: 160}, {0: 260, 1: 138, 2: 120, 3: 96}
    control = told(CONTROL, {"linear": steps, "profiled": seconds})
    assert control.linear_pour.return_steps == {
        1: {1: 300}, 2: {1: 210, 2: 300}, 3: {1: 180, 2: 210, 3: 300}, 4: {1: 160, 2: 180, 3: 210, 4: 300}
    }
    assert control.profiled_pour.dip_seconds == {0: 0.26, 1: 0.138, 2: 0.12, 3: 0.096}


def test_a_search_that_was_broken_off_goes_on_from_its_notes(tmp_path):
    file, all_pours = tmp_path / "notes.jsonl", 2 * sum(map(len, TURNS.values()))
    TableRig.pours = 0
    file.touch()
    found = search(TableRig, CONTROL, 2, Notes(file, "a search"))
    assert TableRig.pours == all_pours
    first = TURNS["profiled"][0]
    lines = file.read_text().splitlines(keepends=True)
    assert [json.loads(line) for line in lines[:2]] == [
        {"search": "a search"}, {"pour": "profiled", "grasp": 0, "turn": first, "arrived": 0}
    ]
    file.write_text("".join(lines[:71]) + lines[71][:20])
    assert search(TableRig, CONTROL, 2, Notes(file, "a search")) == found
    assert TableRig.pours == 2 * all_pours - 70
    assert file.read_text() == "".join(lines)


def test_tubes_that_never_pour_and_notes_that_are_none_are_named(tmp_path):
    with pytest.raises(PourCalibrationError, match="linear: no turn between 10 and 20 leaves just 0 of 4 balls behind"):
        best_turns("linear", (10, 20), np.zeros((2, 3), dtype=int))
    file = tmp_path / "notes.jsonl"
    for text, problem in [
        ('{"pour": "profiled"}\n', "notes.jsonl:1: "),
        ('{"search": "a search"}\n{"pour": "profiled", "grasp": 0, "turn": 70, "arrived": null}\n', "notes.jsonl:2: "),
        ('{"search": "another"}\n', "notes.jsonl: notes of a search with another seed, or other settings"),
        ("\udcff\n", "notes.jsonl:1: "),
        ('{"search": "a se', "notes.jsonl:1: "),
    ]:
        file.write_text(text, errors="surrogateescape")
        with pytest.raises(PourCalibrationError, match=problem):
            Notes(file, "a search")


def test_a_grasp_with_which_nothing_can_be_poured_is_noted_and_the_search_goes_on():
    def make_rig(grasp):
        if grasp == 1:
            raise ControlError(EngineCode.GRASP_EMPTY, "closed on nothing")
        return TableRig(0)

    found = search(make_rig, CONTROL, 3, Notes(None, ""))
    assert found["profiled"][2].share == pytest.approx(2 / 3)


@pytest.fixture
def engine_yaml(tmp_path, monkeypatch):
    """A copy of the engine's yaml that the command writes instead, calibrated on tubes that pour as the table says."""
    copy = tmp_path / "control_engine.yaml"
    copy.write_text(resource_path(WHERE).read_text())
    monkeypatch.setattr(calibrate_pours, "resource_path", lambda name: copy)
    monkeypatch.setattr(pour_rig, "PourRig", lambda control, world, pieces, spread, seed, stage: TableRig(seed))
    return copy


def test_the_command_tells_the_engine_what_it_found_and_keeps_all_else(engine_yaml, capsys):
    before = engine_yaml.read_text()
    assert calibrate_pours.main(["--write", "--grasps", "4"]) == 0
    changed = [(old, new) for old, new in zip(before.splitlines(), engine_yaml.read_text().splitlines()) if old != new]
    assert len(before.splitlines()) == len(engine_yaml.read_text().splitlines())
    assert {old.split(":")[0].strip() for old, _ in changed} <= {"dip_seconds", '"1"', '"2"', '"3"', '"4"'}
    found = search(TableRig, CONTROL, 4, Notes(None, ""))
    written = ControlSettings.from_mapping(load_yaml(engine_yaml), "written")
    assert written.profiled_pour.dip_seconds == {left: turn.at / 1000.0 for left, turn in found["profiled"].items()}
    assert {held: by_count[held] for held, by_count in written.linear_pour.return_steps.items()} == dict.fromkeys(
        (1, 2, 3, 4), found["linear"][0].at
    )
    assert "written into config/control_engine.yaml" in capsys.readouterr().out


def test_without_write_the_command_only_tells(engine_yaml, capsys):
    before = engine_yaml.read_text()
    assert calibrate_pours.main(["--grasps", "1"]) == 0
    assert engine_yaml.read_text() == before
    assert "linear, 3 balls stay behind: turn back after 1" in capsys.readouterr().out


def test_arguments_and_notes_that_cannot_be_used_end_the_command_in_one_line(tmp_path, engine_yaml, capsys):
    (tmp_path / "notes").write_text("notes of something else\n")
    assert calibrate_pours.main(["--notes", str(tmp_path / "notes")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "expected a note of a search, or no file" in error
    with pytest.raises(SystemExit, match="2"):
        calibrate_pours.main(["--grasps", "0"])
    assert "expected a whole number, at least 1" in capsys.readouterr().err


def test_the_grids_of_turns_rise():
    assert all(sorted(set(turns)) == list(turns) for turns in pour_calibration.TURNS.values())
