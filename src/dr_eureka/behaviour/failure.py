"""Why something that the game waited for did not come."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

from dr_eureka.behaviour.observation import NO_ANSWER, Answer
from dr_eureka.behaviour.report import GameCode
from dr_eureka.control.codes import EngineCode


@dataclass(frozen=True)
class Failure:
    """A `GameCode` and one line; `seen` tells of a look that there were images, but they did not decide."""

    code: str
    message: str
    seen: bool = False


def failure_in(answer: Answer) -> Optional[Failure]:
    """Return what is wrong with the engine's answer to a request, None if it accepted."""
    if answer.code == NO_ANSWER:
        return Failure(GameCode.ENGINE_LOST, answer.message)
    if answer.code != EngineCode.OK:
        return Failure(GameCode.ENGINE_REFUSED, f"control_engine: {answer.code}: {answer.message}")
    return None
