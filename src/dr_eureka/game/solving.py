"""Best pours from every state to every goal at once, by value iteration (Bellman), certain or uncertain outcomes alike.

Where each pour does what it should, this finds the same shortest plans as Dijkstra's algorithm does for one card at a
time (paper, section 3.3). What the hands hold belongs to the situation: `held` 0 is nothing, `held` d + 1 the grip of
the pour in direction d just made.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Optional

import numpy as np

from dr_eureka.game.state import TUBE_CAPACITY
from dr_eureka.game.state_graph import DIRECTIONS, StateGraph

#: Price of what cannot be done; also what a goal out of reach costs.
UNREACHABLE = 1e9
#: Entry of `Solution.pour` where there is nothing to pour: at the goal, or where the goal is out of reach.
NO_POUR = 255
# Values are exact where outcomes are certain; else iteration ends when a sweep changes none by more.
_TOLERANCE = 1e-10
# Two pours are equally sure when their chances differ by no more: ten times what iteration leaves open.
_EQUAL_CHANCE = 1e-9
# A plan that has not ended after so many pours never will: the puzzle's diameter is 14.
_MOST_POURS = 96
# Goals solved together: so many that the arrays of one step still lie in a processor's cache.
_GOALS_AT_ONCE = 15


@dataclass(frozen=True)
class Prices:
    """What handling and pours cost; a price of `UNREACHABLE` forbids.

    Attributes:
        begin: (6,) from empty hands to being about to pour in each direction.
        change: (6, 6) from a pour in one direction (row) to being about to pour in another (column).
        finish: (6,) from a pour in each direction to empty hands.
        pour: (4,) a pour of 1 .. 4 balls.
    """

    begin: np.ndarray
    change: np.ndarray
    finish: np.ndarray
    pour: np.ndarray

    @property
    def most(self) -> int:
        """Most balls that any pour is priced for."""
        return int(np.flatnonzero(self.pour < UNREACHABLE).max()) + 1


@dataclass(frozen=True)
class Shares:
    """Outcomes of pours as shares (5, 5), indexed by the balls in the source tube and the balls to be poured.

    As intended, one ball fewer, one ball more; the rest is lost, which ends the game.
    """

    intended: np.ndarray
    fewer: np.ndarray
    more: np.ndarray


@dataclass(frozen=True)
class Solution:
    """What to do everywhere, for one goal of each class.

    Attributes:
        pour: (classes, 7, s) uint8, number of the pour to make, by what is held; `NO_POUR` for none.
        plan: (classes, s, longest) uint8, all pours from empty hands if each does what it should, then `NO_POUR`; without
            `NO_POUR` where they would never end.
        cost: (classes, s), expected price from empty hands to the goal and empty hands.
        chance: (classes, s), of reaching the goal; None where outcomes are certain.
    """

    pour: np.ndarray
    plan: np.ndarray
    cost: np.ndarray
    chance: Optional[np.ndarray]


def solve(graph: StateGraph, prices: Prices, shares: Optional[Shares] = None) -> Solution:
    """Find for every state and goal the pour to make next.

    Without `shares` every pour does what it should and the price is made least. With them the chance to reach the goal
    is made greatest and, among the equally sure, the expected price least.
    """
    goals = graph.representatives
    certain = _Outcomes(graph, None, prices.most)
    uncertain = None if shares is None else _Outcomes(graph, shares, prices.most)
    parts = [
        _solve_goals(goals[first : first + _GOALS_AT_ONCE], prices, certain, uncertain)
        for first in range(0, len(goals), _GOALS_AT_ONCE)
    ]
    pour, cost, chance = (
        None if part[0] is None else np.concatenate([np.moveaxis(array, -1, 0) for array in part]) for part in zip(*parts)
    )
    return Solution(pour, _followed(graph, pour), cost, chance)


def _solve_goals(
    goals: np.ndarray, prices: Prices, certain: _Outcomes, uncertain: Optional[_Outcomes]
) -> tuple[np.ndarray, np.ndarray, Optional[np.ndarray]]:
    at_goal = (goals, np.arange(len(goals)))
    cost = np.full((len(DIRECTIONS), certain.states, len(goals)), UNREACHABLE)
    cost, barred, chance = _least_cost(certain, prices, cost, at_goal, 0.0), 0.0, None
    outcomes = uncertain or certain
    if uncertain is not None:
        chance, barred = _greatest_chance(uncertain, prices, at_goal)
        # Iteration goes on from pours that do what they should: a price is finite there wherever it can be.
        cost = _least_cost(uncertain, prices, cost, at_goal, barred)
    expected = outcomes.expected(cost, UNREACHABLE) + barred
    by_held = [_totals(expected, prices, held) for held in range(len(DIRECTIONS) + 1)]
    best = [np.where(total.min(axis=0) < UNREACHABLE, total.argmin(axis=0), NO_POUR) for total in by_held]
    pour = np.array(best, np.uint8)
    pour[(slice(None), *at_goal)] = NO_POUR
    from_empty_hands = np.minimum(by_held[0].min(axis=0), UNREACHABLE)
    from_empty_hands[at_goal] = 0.0
    return pour, from_empty_hands, chance


def _followed(graph: StateGraph, pour: np.ndarray) -> np.ndarray:
    """Return `Solution.plan` by following the pours (classes, 7, s) from every state at once."""
    goal_class = np.arange(len(pour))[:, None]
    state = np.tile(np.arange(pour.shape[-1]), (len(pour), 1))
    held = np.zeros_like(state)
    steps: list[np.ndarray] = []
    while len(steps) < _MOST_POURS:
        steps.append(pour[goal_class, held, state])
        going = steps[-1] != NO_POUR
        if not going.any():
            break
        direction, fewer = np.divmod(steps[-1][going], TUBE_CAPACITY)
        state[going] = graph.after[direction, fewer + 1, state[going]]
        held[going] = direction + 1
    return np.stack(steps, axis=-1)


class _Outcomes:
    """Where pours lead and with which shares; only counts of balls that have a price are looked at."""

    def __init__(self, graph: StateGraph, shares: Optional[Shares], most: int):
        # scipy takes a while to import, and tables are seldom made
        from scipy.sparse import coo_matrix

        self.states = states = len(graph.states)
        self._shape = (len(DIRECTIONS), most, states)
        rows = np.arange(np.prod(self._shape)).reshape(self._shape)
        first_of_direction = states * np.arange(len(DIRECTIONS))[:, None, None]
        count = np.arange(1, most + 1)
        possible = graph.after[:, count] >= 0
        # Impossible pours lead with certainty to the row after all values.
        entries = [(rows[~possible], np.full((~possible).sum(), states * len(DIRECTIONS)), np.ones((~possible).sum()))]
        for change, share in _ways(graph, shares, count):
            reached = graph.after[:, np.minimum(count + change, TUBE_CAPACITY)]
            taken = possible & (share > 0.0)
            entries.append((rows[taken], (first_of_direction + reached)[taken], share[taken]))
        row, column, share = map(np.concatenate, zip(*entries))
        self._matrix = coo_matrix((share, (row, column)), (rows.size, states * len(DIRECTIONS) + 1)).tocsr()

    def expected(self, values: np.ndarray, otherwise: float) -> np.ndarray:
        """Return (6, counts, s, goals) the mean of values (6, s, goals) after each pour, `otherwise` for impossible ones."""
        goals = values.shape[-1]
        rows = np.vstack([values.reshape(-1, goals), np.full(goals, otherwise)])
        return (self._matrix @ rows).reshape(*self._shape, goals)


def _ways(graph: StateGraph, shares: Optional[Shares], count: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """Return by how many balls pours may differ from what they should do, and the shares (6, counts, s) of those that do."""
    held, room, poured = graph.held[:, None, :], graph.room[:, None, :], count[None, :, None]
    if shares is None:
        return [(0, np.ones(np.broadcast(held, poured).shape))]
    # One ball more than a target has room for falls beside it.
    more = np.where(room > poured, shares.more[held, poured], 0.0)
    return [(0, shares.intended[held, poured]), (-1, shares.fewer[held, poured]), (1, more)]


def _least_cost(
    outcomes: _Outcomes, prices: Prices, cost: np.ndarray, at_goal: tuple[np.ndarray, np.ndarray], barred: np.ndarray | float
) -> np.ndarray:
    """Return (6, s, goals) the expected price after a pour in each direction, beginning iteration with `cost`."""
    while True:
        expected = outcomes.expected(cost, UNREACHABLE) + barred
        from_ready = _cheapest([expected[:, index] for index in range(prices.most)], prices.pour)
        improved = np.array([np.minimum(_cheapest(from_ready, change), UNREACHABLE) for change in prices.change])
        improved[(slice(None), *at_goal)] = prices.finish[:, None]
        if np.abs(improved - cost).max() <= _TOLERANCE:
            return improved
        cost = improved


def _cheapest(options: Sequence[np.ndarray], prices: np.ndarray) -> np.ndarray:
    """Return the least of arrays after adding to each its price; option by option, which stays in a processor's cache."""
    least = options[0] + prices[0]
    for option, price in zip(options[1:], prices[1:]):
        np.minimum(least, option + price, out=least)
    return least


