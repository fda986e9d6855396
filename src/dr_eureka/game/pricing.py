"""Settings turned into what the solver makes least: balls and handling, or seconds; and into shares of outcomes."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Optional

import numpy as np

from dr_eureka.game.hands import EMPTY_GRIP, HANDS, Grip, Reach, ReachError, grip_for, handling_between
from dr_eureka.game.planner_settings import Durations, Measured, PlannerSettings
from dr_eureka.game.solving import UNREACHABLE, Prices, Shares
from dr_eureka.game.state import TUBE_CAPACITY, Pour
from dr_eureka.game.state_graph import DIRECTIONS

#: In the prices of `fewest` a ball weighs this much and a pick or place 1: no plan has as many picks and places.
BALL_WEIGHT = 1000


def fewest_prices(reach: Reach) -> Prices:
    """Price one ball a pour (paper, section 3.3), then picks and places, which only decide between plans as short."""
    grips = [_grip(direction, reach) for direction in DIRECTIONS]
    pour = np.array([BALL_WEIGHT] + [UNREACHABLE] * (TUBE_CAPACITY - 1), float)
    return _prices(grips, handling_between, handling_between, pour)


def duration_prices(settings: PlannerSettings, method: str) -> Prices:
    """Price everything in seconds, pours of any count, poured by `method`."""
    durations = settings.durations

    def handling(before: Grip, after: Grip) -> float:
        home = durations.home.seconds if after == EMPTY_GRIP else 0.0
        return _handling_seconds(before, after, durations, settings.hands_at_once) + home

    prices = _prices(
        [_grip(direction, settings.reach) for direction in DIRECTIONS],
        handling,
        lambda before, after: durations.upright[method].seconds + (handling(before, after) if before != after else 0.0),
        np.array([durations.pour[method][count].seconds for count in range(1, TUBE_CAPACITY + 1)]),
    )
    ready = np.array([durations.ready[method][source].seconds for source, _ in DIRECTIONS])
    return replace(prices, begin=prices.begin + ready, change=prices.change + ready * ~np.eye(len(DIRECTIONS), dtype=bool))


def outcome_shares(settings: PlannerSettings, method: str) -> Shares:
    """Return how pours by `method` end."""
    shape = (TUBE_CAPACITY + 1, TUBE_CAPACITY + 1)
    intended, fewer, more = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for held, by_count in settings.outcomes[method].items():
        for count, outcome in by_count.items():
            intended[held, count], fewer[held, count], more[held, count] = outcome.intended, outcome.fewer, outcome.more
    return Shares(intended, fewer, more)


class Bill:
    """Adds up what pours cost, from lists: single values of an array take many times as long to look up."""

    def __init__(self, prices: Prices) -> None:
        # By number of pour (24) instead of direction (6), the pour's own price included.
        first, following = (
            (handling[..., None] + prices.pour).reshape(*handling.shape[:-1], -1) for handling in (prices.begin, prices.change)
        )
        self._first = first.tolist()
        self._next = np.repeat(following, TUBE_CAPACITY, axis=0).tolist()
        self._finish = np.repeat(prices.finish, TUBE_CAPACITY).tolist()

    def total(self, pours: Sequence[int]) -> float:
        """Return what pours, by their numbers, cost in a row that begins and ends with empty hands; nothing for none."""
        total, price = 0.0, self._first
        for pour in pours:
            total += price[pour]
            price = self._next[pour]
        return total + self._finish[pours[-1]] if pours else 0.0


def _grip(direction: tuple[str, str], reach: Reach) -> Optional[Grip]:
    try:
        return grip_for(Pour(*direction), reach)
    except ReachError:
        return None


def _prices(
    grips: list[Optional[Grip]],
    handling: Callable[[Grip, Grip], float],
    after_pour: Callable[[Grip, Grip], float],
    pour: np.ndarray,
) -> Prices:
    """Price every change of grip: `handling` from empty hands, `after_pour` from the ready pose of a pour."""

    def price(how: Callable[[Grip, Grip], float], before: Optional[Grip], after: Optional[Grip]) -> float:
        return UNREACHABLE if before is None or after is None else how(before, after)

    change = np.array([[price(after_pour, before, after) for after in grips] for before in grips], float)
    np.fill_diagonal(change, 0.0)
    return Prices(
        begin=np.array([price(handling, EMPTY_GRIP, grip) for grip in grips], float),
        change=change,
        finish=np.array([price(after_pour, grip, EMPTY_GRIP) for grip in grips], float),
        pour=pour,
    )


def _handling_seconds(before: Grip, after: Grip, durations: Durations, at_once: bool) -> float:
    """Return how long picks and places take from one grip to another, tubes being upright.

    At once, both hands place together and, when both have, pick together.
    """
    changed = [(hand, old, new) for hand, old, new in zip(HANDS, before, after) if old != new]
    placing = [_seconds(durations.place, hand, old) for hand, old, _ in changed]
    picking = [
        _seconds(durations.pick.from_home if old is None else durations.pick.after_place, hand, new) for hand, old, new in changed
    ]
    return max(placing, default=0.0) + max(picking, default=0.0) if at_once else sum(placing) + sum(picking)


def _seconds(table: dict[str, dict[str, Measured]], hand: str, tube: Optional[str]) -> float:
    return 0.0 if tube is None else table[hand][tube].seconds
