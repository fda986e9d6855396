"""The short-sighted player against the paper's words and a search written for this test, on bare text."""
import random

import pytest
from puzzle_text import distances

from dr_eureka.game.human import Habits, human_pours, lifts_settled, settled_balls
from dr_eureka.game.state import START, Pour, State, all_states

STATES = all_states()


def settled(text, goal):
    """Return for each tube how many balls from the bottom are as in the goal."""
    counts = []
    for balls, wanted in zip(text.split("|"), goal.split("|")):
        same = [a == b for a, b in zip(balls, wanted)] + [False]
        counts.append(same.index(False))
    return counts


def keeps(counts, text, goal):
    return all(now >= before for before, now in zip(counts, settled(text, goal)))


def states_of(start, pours):
    states = [start]
    for pour in pours:
        states.append(states[-1].after(pour))
    return states


def drawn_pairs(count, seed):
    chance = random.Random(seed)
    return [(chance.choice(STATES), chance.choice(STATES)) for _ in range(count)]


def test_settled_balls_are_counted_from_the_bottom_up():
    assert settled_balls(State.parse("RGP|RG|P"), State.parse("RGR|G|PP")) == (2, 0, 1)
    assert settled_balls(START, State.parse("RRGG||PP")) == (2, 0, 2)
    assert lifts_settled(START, State.parse("R|GGR|PP"), State.parse("RRGG||PP"))
    assert not lifts_settled(START, State.parse("RRG|G|PP"), State.parse("RRGG||PP"))


def test_the_pours_are_legal_and_lead_to_the_goal_never_with_fewer_than_the_shortest_plan():
    for start, goal in drawn_pairs(30, seed=1):
        pours = human_pours(start, goal, random.Random(1))
        assert states_of(start, pours)[-1] == goal
        assert all(pour.count == 1 for pour in pours)
        assert len(pours) >= distances(str(start))[str(goal)]


def test_a_goal_that_is_the_start_takes_no_pour():
    assert human_pours(START, START, random.Random(1)) == ()


def test_the_same_seed_gives_the_same_pours_and_another_seed_may_not():
    goal = State.parse("G|R|GPRP")
    runs = [human_pours(START, goal, random.Random(seed)) for seed in (1, 1, *range(2, 12))]
    assert runs[0] == runs[1]
    assert len(set(runs)) > 1


def test_cards_of_one_and_two_pours_are_played_with_no_pour_more():
    """Two pours and fewer are in sight whole, and no way to a nearer sub-goal leads off."""
    for start in (START, State.parse("RGPR|GP|"), State.parse("GRPP|R|G")):
        for goal, distance in distances(str(start)).items():
            if distance <= 2:
                assert len(human_pours(start, State.parse(goal), random.Random(1))) == distance


def test_the_nearest_sub_goal_comes_first():
    """The third ball of the left tube is one pour away, the lowest balls of the others three and more."""
    for seed in range(10):
        assert human_pours(START, State.parse("RRP|PG|G"), random.Random(seed))[0] == Pour("right", "left")


def test_the_player_takes_the_near_ball_where_the_shortest_plan_leaves_it():
    """Purple and green on the left settle at once, but then green is missing when the right tube needs it below purple."""
    goal = State.parse("RRPG||GP")
    assert distances(str(START))[str(goal)] == 5
    for seed in range(10):
        pours = human_pours(START, goal, random.Random(seed))
        assert pours[:2] == (Pour("right", "left"), Pour("center", "left"))
        assert len(pours) >= 6


def test_a_settled_ball_is_lifted_only_when_no_further_ball_can_be_settled_without():
    lifts = 0
    for start, goal in drawn_pairs(100, seed=2):
        kept, lifting = settled(str(start), str(goal)), False
        states = states_of(start, human_pours(start, goal, random.Random(1)))
        for here, after in zip(states, states[1:]):
            now = settled(str(here), str(goal))
            if keeps(kept, str(here), str(goal)) and now != kept:
                kept, lifting = now, False
            if lifting or keeps(kept, str(after), str(goal)):
                continue
            lifting = True
            lifts += 1
            reached = distances(str(here), lambda text: keeps(kept, text, str(goal)))
            assert not [text for text in reached if settled(text, str(goal)) != kept]
    assert lifts > 3


@pytest.mark.parametrize("habits", [Habits(), Habits(sight=1, patience=0), Habits(sight=1, patience=30), Habits(sight=20)])
def test_every_card_ends_within_the_bound_whatever_the_habits(habits):
    """Six sub-goals at most, each after at most `patience` tries and a way of far fewer than 20 pours."""
    for start, goal in drawn_pairs(40, seed=4):
        assert len(human_pours(start, goal, random.Random(1), habits)) <= 6 * (habits.patience + 20)


def test_the_player_is_level_with_the_planner_below_seven_pours_and_ever_worse_from_there():
    """As the paper reports of its Figure 17; level means within half a pour on average."""
    chance = random.Random(5)
    from_start = distances(str(START))
    extra = {}
    for cost in (3, 6, 8, 12):
        goals = chance.sample(sorted(text for text, distance in from_start.items() if distance == cost), 30)
        extra[cost] = sum(len(human_pours(START, State.parse(goal), chance)) - cost for goal in goals) / len(goals)
    assert extra[3] <= extra[6] < 0.5 < extra[8] < extra[12]
