"""Which hand holds which tube: two tubes are held for every pour, one in each hand (paper, section 3.5)."""
from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Optional

from dr_eureka.errors import DrEurekaError
from dr_eureka.game.state import TUBES, Pour

HANDS = ("left", "right")

#: Tubes each hand can take from the table.
Reach = Mapping[str, tuple[str, ...]]


def other_hand(hand: str) -> str:
    """Return the hand that is not this one."""
    return HANDS[1 - HANDS.index(hand)]


class ReachError(DrEurekaError):
    """Something to pour between tubes that no pair of hands can take.

    Attributes:
        reach: the tubes each hand can take.
    """

    def __init__(self, what: object, reach: Reach) -> None:
        tubes = "; ".join(f"{hand} hand: {', '.join(reach.get(hand, ())) or 'none'}" for hand in HANDS)
        super().__init__(f"{what}: the hands cannot take the tubes for this, they reach {tubes}")
        self.reach = reach


class Grip(NamedTuple):
    """The tube in each hand, None for an empty hand."""

    left: Optional[str]
    right: Optional[str]

    def hand_with(self, tube: str) -> str:
        """Return the hand that holds a tube."""
        return HANDS[self.index(tube)]


EMPTY_GRIP = Grip(None, None)


def grip_for(pour: Pour, reach: Reach) -> Grip:
    """Choose the hands for the two tubes of a pour.

    Where both hands could take both tubes, the arms stay uncrossed: the left hand takes the tube further left.

    Raises:
        ReachError: when no choice of hands reaches both tubes.
    """
    outer_left, outer_right = sorted((pour.source, pour.target), key=TUBES.index)
    for grip in (Grip(outer_left, outer_right), Grip(outer_right, outer_left)):
        if all(tube in reach.get(hand, ()) for hand, tube in zip(HANDS, grip)):
            return grip
    raise ReachError(f"pour {pour}", reach)


def handling_between(before: Grip, after: Grip) -> int:
    """Count the picks and places that lead from one grip to another; a tube that stays in its hand costs none."""
    changed = [(old, new) for old, new in zip(before, after) if old != new]
    return sum(tube is not None for pair in changed for tube in pair)
