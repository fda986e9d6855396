"""Reading the shown card: find it, detect its balls, understand their layout (paper section 3.1)."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from dr_eureka.errors import DrEurekaError
from dr_eureka.game.state import COLOUR_NAMES
from dr_eureka.resources import WeightsError, load_weights, load_yaml
from dr_eureka.settings import build
from dr_eureka.vision.card_colours import ODD, PLAIN, oddest_ball
from dr_eureka.vision.card_detections import CropDetections, SeenBall, collect
from dr_eureka.vision.card_finder import (
    NOMINAL_BORDER, THUMBNAIL_PX, Candidate, FinderSettings, coloured_share, find_candidates, group, rectify,
)
from dr_eureka.vision.card_layout import CardLayout, LayoutError, read_layout, turned

SETTINGS_FILE = "config/dr_eureka_main.yaml"
_SMALLEST_PICTURE_PX = 32  # of the shorter side, as it is searched


class CardImageError(DrEurekaError):
    """A picture that is no 8-bit RGB image."""


class CardResult:
    """What reading a picture came to."""

    OK = "OK"
    NO_CARD = "NO_CARD"
    SEVERAL_CARDS = "SEVERAL_CARDS"
    UNREADABLE = "UNREADABLE"


@dataclass(frozen=True)
class CardSettings:
    """The `cards:` block of config/dr_eureka_main.yaml."""

    weights: str
    finder: FinderSettings
    ball_confidence: float = field(metadata={"min": 0.0, "max": 1.0})  # from here on a ball or foot counts
    doubt_confidence: float = field(metadata={"min": 0.0, "max": 1.0})  # from here on it makes a card doubtful
    sure_confidence: float = field(metadata={"min": 0.0, "max": 1.0})  # of all balls and feet: one look is enough
    looks: int = field(metadata={"min": 2, "max": 20})  # most looks at one card, else; two must be read and agree
    longest_side_px: int = field(metadata={"min": 320, "max": 8000})  # larger pictures are shrunk to this
    threads: int = field(metadata={"min": 1, "max": 64})

    @staticmethod
    def load() -> CardSettings:
        """Return the settings of the package's own yaml. Raises SettingsError or ResourceError."""
        return build(CardSettings, load_yaml(SETTINGS_FILE).get("cards", {}), f"{SETTINGS_FILE} cards")


@dataclass(frozen=True)
class CardReading:
    """What one picture shows.

    result: a CardResult; state: like RR|GG|PP when OK, else None; confidence: of the least sure ball, 0..1; reason: why
    not OK, else empty; corners (4, 2): the card's in the picture [px], clockwise from its printed upper left when OK,
    from any otherwise; balls: in fractions of the rectified crop whose corners these are.
    """

    result: str
    state: str | None = None
    confidence: float = 0.0
    reason: str = ""
    corners: np.ndarray | None = None
    balls: tuple[SeenBall, ...] = ()


@dataclass(frozen=True)
class _Look:
    """One crop of a possible card: what was detected and, if it made sense, its layout."""

    seen: CropDetections
    ground: np.ndarray
    layout: CardLayout | None
    reason: str
    beyond_doubt: bool = False

    @property
    def looks_like_a_card(self) -> bool:
        # Bars on a screen may pass for balls, but they stand on no feet.
        balls, feet = len(self.seen.balls), len(self.seen.feet)
        return balls >= 5 or (balls >= 3 and feet >= 1) or (balls >= 1 and feet >= 2)


