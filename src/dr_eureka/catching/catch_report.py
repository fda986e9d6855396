"""The catcher's words: what it is doing, how a catch ended and why."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dr_eureka.catching.prediction import Prediction


class CatchPhase:
    """What the catcher is doing."""

    GETTING_READY = "GETTING_READY"
    WATCHING = "WATCHING"
    FOLLOWING = "FOLLOWING"
    JUDGING = "JUDGING"
    ALL = (GETTING_READY, WATCHING, FOLLOWING, JUDGING)


class CatchResult:
    """How the catch of one ball ended, as far as the robot can see."""

    CAUGHT = "CAUGHT"
    MISSED = "MISSED"
    OUT_OF_REACH = "OUT_OF_REACH"
    #: No prediction was good enough to move by; the reason says why.
    NOT_PREDICTED = "NOT_PREDICTED"
    ALL = (CAUGHT, MISSED, OUT_OF_REACH, NOT_PREDICTED)


class CatchReason:
    """Why, beside the reasons of localisation, track and prediction."""

    #: The prediction was too unsure, or of a flight too long, to move by.
    UNSURE = "UNSURE"
    #: The basket was not yet there when the ball came.
    TOO_LATE = "TOO_LATE"
    NOT_IN_BASKET = "NOT_IN_BASKET"
    #: No camera showed the basket in time.
    BASKET_NOT_SEEN = "BASKET_NOT_SEEN"


@dataclass(frozen=True, eq=False)
class CatchReport:
    """One ball: how it ended and why; the last prediction, on how many points; how often the basket was sent somewhere.

    `reason` is empty for CAUGHT. `late_m`: how far the basket was from its goal when the ball was predicted to come [m].
    """

    result: str
    reason: str = ""
    prediction: Prediction | None = None
    moves: int = 0
    late_m: float | None = None

    def describe(self) -> str:
        """Return the report as one line."""
        words = [self.result]
        if self.reason:
            words.append(f"({self.reason})")
        if self.prediction is not None:
            place = ", ".join(f"{value:.3f}" for value in self.prediction.position)
            words.append(f"predicted at ({place}) m, {self.prediction.points} points, {self.moves} moves")
        return " ".join(words)


@dataclass(frozen=True)
class RobotWord:
    """What the robot says, and of which robot time [s]: its phase, how many balls have ended, and how the last one did."""

    time_s: float
    phase: str
    balls: int = 0
    result: str = ""
    reason: str = ""
    moves: int = 0


def describe_ball(result: Mapping[str, Any]) -> str:
    """Return the end of one ball of `catch.json` as a line: the referee's verdict and the robot's word."""
    said = result["robot"] or "nothing"
    reason = f" ({result['reason']})" if result.get("reason") else ""
    speed = math.hypot(*result["velocity_m_s"]) if "velocity_m_s" in result else 0.0
    return f"{result['verdict']}: robot says {said}{reason}; let go at {speed:.1f} m/s"
