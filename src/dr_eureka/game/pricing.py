"""Settings turned into what the solver makes least: balls and handling, or seconds; and into shares of outcomes."""
from __future__ import annotations

from collections.abc import Callable, Iterable
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
        lambda before, after: durations.upright.seconds + (handling(before, after) if before != after else 0.0),
        np.array([durations.pour[method][count].seconds for count in range(1, TUBE_CAPACITY + 1)]),
    )
    ready = np.array([durations.ready[source].seconds for source, _ in DIRECTIONS])
    return replace(prices, begin=prices.begin + ready, change=prices.change + ready * ~np.eye(len(DIRECTIONS), dtype=bool))


def outcome_shares(settings: PlannerSettings, method: str) -> Shares:
    """Return how pours by `method` end."""
    shape = (TUBE_CAPACITY + 1, TUBE_CAPACITY + 1)
    intended, fewer, more = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for held, by_count in settings.outcomes[method].items():
        for count, outcome in by_count.items():
            intended[held, count], fewer[held, count], more[held, count] = outcome.intended, outcome.fewer, outcome.more
    return Shares(intended, fewer, more)


def price_of(pours: Iterable[int], prices: Prices) -> float:
    """Return what pours, by their numbers, cost in a row that begins and ends with empty hands; nothing for none."""
    total, last = 0.0, None
    for pour in pours:
        direction, fewer = divmod(pour, TUBE_CAPACITY)
        total += prices.begin.item(direction) if last is None else prices.change.item(last, direction)
        total += prices.pour.item(fewer)
        last = direction
    return total if last is None else total + prices.finish.item(last)


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

    With both hands at once each places and then picks on its own; it waits for a tube that the other has yet to place.
    """
    hands = tuple(zip(HANDS, before, after))
    placing = {hand: _seconds(durations.place, hand, old) if old != new else 0.0 for hand, old, new in hands}
    ends = []
    for hand, old, new in hands:
        picks = durations.pick.from_home if old is None else durations.pick.after_place
        picking = _seconds(picks, hand, new) if old != new else 0.0
        free = max(placing.values()) if new in before and old != new else placing[hand]
        ends.append(free + picking if at_once else placing[hand] + picking)
    return max(ends) if at_once else sum(ends)


def _seconds(table: dict[str, dict[str, Measured]], hand: str, tube: Optional[str]) -> float:
    return 0.0 if tube is None else table[hand][tube].seconds
