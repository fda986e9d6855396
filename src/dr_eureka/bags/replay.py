"""What the robot's vision sees in a recording: the card shown, then where the tubes stand."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Protocol

import numpy as np

from dr_eureka.bags.frames import RecordedCamera, Stillness
from dr_eureka.pieces import Pieces
from dr_eureka.resources import load_yaml
from dr_eureka.settings import build
from dr_eureka.vision.cards import CardReading
from dr_eureka.vision.tubes import TubeScene, TubeSettings, locate_tubes
from dr_eureka.vision.voting import CardVote, RepeatedPictures, TubeVote, VoteSettings

CONFIG = "config/dr_eureka_main.yaml"


class ReadsCards(Protocol):
    """What reads a card from one image, such as `vision.cards.CardReader`."""

    def read(self, image_rgb: np.ndarray) -> CardReading:
        """Return the reading of one (height, width, 3) uint8 rgb image."""


@dataclass(frozen=True)
class ReplaySettings:
    """The settings of the game node that matter to what it sees, so that a recording is seen as the node saw it."""

    stillness: Stillness
    votes: VoteSettings
    tubes: TubeSettings

    @classmethod
    def load(cls) -> ReplaySettings:
        """Take the settings from the game node's own file.

        Raises:
            SettingsError: naming the key that is wrong.
        """
        file = load_yaml(CONFIG)
        stillness = {key: value for key, value in file.get("node", {}).items() if key.startswith("still_")}
        return cls(
            stillness=build(Stillness, stillness, f"{CONFIG} node"),
            votes=build(VoteSettings, file.get("votes", {}), f"{CONFIG} votes"),
            tubes=TubeSettings.load(),
        )


@dataclass(frozen=True, eq=False)
class Sighting:
    """What a recording showed; `card` and `tubes` are None where there was no decision.

    `card_failure` and `tubes_failure` are a result code and a reason in one line, None where there is a decision.
    """

    card: Optional[CardReading]
    card_failure: Optional[tuple[str, str]]
    tubes: Optional[TubeScene]
    tubes_failure: Optional[tuple[str, str]]


def replay(camera: RecordedCamera, cards: ReadsCards, pieces: Pieces, settings: ReplaySettings) -> Sighting:
    """Look at recorded images one after another, as the game node does, until card and tubes are decided.

    The tubes are those seen after the card was decided, for until then the head looks at the card. In a recording
    without a card they are the first ones seen.

    Raises:
        BagError: when the recording is damaged or not one image can be decoded.
    """
    card_vote, tube_vote = CardVote(settings.votes.card), TubeVote(settings.votes.tubes)
    card: Optional[CardReading] = None
    scene: Optional[TubeScene] = None
    repeated = RepeatedPictures()
    for frame in camera.frames():
        if repeated.add(frame.image):
            continue
        if card is None:
            card = card_vote.add(cards.read(frame.image))
            if card is not None:
                scene, tube_vote = None, TubeVote(settings.votes.tubes)
                continue
        if scene is None and not camera.unplaced:
            pose = frame.base_from_camera
            scene = tube_vote.add(locate_tubes(frame.image, camera.model, pose, pieces, settings.tubes))
        if card and (scene or camera.unplaced):
            break
    return Sighting(
        card=card,
        card_failure=None if card else card_vote.undecided(),
        tubes=scene,
        tubes_failure=None if scene else _why_no_tubes(camera, tube_vote),
    )


def _why_no_tubes(camera: RecordedCamera, vote: TubeVote) -> tuple[str, str]:
    return ("NO_CAMERA_POSE", camera.unplaced) if camera.unplaced else vote.undecided()
