"""Plans of `fastest` and `surest`, against published figures, a search on single actions and games played at random."""
import random
from dataclasses import replace

import networkx
import numpy as np
import pytest

from dr_eureka.bench.planner_model import ActionGraph, Costs, explore, moves
from dr_eureka.game.actions import actions_for
from dr_eureka.game.hands import ReachError
from dr_eureka.game.planner import Planner, PlannerError
from dr_eureka.game.planner_settings import Durations, Measured, Outcome, PickDurations, load_planner_settings
from dr_eureka.game.pricing import duration_prices, outcome_shares
from dr_eureka.game.solving import solve
from dr_eureka.game.state import START, TUBES, Pour, PourError, State, all_states
from dr_eureka.game.state_graph import state_graph

# By an independent solver, mean over all goals from RR|GG|PP: a pour, pick or place costs 1, up to three balls a pour.
MEAN_TIME_BOTH_HANDS_AT_ONCE = 15.428320655354009
TABLE_2 = {(4, 1): 0.9, (4, 2): 0.9, (4, 3): 0.8, (3, 1): 0.9, (3, 2): 0.9, (2, 1): 1.0}

SETTINGS = load_planner_settings()
PAIRS = [tuple(random.Random(seed).sample(all_states(), 2)) for seed in range(25)]


def every_action_costs_one():
    none, one, hands = Measured(0.0), Measured(1.0), {"left": ("left", "center"), "right": ("center", "right")}
    each = {hand: dict.fromkeys(tubes, one) for hand, tubes in hands.items()}
    pours = {1: one, 2: one, 3: one, 4: Measured(600.0)}
    ready, upright = {"linear": dict.fromkeys(TUBES, none)}, {"linear": none}
    durations = Durations(PickDurations(each, each), each, ready, upright, none, {"linear": pours})
    return replace(SETTINGS, hands_at_once=True, durations=durations, outcomes={"linear": SETTINGS.outcomes["linear"]})


def every_failure_is_final():
    def outcome(held, count):
        share = TABLE_2.get((held, count), 1.0)
        return Outcome(share, lost=1.0 - share)

    table = {held: {count: outcome(held, count) for count in range(1, held + 1)} for held in range(1, 5)}
    return replace(SETTINGS, outcomes={"lock": SETTINGS.outcomes["lock"], "linear": table})


def every_pour_may_end_otherwise():
    def outcome(held, count):
        return Outcome(0.92, fewer=0.04, lost=0.04) if count == held else Outcome(0.92, fewer=0.03, more=0.03, lost=0.02)

    table = {held: {count: outcome(held, count) for count in range(1, held + 1)} for held in range(1, 5)}
    return replace(SETTINGS, outcomes={**SETTINGS.outcomes, "linear": table})


def solve_for(goals, settings, method="linear", uncertain=True):
    """Solve for some goals only, which takes a moment where all of them take seconds."""
    graph = replace(state_graph(), representatives=np.array([state_graph().numbers[goal.tubes] for goal in goals]))
    return solve(graph, duration_prices(settings, method), outcome_shares(settings, method) if uncertain else None)


@pytest.fixture
def planner_for(monkeypatch, tmp_path):
    """Make planners that know the way to one goal only."""

    def make(goal, *arguments, settings=None):
        graph, every = state_graph(), np.zeros(len(all_states()), int)
        one = replace(graph, representatives=np.array([graph.numbers[goal.tubes]]), goal_class=every, recolouring=every)
        monkeypatch.setattr("dr_eureka.game.planner.state_graph", lambda: one)
        return Planner(*arguments, settings=settings, cache=tmp_path)

    return make


def test_both_hands_at_once_take_the_published_time():
    # Prices are the same there and back, so the mean over all starts is the mean over all goals.
    cost = solve_for([START], every_action_costs_one(), uncertain=False).cost
    assert cost.sum() / 1709 == pytest.approx(MEAN_TIME_BOTH_HANDS_AT_ONCE, abs=1e-9)


def test_where_every_failure_is_final_the_surest_plan_is_the_likeliest_path():
    texts, goals = [str(state) for state in all_states()], [START, State.parse("|RG|RGPP")]
    graph = networkx.DiGraph()
    for text in texts:
        for move in moves(text):
            share = TABLE_2.get((len(text.split("|")[move.source]), move.count), 1.0)
            graph.add_edge(move.after, text, weight=-np.log(share))
    chance = solve_for(goals, every_failure_is_final()).chance
    for column, goal in enumerate(goals):
        logarithms = networkx.single_source_dijkstra_path_length(graph, str(goal))
        assert chance[column] == pytest.approx([np.exp(-logarithms[text]) for text in texts], abs=1e-9)


def test_where_no_pour_goes_wrong_the_surest_plan_is_the_fastest():
    goals = all_states()[::400]
    sure, fast = solve_for(goals, SETTINGS, "lock"), solve_for(goals, SETTINGS, "lock", uncertain=False)
    assert sure.chance.min() == 1.0
    assert sure.cost == pytest.approx(fast.cost, abs=1e-6)


@pytest.mark.parametrize("at_once", [False, True])
def test_no_sequence_of_actions_is_faster_than_fastest(planner_for, at_once):
    texts, settings = explore(str(START)), replace(SETTINGS, hands_at_once=at_once)
    graph = ActionGraph(texts, Costs.seconds(settings, "lock"), settings.reach)
    goal = PAIRS[0][1]
    planner = planner_for(goal, "fastest", "lock", settings=settings)
    for start, _ in PAIRS[:10]:
        plan = planner.plan(start, goal)
        assert plan.cost == pytest.approx(graph.costs_from(str(start))[texts.index(str(goal))], abs=1e-6)
        assert plan.cost == pytest.approx(plan.seconds, abs=1e-6)


