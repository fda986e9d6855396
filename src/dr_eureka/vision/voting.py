"""One decision from many images: which card is shown, where the tubes stand, what they hold, whether a ball is lost.

The game node and `replay_bag` decide through these classes, so a recording leads to what the robot decided.
"""
from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass, field, replace
from typing import Optional

import numpy as np

from dr_eureka.game.state import BALLS_PER_COLOUR, COLOUR_NAMES
from dr_eureka.settings import SettingsError
from dr_eureka.vision.cards import CardReading, CardResult
from dr_eureka.vision.contents import ContentsReading, ContentsResult
from dr_eureka.vision.tubes import TubePlace, TubeResult, TubeScene

#: Result of a vote that ran out of images while usable ones disagreed.
UNDECIDED = "UNDECIDED"


@dataclass(frozen=True)
class CardVoteSettings:
    """How many of the newest images must show the same card.

    `agree` of the newest `window` images; more than half of them, so that no two cards can both win.
    """

    window: int = field(metadata={"min": 1, "max": 1000})
    agree: int = field(metadata={"min": 1, "max": 1000})

    def __post_init__(self) -> None:
        if not self.window < 2 * self.agree <= 2 * self.window:
            expected = f"more than half of window ({self.window}) and at most window"
            raise SettingsError("card vote", "agree", f"is {self.agree}", expected, self.agree)


@dataclass(frozen=True)
class TubeVoteSettings:
    """How many of the newest images must show the tubes in the same places.

    `agree` of the newest `window` images, all three tubes within `tolerance_m` [m] of the median.
    """

    window: int = field(metadata={"min": 1, "max": 1000})
    agree: int = field(metadata={"min": 1, "max": 1000})
    tolerance_m: float = field(metadata={"min": 0.0001, "max": 0.05})

    def __post_init__(self) -> None:
        if self.agree > self.window:
            raise SettingsError("tube vote", "agree", f"is {self.agree}", f"at most window ({self.window})", self.agree)


@dataclass(frozen=True)
class VoteSettings:
    """The `votes:` block of config/dr_eureka_main.yaml."""

    card: CardVoteSettings
    tubes: TubeVoteSettings
    contents: CardVoteSettings
    lost: CardVoteSettings


class RepeatedPictures:
    """Notices a picture that repeats the one before pixel by pixel: of a frozen camera, it is no further evidence.

    Two pictures of a living camera always differ by the noise of its sensor.
    """

    def __init__(self) -> None:
        self._last: Optional[np.ndarray] = None

    def add(self, image: np.ndarray) -> bool:
        """Take one more picture; return whether it repeats the last."""
        repeats = self._last is not None and np.array_equal(self._last, image)
        self._last = image
        return repeats


class CardVote:
    """Wait until enough of the newest images show the same card."""

    def __init__(self, settings: CardVoteSettings) -> None:
        self._settings = settings
        self._newest: deque[CardReading] = deque(maxlen=settings.window)

    def add(self, reading: CardReading) -> Optional[CardReading]:
        """Take the reading of one more image; return the surest reading of the card that won, else None."""
        self._newest.append(reading)
        if reading.result != CardResult.OK:
            return None
        same = [other for other in self._newest if other.result == CardResult.OK and other.state == reading.state]
        return max(same, key=lambda other: other.confidence) if len(same) >= self._settings.agree else None

    def undecided(self) -> tuple[str, str]:
        """Return why no card has won: a result code and one line about the newest images."""
        outcomes = [other.state if other.result == CardResult.OK else other.result for other in self._newest]
        failures = [(other.result, other.reason) for other in self._newest if other.result != CardResult.OK]
        return _undecided(outcomes, failures, self._settings.agree)


class TubeVote:
    """Wait until enough of the newest images show the three tubes in the same places."""

    def __init__(self, settings: TubeVoteSettings) -> None:
        self._settings = settings
        self._newest: deque[TubeScene] = deque(maxlen=settings.window)

    def add(self, scene: TubeScene) -> Optional[TubeScene]:
        """Take the scene of one more image; return the median of those that agree, else None.

        The scene returned is the one nearest to the median with each tube's place replaced by the median.
        """
        self._newest.append(scene)
        good = [other for other in self._newest if other.result == TubeResult.OK]
        if scene.result != TubeResult.OK or len(good) < self._settings.agree:
            return None
        names = tuple(scene.tubes)
        places = np.array([[other.tubes[name].position for name in names] for other in good])
        distances = np.linalg.norm(places - np.median(places, axis=0), axis=2).max(axis=1)
        agreeing = distances <= self._settings.tolerance_m
        if np.count_nonzero(agreeing) < self._settings.agree:
            return None
        # The images share the error of the camera's pose and much of the sheet's, so their number shrinks no sigma.
        sigmas = np.array([[other.tubes[name].sigma_m for name in names] for other in good])
        medians = zip(names, np.median(places[agreeing], axis=0), np.median(sigmas[agreeing], axis=0))
        tubes = {name: TubePlace(position, float(sigma_m)) for name, position, sigma_m in medians}
        return replace(good[int(distances.argmin())], tubes=tubes)

    def undecided(self) -> tuple[str, str]:
        """Return why no places were found: a result code and one line about the newest images."""
        failures = [(scene.result, scene.reason) for scene in self._newest if scene.result != TubeResult.OK]
        return _undecided([scene.result for scene in self._newest], failures, self._settings.agree)


class LossVote:
    """Wait until enough of the newest images show the same balls lost: beside the tubes, or nowhere although all is seen."""

    def __init__(self, settings: CardVoteSettings) -> None:
        self._settings = settings
        self._newest: deque[str] = deque(maxlen=settings.window)

    def add(self, reading: ContentsReading) -> Optional[str]:
        """Take the reading of one more image; return one line about what is lost if that won, else None."""
        lost = _lost(reading)
        self._newest.append(lost)
        return lost if lost and self._newest.count(lost) >= self._settings.agree else None


def _lost(reading: ContentsReading) -> str:
    """Say which balls are in no tube, without what differs from image to image; empty if none is known to be."""
    in_tubes = Counter("".join(contents.colours for contents in reading.tubes.values()))
    # Something else of a ball's colour may lie on the table while a tube is covered.
    beside = sorted(ball.colour for ball in reading.loose if in_tubes[ball.colour] < BALLS_PER_COLOUR)
    if beside:
        return f"{', '.join(COLOUR_NAMES[colour] for colour in beside)} seen lying beside the tubes"
    return reading.reason if reading.result == ContentsResult.BALL_MISSING else ""


def _undecided(outcomes: list[str], failures: list[tuple[str, str]], agree: int) -> tuple[str, str]:
    """Name the commonest failure, or UNDECIDED where no image failed, and count what the images showed."""
    counts = ", ".join(f"{count} {outcome}" for outcome, count in Counter(outcomes).most_common()) or "none"
    result, reason = Counter(failures).most_common(1)[0][0] if failures else (UNDECIDED, "")
    detail = f"; {result}: {reason}" if reason else ""
    return result, f"newest images: {counts}, expected {agree} alike{detail}"
