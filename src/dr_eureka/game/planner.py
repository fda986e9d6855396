"""Plans: which pours lead from a state to a goal, best by one of three strategies (paper, section 3.3)."""
from __future__ import annotations

from dataclasses import fields, replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple, Optional

import numpy as np

from dr_eureka.game import pricing, solving
from dr_eureka.game.hands import Reach, ReachError
from dr_eureka.game.planner_settings import PlannerError, PlannerSettings, load_planner_settings
from dr_eureka.game.solving import NO_POUR, Prices, Shares, Solution
from dr_eureka.game.state import TUBE_CAPACITY, Pour, State
from dr_eureka.game.state_graph import POUR_NUMBERS, POURS, StateGraph, state_graph
from dr_eureka.game.tables import cache_folder, load_or_make, table_key

STRATEGIES = ("fewest", "fastest", "surest")


class Plan(NamedTuple):
    """Pours from a state to a goal, none where they are alike.

    Attributes:
        cost: what the strategy makes least: balls poured (`fewest`) or seconds (`fastest`; `surest`: to be expected).
        seconds: predicted duration [s] when every pour does what it should, without looks.
        chance: of reaching the goal if after each pour what results is looked at; None but for `surest`.
    """

    start: State
    goal: State
    strategy: str
    pours: tuple[Pour, ...]
    cost: float
    seconds: float
    chance: Optional[float] = None


class Result(NamedTuple):
    """What a pour may end in: its share of all such pours, the state, and what to pour then.

    `state` is None when a ball is lost; `pour` is None then and at the goal.
    """

    share: float
    state: Optional[State]
    pour: Optional[Pour]


