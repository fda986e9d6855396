"""Plans of fewest pours against a breadth-first search written for this test and the figures published for the puzzle.

The figures come from an independent solver: distances from RR|GG|PP and pick/place actions left after cancelling.
"""
import random
import time
from collections import Counter, deque

import pytest
from puzzle_text import distances, moves

from dr_eureka.game.actions import actions_for, separate_actions
from dr_eureka.game.planner import plan_pours
from dr_eureka.game.state import START, State, all_states

GOALS_AT_DISTANCE = [1, 6, 21, 33, 60, 101, 174, 228, 321, 297, 266, 166, 36]
MEAN_DISTANCE = 8.01111761263897
MEAN_HANDLING_SEPARATE = 32.04447045055588
MEAN_HANDLING_LEFT = 15.441778818022236


def least_handling(start, goal):
    """Return the fewest picks and places of any shortest plan, by trying every shortest plan."""
    to_goal = distances(goal)
    best = []

    def try_all(text, held, handling):
        if text == goal:
            best.append(handling + len(held))
            return
        for source, target, after in moves(text):
            if to_goal[after] == to_goal[text] - 1:
                # The left hand takes the tube further left of the two, the right hand the other.
                wanted = {("left hand", min(source, target)), ("right hand", max(source, target))}
                try_all(after, wanted, handling + len(held - wanted) + len(wanted - held))

    try_all(start, set(), 0)
    return min(best)


def handling(actions):
    return sum(action.kind != "pour" for action in actions)


@pytest.fixture(scope="module")
def plans_from_start():
    return {goal: plan_pours(START, goal) for goal in all_states()}


def test_every_plan_from_the_start_is_legal_and_ends_at_its_goal(plans_from_start):
    for goal, pours in plans_from_start.items():
        state = START
        for pour in pours:
            assert pour in state.legal_pours()
            state = state.after(pour)
        assert state == goal


def test_plans_from_the_start_have_the_published_lengths(plans_from_start):
    lengths = Counter(map(len, plans_from_start.values()))
    assert [lengths[length] for length in range(13)] == GOALS_AT_DISTANCE
    assert sum(lengths.values()) == sum(GOALS_AT_DISTANCE) == 1710
    assert sum(map(len, plans_from_start.values())) / 1709 == pytest.approx(MEAN_DISTANCE, abs=1e-9)


def test_plans_from_the_start_are_as_short_as_breadth_first_search_finds(plans_from_start):
    shortest = distances(str(START))
    assert {str(goal): len(pours) for goal, pours in plans_from_start.items()} == shortest


def test_plans_from_other_starts_are_shortest_with_least_handling():
    random_pairs = random.Random(5)
    states = all_states()
    for _ in range(20):
        start, goal = random_pairs.sample(states, 2)
        pours = plan_pours(start, goal)
        assert len(pours) == distances(str(start))[str(goal)]
        assert handling(actions_for(pours)) == least_handling(str(start), str(goal))


def test_the_cards_furthest_apart_take_fourteen_pours():
    """All distances of the 36 states that `RR|GG|PP` is furthest from; 14 is the published diameter."""
    from_start = distances(str(START))
    furthest = [text for text, distance in from_start.items() if distance == 12]
    lengths = {(text, goal): distance for text in furthest for goal, distance in distances(text).items()}
    assert max(lengths.values()) == 14
    for (start, goal), distance in lengths.items():
        if distance == 14:
            assert len(plan_pours(State.parse(start), State.parse(goal))) == 14


def test_cancelling_leaves_the_least_handling_any_tie_break_can_reach(plans_from_start):
    plans = plans_from_start.values()
    assert sum(handling(separate_actions(plan)) for plan in plans) / 1709 == pytest.approx(MEAN_HANDLING_SEPARATE, abs=1e-9)
    assert sum(handling(actions_for(plan)) for plan in plans) / 1709 == pytest.approx(MEAN_HANDLING_LEFT, abs=1e-9)


def test_a_goal_that_is_the_start_needs_no_pour():
    for state in all_states()[::100]:
        assert plan_pours(state, state) == ()


def test_the_same_plan_comes_out_every_time():
    goal = State.parse("GR|PG|RP")
    assert plan_pours(START, goal) == plan_pours(START, goal)


def test_a_plan_takes_less_than_a_millisecond():
    goals = all_states()[::17]
    plan_pours(START, START)
    began = time.process_time()
    for goal in goals:
        plan_pours(START, goal)
    assert (time.process_time() - began) / len(goals) < 0.001
