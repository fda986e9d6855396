"""All states and pours as arrays of numbers, and the states that differ in their colours' names only."""
from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations

import numpy as np

from dr_eureka.game.state import COLOURS, TUBE_CAPACITY, TUBES, Pour, State, all_states

#: Source and target of a pour; `POURS[d * TUBE_CAPACITY + count - 1]` is the pour of `count` balls in `DIRECTIONS[d]`.
DIRECTIONS = tuple(permutations(TUBES, 2))
POURS = tuple(Pour(source, target, count) for source, target in DIRECTIONS for count in range(1, TUBE_CAPACITY + 1))
POUR_NUMBERS = {pour: number for number, pour in enumerate(POURS)}


@dataclass(frozen=True)
class StateGraph:
    """The puzzle as a graph; states are numbered as in `all_states`, s of them (1710).

    Swapping colours maps plans onto plans, so a plan to one of the six goals that differ in their colours only is a plan
    to each. `classes` (285) of such goals are therefore enough to know all.

    Attributes:
        states: state of each number.
        numbers: number of each state by its tubes, which are faster to look up than the state itself.
        after: (6, 5, s) state after pouring count balls (second index) in a direction (first), -1 where that is not
            possible; count 0 leaves the state as it is.
        held: (6, s) balls in the source tube of each direction.
        room: (6, s) balls for which the target tube of each direction has room.
        recoloured: (6, s) state with its colours swapped in each of the six ways.
        goal_class: (s,) class of each state.
        recolouring: (s,) which way of swapping turns a state into the representative of its class.
        representatives: (classes,) one state of each class.
    """

    states: tuple[State, ...]
    numbers: dict[tuple[str, str, str], int]
    after: np.ndarray
    held: np.ndarray
    room: np.ndarray
    recoloured: np.ndarray
    goal_class: np.ndarray
    recolouring: np.ndarray
    representatives: np.ndarray


@lru_cache(maxsize=1)
def state_graph() -> StateGraph:
    """Return the graph of all states, made at the first call (0.1 s)."""
    states = all_states()
    number_of = {str(state): number for number, state in enumerate(states)}
    recoloured = np.array(
        [
            [number_of[str(state).translate(swap)] for state in states]
            for swap in (str.maketrans(COLOURS, "".join(order)) for order in permutations(COLOURS))
        ]
    )
    representatives, goal_class = np.unique(recoloured.min(axis=0), return_inverse=True)
    fill = np.array([[len(balls) for balls in state.tubes] for state in states]).T
    sources, targets = np.array([[TUBES.index(tube) for tube in direction] for direction in DIRECTIONS]).T
    return StateGraph(
        states=states,
        numbers={state.tubes: number for number, state in enumerate(states)},
        after=_after(states, number_of),
        held=fill[sources],
        room=TUBE_CAPACITY - fill[targets],
        recoloured=recoloured,
        goal_class=goal_class,
        recolouring=recoloured.argmin(axis=0),
        representatives=representatives,
    )


def _after(states: tuple[State, ...], number_of: dict[str, int]) -> np.ndarray:
    """Return `StateGraph.after`: several balls leave one after another, as if poured one by one."""
    after = np.full((len(DIRECTIONS), TUBE_CAPACITY + 1, len(states)), -1)
    after[:, 0] = np.arange(len(states))
    for number, state in enumerate(states):
        for pour in state.legal_pours():
            tubes = dict(zip(TUBES, state.tubes))
            tubes[pour.target] += tubes[pour.source][-1]
            tubes[pour.source] = tubes[pour.source][:-1]
            after[DIRECTIONS.index((pour.source, pour.target)), 1, number] = number_of["|".join(tubes.values())]
    for count in range(2, TUBE_CAPACITY + 1):
        before = after[:, count - 1]
        after[:, count] = np.where(before >= 0, np.take_along_axis(after[:, 1], before, axis=1), -1)
    return after
