"""The benchmark of the planner: the puzzle's figures, every plan checked, time against NetworkX, seconds a game."""
from __future__ import annotations

import os
import random
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from itertools import product

import networkx
import numpy as np
from scipy.sparse.csgraph import dijkstra

from dr_eureka.bench.planner_chances import ChanceModel
from dr_eureka.bench.planner_model import BALL, NAMES, ActionGraph, Costs, explore, moves
from dr_eureka.bench.report import BenchOptions, Row, mean_row, progress, share_row
from dr_eureka.game.actions import actions_for
from dr_eureka.game.planner import Plan, Planner
from dr_eureka.game.planner_settings import PlannerSettings, load_planner_settings
from dr_eureka.game.state import START, Pour, State, all_states

#: Cards at each least number of pours from RR|GG|PP, and further figures, by a solver that is not in this package.
GOALS_BY_POURS = (1, 6, 21, 33, 60, 101, 174, 228, 321, 297, 266, 166, 36)
STATES, EDGES, DIAMETER, CANCELLED = 1710, 3780, 14, 0.5181140895478782
#: How many times faster than NetworkX a plan shall come.
SPEED_UP = 100.0
_PAIRS = 200
_TURN = 20  # queries
_ROUNDS = 5
_LOADS = 5
_LOAD_PROGRAM = """
import time
began = time.perf_counter()
from dr_eureka.game.planner import Planner
imported = time.perf_counter()
Planner({strategy!r})
print(imported - began, time.perf_counter() - imported)
"""


def run(options: BenchOptions) -> list[Row]:
    """Measure; `trials` are the pairs drawn at random (200) and, when given, the starts from which all plans are checked."""
    settings = load_planner_settings()
    texts = explore(str(START))
    graph = networkx.Graph([(text, move.after) for text in texts for move in moves(text, most=1)])
    pours = dijkstra(networkx.to_scipy_sparse_array(graph, texts, dtype=float), unweighted=True).astype(int)
    pairs = _draw_pairs(options)
    fewest = Planner("fewest", settings=settings)
    return [
        *_figures(texts, graph, pours, fewest, settings),
        *_every_plan(texts, pours, fewest, options.trials),
        *_checked_handling(texts, pairs, fewest, settings),
        *_checked_seconds(texts, pairs, settings),
        *_checked_chances(texts, pairs, settings),
        *_times(graph, pairs, fewest),
        *_predictions(options, settings),
    ]


def _draw_pairs(options: BenchOptions) -> list[tuple[State, State]]:
    """Draw different starts and goals."""
    chance = random.Random(options.seed)
    return [tuple(chance.sample(all_states(), 2)) for _ in range(options.trials or _PAIRS)]


def _counted(name: str, value: float, unit: str, expected: float) -> Row:
    return Row(name, value, unit, goal=f"= {expected:g}", ok=bool(abs(value - expected) < 1e-6))


def _figures(
    texts: list[str], graph: networkx.Graph, pours: np.ndarray, fewest: Planner, settings: PlannerSettings
) -> list[Row]:
    """Count the puzzle, and how many picks and places of the plans from RR|GG|PP keeping tubes in the hands saves."""
    from_start = pours[texts.index(str(START))]
    found = np.bincount(from_start, minlength=len(GOALS_BY_POURS))
    least = ActionGraph(texts, Costs.balls(), settings.reach).costs_from(str(START)) % BALL
    separate = 4 * from_start.sum()
    ours = sum(_handling(fewest, START, goal) for goal in all_states())
    return [
        _counted("states", len(texts), "count", STATES),
        _counted("edges, one ball a pour", graph.number_of_edges(), "count", EDGES),
        _counted("diameter, any start", pours.max(), "pours", DIAMETER),
        *(
            _counted(f"cards {number} pours from {START}", found[number], "count", expected)
            for number, expected in enumerate(GOALS_BY_POURS)
        ),
        _counted("picks and places saved, best of all shortest plans", 1 - least.sum() / separate, "share", CANCELLED),
        _counted("the same in the planner's plans", 1 - ours / separate, "share", CANCELLED),
    ]


def _handling(planner: Planner, start: State, goal: State) -> int:
    """Return how many picks and places a plan has."""
    return sum(action.kind != "pour" for action in actions_for(planner.pours(start, goal), planner.reach))


def _every_plan(texts: list[str], pours: np.ndarray, fewest: Planner, trials: int | None) -> list[Row]:
    """Check every plan of `fewest` by following it on bare texts: legal, at its goal, and as short as can be."""
    following = {text: {move[:3]: move.after for move in moves(text, most=1)} for text in texts}
    number = {text: i for i, text in enumerate(texts)}
    states = {text: State.parse(text) for text in texts}
    legal = shortest = total = 0
    starts = texts if trials is None else texts[:trials]
    for start in progress(starts, len(starts), "all plans"):
        for goal in texts:
            if goal == start:
                continue
            plan = fewest.pours(states[start], states[goal])
            legal += _end(start, plan, following) == goal
            shortest += len(plan) == pours[number[start], number[goal]]
            total += 1
    return [
        share_row("plans of fewest that are legal and reach their goal", legal, total, goal="all", ok=legal == total),
        share_row("plans of fewest as short as scipy finds", shortest, total, goal="all", ok=shortest == total),
    ]


_TUBES = {name: index for index, name in enumerate(NAMES)}


def _end(text: str | None, plan: Iterable[Pour], following: dict[str, dict[tuple[int, int, int], str]]) -> str | None:
    """Return the text that pours lead to, None when one is not legal."""
    for pour in plan:
        text = following[text].get((_TUBES[pour.source], _TUBES[pour.target], pour.count)) if text else None
    return text


