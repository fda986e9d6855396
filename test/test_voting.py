"""One decision from many images: the card by majority, the tubes by median."""

import numpy as np
import pytest

from dr_eureka.settings import SettingsError, build
from dr_eureka.vision.cards import CardReading, CardResult
from dr_eureka.vision.tubes import NAMES, TubePlace, TubeResult, TubeScene
from dr_eureka.vision.voting import (
    UNDECIDED,
    CardVote,
    CardVoteSettings,
    RepeatedPictures,
    TubeVote,
    TubeVoteSettings,
    VoteSettings,
)

PLACES = np.array([[0.44, 0.11, 0.775], [0.44, 0.0, 0.775], [0.44, -0.11, 0.775]])


def card(state, confidence=0.9):
    return CardReading(CardResult.OK, state, confidence)


def no_card(reason="no outline of a card"):
    return CardReading(CardResult.NO_CARD, reason=reason)


def scene(places=PLACES, sigma_m=0.001, markers=(0, 1, 2, 3)):
    tubes = {name: TubePlace(np.array(place), sigma_m) for name, place in zip(NAMES, places)}
    return TubeScene(TubeResult.OK, tubes, np.eye(4), markers, "")


def no_scene(result=TubeResult.TUBE_MISSING, reason="2 tube feet seen on the sheet, expected 3"):
    return TubeScene(result, {}, None, (0, 1), reason)


def tube_settings(window=10, agree=5):
    return TubeVoteSettings(window, agree, tolerance_m=0.004)


def decisions(vote, readings):
    return [vote.add(reading) for reading in readings]


def positions(found):
    return np.array([found.tubes[name].position for name in NAMES])


def test_a_picture_repeats_the_last_only_if_every_pixel_does():
    pictures = RepeatedPictures()
    first = np.full((48, 64, 3), 90, np.uint8)
    other = first.copy()
    other[47, 63, 2] += 1
    shown = [first, first.copy(), other, first, first[:47], first[:47].copy(), np.zeros((1, 1, 3), np.uint8)]
    assert [pictures.add(picture) for picture in shown] == [False, True, False, False, False, True, False]


def test_a_card_wins_with_the_image_that_completes_its_majority():
    vote = CardVote(CardVoteSettings(window=5, agree=3))
    readings = [card("RR|GG|PP"), no_card(), card("RG|RG|PP"), card("RR|GG|PP"), card("RR|GG|PP")]
    found = decisions(vote, readings)
    assert found[:4] == [None] * 4
    assert found[4].state == "RR|GG|PP"


def test_the_surest_of_the_agreeing_readings_is_returned():
    vote = CardVote(CardVoteSettings(window=3, agree=3))
    found = decisions(vote, [card("RR|GG|PP", 0.5), card("RR|GG|PP", 0.8), card("RR|GG|PP", 0.7)])
    assert found[2].confidence == 0.8


def test_readings_that_have_left_the_window_no_longer_count():
    vote = CardVote(CardVoteSettings(window=4, agree=3))
    readings = [card("RR|GG|PP")] * 2 + [no_card()] * 3 + [card("RR|GG|PP")]
    assert decisions(vote, readings) == [None] * 6


def test_an_image_without_a_card_never_decides():
    vote = CardVote(CardVoteSettings(window=3, agree=2))
    assert decisions(vote, [card("RR|GG|PP"), card("RR|GG|PP"), no_card()])[2] is None


def test_two_cards_shown_in_turn_never_win():
    vote = CardVote(CardVoteSettings(window=8, agree=5))
    assert decisions(vote, [card("RR|GG|PP"), card("RG|RG|PP")] * 10) == [None] * 20
    assert vote.undecided() == (UNDECIDED, "newest images: 4 RR|GG|PP, 4 RG|RG|PP, expected 5 alike")


def test_an_undecided_card_vote_names_the_commonest_failure():
    vote = CardVote(CardVoteSettings(window=8, agree=5))
    decisions(vote, [no_card()] * 3 + [card("RR|GG|PP")])
    assert vote.undecided() == (
        CardResult.NO_CARD,
        "newest images: 3 NO_CARD, 1 RR|GG|PP, expected 5 alike; NO_CARD: no outline of a card",
    )


