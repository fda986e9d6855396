"""Looks that ripen over several images, with the real votes and made-up readings."""

from dataclasses import replace
from itertools import cycle, repeat

import numpy as np

from dr_eureka.behaviour.looks import BallLost, CardLook, TubeLook
from dr_eureka.behaviour.observation import Frame, ImageHeader
from dr_eureka.behaviour.report import GameCode
from dr_eureka.game.state import TUBES, State
from dr_eureka.vision.cards import CardReading, CardResult
from dr_eureka.vision.contents import ContentsReading, ContentsResult, TubeContents
from dr_eureka.vision.contents_loose import LooseBall
from dr_eureka.vision.tubes import TubePlace, TubeResult, TubeScene
from dr_eureka.vision.voting import CardVote, CardVoteSettings, LossVote, TubeVote, TubeVoteSettings

CARD_VOTE, TUBE_VOTE = CardVoteSettings(window=4, agree=3), TubeVoteSettings(window=4, agree=3, tolerance_m=0.004)
PLACES = {name: TubePlace(np.array([0.44, y, 0.775]), 0.0005) for name, y in zip(TUBES, (0.11, 0.0, -0.11))}
STANDING = TubeScene(TubeResult.OK, PLACES, np.eye(4), (0, 1, 2, 3), "")
FALLEN = TubeScene(TubeResult.TUBE_MISSING, {}, np.eye(4), (0, 1, 2, 3), "2 tube feet seen on the sheet, expected 3")


def frames(count):
    headers = [ImageHeader(10_000_000_000 + 200_000_001 * index, "cam_link") for index in range(count)]
    return [Frame(header, np.zeros((2, 2, 3), np.uint8), None, np.eye(4)) for header in headers]


def card(state):
    result = CardResult.OK if state else CardResult.NO_CARD
    return CardReading(result, state, 0.9 if state else 0.0, "" if state else "no outline of a card")


def balls(state):
    result = ContentsResult.OK if state else ContentsResult.UNREADABLE
    return ContentsReading(result, state, 0.5, "" if state else "1 red ball, expected 2")


def outcomes(look, count):
    return [look.add(frame) for frame in frames(count)]


def card_look(readings):
    """Return a look to which images show these cards, and the list of what it tells."""
    readings, told = iter(readings), []
    tell = lambda frame, reading: told.append((frame.header, reading))
    return CardLook(lambda image: next(readings), CardVote(CARD_VOTE), tell), told


def test_a_card_is_found_when_enough_images_agree_and_carries_the_header_of_the_image_that_was_read_surest():
    readings = [card("RR|GG|PP"), card(None), replace(card("RR|GG|PP"), confidence=0.97), card("RR|GG|PP")]
    look, told = card_look(readings)
    found = outcomes(look, 4)
    assert found[:3] == [None] * 3
    assert (found[3].state, found[3].images, found[3].reading) == (State.parse("RR|GG|PP"), 4, readings[2])
    assert found[3].header == ImageHeader(10_400_000_002, "cam_link")
    assert [reading for _, reading in told] == readings
    assert [header.stamp_ns for header, _ in told] == [10_000_000_000 + 200_000_001 * index for index in range(4)]


def test_no_card_at_all_and_a_card_that_nobody_can_read_are_told_apart():
    nothing, _ = card_look(repeat(card(None)))
    outcomes(nothing, 5)
    code, reason = nothing.failure()
    assert code == GameCode.NO_CARD and "5 images" in reason and "no outline of a card" in reason

    doubtful, _ = card_look(map(card, ["RR|GG|PP", "GG|RR|PP", "PP|GG|RR", "RR|PP|GG"]))
    outcomes(doubtful, 4)
    assert doubtful.failure()[0] == GameCode.CARD_UNREADABLE


def test_a_look_that_never_saw_an_image_found_no_card():
    assert card_look([])[0].failure()[0] == GameCode.NO_CARD


def tube_look(scene, *readings):
    """Return a look to which every image shows this scene, and these contents in turn."""
    shown = cycle(readings)
    votes = TubeVote(TUBE_VOTE), CardVote(CARD_VOTE), LossVote(CARD_VOTE)
    return TubeLook(lambda frame: scene, lambda frame, scene: next(shown), *votes)


def test_tubes_are_found_with_their_places_and_contents():
    found = outcomes(tube_look(STANDING, balls("R|GG|PPR")), 3)[2]
    assert (found.state, found.images, found.header.stamp_ns) == (State.parse("R|GG|PPR"), 3, 10_400_000_002)
    np.testing.assert_allclose(found.tubes["left"].position, PLACES["left"].position)


def test_tubes_that_are_not_located_and_contents_that_are_not_seen_have_names_of_their_own():
    for scene, state, code, reason in (
        (FALLEN, "RR|GG|PP", GameCode.NO_TUBES, "TUBE_MISSING: newest images: 4 TUBE_MISSING, expected 3 alike"),
        (STANDING, None, GameCode.NO_CONTENTS, "UNREADABLE: 1 red ball, expected 2"),
    ):
        look = tube_look(scene, balls(state))
        assert outcomes(look, 4) == [None] * 4
        assert look.failure()[0] == code
        assert reason in look.failure()[1]


def seen(result, left, center, right, reason="", loose=""):
    tubes = {name: TubeContents(colours, 0.9) for name, colours in zip(TUBES, (left, center, right))}
    lying = tuple(LooseBall(colour, np.array([0.5, 0.0, 0.786])) for colour in loose)
    return ContentsReading(result, None, 0.0, reason, tubes, lying)


def test_a_ball_that_three_images_see_beside_the_tubes_is_lost():
    reading = seen(ContentsResult.UNSURE, "R?", "GG", "PP", loose="R")
    found = outcomes(tube_look(STANDING, reading), 3)
    assert found == [None, None, BallLost("red seen lying beside the tubes")]


def test_a_ball_that_is_in_no_tube_although_all_of_them_are_seen_is_lost():
    reading = seen(ContentsResult.BALL_MISSING, "R", "GG", "PP", "R|GG|PP: R in no tube")
    assert outcomes(tube_look(STANDING, reading), 3)[2] == BallLost("R|GG|PP: R in no tube")


def test_something_on_the_table_of_a_colour_whose_balls_are_all_in_tubes_is_no_ball():
    reading = seen(ContentsResult.UNSURE, "RR", "GG", "P?", loose="RG")
    assert outcomes(tube_look(STANDING, reading), 5) == [None] * 5


def test_images_that_do_not_agree_on_what_is_lost_lose_no_ball():
    missing = seen(ContentsResult.BALL_MISSING, "R", "GG", "PP", "R|GG|PP: R in no tube")
    assert outcomes(tube_look(STANDING, missing, balls("RR|GG|PP")), 4) == [None] * 4


def test_tubes_that_are_not_located_lose_no_ball():
    assert outcomes(tube_look(FALLEN, seen(ContentsResult.BALL_MISSING, "", "", "", "RRGGPP in no tube")), 4) == [None] * 4
