"""Which balls are in the tubes, on the sheet or in a hand: the robot's look at what its pours did."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Mapping

import numpy as np

from dr_eureka.game.state import TUBE_CAPACITY, TUBES
from dr_eureka.pieces import Pieces
from dr_eureka.vision.camera import CameraModel
from dr_eureka.vision.contents_levels import UNKNOWN, ContentsSettings, Level, LevelReader, TubeView
from dr_eureka.vision.contents_loose import LooseBall, find_loose_balls
from dr_eureka.vision.contents_paper import paper_mask, paper_white
from dr_eureka.vision.contents_state import consistent_states, missing, settle, surplus
from dr_eureka.vision.tubes import TubePlace

NOTHING_HELD: Mapping[str, np.ndarray] = MappingProxyType({})


class ContentsResult:
    """Names of what came out of looking into the tubes."""

    OK = "OK"
    UNSURE = "UNSURE"
    OUT_OF_VIEW = "OUT_OF_VIEW"
    BALL_MISSING = "BALL_MISSING"
    UNREADABLE = "UNREADABLE"


@dataclass(frozen=True)
class TubeContents:
    """A tube's balls bottom to top, `?` where one is or may be that is not seen, and how sure the rest is (0..1)."""

    colours: str
    confidence: float


@dataclass(frozen=True)
class ContentsReading:
    """What one picture tells; `state` is None and `reason` one line unless `result` is OK. `confidence` is 0..1.

    `loose`: balls that lie beside the tubes, looked for near a located sheet when the state is not OK.
    """

    result: str
    state: str | None
    confidence: float
    reason: str
    tubes: Mapping[str, TubeContents] = field(default_factory=dict)
    loose: tuple[LooseBall, ...] = ()


def read_contents(
    image_rgb: np.ndarray,
    camera: CameraModel,
    base_from_camera: np.ndarray,
    places: Mapping[str, TubePlace],
    pieces: Pieces,
    settings: ContentsSettings,
    base_from_sheet: np.ndarray | None = None,
    held: Mapping[str, np.ndarray] = NOTHING_HELD,
) -> ContentsReading:
    """Read the balls in three tubes.

    A state is only reported if it is the only one that fits what is seen (`contents_state`). The tubes are read from near to
    far, since a nearer one hides what is behind it.

    Args:
        image_rgb: (height, width, 3) uint8 picture as the camera took it.
        camera: calibration of the camera.
        base_from_camera: (4, 4) pose of the optical frame in `base`.
        places: where each standing tube stands, by name.
        base_from_sheet: (4, 4) pose of the sheet, if located: tells a hand over a standing tube from the paper behind it.
        held: base_from_tube (4, 4) of each tube in a hand, from the joints: origin at its foot's underside, z to its mouth.

    Returns:
        A reading whose `tubes` tell what is known of each even if the state is not. Its result is OUT_OF_VIEW if a tube that
        matters is not in the picture, UNSURE if one is covered, BALL_MISSING if all is seen but some balls are in no tube,
        UNREADABLE if more balls of a colour are seen than there are.
    """
    poses = {name: upright(place.position) for name, place in places.items() if name not in held} | dict(held)
    views = {name: TubeView(camera, base_from_camera, pose, pieces) for name, pose in poses.items() if name in TUBES}
    paper = paper_mask(camera, base_from_camera, base_from_sheet, pieces)
    reader = LevelReader(image_rgb, paper, paper_white(image_rgb, paper), pieces, settings)
    nothing = (Level(UNKNOWN, 0.0),) * TUBE_CAPACITY
    levels = dict.fromkeys(TUBES, nothing)
    for name in sorted(views, key=lambda name: views[name].distance):
        levels[name] = reader.read(views[name], name not in held)
    reading = _conclude(levels, [name for name in views if not _in_picture(views[name], camera)])
    if reading.result == ContentsResult.OK or base_from_sheet is None:
        return reading
    loose = find_loose_balls(image_rgb, camera, base_from_camera, base_from_sheet, views.values(), pieces, settings)
    return replace(reading, loose=loose)


def _conclude(levels: Mapping[str, tuple[Level, ...]], beyond: list[str]) -> ContentsReading:
    labels = {name: settle("".join(level.label for level in levels[name])) for name in TUBES}
    tubes = {name: TubeContents(labels[name].rstrip(), _confidence(levels[name], labels[name])) for name in TUBES}
    seen = "|".join(tubes[name].colours for name in TUBES)
    problem = surplus(list(labels.values()))
    if problem:
        return ContentsReading(ContentsResult.UNREADABLE, None, 0.0, f"{seen}: {problem}", tubes)
    states = consistent_states(labels)
    if len(states) == 1:
        confidence = min(contents.confidence for contents in tubes.values())
        return ContentsReading(ContentsResult.OK, str(states[0]), confidence, "", tubes)
    unknown = [name for name in TUBES if UNKNOWN in labels[name]]
    if not unknown:
        reason = f"{seen}: {missing(list(labels.values()))} in no tube"
        return ContentsReading(ContentsResult.BALL_MISSING, None, 0.0, reason, tubes)
    if set(unknown) <= set(beyond):
        reason = f"{seen}: the {unknown[0]} tube is not wholly in the picture"
        return ContentsReading(ContentsResult.OUT_OF_VIEW, None, 0.0, reason, tubes)
    return ContentsReading(ContentsResult.UNSURE, None, 0.0, f"{seen}: the {', '.join(unknown)} tube is covered", tubes)


def _confidence(levels: tuple[Level, ...], labels: str) -> float:
    """Return how sure the telling levels are: the balls that are seen, and the first place above them."""
    telling = levels[: len(labels.rstrip()) + 1]
    known = [level.confidence for level in telling if level.label != UNKNOWN]
    return min(known, default=0.0)


def _in_picture(view: TubeView, camera: CameraModel) -> bool:
    inside = (view.centres >= 0) & (view.centres < (camera.width, camera.height))
    return bool(inside.all())


def upright(foot: np.ndarray) -> np.ndarray:
    """Return base_from_tube (4, 4) of a tube that stands with its foot at (3,) [m] in `base`."""
    pose = np.eye(4)
    pose[:3, 3] = foot
    return pose
