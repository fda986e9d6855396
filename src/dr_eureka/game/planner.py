"""Shortest plans: Dijkstra's algorithm on the graph of all states (paper, section 3.3)."""
from __future__ import annotations

import heapq
from functools import lru_cache

from dr_eureka.game.hands import DEFAULT_REACH, EMPTY_GRIP, Grip, Reach, grip_for, handling_between
from dr_eureka.game.state import Pour, State, all_states


def plan_pours(start: State, goal: State, reach: Reach = DEFAULT_REACH) -> tuple[Pour, ...]:
    """Find the pours that lead from one state to another with the fewest balls moved.

    Each pour moves one ball and costs 1, as in the paper. Among the equally short plans (up to 16) this is one with
    the fewest picks and places, which depend on how often the hands can keep their tubes between two pours.
    The choice is exact, and the same plan comes out every time. Start and goal alike need no pour.

    Raises:
        ReachError: when the hands cannot take both tubes of a pour that a shortest plan may contain.
    """
    balls_moved = _balls_from(start)

    @lru_cache(maxsize=None)
    def cheapest_way(state: State, grip: Grip) -> tuple[int, tuple[Pour, ...]]:
        """Return the fewest picks and places, and the pours, from the start to `state` and then to holding `grip`."""
        if state == start:
            return handling_between(EMPTY_GRIP, grip), ()
        ways = []
        for pour_back, previous in _edges()[state]:
            if balls_moved[previous] >= balls_moved[state]:
                continue
            pour = Pour(pour_back.target, pour_back.source)
            pour_grip = grip_for(pour, reach)
            handling, pours = cheapest_way(previous, pour_grip)
            ways.append((handling + handling_between(pour_grip, grip), (*pours, pour)))
        return min(ways)

    return cheapest_way(goal, EMPTY_GRIP)[1]


@lru_cache(maxsize=1)
def _edges() -> dict[State, tuple[tuple[Pour, State], ...]]:
    """Return the pours of one ball from each state with the states they lead to; each can be poured back."""
    return {state: tuple((pour, state.after(pour)) for pour in state.legal_pours()) for state in all_states()}


@lru_cache(maxsize=16)
def _balls_from(start: State) -> dict[State, int]:
    """Return for each state how many balls a shortest plan from `start` moves, by Dijkstra's algorithm."""
    edges = _edges()
    distances = {start: 0}
    frontier = [(0, start)]
    while frontier:
        distance, state = heapq.heappop(frontier)
        if distance > distances[state]:
            continue
        for pour, neighbour in edges[state]:
            through = distance + pour.count
            if through < distances.get(neighbour, through + 1):
                distances[neighbour] = through
                heapq.heappush(frontier, (through, neighbour))
    return distances