def test_a_vote_without_images_says_so():
    assert CardVote(CardVoteSettings(window=8, agree=5)).undecided() == (UNDECIDED, "newest images: none, expected 5 alike")
    assert TubeVote(tube_settings()).undecided() == (UNDECIDED, "newest images: none, expected 5 alike")


def test_tube_places_are_the_median_of_the_agreeing_images():
    rng = np.random.default_rng(3)
    shaken = PLACES + rng.normal(0, 0.0005, (5, 3, 3))
    found = decisions(TubeVote(tube_settings(10, 5)), [scene(places) for places in shaken])
    assert found[:4] == [None] * 4
    np.testing.assert_allclose(positions(found[4]), np.sort(shaken, axis=0)[2], atol=1e-12)
    assert found[4].result == TubeResult.OK and found[4].markers_seen == (0, 1, 2, 3)


def test_an_image_with_one_tube_far_off_moves_nothing():
    off = PLACES + [[0, 0, 0], [0, 0, 0], [0.02, 0, 0]]
    vote = TubeVote(tube_settings(10, 5))
    found = decisions(vote, [scene(off), scene(), scene(), scene(), scene(), scene()])
    assert found[4] is None
    np.testing.assert_array_equal(positions(found[5]), PLACES)


def test_tubes_that_drift_through_the_window_are_not_located():
    drifting = [scene(PLACES + [0.005 * step, 0, 0]) for step in range(20)]
    vote = TubeVote(tube_settings(10, 5))
    assert decisions(vote, drifting) == [None] * 20
    assert vote.undecided() == (UNDECIDED, "newest images: 10 OK, expected 5 alike")


def test_images_without_tubes_do_not_count():
    vote = TubeVote(tube_settings(6, 4))
    found = decisions(vote, [scene(), no_scene(), scene(), no_scene(), scene(), scene()])
    assert found[:5] == [None] * 5
    np.testing.assert_array_equal(positions(found[5]), PLACES)


def test_the_uncertainty_of_a_place_is_the_typical_one_of_the_agreeing_images():
    vote = TubeVote(tube_settings(4, 3))
    far = scene(PLACES + [0.1, 0, 0], sigma_m=0.5)
    found = decisions(vote, [scene(sigma_m=0.001), scene(sigma_m=0.002), far, scene(sigma_m=0.003)])
    assert [place.sigma_m for place in found[3].tubes.values()] == [0.002] * 3


def test_an_undecided_tube_vote_names_the_commonest_failure():
    vote = TubeVote(tube_settings(10, 5))
    decisions(vote, [no_scene(), no_scene(), scene(), no_scene(TubeResult.NO_SHEET, "no marker seen")])
    result, reason = vote.undecided()
    assert result == TubeResult.TUBE_MISSING
    assert reason.endswith("expected 5 alike; TUBE_MISSING: 2 tube feet seen on the sheet, expected 3")


def test_a_card_vote_that_two_cards_could_win_is_refused():
    with pytest.raises(SettingsError, match=r"agree: is 4; expected more than half of window \(8\) and at most window"):
        CardVoteSettings(window=8, agree=4)
    with pytest.raises(SettingsError):
        CardVoteSettings(window=8, agree=9)


def test_a_tube_vote_that_nothing_can_win_is_refused():
    with pytest.raises(SettingsError, match=r"agree: is 6; expected at most window \(5\)"):
        tube_settings(5, 6)


def test_votes_are_built_from_the_game_nodes_settings():
    votes = {
        "card": {"window": 3, "agree": 2},
        "tubes": {"window": 4, "agree": 2, "tolerance_m": 0.01},
        "contents": {"window": 5, "agree": 3},
        "lost": {"window": 5, "agree": 4},
    }
    settings = build(VoteSettings, votes)
    assert settings.lost == CardVoteSettings(window=5, agree=4)
    assert settings.card == CardVoteSettings(window=3, agree=2)
    assert settings.tubes == TubeVoteSettings(4, 2, 0.01)
