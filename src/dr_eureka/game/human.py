"""The short-sighted player: a model of how a person solves a card (paper, section 4.2).

The paper describes the person in words only: short-term planning; "try to make the configuration of the balls in the
bottom of the tube the same as the goal", then check "beginning from the bottom"; "achieving the nearest subgoals"; on
hard cards "a lot of random actions". Here these words are rules. A ball is settled when it and all below it in its tube
are as in the goal. A sub-goal is one more settled ball in any tube, with the settled ones still or again in place. Then:

1. Is a sub-goal within `sight` pours that lift no settled ball? Pour the way to the nearest, by chance among equals.
2. Otherwise try something: a random pour that lifts no settled ball and does not take the last one back.
3. After `patience` tries in a row, or with nothing to try, work the nearest sub-goal out however far it is; lift
   settled balls only if there is no way without.

Every card ends: only the ways of rules 1 and 3 change how many balls are settled, each leaves at least one more than
before, there are six, and at most `patience` tries come before each. Rule 3 always finds a way, for each state leads
to each other.
"""
from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import takewhile
from typing import Optional

from dr_eureka.game.state import Pour, State


@dataclass(frozen=True)
class Habits:
    """How a short-sighted player plays.

    The paper measured neither figure. With the defaults the player does as the paper reports: on cards of up to six
    pours level with the shortest plan, here within half a pour on average, then worse and worse (`benchmark human`).

    Attributes:
        sight: pours ahead that the player sees [pours].
        patience: pours tried at random before the player stops to think [pours].
    """

    sight: int = 3
    patience: int = 5


def human_pours(start: State, goal: State, chance: random.Random, habits: Habits = Habits()) -> tuple[Pour, ...]:
    """Play a card as the short-sighted player does; returns the pours, one ball each, from start to goal.

    The same start, goal, habits and seed of `chance` give the same pours.
    """
    pours: list[Pour] = []
    state, last_state, tries = start, None, 0
    while state != goal:
        way = _way_to_subgoal(state, goal, chance, habits.sight)
        tried = _random_try(state, last_state, goal, chance) if way is None and tries < habits.patience else None
        if tried is not None:
            way = (tried,)
            tries += 1
        else:
            way = way or _way_to_subgoal(state, goal, chance) or _way_to_subgoal(state, goal, chance, may_lift=True)
            tries = 0
        for pour in way:
            last_state, state = state, state.after(pour)
        pours += way
    return tuple(pours)


def settled_balls(state: State, goal: State) -> tuple[int, ...]:
    """Return for each tube how many balls, counted from the bottom, are as in the goal."""
    return tuple(
        sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(balls, wanted)))
        for balls, wanted in zip(state.tubes, goal.tubes)
    )


def lifts_settled(state: State, following: State, goal: State) -> bool:
    """Tell whether a ball that is settled in `state` no longer is in `following`."""
    return any(after < before for before, after in zip(settled_balls(state, goal), settled_balls(following, goal)))


def _way_to_subgoal(
    state: State, goal: State, chance: random.Random, sight: float = math.inf, may_lift: bool = False
) -> Optional[tuple[Pour, ...]]:
    """Return the fewest pours to a nearest sub-goal, chosen by chance among equals, or None if none is in sight."""
    settled = settled_balls(state, goal)
    arrivals: dict[State, Optional[tuple[State, Pour]]] = {state: None}
    outermost = [state]
    while outermost and sight > 0:
        # Breadth first, so what is found first is nearest; the shuffle leaves to chance which of the nearest it is.
        steps = [(here, *step) for here in outermost for step in _steps(here)]
        chance.shuffle(steps)
        outermost = []
        sight -= 1
        for here, pour, following in steps:
            lifts = lifts_settled(state, following, goal)
            if following in arrivals or (lifts and not may_lift):
                continue
            arrivals[following] = (here, pour)
            if not lifts and settled_balls(following, goal) != settled:
                return tuple(_pours_to(following, arrivals))[::-1]
            outermost.append(following)
    return None


def _pours_to(state: State, arrivals: dict[State, Optional[tuple[State, Pour]]]) -> Iterator[Pour]:
    """Yield the pours that a search found to a state, the last first."""
    while (arrival := arrivals[state]) is not None:
        state, pour = arrival
        yield pour


def _random_try(state: State, last_state: Optional[State], goal: State, chance: random.Random) -> Optional[Pour]:
    """Return a random pour that lifts no settled ball and does not lead back, or None if there is none."""
    options = [
        pour for pour, following in _steps(state) if following != last_state and not lifts_settled(state, following, goal)
    ]
    return chance.choice(options) if options else None


@lru_cache(maxsize=None)
def _steps(state: State) -> tuple[tuple[Pour, State], ...]:
    """Return the pours of one ball that a state allows, each with the state it leads to; 1710 states at most."""
    return tuple((pour, state.after(pour)) for pour in state.legal_pours())