class CardReader:
    """Reads cards with trained weights; holds no state between pictures."""

    def __init__(self, settings: CardSettings, arrays: dict[str, np.ndarray]) -> None:
        # torch takes seconds to import: only a program that reads cards pays for it.
        from dr_eureka.vision.card_network import CardNetwork

        self._settings = settings
        try:
            self._network = CardNetwork(arrays, settings.threads)
        except ValueError as error:
            raise WeightsError(f"{settings.weights}: {error}") from error

    @classmethod
    def load(cls, settings: CardSettings | None = None) -> CardReader:
        """Return a reader with the shipped weights. Raises WeightsError, SettingsError or ResourceError."""
        settings = settings or CardSettings.load()
        return cls(settings, load_weights(settings.weights))

    def read(self, image_rgb: np.ndarray) -> CardReading:
        """Read the one card in an RGB image (h, w, 3) uint8. Raises CardImageError for any other array."""
        if not isinstance(image_rgb, np.ndarray) or image_rgb.dtype != np.uint8 or image_rgb.shape[2:] != (3,):
            found = f"{image_rgb.dtype} {image_rgb.shape}" if isinstance(image_rgb, np.ndarray) else type(image_rgb)
            raise CardImageError(f"picture is {found}, expected uint8 RGB of shape (height, width, 3)")
        shortest, longest = sorted(image_rgb.shape[:2])
        shrink = min(1.0, self._settings.longest_side_px / max(longest, 1))
        if shortest * shrink < _SMALLEST_PICTURE_PX:
            return CardReading(CardResult.NO_CARD, reason="the picture is too small to hold a card")
        if shrink < 1.0:
            image_rgb = cv2.resize(image_rgb, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
        candidates = find_candidates(image_rgb, self._settings.finder)
        cards: list[list[_Look]] = []
        for members in group(candidates, self._settings.finder.most_candidates):
            if any(_holds(looks[0].ground, members[0].centre) for looks in cards):
                continue
            looks = self._look(image_rgb, members)
            if any(look.looks_like_a_card for look in looks):
                cards.append(looks)
        if not cards:
            outlines = f"{len(candidates)} dark outlines with a white border" if candidates else "no outline of a card"
            return CardReading(CardResult.NO_CARD, reason=f"{outlines}, no balls in any" if candidates else outlines)
        if len(cards) > 1:
            shown = ", ".join(self._verdict(looks, shrink).state or "unreadable" for looks in cards)
            return CardReading(CardResult.SEVERAL_CARDS, reason=f"{len(cards)} cards seen: {shown}")
        return self._verdict(cards[0], shrink)

    def _look(self, image_rgb: np.ndarray, members: list[Candidate]) -> list[_Look]:
        """Look at one possible card, by one outline after another and both ways up, until two looks could be read.

        A first look beyond doubt is enough. Upside down the network sees another picture and errs in other ways: two looks
        that agree are seldom both wrong.
        """
        looks: list[_Look] = []
        for ground in (np.roll(member.ground, half, 0) for member in members for half in (0, 2)):
            looks.append(self._look_once(image_rgb, ground))
            read = sum(look.layout is not None for look in looks)
            if looks[0].beyond_doubt or read == 2 or len(looks) == self._settings.looks or not looks[-1].looks_like_a_card:
                break
        return looks

    def _look_once(self, image_rgb: np.ndarray, ground: np.ndarray) -> _Look:
        thumbnail, _ = rectify(image_rgb, ground, THUMBNAIL_PX)
        if coloured_share(thumbnail) < self._settings.finder.least_coloured:
            return _Look(CropDetections((), ()), ground, None, "nothing in it is coloured")
        crop, _ = rectify(image_rgb, ground)
        grid = self._network.detect(crop)
        arrays = (a[0].numpy() for a in (grid.balls, grid.diameters, grid.class_scores, grid.feet))
        seen = collect(*arrays, threshold=self._settings.doubt_confidence)
        try:
            layout = read_layout(self._sure(seen))
        except LayoutError as error:
            return _Look(seen, ground, None, str(error))
        ball, oddity = oddest_ball(crop, seen.balls)
        if oddity > ODD:
            return _Look(seen, ground, None, f"a ball taken for {COLOUR_NAMES[ball.colour]} looks unlike the other one")
        # Six balls and three feet were sure to be there and nothing else was seen, not even faintly.
        sure = all(thing.confidence >= self._settings.sure_confidence for thing in seen.balls + seen.feet)
        return _Look(seen, ground, layout, "", beyond_doubt=sure and len(seen.feet) == 3 and oddity <= PLAIN)

    def _sure(self, seen: CropDetections) -> CropDetections:
        """Return the detections that count. Raises LayoutError when a ball is neither sure nor absent."""
        doubtful = sum(ball.confidence < self._settings.ball_confidence for ball in seen.balls)
        if doubtful:
            raise LayoutError(f"{len(seen.balls)} balls seen, {doubtful} of them doubtful")
        feet = tuple(foot for foot in seen.feet if foot.confidence >= self._settings.ball_confidence)
        return CropDetections(seen.balls, feet)

    def _verdict(self, looks: list[_Look], shrink: float) -> CardReading:
        """Return OK for a look beyond doubt or two that were read and agree, else UNREADABLE."""
        read = [look for look in looks if look.layout]
        last = read[-1] if read else looks[-1]
        corners = _outer_corners(last.ground) / shrink
        states = list(dict.fromkeys(str(look.layout.state) for look in read))
        if len(read) < 2 and not looks[0].beyond_doubt:
            reason = next(look.reason for look in looks if look.reason)
        elif len(states) > 1:
            reason = f"two looks disagree: {' and '.join(states)}"
        else:
            confidence = min(ball.confidence for look in read for ball in look.seen.balls)
            corners = np.roll(corners, last.layout.turn, 0)
            balls = tuple(turned(ball, last.layout.turn) for ball in last.seen.balls)
            return CardReading(CardResult.OK, states[0], confidence, "", corners, balls)
        return CardReading(CardResult.UNREADABLE, reason=reason, corners=corners, balls=last.seen.balls)


def _holds(ground: np.ndarray, point: np.ndarray) -> bool:
    return cv2.pointPolygonTest(ground.astype(np.float32), (float(point[0]), float(point[1])), False) >= 0


def _outer_corners(ground: np.ndarray) -> np.ndarray:
    """Return the card's corners (4, 2) from those of its black ground, for a border of nominal width."""
    b = NOMINAL_BORDER
    inside = np.array([(b, b), (1 - b, b), (1 - b, 1 - b), (b, 1 - b)], np.float32)
    square = np.array([[(0, 0), (1, 0), (1, 1), (0, 1)]], np.float32)
    return cv2.perspectiveTransform(square, cv2.getPerspectiveTransform(inside, ground.astype(np.float32)))[0]
