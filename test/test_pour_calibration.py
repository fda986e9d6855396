"""The search for when a direct pour turns back, on tubes that pour as a table says, and its notes."""

import json

import pytest

from dr_eureka.bench.pour_calibration import LATER_FOR_ALL, Notes, PourCalibrationError, linear_steps, profiled_seconds
from dr_eureka.bench.pour_rig import Poured
from dr_eureka.control.settings import ControlSettings
from dr_eureka.resources import load_yaml

WHERE = "config/control_engine.yaml"
CONTROL = ControlSettings.from_mapping(load_yaml(WHERE), WHERE)
# From when on so many balls of four pass: [s] of the dip, and steps.
DIP_EDGES = (0.0805, 0.1055, 0.1255, 0.1445)
STEP_EDGES = (130, 140, 150, 160)


class TableRig:
    """Lets as many balls pass as were asked to, late enough; counts how often it was asked."""

    def __init__(self):
        self.pours = 0

    def pour(self, kind, settings):
        self.pours += 1
        if kind.method == "profiled":
            passed = sum(settings.profiled_pour.dip_seconds[0] >= edge for edge in DIP_EDGES)
        else:
            turn = settings.linear_pour.return_steps[kind.held][kind.held]
            passed = sum(turn >= edge for edge in STEP_EDGES[4 - kind.held :])
        return Poured(passed, 0, 1.0)


class DryRig(TableRig):
    """Nothing ever passes."""

    def pour(self, kind, settings):
        return Poured(0, 0, 1.0)


def test_a_dip_lasts_to_the_middle_between_too_few_and_too_many():
    seconds = profiled_seconds(TableRig(), CONTROL, Notes(None))
    for staying in (1, 2, 3):
        middle = (DIP_EDGES[3 - staying] + DIP_EDGES[4 - staying]) / 2.0
        assert seconds[staying] == pytest.approx(middle, abs=0.002)
    assert seconds[0] == pytest.approx(LATER_FOR_ALL * DIP_EDGES[3], abs=0.003)


def test_return_steps_are_found_for_every_number_of_balls():
    steps = linear_steps(TableRig(), CONTROL, Notes(None))
    assert {held: list(by_count) for held, by_count in steps.items()} == {1: [1], 2: [1, 2], 3: [1, 2, 3], 4: [1, 2, 3, 4]}
    assert steps[4][1] == pytest.approx(135, abs=2) and steps[3][1] == steps[4][2] == pytest.approx(145, abs=2)
    assert steps[2][2] == pytest.approx(LATER_FOR_ALL * 160, abs=4)


def test_a_search_that_was_broken_off_goes_on_from_its_notes(tmp_path):
    file = tmp_path / "notes.jsonl"
    first, again = TableRig(), TableRig()
    found = profiled_seconds(first, CONTROL, Notes(file))
    file.write_text("".join(file.read_text().splitlines(keepends=True)[: first.pours // 2]))
    assert profiled_seconds(again, CONTROL, Notes(file)) == found
    assert again.pours == first.pours - first.pours // 2
    assert json.loads(file.read_text().splitlines()[0]) == {"pour": "profiled", "held": 4, "turn": 400, "arrived": 4}


def test_tubes_that_never_pour_and_notes_that_are_none_are_named(tmp_path):
    with pytest.raises(PourCalibrationError, match="turning at 400, fewer than 1 balls pass"):
        profiled_seconds(DryRig(), CONTROL, Notes(None))
    file = tmp_path / "notes.jsonl"
    file.write_text('{"pour": "profiled"}\n')
    with pytest.raises(PourCalibrationError, match="notes.jsonl:1: "):
        Notes(file)
