"""One game as it goes: where it began, what it is for, what was done so far, how it ended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

from dr_eureka.behaviour.observation import Observation
from dr_eureka.behaviour.report import ActionRecord, GameCode, GameReport
from dr_eureka.game.state import Pour, State


@dataclass
class GameRecord:
    """What is known of game number `number`, from 0.

    `start` is what the tubes held at the beginning, as far as is known: until they are seen, what the game before left.
    `goal` differs from `card` when a person corrected it, and there is no `card` when the goal was given. `strategy` and
    `pour` tell what plans make best and how balls are poured.
    """

    number: int
    strategy: str
    pour: str
    start: Optional[State] = None
    goal: Optional[State] = None
    card: Optional[State] = None
    code: str = GameCode.UNDECIDED
    pours: tuple[Pour, ...] = ()
    actions: tuple[ActionRecord, ...] = ()
    replans: int = 0
    began: Optional[Observation] = None

    def since_began_s(self, now: Observation) -> float:
        """Return the robot time since this game began [s]."""
        return now.robot_s - self.began.robot_s if self.began else 0.0

    def report(self, games: int, phase: str, message: str, now: Optional[Observation]) -> GameReport:
        """Return this game, one of so many, as it stands in a phase at a moment; `now` is None before the first."""
        return GameReport(
            phase=phase,
            code=self.code,
            game=self.number,
            games=games,
            start=str(self.start or ""),
            card=str(self.card or ""),
            goal=str(self.goal or ""),
            strategy=self.strategy,
            pour=self.pour,
            pours=self.pours,
            actions=self.actions,
            replans=self.replans,
            robot_seconds=self.since_began_s(now) if now else 0.0,
            wall_seconds=now.wall_s - self.began.wall_s if now and self.began else 0.0,
            message=message,
        )
