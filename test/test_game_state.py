"""States and pours of the puzzle, against enumeration by other means and the published counts."""
from itertools import product

import pytest

from dr_eureka.game.state import START, TUBES, Pour, PourError, State, StateError, all_states


def states_by_trial():
    """Build the states by trying every way to drop six balls, one after another, into three tubes."""
    reached = {(("", "", ""), "RRGGPP")}
    for _ in range(6):
        reached = {
            (tuple(balls + (colour if place == tube else "") for place, balls in enumerate(tubes)), left.replace(colour, "", 1))
            for tubes, left in reached
            for colour, tube in product(set(left), range(3))
        }
    return {"|".join(tubes) for tubes, _ in reached if all(len(balls) <= 4 for balls in tubes)}


def test_there_are_1710_states_and_they_are_those_found_by_dropping_balls():
    states = all_states()
    assert len(states) == 1710
    assert {str(state) for state in states} == states_by_trial()


def test_the_tubes_can_be_filled_in_nineteen_ways_with_ninety_orders_each():
    fillings = {}
    for state in all_states():
        fillings.setdefault(tuple(map(len, state.tubes)), set()).add("".join(state.tubes))
    assert len(fillings) == 19
    assert {len(orders) for orders in fillings.values()} == {90}


def test_every_state_is_read_back_from_its_text():
    assert all(State.parse(str(state)) == state for state in all_states())


def test_the_game_starts_with_one_colour_a_tube():
    assert str(START) == "RR|GG|PP"
    assert START.tube("center") == "GG"


@pytest.mark.parametrize(
    "text, message",
    [
        ("RRR|GG|PP", "RRR|GG|PP: 3 red balls, expected 2"),
        ("RR|G|PP", "RR|G|PP: 1 green ball, expected 2"),
        ("||", "||: 0 red balls, expected 2"),
        ("RRGGP||P", "RRGGP||P: 5 balls in the left tube, at most 4 fit"),
        ("RR|GG", "RR|GG: 2 tubes, expected 3 separated by '|'"),
        ("RRGGPP", "RRGGPP: 1 tube, expected 3 separated by '|'"),
        ("RR|GB|PP", "RR|GB|PP: unknown ball 'B' in the center tube, expected only R, G and P"),
        ("rr|gg|pp", "rr|gg|pp: unknown ball 'r' in the left tube, expected only R, G and P"),
        ("RR|GG|PP\n", r"'RR|GG|PP\n': unknown ball '\n' in the right tube, expected only R, G and P"),
        ("", "'': 1 tube, expected 3 separated by '|'"),
    ],
)
def test_an_impossible_state_says_in_one_line_what_is_wrong(text, message):
    with pytest.raises(StateError) as caught:
        State.parse(text)
    assert str(caught.value) == message
    assert caught.value.state == text


def test_a_goal_that_is_no_text_is_refused():
    with pytest.raises(StateError, match=r"^17: not a text, expected a state such as RR\|GG\|PP$"):
        State.parse(17)


def test_a_very_long_goal_is_cut_in_the_message():
    with pytest.raises(StateError) as caught:
        State.parse("R" * 10_000)
    assert len(str(caught.value)) < 120


def test_a_pour_takes_the_uppermost_ball_to_the_top_of_the_target():
    assert str(State.parse("RG|GP|PR").after(Pour("left", "right"))) == "R|GP|PRG"


def test_several_balls_arrive_reversed_as_if_poured_one_by_one():
    for state in all_states():
        for pour in state.legal_pours(max_count=4):
            one_by_one = state
            for _ in range(pour.count):
                one_by_one = one_by_one.after(Pour(pour.source, pour.target))
            assert state.after(pour) == one_by_one


def test_the_legal_pours_are_exactly_those_that_are_not_refused():
    for state in all_states()[::7]:
        allowed = set()
        for source, target, count in product(TUBES, TUBES, range(1, 7)):
            try:
                state.after(Pour(source, target, count))
            except PourError:
                continue
            allowed.add(Pour(source, target, count))
        assert set(state.legal_pours(max_count=6)) == allowed
        assert set(state.legal_pours()) == {pour for pour in allowed if pour.count == 1}


def test_the_graph_has_7560_pours_of_one_ball_and_each_can_be_poured_back():
    edges = {(state, state.after(pour)) for state in all_states() for pour in state.legal_pours()}
    assert len(edges) == 7560
    assert {(after, before) for before, after in edges} == edges
    assert sum(len(state.legal_pours(max_count=3)) for state in all_states()) == 14580
    assert sum(len(state.legal_pours(max_count=4)) for state in all_states()) == 15120


def test_a_pour_from_an_empty_tube_is_refused():
    with pytest.raises(PourError, match=r"^pour center to left, count 1: 0 balls in the center tube of RRGG\|\|PP$"):
        State.parse("RRGG||PP").after(Pour("center", "left"))


def test_a_pour_into_a_full_tube_is_refused():
    with pytest.raises(PourError, match=r"4 balls in the left tube of RRGG\|\|PP, at most 4 fit$"):
        State.parse("RRGG||PP").after(Pour("right", "left"))


@pytest.mark.parametrize(
    "arguments, message",
    [
        (("left", "middle"), "unknown tube 'middle', expected one of left, center, right"),
        (("left", "left"), "source and target are the same tube, expected two"),
        (("left", "right", 0), "count is 0, expected a whole number of at least 1"),
        (("left", "right", 1.0), "count is 1.0, expected a whole number of at least 1"),
        (("left", "right", True), "count is True, expected a whole number of at least 1"),
    ],
)
def test_a_malformed_pour_is_refused(arguments, message):
    with pytest.raises(PourError) as caught:
        Pour(*arguments)
    assert str(caught.value).endswith(message)
