"""Where a game stands, as the game flow tells it and as `GameStatus` carries it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, Sequence

from dr_eureka.game.actions import Action
from dr_eureka.game.state import Pour, State


class Phase:
    """Phases of one game, in their usual order; the names are those of `GameStatus.msg`."""

    WAITING_FOR_ENGINE = "WAITING_FOR_ENGINE"
    WAITING_FOR_CAMERA = "WAITING_FOR_CAMERA"
    LOOKING_FOR_CARD = "LOOKING_FOR_CARD"
    WAITING_FOR_CONFIRMATION = "WAITING_FOR_CONFIRMATION"
    LOOKING_FOR_TUBES = "LOOKING_FOR_TUBES"
    PLANNING = "PLANNING"
    PLAYING = "PLAYING"
    CHECKING = "CHECKING"
    FINISHED = "FINISHED"
    FAILED = "FAILED"

    ALL = (
        WAITING_FOR_ENGINE, WAITING_FOR_CAMERA, LOOKING_FOR_CARD, WAITING_FOR_CONFIRMATION, LOOKING_FOR_TUBES, PLANNING,
        PLAYING, CHECKING, FINISHED, FAILED,
    )


class GameCode:
    """How a game ended; the names are those of `GameStatus.msg`, which explains them."""

    UNDECIDED = "UNDECIDED"
    SOLVED = "SOLVED"
    UNCHECKED = "UNCHECKED"
    NOT_SOLVED = "NOT_SOLVED"
    REPLAYED = "REPLAYED"
    NO_ENGINE = "NO_ENGINE"
    ENGINE_LOST = "ENGINE_LOST"
    ENGINE_REFUSED = "ENGINE_REFUSED"
    ENGINE_FAULT = "ENGINE_FAULT"
    HEAD_NOT_STILL = "HEAD_NOT_STILL"
    NO_CAMERA = "NO_CAMERA"
    CAMERA_FROZEN = "CAMERA_FROZEN"
    NO_CARD = "NO_CARD"
    CARD_UNREADABLE = "CARD_UNREADABLE"
    NOT_CONFIRMED = "NOT_CONFIRMED"
    NO_TUBES = "NO_TUBES"
    NO_CONTENTS = "NO_CONTENTS"
    BALL_LOST = "BALL_LOST"
    NO_PLAN = "NO_PLAN"
    INTERNAL_ERROR = "INTERNAL_ERROR"

    ALL = (
        UNDECIDED, SOLVED, UNCHECKED, NOT_SOLVED, REPLAYED, NO_ENGINE, ENGINE_LOST, ENGINE_REFUSED, ENGINE_FAULT,
        HEAD_NOT_STILL, NO_CAMERA, CAMERA_FROZEN, NO_CARD, CARD_UNREADABLE, NOT_CONFIRMED, NO_TUBES, NO_CONTENTS, BALL_LOST,
        NO_PLAN, INTERNAL_ERROR,
    )


@dataclass(frozen=True)
class ActionRecord:
    """An action that was begun; `start_s` and `end_s` are robot time, `end_s` so far when it is under way.

    `failed`: it was under way when a fault of the engine ended the strategy; `end_s` is when the engine had told of it.
    """

    action: Action
    start_s: float
    end_s: float
    failed: bool = False


@dataclass(frozen=True)
class GameReport:
    """One game as it stands; times are seconds since this game began.

    `start` is what the tubes held at the beginning, empty until that was seen, or, after the first game, what the game
    before left. `card` is the state read from the card, empty when none was read; `goal` differs from it when a person
    corrected it. `strategy` and `pour` tell what plans make best and how balls are poured.
    """

    phase: str
    code: str
    game: int
    games: int
    start: str
    card: str
    goal: str
    strategy: str
    pour: str
    pours: tuple[Pour, ...]
    actions: tuple[ActionRecord, ...]
    replans: int
    robot_seconds: float
    wall_seconds: float
    message: str

    @property
    def last(self) -> bool:
        """Tell whether nothing follows this report: the last game is finished, or any game failed."""
        return self.phase == Phase.FAILED or (self.phase == Phase.FINISHED and self.game + 1 == self.games)


class Listener(Protocol):
    """Who is told what the flow finds out."""

    def on_card(self, finding: Any) -> None:
        """A card was read (what the card look returned)."""

    def on_confirmation(self, card: State, goal: State) -> None:
        """A person confirmed the card that was read, or corrected it to another goal."""

    def on_plan(self, start: State, goal: State, pours: Sequence[Pour], actions: Sequence[Action]) -> None:
        """A plan was made."""

    def on_tubes(self, finding: Any) -> None:
        """Where the tubes stand and what they hold was seen (what the tube look returned)."""

    def on_surprise(self, expected: State, seen: State) -> None:
        """The tubes hold something else than the pours should have led to; a new plan follows."""

    def on_hands(self, message: str) -> None:
        """The tubes in the hands were seen after a pour to hold something else than they should, or not seen at all."""

    def on_fault(self, message: str) -> None:
        """A grasp failed, and the robot has put down what it held; a look and a new plan follow."""

    def on_report(self, report: GameReport) -> None:
        """Phase, code or action changed."""
