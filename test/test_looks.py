"""Looks that ripen over several images, with the real votes and made-up readings."""

import numpy as np

from dr_eureka.behaviour.looks import CardLook, ResultLook, TubeLook
from dr_eureka.behaviour.observation import Frame
from dr_eureka.behaviour.report import GameCode
from dr_eureka.game.state import TUBES, State
from dr_eureka.vision.cards import CardReading, CardResult
from dr_eureka.vision.contents import ContentsReading, ContentsResult
from dr_eureka.vision.tubes import TubePlace, TubeResult, TubeScene
from dr_eureka.vision.voting import CardVote, CardVoteSettings, TubeVote, TubeVoteSettings

CARD_VOTE, TUBE_VOTE = CardVoteSettings(window=4, agree=3), TubeVoteSettings(window=4, agree=3, tolerance_m=0.004)
PLACES = {name: TubePlace(np.array([0.44, y, 0.775]), 0.0005) for name, y in zip(TUBES, (0.11, 0.0, -0.11))}
STANDING = TubeScene(TubeResult.OK, PLACES, np.eye(4), (0, 1, 2, 3), "")
FALLEN = TubeScene(TubeResult.TUBE_MISSING, {}, np.eye(4), (0, 1, 2, 3), "2 tube feet seen on the sheet, expected 3")


def frames(count):
    return [Frame(10.0 + 0.2 * index, np.zeros((2, 2, 3), np.uint8), None, np.eye(4)) for index in range(count)]


def card(state):
    result = CardResult.OK if state else CardResult.NO_CARD
    return CardReading(result, state, 0.9 if state else 0.0, "" if state else "no outline of a card")


def balls(state):
    result = ContentsResult.OK if state else ContentsResult.UNREADABLE
    return ContentsReading(result, state, 0.5, "" if state else "1 red ball, expected 2")


def outcomes(look, count):
    return [look.add(frame) for frame in frames(count)]


def test_a_card_is_found_when_enough_images_agree_and_carries_the_last_images_time():
    readings = iter(map(card, ["RR|GG|PP", None, "RR|GG|PP", "RR|GG|PP"]))
    found = outcomes(CardLook(lambda image: next(readings), CardVote(CARD_VOTE)), 4)
    assert found[:3] == [None] * 3
    assert (found[3].state, found[3].images, round(found[3].stamp_s, 6)) == (State.parse("RR|GG|PP"), 4, 10.6)


def test_no_card_at_all_and_a_card_that_nobody_can_read_are_told_apart():
    nothing = CardLook(lambda image: card(None), CardVote(CARD_VOTE))
    outcomes(nothing, 5)
    code, reason = nothing.failure()
    assert code == GameCode.NO_CARD and "5 images" in reason and "no outline of a card" in reason

    readings = iter(map(card, ["RR|GG|PP", "GG|RR|PP", "PP|GG|RR", "RR|PP|GG"]))
    doubtful = CardLook(lambda image: next(readings), CardVote(CARD_VOTE))
    outcomes(doubtful, 4)
    assert doubtful.failure()[0] == GameCode.CARD_UNREADABLE


def test_a_look_that_never_saw_an_image_found_no_card():
    assert CardLook(lambda image: card(None), CardVote(CARD_VOTE)).failure()[0] == GameCode.NO_CARD


def test_tubes_are_found_or_the_reason_is_given():
    assert outcomes(TubeLook(lambda frame: STANDING, TubeVote(TUBE_VOTE)), 3)[2].tubes.keys() == PLACES.keys()
    fallen = TubeLook(lambda frame: FALLEN, TubeVote(TUBE_VOTE))
    outcomes(fallen, 3)
    code, reason = fallen.failure()
    assert code == GameCode.NO_TUBES and "TUBE_MISSING: " in reason and "expected 3" in reason


def result_look(scene, state):
    return ResultLook(lambda frame: scene, lambda frame, scene: balls(state), TubeVote(TUBE_VOTE), CardVote(CARD_VOTE))


def test_a_result_has_places_and_contents():
    found = outcomes(result_look(STANDING, "R|GG|PPR"), 3)[2]
    assert found.state == State.parse("R|GG|PPR")
    np.testing.assert_allclose(found.tubes["left"].position, PLACES["left"].position)


def test_a_result_that_cannot_be_seen_is_unchecked_with_the_reason():
    for look, reason in ((result_look(STANDING, None), "1 red ball"), (result_look(FALLEN, "RR|GG|PP"), "2 tube feet")):
        assert outcomes(look, 4) == [None] * 4
        assert look.failure()[0] == GameCode.UNCHECKED
        assert reason in look.failure()[1]
