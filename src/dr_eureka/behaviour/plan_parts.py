"""A plan taken in parts of a few pours, after each of which the tubes are looked at."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import Mapping, Sequence

from dr_eureka.game.actions import Action, actions_for
from dr_eureka.game.state import TUBES, Pour, State


@dataclass(frozen=True)
class Part:
    """Pours that are carried out without a look in between, from the state `before`."""

    before: State
    pours: tuple[Pour, ...]

    @property
    def expected(self) -> State:
        """What the tubes hold afterwards, unless a pour goes wrong."""
        return reduce(State.after, self.pours, self.before)

    def after_action(self, index: int) -> Part:
        """Return as much of the part as is done when the action of this index is."""
        return Part(self.before, self.pours[: sum(action.kind == "pour" for action in self.actions[: index + 1])])

    @property
    def actions(self) -> tuple[Action, ...]:
        """What the hands do; afterwards every tube stands on the table."""
        return actions_for(self.pours)

    @property
    def balls(self) -> Mapping[str, int]:
        """How many balls each tube holds before."""
        return {tube: len(content) for tube, content in zip(TUBES, self.before.tubes)}


def next_part(present: State, pours_ahead: Sequence[Pour], least: int) -> Part:
    """Return the part that begins a plan: `least` pours, and those that follow with the same two tubes."""
    count = min(least, len(pours_ahead))
    while count < len(pours_ahead) and _tubes(pours_ahead[count]) == _tubes(pours_ahead[count - 1]):
        count += 1
    return Part(present, tuple(pours_ahead[:count]))


def _tubes(pour: Pour) -> set[str]:
    return {pour.source, pour.target}
