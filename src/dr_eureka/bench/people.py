"""Cards that people played: JSON lines that `play_human --log` writes and `benchmark human` draws beside its model."""
from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Optional

from dr_eureka.errors import DrEurekaError
from dr_eureka.game.state import TUBES, Pour, PourError, State, StateError
from dr_eureka.settings import build

_SECONDS = {"min": 0.0}
_TUBE = {"choices": TUBES}


class PlayedCardError(DrEurekaError):
    """A line of a log that is not as it was written."""


@dataclass(frozen=True)
class Move:
    """A pour of one ball, `seconds` after the card was shown; taken back or made by the person's choice."""

    seconds: float = field(metadata=_SECONDS)
    source: str = field(metadata=_TUBE)
    target: str = field(metadata=_TUBE)
    undo: bool


@dataclass(frozen=True)
class PlayedCard:
    """A card that a person played, one line of the log.

    Attributes:
        began: when the card was shown, ISO 8601 with time zone.
        start, goal: states.
        optimum: the fewest pours from start to goal.
        solved: False when the person stopped before the goal.
        seconds: from the showing of the card to its last pour, or to when the person stopped.
        moves: every pour, those that take others back included; their number is what the card cost.
    """

    began: str
    start: str
    goal: str
    optimum: int = field(metadata={"min": 0})
    solved: bool
    seconds: float = field(metadata=_SECONDS)
    moves: tuple[Move, ...]

    def as_line(self) -> str:
        """Return the card as one line of JSON."""
        return json.dumps(asdict(self)) + "\n"


def read_played_cards(folder: Optional[Path]) -> list[PlayedCard]:
    """Read the cards in all `*.jsonl` files of a folder, none without a folder.

    Raises PlayedCardError or SettingsError naming file and line: for what is no such line, or whose moves do not lead from
    start to goal as it says.
    """
    cards: list[PlayedCard] = []
    for file in sorted(folder.glob("*.jsonl")) if folder else ():
        try:
            lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError as error:
            raise PlayedCardError(f"{file}: {error.strerror}; expected a log of play_human") from error
        cards += [_played_card(line, f"{file}:{number}") for number, line in enumerate(lines, 1)]
    return cards


def _played_card(line: str, where: str) -> PlayedCard:
    try:
        mapping: Any = json.loads(line)
    except ValueError as error:
        raise PlayedCardError(f"{where}: {error}; expected JSON as play_human --log writes it") from error
    card = build(PlayedCard, mapping, where)
    try:
        state, goal = State.parse(card.start), State.parse(card.goal)
        for move in card.moves:
            state = state.after(Pour(move.source, move.target))
    except (StateError, PourError) as error:
        raise PlayedCardError(f"{where}: {error}") from error
    if card.solved != (state == goal):
        solved = json.dumps(card.solved)
        raise PlayedCardError(f"{where}: the moves lead to {state}, solved is {solved}; expected a log as it was written")
    return card
