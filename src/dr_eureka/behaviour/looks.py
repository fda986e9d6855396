"""Looking at something until enough images agree: which card is shown, where the tubes stand and what they hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Generic, Optional, Protocol, TypeVar

import numpy as np

from dr_eureka.behaviour.held_look import ReadHeld
from dr_eureka.behaviour.observation import Frame, ImageHeader, Look
from dr_eureka.behaviour.report import GameCode
from dr_eureka.game.state import State
from dr_eureka.vision.cards import CardReading, CardResult
from dr_eureka.vision.contents import ContentsReading
from dr_eureka.vision.tubes import TubePlace, TubeResult, TubeScene
from dr_eureka.vision.voting import LossVote

Reading = TypeVar("Reading")


class Vote(Protocol, Generic[Reading]):
    """What the votes of `vision.voting` have in common."""

    def add(self, reading: Reading) -> Optional[Reading]:
        """Take one more reading; return the one that won, if any."""

    def undecided(self) -> tuple[str, str]:
        """Return result code and reason while nothing has won."""


@dataclass(frozen=True, eq=False)
class CardFinding:
    """The card that won the vote after `images` images: its surest reading, and the header of the image that was read."""

    state: State
    reading: CardReading
    header: ImageHeader
    images: int


@dataclass(frozen=True, eq=False)
class TubesFinding:
    """The tubes as the votes have them after `images` images, of which the last has this header: places and contents."""

    scene: TubeScene
    header: ImageHeader
    images: int
    state: State

    @property
    def tubes(self) -> dict[str, TubePlace]:
        """Place of each tube by name."""
        return self.scene.tubes


@dataclass(frozen=True)
class BallLost:
    """At least one ball is in no tube; `message` is one line that tells which and how it is known."""

    message: str


@dataclass(frozen=True)
class Looks:
    """Makers of the looks at the card and at the tubes, and how tubes in the hands are read."""

    card: Callable[[], Look]
    tubes: Callable[[], Look]
    read_held: ReadHeld


class CardLook:
    """Reads the card in one image after the other until the vote is won; tells each reading to `tell`."""

    def __init__(
        self, read: Callable[[np.ndarray], CardReading], vote: Vote, tell: Callable[[Frame, CardReading], None]
    ):
        self._read = read
        self._vote = vote
        self._tell = tell
        self._readings: list[tuple[CardReading, ImageHeader]] = []

    def add(self, frame: Frame) -> Optional[CardFinding]:
        """Read the card in one more image; return the decision once there is one."""
        reading = self._read(frame.image)
        self._readings.append((reading, frame.header))
        self._tell(frame, reading)
        winner = self._vote.add(reading)
        if winner is None:
            return None
        header = next(header for reading, header in self._readings if reading is winner)
        return CardFinding(State.parse(winner.state), winner, header, len(self._readings))

    def failure(self) -> tuple[str, str]:
        """Return NO_CARD or CARD_UNREADABLE, and what was seen instead of a readable card."""
        result, reason = self._vote.undecided()
        code = GameCode.NO_CARD if not self._readings or result == CardResult.NO_CARD else GameCode.CARD_UNREADABLE
        return code, f"no card decided in {len(self._readings)} images ({reason})"


class TubeLook:
    """Looks where the tubes stand and what they hold, in one image after the other until both votes are won, or until
    enough images agree that a ball is in no tube.
    """

    def __init__(
        self,
        locate: Callable[[Frame], TubeScene],
        read: Callable[[Frame, TubeScene], ContentsReading],
        place_vote: Vote,
        contents_vote: Vote,
        loss_vote: LossVote,
    ):
        self._locate = locate
        self._read = read
        self._place_vote = place_vote
        self._contents_vote = contents_vote
        self._loss_vote = loss_vote
        self._images = 0
        self._located = False

    def add(self, frame: Frame) -> TubesFinding | BallLost | None:
        """Look at one more image; return the decision once there is one."""
        self._images += 1
        scene = self._locate(frame)
        if scene.result == TubeResult.OK:
            reading = self._read(frame, scene)
        else:
            reading = ContentsReading(scene.result, None, 0.0, scene.reason)
        placed, held = self._place_vote.add(scene), self._contents_vote.add(reading)
        lost = self._loss_vote.add(reading)
        self._located = self._located or placed is not None
        if lost:
            return BallLost(lost)
        if placed is None or held is None:
            return None
        return TubesFinding(placed, frame.header, self._images, State.parse(held.state))

    def failure(self) -> tuple[str, str]:
        """Return NO_TUBES or NO_CONTENTS, and what was seen instead."""
        if not self._located:
            result, reason = self._place_vote.undecided()
            return GameCode.NO_TUBES, f"tubes not located in {self._images} images ({result}: {reason})"
        result, reason = self._contents_vote.undecided()
        return GameCode.NO_CONTENTS, f"contents of the tubes not read in {self._images} images ({result}: {reason})"
