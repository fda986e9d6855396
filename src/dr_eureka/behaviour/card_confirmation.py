"""A card that was read waits for a person to confirm or correct it before anything moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

from dr_eureka.behaviour.failure import Failure
from dr_eureka.behaviour.observation import Observation
from dr_eureka.behaviour.report import GameCode
from dr_eureka.game.state import State, StateError


class ConfirmCode:
    """What became of a confirmation; the names are those of `ConfirmCard.srv`, which explains them."""

    OK = "OK"
    NOT_WAITING = "NOT_WAITING"
    WRONG_STATE = "WRONG_STATE"

    ALL = (OK, NOT_WAITING, WRONG_STATE)


@dataclass(frozen=True)
class ConfirmAnswer:
    """The answer to a person: a `ConfirmCode` and one line."""

    code: str
    message: str


class CardConfirmation:
    """Waits for the word about one card, at most `limit_s` of wall time [s] from `now` on."""

    def __init__(self, card: State, limit_s: float, now: Observation):
        self._card = card
        self._limit_s = limit_s
        self._began_s = now.wall_s
        self._goal: Optional[State] = None

    def answer(self, text: str) -> ConfirmAnswer:
        """Take a person's word: empty confirms what was read, a state corrects it, anything else changes nothing."""
        if self._goal is not None:
            return ConfirmAnswer(ConfirmCode.NOT_WAITING, f"the goal is {self._goal} already")
        try:
            goal = State.parse(text.strip()) if text.strip() else self._card
        except StateError as error:
            return ConfirmAnswer(ConfirmCode.WRONG_STATE, f"{error}; still waiting: the card was read as {self._card}")
        self._goal = goal
        done = "confirmed" if goal == self._card else f"corrected from {self._card}"
        return ConfirmAnswer(ConfirmCode.OK, f"the goal is {goal}, {done}")

    def step(self, now: Observation) -> State | Failure | None:
        """Return the goal once it is confirmed, a Failure when the limit is over, else None."""
        if self._goal is not None:
            return self._goal
        if now.wall_s - self._began_s <= self._limit_s:
            return None
        message = f"nobody confirmed or corrected the card, read as {self._card}, within {self._limit_s:g} s"
        return Failure(GameCode.NOT_CONFIRMED, message)
