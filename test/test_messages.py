"""Values of the cores as messages and back; needs the built messages, but no master."""

import pytest

pytest.importorskip("dr_eureka.msg", reason="the package's messages are not built")

from dr_eureka import msg
from dr_eureka.behaviour.report import ActionRecord, GameCode, GameReport, Phase
from dr_eureka.control.codes import EngineCode, EngineState
from dr_eureka.control.engine import EngineStatus
from dr_eureka.game.actions import Action
from dr_eureka.game.state import Pour
from dr_eureka.nodes import messages

ACTIONS = (Action("pick", "left", "center"), Action("pour", "left", "center", "right", "right", 2))


def constants(message):
    """Return name -> value of a message's number constants."""
    return {name: value for name, value in vars(message).items() if name.isupper() and isinstance(value, int)}


@pytest.mark.parametrize("action", ACTIONS)
def test_an_action_survives_the_way_there_and_back(action):
    assert messages.action_from_message(messages.action_to_message(action)) == action


@pytest.mark.parametrize("code", EngineCode.ALL)
def test_every_code_of_the_engine_has_a_constant_of_its_own(code):
    number = messages.engine_code_number(code)
    assert number != msg.EngineStatus.UNKNOWN
    assert messages.engine_code_name(number) == code


def test_a_code_without_a_constant_is_unknown():
    assert messages.engine_code_number("ON_FIRE") == msg.EngineStatus.UNKNOWN


@pytest.mark.parametrize("state", [EngineState.IDLE, EngineState.BUSY, EngineState.DONE, EngineState.FAULT])
def test_the_engines_status_survives_the_way_there_and_back(state):
    status = EngineStatus(state, EngineCode.TUBE_SLIPPED, 3, "left tube slipped")
    view = messages.engine_view(messages.engine_status_to_message(status, 7, messages.stamp(1.5)), 99.0)
    assert (view.state, view.code, view.action_index, view.message) == (state, "TUBE_SLIPPED", 3, "left tube slipped")
    assert (view.strategy_id, view.heard_wall_s) == (7, 99.0)


def test_every_phase_and_code_of_a_game_has_a_constant_and_every_constant_a_meaning():
    assert set(constants(msg.GameStatus)) == set(Phase.ALL) | set(GameCode.ALL)
    for names in (Phase.ALL, GameCode.ALL):
        assert sorted(getattr(msg.GameStatus, name) for name in names) == list(range(len(names)))


def test_a_game_report_survives_the_way_there_and_back():
    records = tuple(ActionRecord(action, 1.25 + index, 2.25 + index) for index, action in enumerate(ACTIONS))
    pours = (Pour("center", "right", 2),)
    report = GameReport(Phase.PLAYING, GameCode.UNDECIDED, 1, 3, "RR|GG|PP", "RR||PPGG", pours, records, 0, 4.5, 9.75, "on it")
    assert messages.report_from_message(messages.report_to_message(report, now_s=100.0)) == report