def _checked_handling(
    texts: list[str], pairs: list[tuple[State, State]], fewest: Planner, settings: PlannerSettings
) -> list[Row]:
    """Compare the picks and places of `fewest` with Dijkstra's algorithm on single actions of two hands."""
    graph = ActionGraph(texts, Costs.balls(), settings.reach)
    hits = sum(
        _handling(fewest, start, goal) == round(graph.costs_from(str(start))[texts.index(str(goal))] % BALL)
        for start, goal in progress(pairs, len(pairs), "fewest")
    )
    name = "plans of fewest with as few picks and places as any as short"
    return [share_row(name, hits, len(pairs), goal="all", ok=hits == len(pairs))]


def _checked_seconds(texts: list[str], pairs: list[tuple[State, State]], settings: PlannerSettings) -> list[Row]:
    """Compare `fastest` with Dijkstra's algorithm on single actions of two hands."""
    following = {text: {move[:3]: move.after for move in moves(text)} for text in texts}
    rows = []
    for method in settings.methods:
        graph = ActionGraph(texts, Costs.seconds(settings, method), settings.reach)
        planner = Planner("fastest", method, settings)

        def right(plan: Plan) -> bool:
            least = graph.costs_from(str(plan.start))[texts.index(str(plan.goal))]
            ends = _end(str(plan.start), plan.pours, following) == str(plan.goal)
            return ends and abs(plan.cost - least) < 1e-6 and abs(plan.seconds - least) < 1e-6

        hits = sum(right(planner.plan(*pair)) for pair in progress(pairs, len(pairs), f"fastest, {method}"))
        name = f"plans of fastest, {method}, as fast as Dijkstra finds on single actions"
        rows.append(share_row(name, hits, len(pairs), goal="all", ok=hits == len(pairs)))
    return rows


def _checked_chances(texts: list[str], pairs: list[tuple[State, State]], settings: PlannerSettings) -> list[Row]:
    """Compare `surest` with a value iteration of its own."""
    rows = []
    for method in settings.methods:
        model, planner = ChanceModel(texts, settings, method), Planner("surest", method, settings)
        plans = [planner.plan(*pair) for pair in pairs]
        right = 0
        for plan in progress(plans, len(plans), f"surest, {method}"):
            chance, seconds = model.solve(str(plan.start), str(plan.goal))
            right += abs(plan.chance - chance) < 1e-6 and abs(plan.cost - seconds) < 1e-4
        name = f"plans of surest, {method}, as sure and fast as value iteration finds"
        rows.append(share_row(name, right, len(plans), goal="all", ok=right == len(plans)))
        rows.append(mean_row(f"chance to solve by surest, {method}", [plan.chance for plan in plans], "share"))
    return rows


def _times(graph: networkx.Graph, pairs: list[tuple[State, State]], fewest: Planner) -> list[Row]:
    """Time queries beside NetworkX's Dijkstra on the same graph, and loading in fresh processes.

    Queries are in processor time, so that other programs do not count. They take turns of twenty: one by one, each would
    also pay for the other's traces in the processor's caches.
    """
    ours, theirs = [], []
    turns = [pairs[first:first + _TURN] for first in range(0, len(pairs), _TURN)] * _ROUNDS
    for turn in progress(turns, len(turns), "query times"):
        theirs += [_seconds(lambda: networkx.dijkstra_path(graph, str(start), str(goal))) for start, goal in turn]
        ours += [_seconds(lambda: fewest.plan(start, goal)) for start, goal in turn]
    median, slowest = (float(np.quantile(theirs, share) / np.quantile(ours, share)) for share in (0.5, 0.99))
    goal = f">= {SPEED_UP:g}"
    loads = np.array([_load_times("fewest") for _ in range(_LOADS)])
    return [
        Row("query of fewest, median", float(np.median(ours)) * 1e6, "us", len(ours)),
        Row("query of fewest, 99th percentile", float(np.quantile(ours, 0.99)) * 1e6, "us", len(ours)),
        Row("NetworkX Dijkstra, median", float(np.median(theirs)) * 1e6, "us", len(theirs)),
        Row("NetworkX Dijkstra, 99th percentile", float(np.quantile(theirs, 0.99)) * 1e6, "us", len(theirs)),
        Row("times faster than NetworkX, medians", median, "ratio", len(ours), goal=goal, ok=median >= SPEED_UP),
        Row("times faster than NetworkX, 99th percentiles", slowest, "ratio", len(ours), goal=goal, ok=slowest >= SPEED_UP),
        Row("loading a strategy's table in a fresh process, median", float(np.median(loads[:, 1])), "s", _LOADS),
        Row("importing the planner, median", float(np.median(loads[:, 0])), "s", _LOADS),
    ]


def _seconds(call: Callable[[], object]) -> float:
    began = time.process_time()
    call()
    return time.process_time() - began


def _load_times(strategy: str) -> tuple[float, float]:
    """Return how long a fresh process imports the planner and loads a table that has been made before [s]."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    program = _LOAD_PROGRAM.format(strategy=strategy)
    command = [sys.executable, "-c", program]
    finished = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return tuple(map(float, finished.stdout.split()))


def _predictions(options: BenchOptions, settings: PlannerSettings) -> list[Row]:
    """Predict the seconds of games with random cards, without looks, every pour going as intended."""
    chance = random.Random(options.seed)
    goals = chance.sample([state for state in all_states() if state != START], options.trials or _PAIRS)
    rows = []
    for method, strategy in product(settings.methods, ("fewest", "fastest", "surest")):
        planner = Planner(strategy, method, settings)
        seconds = [planner.plan(START, goal).seconds for goal in goals]
        rows.append(mean_row(f"predicted seconds of a game from {START}, {strategy}, {method}", seconds, "s"))
    return rows
