"""The surest way to a goal by value iteration, written a second time to check the planner by."""
from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix

from dr_eureka.bench.planner_model import ActionGraph, Costs, moves
from dr_eureka.game.planner_settings import PlannerSettings

_PRECISION = 1e-11
# Pours whose chances differ by less are equally sure.
_EQUAL = 1e-9


class ChanceModel:
    """Pours that may go wrong: rows of `matrix` are (text, pour), columns texts; what a row lacks to 1 is a lost ball."""

    def __init__(self, texts: list[str], settings: PlannerSettings, method: str):
        self._texts = {text: number for number, text in enumerate(texts)}
        costs = Costs.seconds(settings, method)
        self._begin, self._change, self._finish, directions = ActionGraph(texts, costs, settings.reach).changes()
        entries, self._rows = [], []
        for text, number in self._texts.items():
            options = {(move.source, move.target, move.count): self._texts[move.after] for move in moves(text)}
            for source, target, count in options:
                outcome = settings.outcomes[method][len(text.split("|")[source])][count]
                row = len(self._rows)
                self._rows.append((number, directions.index((source, target)), costs.pours[count]))
                shares = {count: outcome.intended, count - 1: outcome.fewer, count + 1: outcome.more}
                for poured, share in shares.items():
                    reached = number if poured == 0 else options.get((source, target, poured))
                    if share and reached is not None:
                        entries.append((row, reached, share))
        row, column, share = zip(*entries)
        self._matrix = csr_matrix((share, (row, column)), (len(self._rows), len(texts)))
        self._text_of, self._direction, self._pour = map(np.array, zip(*self._rows))
        self._starts = np.flatnonzero(np.diff(self._text_of, prepend=-1))

    def solve(self, start: str, goal: str) -> tuple[float, float]:
        """Return the greatest chance to get from start to goal, and the least expected seconds among the equally sure."""
        at_goal, size = self._texts[goal], len(self._texts)
        chance = np.zeros(size)
        chance[at_goal] = 1.0
        while True:
            options = self._matrix @ chance
            better = np.maximum.reduceat(options, self._starts)
            better[at_goal] = 1.0
            if np.abs(better - chance).max() < _PRECISION:
                break
            chance = better
        barred = np.where(options < better[self._text_of] - _EQUAL, np.inf, 0.0)
        seconds = np.zeros((len(self._finish), size))
        while True:
            after = (self._matrix @ seconds.T)[np.arange(len(self._rows)), self._direction] + barred
            improved = np.array([self._least(after, last) for last in range(len(self._finish))])
            improved[:, at_goal] = self._finish
            if np.abs(improved - seconds).max() < 1e-9:
                break
            seconds = improved
        begin = np.minimum.reduceat(after + self._pour + self._begin[self._direction], self._starts)
        return float(better[self._texts[start]]), 0.0 if start == goal else float(begin[self._texts[start]])

    def _least(self, after: np.ndarray, last: int) -> np.ndarray:
        """Return the least expected seconds (texts,) after a pour in direction `last`."""
        return np.minimum.reduceat(after + self._pour + self._change[last, self._direction], self._starts)
