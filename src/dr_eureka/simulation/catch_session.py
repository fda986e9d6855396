"""A session of catches: when the next ball is let go, and how each ended."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dr_eureka.catching.catch_report import CatchPhase, CatchResult, RobotWord
from dr_eureka.simulation.saika import CAUGHT, FLYING, MISSED
from dr_eureka.simulation.throws import BEYOND, Throw, ThrowSettings, draw_throw

NO_BALL = "NO_BALL"
#: The robot never got ready for the ball; it was not let go.
NOT_THROWN = "NOT_THROWN"


@dataclass(frozen=True)
class SessionSettings:
    """Robot times [s]; see the `node:` block of config/fake_saika.yaml."""

    ready_limit: float
    pause: float
    flight_limit: float


@dataclass
class _Flight:
    """A ball on its way: since when, after how many, and since when robot and referee have spoken; robot times [s]."""

    throw: Throw
    released_s: float
    balls_before: int
    told_s: float | None = None
    decided_s: float | None = None


@dataclass
class CatchSession:
    """Lets `throws` balls go one by one, each when the robot watches for it, and keeps how each ended.

    When the next ball goes follows from the stamps of what the robot says, not from when it is heard: equal robots get equal
    balls at equal times however fast messages travel.
    """

    throws: int
    aim: str
    balls: ThrowSettings
    settings: SessionSettings
    rng: np.random.Generator
    results: list[dict[str, Any]] = field(default_factory=list)
    _robot: RobotWord | None = None
    _flight: _Flight | None = None
    _waiting_since_s: float | None = None
    _watching_since_s: float | None = None
    _ended_s: float = 0.0

    @property
    def over(self) -> bool:
        """Whether every ball has ended."""
        return len(self.results) == self.throws

    @property
    def released(self) -> int:
        """How many balls were let go."""
        return sum(result["verdict"] != NOT_THROWN for result in self.results) + (self._flight is not None)

    @property
    def ok(self) -> bool:
        """Whether every ball ended as it should: caught, or called out of reach when it was."""
        return self.over and all(result["ok"] for result in self.results)

    def hear(self, word: RobotWord) -> None:
        """Take what the robot says; every word counts, in order."""
        self._robot = word
        if word.phase != CatchPhase.WATCHING:
            self._watching_since_s = None
        elif self._watching_since_s is None:
            self._watching_since_s = word.time_s
        if self._flight is not None and self._flight.told_s is None and word.balls > self._flight.balls_before:
            self._flight.told_s = word.time_s

    def step(self, now_s: float, verdict: str) -> Throw | None:
        """Go on at a robot time [s] with the referee's verdict; return a ball to let go now."""
        if self.over:
            return None
        if self._flight is None:
            return self._next(now_s)
        self._follow(self._flight, now_s, verdict)
        return None

    def _next(self, now_s: float) -> Throw | None:
        if self._robot is None:  # it is still being started, which takes no robot time
            return None
        self._waiting_since_s = now_s if self._waiting_since_s is None else self._waiting_since_s
        if self._watching_since_s is None:
            if now_s - self._waiting_since_s > self.settings.ready_limit:
                self._end({"verdict": NOT_THROWN, "robot": None, "reason": "the robot did not get ready", "ok": False}, now_s)
            return None
        if now_s - max(self._watching_since_s, self._ended_s) < self.settings.pause:
            return None
        throw = draw_throw(self.balls, self.aim, self.rng)
        self._flight = _Flight(throw, now_s, self._robot.balls)
        return throw

    def _follow(self, flight: _Flight, now_s: float, verdict: str) -> None:
        if verdict == FLYING:
            flight.decided_s = None
        elif flight.decided_s is None:
            flight.decided_s = now_s
        told, overdue = flight.told_s is not None, now_s - flight.released_s > self.settings.flight_limit
        if not (told and verdict != FLYING) and not overdue:
            return
        robot, truth = self._robot, MISSED if verdict == FLYING else verdict
        said = robot.result if told else None
        right = said == CatchResult.OUT_OF_REACH and robot.moves == 0 if self.aim == BEYOND else said == truth == CAUGHT
        ended_s = now_s if overdue else max(flight.told_s, flight.decided_s)
        self._end({
            "verdict": truth,
            "robot": said,
            "reason": robot.reason if told else "the robot said nothing",
            "moves": robot.moves if told else None,
            "ok": bool(right),
            "released_s": round(flight.released_s, 3),
            "from_m": np.round(flight.throw.position, 4).tolist(),
            "velocity_m_s": np.round(flight.throw.velocity, 4).tolist(),
            "aim_m": np.round(flight.throw.aim, 4).tolist(),
        }, ended_s)

    def _end(self, result: dict[str, Any], ended_s: float) -> None:
        self.results.append(result)
        self._flight, self._waiting_since_s, self._ended_s = None, None, ended_s

    def as_mapping(self) -> dict[str, Any]:
        """Return what goes into `catch.json`."""
        return {
            "aim": self.aim,
            "throws": self.throws,
            "caught": sum(result["verdict"] == CAUGHT for result in self.results),
            "ok": self.ok,
            "balls": self.results,
        }
