"""The checks of the planner: they know the puzzle by themselves, and they find a planner out that errs."""
from dataclasses import replace

import networkx
import pytest
from scipy.sparse.csgraph import shortest_path

from dr_eureka.bench import planner as benchmark
from dr_eureka.bench.planner_chances import ChanceModel
from dr_eureka.bench.planner_model import BALL, ActionGraph, Costs, explore, moves
from dr_eureka.bench.report import BenchOptions
from dr_eureka.game.planner import Planner
from dr_eureka.game.planner_settings import Outcome, load_planner_settings
from dr_eureka.game.state import TUBES, Pour, State, all_states

SETTINGS = load_planner_settings()


@pytest.fixture(scope="module")
def texts():
    return explore("RR|GG|PP")


@pytest.fixture(scope="module")
def pours(texts):
    graph = networkx.Graph([(text, move.after) for text in texts for move in moves(text, most=1)])
    return shortest_path(networkx.to_scipy_sparse_array(graph, texts, dtype=float), method="D", unweighted=True).astype(int)


def test_exploring_finds_the_states_and_pours_that_the_planner_knows(texts):
    assert texts == sorted(map(str, all_states()))
    for text in texts[::50]:
        state = State.parse(text)
        ours = {(TUBES[move.source], TUBES[move.target], move.count): move.after for move in moves(text)}
        assert ours == {(p.source, p.target, p.count): str(state.after(p)) for p in state.legal_pours(4)}


class Detour(Planner):
    """A planner that pours a ball there and back before anything else."""

    def pours(self, start, goal):
        pour = start.legal_pours()[0]
        return (pour, Pour(pour.target, pour.source), *super().pours(start, goal))


class Cheat(Planner):
    """A planner that leaves the last pour out."""

    def pours(self, start, goal):
        return super().pours(start, goal)[:-1]


@pytest.mark.parametrize("planner, legal, shortest", [(Planner, True, True), (Detour, True, False), (Cheat, False, False)])
def test_following_every_plan_finds_errors(texts, pours, planner, legal, shortest):
    rows = benchmark._every_plan(texts, pours, planner("fewest"), trials=1)
    assert [row.ok for row in rows] == [legal, shortest]
    assert [row.n for row in rows] == [1709, 1709]


def test_a_single_pour_costs_its_ball_and_four_picks_and_places(texts):
    graph = ActionGraph(texts, Costs.balls(), SETTINGS.reach)
    least = graph.costs_from("RR|GG|PP")
    assert least[texts.index("RR|GG|PP")] == 0.0
    assert least[texts.index("RR|G|PPG")] == pytest.approx(BALL + 4)
    assert least[texts.index("RR||PPGG")] == pytest.approx(2 * BALL + 4)


def test_the_chance_of_one_pour_is_the_share_that_goes_as_intended_or_is_mended(texts):
    outcome = Outcome(intended=0.9, fewer=0.04, more=0.04, lost=0.02)
    pours = {held: {count: outcome for count in by_count} for held, by_count in SETTINGS.outcomes["linear"].items()}
    settings = replace(SETTINGS, outcomes={**SETTINGS.outcomes, "linear": pours})
    # One ball short is poured again; one ball over is poured back, one out of three, which is as risky.
    chance, _ = ChanceModel(texts, settings, "linear").solve("RRGG|P|P", "RRG|PG|P")
    assert chance == pytest.approx(outcome.intended / (1 - outcome.fewer - outcome.more), abs=1e-9)


def test_random_pairs_depend_on_the_seed_alone():
    first, again, other = (benchmark._draw_pairs(BenchOptions(seed=seed, trials=20)) for seed in (4, 4, 5))
    assert first == again != other
    assert all(start != goal for start, goal in first)
