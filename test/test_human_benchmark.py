"""The comparison with a person: cards drawn by their cost, rows, figures, and what people played."""
import json
import random

import cv2
import numpy as np
import pytest

from dr_eureka.bench.human import lost_contest, run
from dr_eureka.bench.human_cards import draw_cards, fewest_pours, optima
from dr_eureka.bench.people import PlayedCardError, read_played_cards
from dr_eureka.bench.report import BenchOptions
from dr_eureka.game.state import START, State
from dr_eureka.settings import SettingsError

# Ordered pairs of states by the fewest pours between them, published for the puzzle by an independent solver.
PAIRS = [1710, 7560, 19764, 49356, 105048, 193896, 307872, 432288, 536562, 528930, 436212, 240264, 60030, 4536, 72]

PLAYED = {
    "began": "2026-11-22T12:00:00+00:00",
    "start": "RR|GG|PP",
    "goal": "RR|G|PPG",
    "optimum": 1,
    "solved": True,
    "seconds": 4.5,
    "moves": [
        {"seconds": 1.0, "source": "left", "target": "center", "undo": False},
        {"seconds": 2.5, "source": "center", "target": "left", "undo": True},
        {"seconds": 4.5, "source": "center", "target": "right", "undo": False},
    ],
}


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Rows and folder of a run with two starts for each cost, and one card that a person played."""
    folder = tmp_path_factory.mktemp("out")
    shown_only = {**PLAYED, "solved": False, "moves": []}
    (folder / "me.jsonl").write_text(f"{json.dumps(PLAYED)}\n{json.dumps(shown_only)}\n")
    return {row.name: row for row in run(BenchOptions(seed=1, trials=2, out=folder))}, folder


def test_the_fewest_pours_are_those_published():
    assert np.bincount(fewest_pours().ravel()).tolist() == PAIRS
    assert list(optima()) == list(range(1, 15))
    assert list(optima(START)) == list(range(1, 13))


def test_cards_are_drawn_by_cost_and_seed_and_differ():
    cards = draw_cards(14, 100, random.Random(1))
    assert len(set(cards)) == PAIRS[14]
    drawn = draw_cards(7, 5, random.Random(1), START)
    assert drawn == draw_cards(7, 5, random.Random(1), START) != draw_cards(7, 5, random.Random(2), START)
    assert len(set(drawn)) == 5
    assert {(card.start, card.optimum) for card in drawn} == {(START, 7)}


def test_there_is_a_row_for_every_cost_and_the_planner_is_always_at_the_optimum(measured):
    rows, _ = measured
    for cost in range(1, 15):
        row = rows[f"human, optimum {cost}"]
        assert row.n == 2 and row.value >= cost and row.unit == "pours"
        assert row.paper == ("comparable" if cost < 7 else "worse")
    planner = rows["planner at the optimum"]
    assert (planner.value, planner.n, planner.ok) == (1.0, 28, True)
    assert rows["human by planner"].value > 1.0


def test_solved_cards_of_people_have_rows_and_cost_every_pour_undone_ones_included(measured):
    rows, _ = measured
    assert (rows["people, optimum 1"].value, rows["people, optimum 1"].n) == (3.0, 1)
    assert [name for name in rows if name.startswith("people")] == ["people, optimum 1"]


def test_both_figures_are_drawn(measured):
    _, folder = measured
    for name in ("figure16.png", "figure17.png"):
        picture = cv2.imread(str(folder / name))
        assert picture.shape[1] > 800 and picture.std() > 10


def test_the_card_of_figure_16_is_one_that_the_human_typically_loses():
    contest = lost_contest(5, seed=1)
    assert contest.card.start == START
    assert len(contest.planner) == 5 < len(contest.human)
    state = START
    for pour in contest.human:
        state = state.after(pour)
    assert state == contest.card.goal


@pytest.mark.parametrize(
    "change, error, text",
    [
        ({"solved": False}, PlayedCardError, "the moves lead to RR|G|PPG, solved is false"),
        ({"goal": "RRG|G|PP"}, PlayedCardError, "the moves lead to RR|G|PPG, solved is true"),
        ({"seconds": -1.0}, SettingsError, "seconds: is -1.0; expected a number, at least 0.0"),
        ({"pours": 3}, SettingsError, "pours: unknown key"),
        ({"moves": [{**PLAYED["moves"][0], "source": "middle"}]}, SettingsError, "moves[0].source: is 'middle'"),
        ({"start": "RR|GG"}, PlayedCardError, "2 tubes, expected 3"),
        ({"moves": PLAYED["moves"][:1] * 3}, PlayedCardError, "0 balls in the left tube"),
    ],
)
def test_a_log_that_is_not_as_it_was_written_is_refused_with_file_and_line(tmp_path, change, error, text):
    (tmp_path / "a.jsonl").write_text(json.dumps(PLAYED) + "\n" + json.dumps({**PLAYED, **change}) + "\n")
    with pytest.raises(error) as caught:
        read_played_cards(tmp_path)
    assert str(caught.value).startswith(f"{tmp_path / 'a.jsonl'}:2: ")
    assert text in str(caught.value)


def test_a_line_that_is_no_json_is_refused_and_no_folder_holds_no_cards(tmp_path):
    (tmp_path / "a.jsonl").write_text("{\n")
    with pytest.raises(PlayedCardError, match=r"a\.jsonl:1: .*expected JSON"):
        read_played_cards(tmp_path)
    assert read_played_cards(None) == []


def test_a_log_keeps_what_was_played(tmp_path):
    (tmp_path / "a.jsonl").write_text(json.dumps(PLAYED) + "\n")
    (card,) = read_played_cards(tmp_path)
    assert json.loads(card.as_line()) == PLAYED
    assert State.parse(card.goal) == State.parse("RR|G|PPG")