class Planner:
    """Answers from tables of all 1710 x 1710 cards, made once (a few seconds) and kept in the user's cache folder.

    * `fewest`: one ball a pour, as few pours as possible, then as few picks and places (the paper, and its section 3.5).
    * `fastest`: as few seconds as possible, any count of balls a pour.
    * `surest`: the greatest chance to reach the goal when pours may go wrong, then as few expected seconds.
    """

    def __init__(
        self,
        strategy: str = "fewest",
        method: str = "lock",
        settings: Optional[PlannerSettings] = None,
        cache: Optional[Path] = None,
    ):
        """Load or make the tables; `settings` are config/planner.yaml and `cache` is `cache_folder()` by default.

        Raises:
            PlannerError: for an unknown strategy or way to pour.
        """
        self._settings = settings or load_planner_settings()
        _expect("strategy", strategy, STRATEGIES)
        _expect("way to pour", method, self._settings.methods)
        self.strategy = strategy
        self.method = method
        self.reach: Reach = self._settings.reach
        seconds = pricing.duration_prices(self._settings, method)
        self._seconds = pricing.Bill(seconds)
        self._graph = state_graph()
        prices = pricing.fewest_prices(self.reach) if strategy == "fewest" else seconds
        shares = pricing.outcome_shares(self._settings, method) if strategy == "surest" else None
        self._solution = _solution(self._graph, prices, shares, cache or cache_folder())
        # Bytes and memory views give single values many times faster than arrays do.
        self._plans, self._longest = self._solution.plan.tobytes(), self._solution.plan.shape[-1]
        graph = self._graph
        self._goal_class, self._recolouring, self._recoloured = map(
            memoryview, (graph.goal_class, graph.recolouring, graph.recoloured)
        )

    def plan(self, start: State, goal: State) -> Plan:
        """Return the best plan if every pour does what it should; where one does not, plan again from what resulted.

        Raises:
            ReachError: when the hands cannot take the tubes that lead to the goal.
            PlannerError: when pours that do what they should never get there, so odd are the outcomes in the settings.
        """
        numbers = self._numbers(start, goal)
        cost, chance = len(numbers), None
        if self.strategy != "fewest":
            cost = self._solution.cost[self._look_up(start, goal)]
        if self._solution.chance is not None:
            chance = float(self._solution.chance[self._look_up(start, goal)])
        pours = tuple(map(POURS.__getitem__, numbers))
        return Plan(start, goal, self.strategy, pours, float(cost), self._seconds.total(numbers), chance)

    def pours(self, start: State, goal: State) -> tuple[Pour, ...]:
        """Return the pours of the best plan alone; raises what `plan` does."""
        return tuple(map(POURS.__getitem__, self._numbers(start, goal)))

    def _numbers(self, start: State, goal: State) -> bytes:
        """Return the pours of the best plan by their numbers in `POURS`."""
        goal_class, state = self._look_up(start, goal)
        first = (goal_class * len(self._graph.states) + state) * self._longest
        end = self._plans.find(NO_POUR, first, first + self._longest)
        if end < 0:
            raise PlannerError(f"{start} to {goal}: the {self.strategy} way counts on pours that go wrong")
        if end == first and start != goal:
            raise ReachError(f"{start} to {goal}", self.reach)
        return self._plans[first:end]

    def next_pour(self, state: State, goal: State, last: Optional[Pour] = None) -> Optional[Pour]:
        """Return what to pour next, None at the goal, from whatever state has resulted.

        `last` is the pour just made when its tubes are still in the hands, None for empty hands.

        Raises:
            ReachError: when the hands cannot take the tubes that lead to the goal.
        """
        goal_class, number = self._look_up(state, goal)
        held = 0 if last is None else POUR_NUMBERS[last] // TUBE_CAPACITY + 1
        pour = self._solution.pour.item(goal_class, held, number)
        if pour == NO_POUR and state != goal:
            raise ReachError(f"{state} to {goal}", self.reach)
        return None if pour == NO_POUR else POURS[pour]

    def results_of(self, pour: Pour, state: State, goal: State) -> tuple[Result, ...]:
        """Return how a pour from a state may end other than as intended, likeliest first, and what to pour then.

        Raises:
            PourError: for a pour that the state does not allow.
        """
        state.after(pour)
        outcome = self._settings.outcomes[self.method][len(state.tube(pour.source))][pour.count]
        fewer = state if pour.count == 1 else state.after(replace(pour, count=pour.count - 1))
        shares, lost = {fewer: outcome.fewer}, outcome.lost
        if len(state.tube(pour.target)) + pour.count < TUBE_CAPACITY and outcome.more:
            shares[state.after(replace(pour, count=pour.count + 1))] = outcome.more
        else:
            lost += outcome.more
        found = [Result(share, other, self.next_pour(other, goal, last=pour)) for other, share in shares.items() if share]
        found += [Result(lost, None, None)] if lost else []
        return tuple(sorted(found, key=lambda result: -result.share))

    def _look_up(self, state: State, goal: State) -> tuple[int, int]:
        """Return by which class and state the tables know a goal and a state, colours swapped as in the class's goal."""
        goal_number = self._graph.numbers[goal.tubes]
        swap = self._recolouring[goal_number]
        return self._goal_class[goal_number], self._recoloured[swap, self._graph.numbers[state.tubes]]


def plan_pours(start: State, goal: State) -> tuple[Pour, ...]:
    """Return the pours of the `fewest` plan: as few balls as possible, one a pour, then as few picks and places.

    Raises:
        ReachError: when the hands cannot take the tubes that lead to the goal.
    """
    return _fewest().pours(start, goal)


@lru_cache(maxsize=1)
def _fewest() -> Planner:
    return Planner("fewest")


def _solution(graph: StateGraph, prices: Prices, shares: Optional[Shares], folder: Optional[Path]) -> Solution:
    """Return the tables for prices and shares, from the cache folder if the same solver has made them there before."""
    arrays = [getattr(part, field.name) for part in (prices, shares) if part is not None for field in fields(part)]
    key = table_key(*arrays, graph.after, graph.representatives, Path(solving.__file__).read_bytes())

    def make() -> dict[str, np.ndarray]:
        solution = vars(solving.solve(graph, prices, shares))
        return {name: array for name, array in solution.items() if array is not None}

    return Solution(**{"chance": None, **load_or_make(f"plans-{key}", make, folder)})


def _expect(what: str, word: str, known: tuple[str, ...]) -> None:
    if word not in known:
        raise PlannerError(f"{what} {word!r}, expected one of {', '.join(known)}")
