"""Pouring from one held tube into the other: to the ready pose, the pour, and back upright (paper 3.5)."""

from __future__ import annotations

from itertools import chain
from typing import Iterator, Sequence

import numpy as np

from dr_eureka.control.arm import Arm
from dr_eureka.control.at_once import at_once
from dr_eureka.control.body import Body
from dr_eureka.control.codes import ControlError, EngineCode
from dr_eureka.control.motion import Follow, Motion
from dr_eureka.control.pour_planner import PourPlanner
from dr_eureka.control.trajectory import JointTrajectory
from dr_eureka.game.hands import HANDS

_Move = tuple[Arm, np.ndarray, np.ndarray]
"""An arm, and the postures (7,) [rad] that it goes from and to."""


def raise_tubes(body: Body) -> Iterator[Motion]:
    """Bring both held tubes from a pour's ready pose back to upright, side by side; nothing to do when they are."""
    if not body.upright:
        return
    if body.pour_ready is not None and all(hand in body.held for hand in HANDS):
        planner = PourPlanner(body, *body.pour_ready)
        points = np.vstack([body.commanded(planner.source.hand), planner.docking[-2::-1]])
        yield _along(body, planner, points)
    moves = [(body.arms[hand], body.commanded(hand), body.upright[hand]) for hand in HANDS if hand in body.held]
    if moves:
        yield from _carry(body, moves)
    body.pour_ready, body.upright = None, {}


def _carry(body: Body, moves: Sequence[_Move]) -> Iterator[Motion]:
    """Move arms in joint space, all in the same time and together or, where they would collide, one after the other."""
    limits = body.settings.speeds.carry
    longest = max(arm.move(start, end, limits).duration for arm, start, end in moves)
    ways = [iter([Follow(((arm.joints, arm.move(start, end, limits, longest)),))]) for arm, start, end in moves]
    return at_once(body, *ways) if len(ways) == len(HANDS) else chain(*ways)


def _along(body: Body, planner: PourPlanner, points: np.ndarray) -> Follow:
    """Return the pouring arm's way through joint angles (k, 7) [rad] near the other tube."""
    return Follow(((planner.source.joints, JointTrajectory.within(points, body.settings.speeds.carry)),), planner.lips)


def pour(body: Body, source_hand: str, target_hand: str, method: str, balls_before: int, count: int) -> Iterator[Motion]:
    """Pour `count` balls out of the tube in one hand into the tube in the other, one of POUR_METHODS.

    Both tubes stay at the ready pose, so that a pour of the same kind can follow at once. Raises ControlError
    (INVALID_ACTION, UNREACHABLE_POUR, TUBE_SLIPPED).
    """
    if source_hand not in body.held or target_hand not in body.held or source_hand == target_hand:
        raise ControlError(EngineCode.INVALID_ACTION, f"a pour needs a tube in each hand, held: {sorted(body.held)}")
    planner = PourPlanner(body, source_hand, method)
    motions = planner.motions(balls_before, count)
    if body.pour_ready != (source_hand, method):
        yield from _get_ready(body, planner)
        body.pour_ready = (source_hand, method)
    for motion in motions:
        # A tube may have gone on the way here, or while somebody looked: no ball is poured on hope.
        _check_grips(body, source_hand, target_hand, "before the pour")
        yield motion
    _check_grips(body, source_hand, target_hand, "after the pour")


def _check_grips(body: Body, source_hand: str, target_hand: str, moment: str) -> None:
    """Raise ControlError TUBE_SLIPPED unless both hands still hold a tube, as far as the fingers tell."""
    for hand, doing in ((source_hand, "pouring"), (target_hand, "receiving")):
        body.check_grip(hand, EngineCode.TUBE_SLIPPED, f"{doing}, {moment}")


def _get_ready(body: Body, planner: PourPlanner) -> Iterator[Motion]:
    """Bring the tubes, upright in the hands, to the ready pose: side by side first, then lip to lip."""
    source, target = planner.source, planner.target
    body.upright = {arm.hand: body.commanded(arm.hand) for arm in (source, target)}
    ends = ((source, planner.docking[0]), (target, planner.receiving))
    yield from _carry(body, [(arm, body.commanded(arm.hand), end) for arm, end in ends])
    _check_grips(body, source.hand, target.hand, "before the tubes come together")
    yield _along(body, planner, planner.docking)
