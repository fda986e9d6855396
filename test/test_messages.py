"""Values of the cores as messages and back; needs the built messages, but no master."""

import numpy as np
import pytest

pytest.importorskip("dr_eureka.msg", reason="the package's messages are not built")

from dr_eureka import msg, srv
from dr_eureka.behaviour.card_confirmation import ConfirmCode
from dr_eureka.behaviour.observation import ImageHeader
from dr_eureka.behaviour.report import ActionRecord, GameCode, GameReport, Phase
from dr_eureka.control.codes import EngineCode, EngineState
from dr_eureka.control.engine import EngineStatus
from dr_eureka.game.actions import Action
from dr_eureka.game.state import Pour
from dr_eureka.nodes import messages
from dr_eureka.simulation.faults import FaultName
from dr_eureka.vision.card_detections import SeenBall
from dr_eureka.vision.cards import CardReading, CardResult
from dr_eureka.vision.tubes import TubeResult

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


def test_tubes_in_the_hands_come_with_a_pause():
    turned = np.array([[0.0, 0.0, 1.0, 0.45], [0.6, 0.8, 0.0, 0.1], [-0.8, 0.6, 0.0, 1.05], [0.0, 0.0, 0.0, 1.0]])
    status = EngineStatus(EngineState.BUSY, EngineCode.OK, 2, "pour", paused=True)
    message = messages.engine_status_to_message(status, 1, messages.stamp(1.5))
    message.held = [messages.held_tube_to_message("left", turned)]
    assert message.paused
    held = messages.engine_view(message, 99.0).held
    assert list(held) == ["left"]
    np.testing.assert_allclose(held["left"], turned, atol=1e-12)


def test_every_phase_and_code_of_a_game_has_a_constant_and_every_constant_a_meaning():
    assert set(constants(msg.GameStatus)) == set(Phase.ALL) | set(GameCode.ALL)
    for names in (Phase.ALL, GameCode.ALL):
        assert sorted(getattr(msg.GameStatus, name) for name in names) == list(range(len(names)))


def test_every_result_of_looking_for_tubes_has_a_constant():
    results = {name for name in vars(TubeResult) if name.isupper()}
    assert set(constants(msg.TubeScene)) == results


def test_every_fault_of_a_pour_has_a_constant():
    faults = {name: value for name, value in vars(srv.SpoilPourRequest).items() if name.isupper()}
    assert faults == {name: name for name in FaultName.ALL}


def test_every_answer_to_a_confirmation_has_a_constant():
    assert set(constants(srv.ConfirmCardResponse)) == set(ConfirmCode.ALL)


def test_a_card_carries_the_header_of_its_image_to_the_nanosecond_and_the_balls_where_they_are_in_it():
    header = ImageHeader(1_763_782_496_123_456_789, "robotis_camera")
    balls = (SeenBall(0.25, 0.75, 0.1, "R", 0.9), SeenBall(0.5, 0.25, 0.1, "G", 0.2))
    corners = np.array([(100.0, 50.0), (300.0, 50.0), (300.0, 250.0), (100.0, 250.0)])
    reading = CardReading(CardResult.UNREADABLE, None, 0.0, "2 balls seen, expected 6", corners, balls)
    card = messages.card_to_message(reading, header, images=1)
    assert (card.header.stamp.secs, card.header.stamp.nsecs) == (1_763_782_496, 123_456_789)
    assert (card.header.frame_id, card.result, card.state) == ("robotis_camera", msg.CardDetection.UNREADABLE, "")
    assert (card.reason, card.images, card.corners) == ("2 balls seen, expected 6", 1, corners.ravel().tolist())
    found = [(ball.colour, ball.x, ball.y, ball.confidence) for ball in card.balls]
    assert found == [("R", pytest.approx(150.0), pytest.approx(200.0), 0.9), ("G", pytest.approx(200.0), pytest.approx(100.0), 0.2)]
    assert card.balls[0].diameter == pytest.approx(20.0, rel=0.02)


@pytest.mark.parametrize("result", [CardResult.OK, CardResult.NO_CARD, CardResult.SEVERAL_CARDS, CardResult.UNREADABLE])
def test_every_result_of_a_reading_has_a_constant(result):
    message = messages.card_to_message(CardReading(result, "RR|GG|PP" if result == CardResult.OK else None), ImageHeader(1, ""), 1)
    assert message.result == getattr(msg.CardDetection, result)
    assert (message.corners, message.balls) == ([], [])


def test_a_game_report_survives_the_way_there_and_back():
    records = tuple(ActionRecord(action, 1.25 + index, 2.25 + index, index == 1) for index, action in enumerate(ACTIONS))
    pours = (Pour("center", "right", 2),)
    report = GameReport(Phase.PLAYING, GameCode.UNDECIDED, 1, 3, "RR|GG|PP", "RR|G|PPG", "RR||PPGG", "fastest", "linear", pours, records, 0, 4.5, 9.75, "on it")
    assert messages.report_from_message(messages.report_to_message(report, now_s=100.0)) == report