def test_the_fastest_plan_is_never_slower_than_the_one_of_fewest_balls():
    fewest, fastest = Planner("fewest"), Planner("fastest")
    gains = [fewest.plan(*pair).seconds - fastest.plan(*pair).seconds for pair in PAIRS]
    assert min(gains) >= -1e-9
    assert max(gains) > 1.0


def play(planner, state, goal, chance):
    """Play a game with random outcomes of the pours; return the state, None with a ball lost, and the pours as intended."""
    last, pours = None, []
    while state is not None and (pour := planner.next_pour(state, goal, last)) is not None:
        others = planner.results_of(pour, state, goal)
        shares = [result.share for result in others]
        states = [*(result.state for result in others), state.after(pour)]
        state = chance.choices(states, [*shares, 1.0 - sum(shares)])[0]
        pours.append(pour)
        last = pour
    return state, pours


def test_games_by_the_surest_plan_are_solved_as_often_as_it_says(planner_for):
    goal, games, chance = State.parse("GR|PG|RP"), 2000, random.Random(8)
    planner = planner_for(goal, "surest", "linear", settings=every_pour_may_end_otherwise())
    plan = planner.plan(START, goal)
    ends = [play(planner, START, goal, chance) for _ in range(games)]
    solved = sum(state == goal for state, _ in ends) / games
    assert all(state in (goal, None) for state, _ in ends)
    assert max(len(pours) for _, pours in ends) > len(plan.pours)
    assert solved == pytest.approx(plan.chance, abs=4 * (plan.chance * (1 - plan.chance) / games) ** 0.5)


def test_what_to_pour_next_follows_the_plan_and_ends_at_the_goal():
    planner, goal = Planner("fastest"), State.parse("GR|PG|RP")
    state, last = START, None
    for pour in planner.plan(START, goal).pours:
        assert planner.next_pour(state, goal, last) == pour
        state, last = state.after(pour), pour
    assert planner.next_pour(state, goal, last) is None


def test_a_pour_may_end_one_ball_short_or_one_ball_over_or_beside_the_tubes(planner_for):
    settings = every_pour_may_end_otherwise()
    outcome = settings.outcomes["linear"][4][2]
    planner = planner_for(START, "surest", "linear", settings=settings)
    results = planner.results_of(Pour("left", "right", 2), State.parse("RRGG|PP|"), START)
    assert {None if r.state is None else str(r.state): r.share for r in results} == {
        "RRG|PP|G": outcome.fewer, "R|PP|GGR": outcome.more, None: outcome.lost,
    }
    full = planner.results_of(Pour("left", "right", 2), State.parse("RRGG||PP"), START)
    assert {None if r.state is None else str(r.state): r.share for r in full} == {
        "RRG||PPG": outcome.fewer, None: pytest.approx(outcome.lost + outcome.more),
    }


def test_what_a_pour_that_is_not_possible_may_end_in_is_not_told(planner_for):
    with pytest.raises(PourError, match="0 balls in the right tube"):
        planner_for(START, "surest", "linear").results_of(Pour("right", "left"), State.parse("RRGG|PP|"), START)


def test_with_shorter_arms_plans_go_round_the_pair_they_cannot_take(planner_for):
    reach, goal = {"left": ("left", "center"), "right": ("right",)}, State.parse("RRG|G|PP")
    planner = planner_for(goal, "fewest", settings=replace(SETTINGS, reach=reach))
    pours = planner.plan(START, goal).pours
    assert len(pours) > 1
    assert all("right" in (pour.source, pour.target) for pour in pours)
    actions_for(pours, reach)


def test_hands_that_cannot_hold_two_tubes_have_no_plan(planner_for):
    goal = State.parse("RRG|G|PP")
    planner = planner_for(goal, "fastest", settings=replace(SETTINGS, reach={"left": ("left",), "right": ()}))
    for ask in (planner.plan, planner.pours, planner.next_pour):
        with pytest.raises(ReachError, match="left hand: left; right hand: none"):
            ask(START, goal)


def test_a_plan_that_would_never_end_if_pours_did_what_they_should_is_refused(planner_for):
    def outcome(held, count):
        return Outcome(1.0) if count == held else Outcome(0.1, more=0.9)

    table = {held: {count: outcome(held, count) for count in range(1, held + 1)} for held in range(1, 5)}
    settings = replace(SETTINGS, outcomes={**SETTINGS.outcomes, "linear": table})
    planner = planner_for(START, "surest", "linear", settings=settings)
    start = State.parse("|GG|PPRR")
    for ask in (planner.plan, planner.pours):
        with pytest.raises(PlannerError, match=r"\|GG\|PPRR to RR\|GG\|PP: the surest way counts on pours that go wrong"):
            ask(start, START)
    assert planner.next_pour(start, START) is not None


def test_unknown_words_are_refused_with_those_that_are_known():
    with pytest.raises(PlannerError, match="strategy 'nicest', expected one of fewest, fastest, surest"):
        Planner("nicest")
    with pytest.raises(PlannerError, match="way to pour 'upside', expected one of lock, linear, profiled"):
        Planner("fastest", "upside")
