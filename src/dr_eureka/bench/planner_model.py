"""The puzzle and the two hands written a second time, to check the planner by: none of the planner's code is used.

States are bare texts such as `RR|GG|PP`; plans are found by scipy on a graph whose steps are single picks, places and
pours, where the planner reasons about whole grips. Only the settings are shared.
"""
from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple, Optional

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from dr_eureka.game.planner_settings import Durations, PlannerSettings

CAPACITY = 4
NAMES = ("left", "center", "right")
#: Weight of a ball where a pick or place weighs 1.
BALL = 1000.0


class Move(NamedTuple):
    """A pour between tubes (0 left, 1 center, 2 right) and the text it leads to."""

    source: int
    target: int
    count: int
    after: str


def moves(text: str, most: int = CAPACITY) -> Iterator[Move]:
    """Yield every pour of up to `most` balls that a text allows."""
    tubes = text.split("|")
    for source in range(3):
        for target in range(3):
            after = list(tubes)
            for count in range(1, most + 1):
                if source == target or not after[source] or len(after[target]) == CAPACITY:
                    break
                after[target] += after[source][-1]
                after[source] = after[source][:-1]
                yield Move(source, target, count, "|".join(after))


def explore(start: str) -> list[str]:
    """Return every text that single balls poured lead to, by breadth-first search, sorted."""
    found, queue = {start}, deque([start])
    while queue:
        for move in moves(queue.popleft(), most=1):
            if move.after not in found:
                found.add(move.after)
                queue.append(move.after)
    return sorted(found)


class Hands(NamedTuple):
    """What the hands hold (tubes, None empty), between which tubes they have just poured, and whether each has moved yet."""

    held: tuple[Optional[int], Optional[int]] = (None, None)
    poured: Optional[tuple[int, int]] = None
    moved: tuple[bool, bool] = (False, False)


@dataclass(frozen=True)
class Costs:
    """Price of single actions: pours by count, all else by `durations`; without them a pick or place is 1, all else 0.

    `method` is how balls are poured, by which `durations` tells some. With `at_once` both hands may also pick, or place,
    together, which takes as long as the slower one does.
    """

    pours: dict[int, float]
    durations: Optional[Durations] = None
    method: str = ""
    at_once: bool = False

    @classmethod
    def seconds(cls, settings: PlannerSettings, method: str) -> Costs:
        """Return costs in seconds."""
        pours = {count: pour.seconds for count, pour in settings.durations.pour[method].items()}
        return cls(pours, settings.durations, method, settings.hands_at_once)

    @classmethod
    def balls(cls) -> Costs:
        """Return the cost of balls poured one by one, then picks and places."""
        return cls({1: BALL})

    def ready(self, source: int) -> float:
        """Return the price of bringing the tubes together for a pour out of one of them."""
        return self.durations.ready[self.method][NAMES[source]].seconds if self.durations else 0.0

    def handling(self, hands: Hands, reach: dict[str, tuple[str, ...]]) -> Iterator[tuple[Hands, float]]:
        """Yield what one pick, one place or raising both tubes after a pour makes of the hands, and its price.

        With `at_once`, also what two picks or two places make of them.
        """
        if hands.poured is not None:
            yield hands._replace(poured=None), self.durations.upright[self.method].seconds if self.durations else 0.0
            return
        one = [list(self._of_hand(hands, hand, reach[name])) for hand, name in enumerate(("left", "right"))]
        yield from one[0] + one[1]
        if self.at_once and (hands.held[0] is None) == (hands.held[1] is None):
            for (after_left, left), (after_right, right) in product(*one):
                held = (after_left.held[0], after_right.held[1])
                if held[0] != held[1] or held[0] is None:
                    yield Hands(held, None, (after_left.moved[0], after_right.moved[1])), max(left, right)

    def _of_hand(self, hands: Hands, hand: int, reach: tuple[str, ...]) -> Iterator[tuple[Hands, float]]:
        """Yield what a pick or a place of one hand (0 left, 1 right) makes of the hands, and its price."""
        name = ("left", "right")[hand]
        if hands.held[hand] is not None:
            seconds = self.durations.place[name][NAMES[hands.held[hand]]].seconds if self.durations else 1.0
            yield hands._replace(held=_with(hands.held, hand, None)), seconds
            return
        for tube in (tube for tube in range(3) if NAMES[tube] in reach and tube not in hands.held):
            seconds = 1.0
            if self.durations:
                pick = self.durations.pick
                seconds = (pick.after_place if hands.moved[hand] else pick.from_home)[name][NAMES[tube]].seconds
            yield Hands(_with(hands.held, hand, tube), None, _with(hands.moved, hand, True)), seconds

    def pour(self, hands: Hands, move: Move) -> Optional[float]:
        """Return the price of a pour with the hands as they are, None when it cannot follow."""
        if {move.source, move.target} != set(hands.held) or hands.poured not in (None, (move.source, move.target)):
            return None
        if move.count not in self.pours:
            return None
        return self.pours[move.count] + (self.ready(move.source) if hands.poured is None else 0.0)