def _greatest_chance(
    outcomes: _Outcomes, prices: Prices, at_goal: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the chance (s, goals) to reach the goal, and (6, counts, s, goals) a price that bars pours which lessen it."""
    usable = ((prices.begin < UNREACHABLE)[:, None] & (prices.pour[: prices.most] < UNREACHABLE))[:, :, None, None]
    chance = np.zeros((outcomes.states, len(at_goal[0])))
    chance[at_goal] = 1.0
    while True:
        expected = outcomes.expected(np.broadcast_to(chance, (len(DIRECTIONS), *chance.shape)), 0.0) * usable
        improved = expected.max(axis=(0, 1))
        improved[at_goal] = 1.0
        if np.abs(improved - chance).max() <= _TOLERANCE:
            return improved, np.where(expected >= improved - _EQUAL_CHANCE, 0.0, UNREACHABLE)
        chance = improved


def _totals(expected: np.ndarray, prices: Prices, held: int) -> np.ndarray:
    """Return (24, s, goals) the price of making each pour next and going on best, with what is held."""
    handling = prices.change[held - 1] if held else prices.begin
    total = np.full((len(DIRECTIONS), TUBE_CAPACITY, *expected.shape[2:]), UNREACHABLE)
    total[:, : prices.most] = expected + (handling[:, None] + prices.pour[: prices.most])[:, :, None, None]
    return total.reshape(-1, *expected.shape[2:])
