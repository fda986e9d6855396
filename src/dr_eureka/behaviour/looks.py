"""Looking at something until enough images agree: which card is shown, and where the tubes stand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Generic, Optional, Protocol, TypeVar

import numpy as np

from dr_eureka.behaviour.observation import Frame
from dr_eureka.behaviour.report import GameCode
from dr_eureka.game.state import State
from dr_eureka.vision.cards import CardReading, CardResult
from dr_eureka.vision.contents import ContentsReading
from dr_eureka.vision.tubes import TubePlace, TubeResult, TubeScene

Reading = TypeVar("Reading")


class Vote(Protocol, Generic[Reading]):
    """What the votes of `vision.voting` have in common."""

    def add(self, reading: Reading) -> Optional[Reading]:
        """Take one more reading; return the one that won, if any."""

    def undecided(self) -> tuple[str, str]:
        """Return result code and reason while nothing has won."""


@dataclass(frozen=True, eq=False)
class CardFinding:
    """The card that won the vote, as the robot saw it last at `stamp_s`, after `images` images."""

    state: State
    reading: CardReading
    stamp_s: float
    images: int


@dataclass(frozen=True, eq=False)
class TubesFinding:
    """The tubes as the vote places them, seen last at `stamp_s`, after `images` images."""

    scene: TubeScene
    stamp_s: float
    images: int

    @property
    def tubes(self) -> dict[str, TubePlace]:
        """Place of each tube by name."""
        return self.scene.tubes


@dataclass(frozen=True, eq=False)
class ResultFinding(TubesFinding):
    """Where the tubes stand and what they hold."""

    state: State


class CardLook:
    """Reads the card in one image after the other until the vote is won."""

    def __init__(self, read: Callable[[np.ndarray], CardReading], vote: Vote):
        self._read = read
        self._vote = vote
        self._images = 0

    def add(self, frame: Frame) -> Optional[CardFinding]:
        """Read the card in one more image; return the decision once there is one."""
        self._images += 1
        winner = self._vote.add(self._read(frame.image))
        return CardFinding(State.parse(winner.state), winner, frame.stamp_s, self._images) if winner else None

    def failure(self) -> tuple[str, str]:
        """Return NO_CARD or CARD_UNREADABLE, and what was seen instead of a readable card."""
        result, reason = self._vote.undecided()
        code = GameCode.NO_CARD if self._images == 0 or result == CardResult.NO_CARD else GameCode.CARD_UNREADABLE
        return code, f"no card decided in {self._images} images ({reason})"


class TubeLook:
    """Locates the tubes in one image after the other until the vote is won."""

    def __init__(self, locate: Callable[[Frame], TubeScene], vote: Vote):
        self._locate = locate
        self._vote = vote
        self._images = 0

    def add(self, frame: Frame) -> Optional[TubesFinding]:
        """Locate the tubes in one more image; return the decision once there is one."""
        self._images += 1
        winner = self._vote.add(self._locate(frame))
        return TubesFinding(winner, frame.stamp_s, self._images) if winner else None

    def failure(self) -> tuple[str, str]:
        """Return NO_TUBES, and what was seen instead."""
        result, reason = self._vote.undecided()
        return GameCode.NO_TUBES, f"tubes not located in {self._images} images ({result}: {reason})"


class ResultLook:
    """Looks where the tubes stand and what they hold, in one image after the other until both votes are won."""

    def __init__(
        self,
        locate: Callable[[Frame], TubeScene],
        read: Callable[[Frame, TubeScene], ContentsReading],
        place_vote: Vote,
        contents_vote: Vote,
    ):
        self._locate = locate
        self._read = read
        self._place_vote = place_vote
        self._contents_vote = contents_vote
        self._images = 0

    def add(self, frame: Frame) -> Optional[ResultFinding]:
        """Look at one more image; return the decision once there is one."""
        self._images += 1
        scene = self._locate(frame)
        if scene.result == TubeResult.OK:
            reading = self._read(frame, scene)
        else:
            reading = ContentsReading(scene.result, None, 0.0, scene.reason)
        placed, held = self._place_vote.add(scene), self._contents_vote.add(reading)
        if placed is None or held is None:
            return None
        return ResultFinding(placed, frame.stamp_s, self._images, State.parse(held.state))

    def failure(self) -> tuple[str, str]:
        """Return UNCHECKED, and what was seen instead."""
        result, reason = self._contents_vote.undecided()
        return GameCode.UNCHECKED, f"contents of the tubes not read in {self._images} images ({result}: {reason})"