def _with(pair: tuple, index: int, value: object) -> tuple:
    return (value, pair[1]) if index == 0 else (pair[0], value)


class ActionGraph:
    """Every state of tubes and hands, and the single actions between them."""

    def __init__(self, texts: list[str], costs: Costs, reach: dict[str, tuple[str, ...]]):
        self._number = {text: number for number, text in enumerate(texts)}
        self._costs = costs
        self._home = costs.durations.home.seconds if costs.durations else 0.0
        self.hands, handling = _all_hands(costs, reach)
        size = len(texts)
        every = np.arange(size)
        edges = [np.array([one * size + every, two * size + every, np.full(size, price)]) for one, two, price in handling]
        for hands, row in self.hands.items():
            steps = [
                (row * size + number, self.hands[hands._replace(poured=move[:2])] * size + self._number[move.after], price)
                for text, number in self._number.items()
                for move in moves(text)
                if (price := costs.pour(hands, move)) is not None
            ]
            edges.append(np.array(steps, float).reshape(-1, 3).T)
        before, after, price = np.hstack(edges)
        nodes = size * len(self.hands)
        # A price of zero would be no edge to scipy.
        self.matrix = csr_matrix((np.maximum(price, 1e-9), (before.astype(int), after.astype(int))), (nodes, nodes))
        self._empty = [row for hands, row in self.hands.items() if hands.held == (None, None)]

    def costs_from(self, start: str) -> np.ndarray:
        """Return the least price (texts,) from a text to each text, with empty hands, by Dijkstra's algorithm."""
        found = dijkstra(self.matrix, indices=self.hands[Hands()] * len(self._number) + self._number[start])
        least = found.reshape(len(self.hands), -1)[self._empty].min(axis=0) + self._home
        least[self._number[start]] = 0.0
        return least

    def changes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[tuple[int, int]]]:
        """Return the least price of all but the pours themselves, and the directions (6) that it is about.

        From empty hands to the ready pose of a direction (6,); from just having poured in one to the ready pose of another
        (6, 6), 0 for the same; from just having poured to home (6,).
        """
        size = len(self._number)
        distance = dijkstra(self.matrix[::size, ::size])
        directions = [(a, b) for a in range(3) for b in range(3) if a != b]
        held = [[r for h, r in self.hands.items() if h.poured is None and set(h.held) == set(pair)] for pair in directions]
        just = [next(r for h, r in self.hands.items() if h.poured == pair and all(h.moved)) for pair in directions]
        ready = np.array([self._costs.ready(source) for source, _ in directions])
        begin = np.array([distance[self.hands[Hands()], rows].min() for rows in held]) + ready
        change = np.array([[distance[one, rows].min() for rows in held] for one in just]) + ready
        np.fill_diagonal(change, 0.0)
        finish = np.array([distance[one, self._empty].min() for one in just]) + self._home
        return begin, change, finish, directions


def _all_hands(costs: Costs, reach: dict[str, tuple[str, ...]]) -> tuple[dict[Hands, int], list[tuple[int, int, float]]]:
    """Return every way the hands can be, numbered, and the handling between them."""
    numbers, queue, edges = {Hands(): 0}, deque([Hands()]), []
    while queue:
        hands = queue.popleft()
        following = list(costs.handling(hands, reach))
        if None not in hands.held and hands.poured is None:
            following += [(hands._replace(poured=pair), None) for pair in (hands.held, hands.held[::-1])]
        for other, price in following:
            if other not in numbers:
                numbers[other] = len(numbers)
                queue.append(other)
            if price is not None:
                edges.append((numbers[hands], numbers[other], price))
    return numbers, edges
