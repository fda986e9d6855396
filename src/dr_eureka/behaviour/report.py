"""Where a game stands, as the game flow tells it and as `GameStatus` carries it."""

from __future__ import annotations

from dataclasses import dataclass

from dr_eureka.game.actions import Action
from dr_eureka.game.state import Pour


class Phase:
    """Phases of one game, in their usual order; the names are those of `GameStatus.msg`."""

    WAITING_FOR_ENGINE = "WAITING_FOR_ENGINE"
    WAITING_FOR_CAMERA = "WAITING_FOR_CAMERA"
    LOOKING_FOR_CARD = "LOOKING_FOR_CARD"
    PLANNING = "PLANNING"
    LOOKING_FOR_TUBES = "LOOKING_FOR_TUBES"
    PLAYING = "PLAYING"
    CHECKING = "CHECKING"
    FINISHED = "FINISHED"
    FAILED = "FAILED"

    ALL = (
        WAITING_FOR_ENGINE, WAITING_FOR_CAMERA, LOOKING_FOR_CARD, PLANNING, LOOKING_FOR_TUBES, PLAYING, CHECKING,
        FINISHED, FAILED,
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
    NO_CARD = "NO_CARD"
    CARD_UNREADABLE = "CARD_UNREADABLE"
    NO_TUBES = "NO_TUBES"
    NO_PLAN = "NO_PLAN"
    INTERNAL_ERROR = "INTERNAL_ERROR"

    ALL = (
        UNDECIDED, SOLVED, UNCHECKED, NOT_SOLVED, REPLAYED, NO_ENGINE, ENGINE_LOST, ENGINE_REFUSED, ENGINE_FAULT,
        HEAD_NOT_STILL, NO_CAMERA, NO_CARD, CARD_UNREADABLE, NO_TUBES, NO_PLAN, INTERNAL_ERROR,
    )


@dataclass(frozen=True)
class ActionRecord:
    """An action that was begun; `start_s` and `end_s` are robot time, `end_s` so far when it is under way."""

    action: Action
    start_s: float
    end_s: float


@dataclass(frozen=True)
class GameReport:
    """One game as it stands; times are seconds since this game began."""

    phase: str
    code: str
    game: int
    games: int
    start: str
    goal: str
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
