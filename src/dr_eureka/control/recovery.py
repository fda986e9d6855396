"""After a grasp that failed: put down what is still held and go home, so that somebody can look and try again."""

from __future__ import annotations

from typing import Iterator, Mapping

import numpy as np

from dr_eureka.control.body import Body
from dr_eureka.control.motion import Follow, Motion, Wait, settled
from dr_eureka.control.picking import fingers, go_home, grasp_contacts, place, vertical
from dr_eureka.control.port import grip_joint
from dr_eureka.control.pouring import raise_tubes

_LOW_M = 0.05  # a hand that is no more than this above where it grasps a standing tube has one between its fingers


def put_all_down(body: Body, homes: Mapping[str, np.ndarray]) -> Iterator[Motion]:
    """Let go of what is not safely held, place what is at `homes`, feet (3,) [m] in base, and go home.

    Raises ControlError when a hand cannot get there, or loses its tube on the way.
    """
    low, high = body.settings.grip.on_tube
    for hand in tuple(body.held):
        if not low <= body.joints[grip_joint(hand)] <= high:
            del body.held[hand]
    for hand in [hand for hand in body.arms if hand not in body.held]:
        yield Follow((fingers(body, hand, body.settings.grip.open),), _everything_graspable(body, hand))
        yield Wait(settled((grip_joint(hand),)), body.settings.grip.settle_seconds)
        if _is_low(body, hand):
            yield vertical(body, hand, body.settings.pick.lift, body.settings.speeds.move, "the way up")
    yield from raise_tubes(body)
    for hand, held in tuple(body.held.items()):
        yield from place(body, hand, held.tube, homes[held.tube])
    yield from go_home(body)


def _everything_graspable(body: Body, hand: str) -> frozenset[frozenset[str]]:
    return frozenset(pair for tube in body.places for pair in grasp_contacts(hand, tube))


def _is_low(body: Body, hand: str) -> bool:
    """Tell whether a hand is where it closes round standing tubes."""
    height = body.arms[hand].pose(body.joints)[2, 3] - body.settings.pick.grip_height
    return any(height - foot[2] < _LOW_M for foot in body.places.values())
