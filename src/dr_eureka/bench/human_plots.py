"""Figures 16 and 17 of the paper: how human and planner get to the goal, and what it costs them."""
from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Optional

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle
from matplotlib.ticker import MultipleLocator

from dr_eureka.bench.human_cards import Contest
from dr_eureka.bench.people import PlayedCard
from dr_eureka.bench.report import mean_row
from dr_eureka.game.state import TUBE_CAPACITY, TUBES, Pour, State

BALL_FACES = {"R": "#d62728", "G": "#2ca02c", "P": "#8e5bb5"}
HUMAN, PLANNER, PEOPLE = "tab:blue", "tab:red", "tab:green"
#: States of a flow that stand side by side, and the room of each, in diameters of a ball.
STATES_A_ROW = 4
STATE_WIDTH, STATE_HEIGHT = 5.2, 6.4


def draw_flows(contests: Sequence[Contest], file: Path) -> None:
    """Draw for each card, one below the other, the states that the human (left) and the planner (right) go through."""
    flows = [[states_of(contest, pours) for pours in (contest.human, contest.planner)] for contest in contests]
    rows = [max(-(-len(flow) // STATES_A_ROW) for flow in pair) for pair in flows]
    size = (12, 1.5 * sum(rows) + 0.6 * len(rows))
    figure, axes = plt.subplots(len(contests), 2, squeeze=False, figsize=size, height_ratios=rows)
    # Fixed margins: an automatic layout would measure every ball.
    figure.subplots_adjust(left=0.01, right=0.99, bottom=0.01, top=0.92, wspace=0.05, hspace=0.2)
    for contest, pair, row_count, cells in zip(contests, flows, rows, axes):
        for who, colour, flow, cell in zip(("Human (model)", "Planner"), (HUMAN, PLANNER), pair, cells):
            cell.set_title(f"{who}: {contest.card.start} to {contest.card.goal}, cost {len(flow) - 1}", color=colour)
            _draw_flow(cell, flow, row_count)
    figure.suptitle("Figure 16: cards that the human plays above the optimum, run of median cost; outlined: just poured")
    figure.savefig(file, dpi=110)
    plt.close(figure)


def draw_costs(contests: Sequence[Contest], people: Sequence[PlayedCard], file: Path) -> None:
    """Draw the mean cost with its 95 % interval against the fewest pours: human, planner, and each card of people."""
    figure, axes = plt.subplots(figsize=(8, 6), layout="constrained")
    optima = sorted({contest.card.optimum for contest in contests})
    axes.plot([0, optima[-1] + 1], [0, optima[-1] + 1], color="0.7", linewidth=1, label="cost = fewest pours")
    human = _costs((contest.card.optimum, len(contest.human)) for contest in contests)
    planner = _costs((contest.card.optimum, sum(pour.count for pour in contest.planner)) for contest in contests)
    _draw_means(axes, human, -0.1, HUMAN, "o", f"human (model), {max(map(len, human.values()))} starts each")
    _draw_means(axes, planner, 0.0, PLANNER, "s", "planner")
    if people:
        # Few cards each: their scatter says more than the interval of a mean.
        places = [card.optimum + 0.15 for card in people]
        costs = [len(card.moves) for card in people]
        axes.scatter(places, costs, color=PEOPLE, marker="^", alpha=0.6, label="people, card by card")
    axes.set(
        title="Figure 17: mean cost and 95 % interval",
        xlabel="fewest pours from start to goal [pours]",
        ylabel="pours to reach the goal [pours]",
        xticks=optima,
        xlim=(0, optima[-1] + 1),
        ylim=(0, None),
    )
    axes.yaxis.set_major_locator(MultipleLocator(2))
    axes.grid(alpha=0.3)
    axes.legend(loc="upper left")
    figure.savefig(file, dpi=110)
    plt.close(figure)


def states_of(contest: Contest, pours: Iterable[Pour]) -> list[tuple[State, Optional[str]]]:
    """Return the states that pours lead through, the start first, each with the tube that was just poured into."""
    states: list[tuple[State, Optional[str]]] = [(contest.card.start, None)]
    for pour in pours:
        states.append((states[-1][0].after(pour), pour.target))
    return states


def _costs(pairs: Iterable[tuple[int, int]]) -> dict[int, list[int]]:
    costs: dict[int, list[int]] = defaultdict(list)
    for optimum, cost in pairs:
        costs[optimum].append(cost)
    return dict(sorted(costs.items()))


def _draw_means(axes: Axes, costs: dict[int, list[int]], shift: float, colour: str, marker: str, label: str) -> None:
    rows = [mean_row("", values, "pours") for values in costs.values()]
    # A mean of one value has no interval: it is drawn without one.
    reach = [0.0 if row.interval95 is None else row.interval95[1] - row.value for row in rows]
    places = np.array(list(costs)) + shift
    means = [row.value for row in rows]
    axes.errorbar(places, means, reach, color=colour, marker=marker, markersize=5, capsize=3, label=label)


def _draw_flow(axes: Axes, flow: Sequence[tuple[State, Optional[str]]], row_count: int) -> None:
    """Draw the states in reading order, arrows between neighbours, numbered by the pours made."""
    for number, (state, poured_into) in enumerate(flow):
        row, column = divmod(number, STATES_A_ROW)
        left, bottom = column * STATE_WIDTH, -row * STATE_HEIGHT
        _draw_tubes(axes, state, poured_into, left, bottom)
        name = {0: "start", len(flow) - 1: f"{number}: goal"}.get(number, str(number))
        axes.text(left + 1.7, bottom - 0.35, name, ha="center", va="top", fontsize=8)
        if number + 1 < len(flow):
            arrow = {"arrowstyle": "->", "color": "0.3"}
            axes.annotate("", (left + 4.8, bottom + 2), (left + 3.9, bottom + 2), arrowprops=arrow)
    axes.set_xlim(-0.5, STATES_A_ROW * STATE_WIDTH)
    axes.set_ylim(-(row_count - 1) * STATE_HEIGHT - 1.5, TUBE_CAPACITY + 0.8)
    axes.set_aspect("equal")
    axes.axis("off")


def _draw_tubes(axes: Axes, state: State, poured_into: Optional[str], left: float, bottom: float) -> None:
    for column, (tube, balls) in enumerate(zip(TUBES, state.tubes)):
        x = left + column * 1.2
        axes.add_artist(Rectangle((x, bottom), 1, TUBE_CAPACITY + 0.2, facecolor="none", edgecolor="0.5", linewidth=0.8))
        for level, ball in enumerate(balls):
            just_poured = tube == poured_into and level == len(balls) - 1
            edge = {"edgecolor": "black", "linewidth": 1.6} if just_poured else {"edgecolor": "none"}
            axes.add_artist(Circle((x + 0.5, bottom + level + 0.5), 0.44, facecolor=BALL_FACES[ball], **edge))
            axes.text(x + 0.5, bottom + level + 0.47, ball, ha="center", va="center", color="white", fontsize=6)
