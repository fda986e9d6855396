"""The person who holds a card in front of the robot: which one, and when."""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import Optional

from dr_eureka.game.state import State, all_states


@dataclass(frozen=True)
class CardChange:
    """A card to be shown, or taken away when `state` is None; `number` tells cards of one seed apart."""

    state: Optional[State]
    number: int


class CardHolder:
    """Shows the next card when the robot looks for one, and takes it away once it was read.

    The first card may be given; every other is drawn from the seed among all states but the present one.
    """

    def __init__(self, seed: int, first: Optional[State]):
        self._seed = seed
        self._first = first
        self._shown_in_game: Optional[int] = None
        self._visible = False

    def follow(self, looking: bool, game: int, present: State) -> Optional[CardChange]:
        """Return what to do, None for nothing, when the robot looks for a card or not and the tubes hold `present`."""
        if looking:
            if self._shown_in_game == game:
                return None
            self._shown_in_game = game
            self._visible = True
            return CardChange(self.card(game, present), game)
        if not self._visible:
            return None
        self._visible = False
        return CardChange(None, game)

    def card(self, game: int, present: State) -> State:
        """Return the card of a game that starts with the tubes as `present`."""
        if game == 0 and self._first is not None:
            return self._first
        others = [state for state in all_states() if state != present]
        return random.Random(f"card {self._seed} {game}").choice(others)
