"""Cards drawn by how many pours they need at least, as in the paper's comparison with a person (section 4.2)."""
from __future__ import annotations

import random
from functools import lru_cache
from typing import NamedTuple, Optional

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from dr_eureka.game.state import Pour, State, all_states


class Card(NamedTuple):
    """A start, a goal and the fewest pours of one ball between them."""

    start: State
    goal: State
    optimum: int


class Contest(NamedTuple):
    """A card with the pours of both sides."""

    card: Card
    human: tuple[Pour, ...]
    planner: tuple[Pour, ...]

    @property
    def extra(self) -> int:
        """Pours that the human needed beyond the fewest."""
        return len(self.human) - self.card.optimum


def draw_cards(optimum: int, count: int, chance: random.Random, start: Optional[State] = None) -> list[Card]:
    """Draw different cards that need `optimum` pours, each equally likely, from one start or from any.

    Returns fewer than `count` when there are no more: of 14 pours there are 72, from one start fewer.
    """
    starts = all_states() if start is None else (start,)
    pairs = np.argwhere(fewest_pours(start) == optimum)
    drawn = chance.sample(range(len(pairs)), min(count, len(pairs)))
    return [Card(starts[pairs[i][0]], all_states()[pairs[i][1]], optimum) for i in drawn]


def optima(start: Optional[State] = None) -> range:
    """Return the numbers of pours that cards need at least: 1 to 14; from one start 1 to 11 ... 14, as it may be."""
    return range(1, int(fewest_pours(start).max()) + 1)


@lru_cache(maxsize=2)
def fewest_pours(start: Optional[State] = None) -> np.ndarray:
    """Return the fewest pours of one ball from each state (rows; or from one start, 1 row) to each, (n, 1710) int8.

    States are in the order of `all_states`. SciPy finds the numbers, not the planner that is compared with.
    """
    starts = None if start is None else [all_states().index(start)]
    return dijkstra(_graph(), indices=starts, unweighted=True).astype(np.int8)


@lru_cache(maxsize=1)
def _graph() -> csr_matrix:
    states = all_states()
    number = {state: i for i, state in enumerate(states)}
    edges = [(number[state], number[state.after(pour)]) for state in states for pour in state.legal_pours()]
    return csr_matrix((np.ones(len(edges)), tuple(zip(*edges))), shape=(len(states), len(states)))
