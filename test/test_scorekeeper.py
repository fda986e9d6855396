"""The record of finished games (`game.json`), without ROS."""

import json

import pytest

from dr_eureka.behaviour.report import ActionRecord, GameCode, GameReport, Phase
from dr_eureka.behaviour.scorecard import Ruling, Scorecard
from dr_eureka.game.actions import Action
from dr_eureka.game.state import TUBES, Pour

KEYS = {"seed", "start", "card", "goal", "strategy", "pour", "verdict", "solved", "balls_lost", "pours", "replans",
        "simulated_seconds", "wall_seconds", "actions"}


def report(game=0, games=1, start="RR|GG|PP", goal="R|GG|PPR", code=GameCode.SOLVED, card="R|GG|PPR"):
    actions = (
        ActionRecord(Action("pick", "left", "left"), 3.2, 9.0),
        ActionRecord(Action("pour", "left", "left", "right", "right", 1), 9.0, 15.51234, failed=True),
    )
    phase = Phase.FINISHED if code == GameCode.SOLVED else Phase.FAILED
    return GameReport(
        phase, code, game, games, start, card, goal, "fewest", "lock", (Pour("left", "right"),), actions, 0, 31.25, 12.5, ""
    )


def ruling(state="R|GG|PPR", balls_lost=0, standing=TUBES):
    return Ruling(state, balls_lost, tuple(standing))


def written(card):
    return json.loads(json.dumps(card.as_mapping()))


def test_one_game_has_its_keys_at_the_top_level():
    card = Scorecard(seed=5)
    card.add(report(), ruling())
    result = written(card)
    assert KEYS <= set(result) and "games" not in result
    assert (result["seed"], result["verdict"], result["solved"], result["balls_lost"], result["pours"]) == (5, "SOLVED", True, 0, 1)
    assert (result["strategy"], result["pour"]) == ("fewest", "lock")
    assert (result["simulated_seconds"], result["wall_seconds"]) == (31.25, 12.5)
    assert result["actions"] == [
        {"kind": "pick", "hand": "left", "tube": "left", "start": 3.2, "end": 9.0},
        {
            "kind": "pour", "hand": "left", "tube": "left", "target_hand": "right", "target_tube": "right", "count": 1,
            "start": 9.0, "end": 15.512, "failed": True,
        },
    ]


@pytest.mark.parametrize(
    "seen, solved, lost",
    [
        (ruling(), True, 0),
        (ruling(state="RR|GG|PP"), False, 0),
        (ruling(state=None, balls_lost=1), False, 1),
        (ruling(standing=("left", "right")), False, 0),
        (None, None, None),
    ],
)
def test_solved_and_balls_lost_are_the_referees_not_the_robots(seen, solved, lost):
    card = Scorecard(seed=1)
    card.add(report(), seen)
    assert (written(card)["solved"], written(card)["balls_lost"], written(card)["verdict"]) == (solved, lost, "SOLVED")


def test_a_corrected_card_is_told_from_the_goal():
    card = Scorecard(seed=1)
    card.add(report(card="R|GP|PGR"), ruling())
    assert (written(card)["card"], written(card)["goal"], written(card)["solved"]) == ("R|GP|PGR", "R|GG|PPR", True)


def test_a_game_that_failed_before_its_goal_was_known_has_none():
    card = Scorecard(seed=1)
    card.add(report(card="", goal="", code=GameCode.NO_CARD), ruling(state="RR|GG|PP"))
    assert written(card)["card"] is None
    assert (written(card)["goal"], written(card)["verdict"], written(card)["solved"]) == (None, "NO_CARD", False)


def test_several_games_are_listed_and_summed_up():
    card = Scorecard(seed=2)
    card.add(report(0, 2), ruling())
    card.add(report(1, 2, start="R|GG|PPR", goal="|GGR|PPR"), ruling(state="R|GG|PPR"))
    result = written(card)
    assert [game["solved"] for game in result["games"]] == [True, False]
    assert (result["start"], result["goal"], result["solved"]) == ("RR|GG|PP", "|GGR|PPR", False)
    assert (result["pours"], result["simulated_seconds"]) == (2, 62.5)
    assert [action["game"] for action in result["actions"]] == [0, 0, 1, 1]


def test_no_game_is_no_result():
    with pytest.raises(ValueError, match="no game"):
        Scorecard(seed=1).as_mapping()
