"""The record of finished games: what the robot says of each, and what the referee says of the balls."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Optional

from dr_eureka.behaviour.report import ActionRecord, GameReport
from dr_eureka.game.state import TUBES


@dataclass(frozen=True)
class Ruling:
    """What the referee sees: the true state (None when balls are not all in tubes), balls lost, tubes that stand."""

    state: Optional[str]
    balls_lost: int
    tubes_standing: tuple[str, ...]

    def solved(self, goal: str) -> bool:
        """Tell whether the goal is reached with no ball lost and every tube standing."""
        return self.state == goal and self.balls_lost == 0 and set(self.tubes_standing) == set(TUBES)


class Scorecard:
    """Collects the games of one run and gives them in the shape of `game.json`."""

    def __init__(self, seed: Optional[int]):
        self._seed = seed
        self._games: list[dict[str, Any]] = []

    @property
    def games(self) -> int:
        """Number of games recorded."""
        return len(self._games)

    def add(self, report: GameReport, ruling: Optional[Ruling]) -> None:
        """Record a game that ended; `ruling` is None where there is no referee, as on the real robot."""
        self._games.append(
            {
                "seed": self._seed,
                "start": report.start or None,
                "card": report.card or None,
                "goal": report.goal or None,
                "strategy": report.strategy,
                "pour": report.pour,
                "verdict": report.code,
                "message": report.message,
                "solved": ruling.solved(report.goal) if ruling else None,
                "balls_lost": ruling.balls_lost if ruling else None,
                "true_state": ruling.state if ruling else None,
                "pours": len(report.pours),
                "replans": report.replans,
                "simulated_seconds": round(report.robot_seconds, 3),
                "wall_seconds": round(report.wall_seconds, 3),
                "actions": [_action(record) for record in report.actions],
            }
        )

    def as_mapping(self) -> dict[str, Any]:
        """Return the content of `game.json`.

        One game: its keys at the top level. Several: `games` lists them, and the top level sums them up: `start` of the
        first; `goal`, `verdict`, `balls_lost` of the last (a failed game is the last); times and pours added.
        Raises ValueError when no game was recorded.
        """
        if not self._games:
            raise ValueError("no game was recorded")
        if len(self._games) == 1:
            return dict(self._games[0])
        first, last = self._games[0], self._games[-1]
        return {
            **last,
            "start": first["start"],
            "solved": None if last["solved"] is None else all(game["solved"] for game in self._games),
            **{
                key: round(sum(game[key] for game in self._games), 3)
                for key in ("pours", "replans", "simulated_seconds", "wall_seconds")
            },
            "actions": [{**action, "game": number} for number, game in enumerate(self._games) for action in game["actions"]],
            "games": list(self._games),
        }


def _action(record: ActionRecord) -> dict[str, Any]:
    """Return an action without the fields that do not apply; `start` and `end` are robot seconds since the game began."""
    fields = {key: value for key, value in asdict(record.action).items() if value}
    failed = {"failed": True} if record.failed else {}
    return {**fields, "start": round(record.start_s, 3), "end": round(record.end_s, 3), **failed}
