"""Which balls are in tubes that stand on the sheet: the robot's look at what its pours did.

Where the tubes stand is known (`vision.tubes`), so is where the centre of each ball would be in the picture. There the
colour tells ball from paper: seen from above, neither the tape nor the next ball hides a ball's centre, and behind an
empty tube lies the sheet, which is white or black.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Mapping

import numpy as np

from dr_eureka.game.state import TUBE_CAPACITY, TUBES, State, StateError
from dr_eureka.pieces import Pieces
from dr_eureka.vision.camera import CameraModel
from dr_eureka.vision.tubes import TubePlace


class ContentsResult:
    """Names of what came out of looking into the tubes."""

    OK = "OK"
    OUT_OF_VIEW = "OUT_OF_VIEW"
    UNREADABLE = "UNREADABLE"


@dataclass(frozen=True)
class ContentsSettings:
    """The `contents:` block of config/dr_eureka_main.yaml, which gives meaning and unit of each key."""

    sample_share: float = field(metadata={"min": 0.1, "max": 1.0})
    darkest: float = field(metadata={"min": 0.0, "max": 255.0})
    smallest_chroma: float = field(metadata={"min": 0.01, "max": 0.2})
    smallest_resemblance: float = field(metadata={"min": -1.0, "max": 1.0})


@dataclass(frozen=True)
class ContentsReading:
    """What one picture tells; `state` is None and `reason` one line unless `result` is OK. `confidence` is 0..1."""

    result: str
    state: str | None
    confidence: float
    reason: str


def read_contents(
    image_rgb: np.ndarray,
    camera: CameraModel,
    base_from_camera: np.ndarray,
    places: Mapping[str, TubePlace],
    pieces: Pieces,
    settings: ContentsSettings,
) -> ContentsReading:
    """Read the balls in three standing tubes.

    Args:
        image_rgb: (height, width, 3) uint8 picture as the camera took it.
        camera: calibration of the camera.
        base_from_camera: (4, 4) pose of the optical frame in `base`.
        places: where each tube stands, by name.

    Returns:
        A reading whose state obeys the rules of the game: two balls of each colour, no gap below a ball.
    """
    colours = {}
    for name in TUBES:
        centres, radii = _ball_discs(camera, base_from_camera, places[name].position, pieces)
        samples = [_median_colour(image_rgb, centre, radius * settings.sample_share) for centre, radius in zip(centres, radii)]
        if any(sample is None for sample in samples):
            return ContentsReading(ContentsResult.OUT_OF_VIEW, None, 0.0, f"the {name} tube is not wholly in the picture")
        colours[name] = [_classify(sample, pieces, settings) for sample in samples]
    tubes = {name: "".join(colour for colour, _ in levels) for name, levels in colours.items()}
    seen = "|".join(tubes[name] for name in TUBES)
    floating = [name for name, levels in tubes.items() if " " in levels.rstrip()]
    if floating:
        return ContentsReading(ContentsResult.UNREADABLE, None, 0.0, f"{seen!r}: a ball above nothing in the {floating[0]} tube")
    try:
        state = State.parse("|".join(tubes[name].rstrip() for name in TUBES))
    except StateError as error:
        return ContentsReading(ContentsResult.UNREADABLE, None, 0.0, str(error))
    confidence = min(sure for levels in colours.values() for _, sure in levels)
    return ContentsReading(ContentsResult.OK, str(state), confidence, "")


def _ball_discs(
    camera: CameraModel, base_from_camera: np.ndarray, foot: np.ndarray, pieces: Pieces
) -> tuple[np.ndarray, np.ndarray]:
    """Return centres (4, 2) and radii (4,) [px] of the balls that a tube with its foot at `foot` [m] may hold."""
    heights = pieces.tube_floor + pieces.ball_radius + pieces.ball_diameter * np.arange(TUBE_CAPACITY)
    points = np.hstack([foot + np.outer(heights, [0.0, 0.0, 1.0]), np.ones((TUBE_CAPACITY, 1))])
    in_camera = points @ np.linalg.inv(base_from_camera).T[:, :3]
    return camera.project(in_camera), camera.matrix[0, 0] * pieces.ball_radius / in_camera[:, 2]


def _median_colour(image: np.ndarray, centre: np.ndarray, radius: float) -> np.ndarray | None:
    """Return the median rgb within a disc, None where the disc is not wholly in the picture."""
    height, width = image.shape[:2]
    inside = np.isfinite(centre).all() and (centre >= radius).all() and (centre < np.array([width, height]) - radius - 1).all()
    if not inside:
        return None
    column, row = centre
    first_row, first_column = int(row - radius), int(column - radius)
    patch = image[first_row : int(row + radius) + 2, first_column : int(column + radius) + 2]
    rows, columns = np.indices(patch.shape[:2])
    disc = np.hypot(rows + first_row - row, columns + first_column - column) <= radius
    return np.median(patch[disc], axis=0)


def _classify(rgb: np.ndarray, pieces: Pieces, settings: ContentsSettings) -> tuple[str, float]:
    """Return the ball's letter, or a blank for none, and how sure that is (0..1).

    Chroma is the share of each channel, less a third: it is zero for any grey, keeps its direction under more or less
    light, and only shrinks behind the tinted wall of a tube.
    """
    if rgb.max() < settings.darkest:
        return " ", 1.0
    chroma = _chroma(rgb)
    strength = np.linalg.norm(chroma)
    sure = min(1.0, abs(strength / settings.smallest_chroma - 1.0))
    if strength < settings.smallest_chroma:
        return " ", sure
    likeness = {
        letter: float(chroma @ _chroma(np.array(colour)) / (strength * np.linalg.norm(_chroma(np.array(colour)))))
        for letter, colour in pieces.ball_colours.items()
    }
    letter = max(likeness, key=likeness.get)
    # Something coloured that is no ball, such as wood behind a tube that is not where it should be.
    if likeness[letter] < settings.smallest_resemblance:
        return " ", 0.0
    return letter, min(sure, max(0.0, likeness[letter]))


def _chroma(rgb: np.ndarray) -> np.ndarray:
    return rgb / rgb.sum() - 1.0 / 3.0
