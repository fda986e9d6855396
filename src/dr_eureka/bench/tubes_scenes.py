"""Random scenes of the sheet with its tubes in the simulated world, and what the robot's eyes make of them.

Each scene has its own random numbers, drawn from seed and index: it can be drawn again alone, and the outcome does not
depend on how many processes share the work. The simulator's truth is the judge's; the eyes get picture, calibration and
joints.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from dr_eureka.game.state import TUBES, State, all_states
from dr_eureka.kinematics.arms import base_from_camera
from dr_eureka.pieces import Pieces, load_pieces
from dr_eureka.resources import load_yaml
from dr_eureka.settings import build
from dr_eureka.simulation.camera_model import camera_model
from dr_eureka.simulation.placement import draw_placement
from dr_eureka.simulation.rendering import SceneTextures
from dr_eureka.simulation.settings import CameraSettings, WorldSettings, load_camera_settings, load_world_settings
from dr_eureka.simulation.stage import Stage
from dr_eureka.simulation.world import World
from dr_eureka.vision.camera import LAB_DISTORTION, CameraModel
from dr_eureka.vision.contents import ContentsSettings, read_contents
from dr_eureka.vision.sheet_renderer import PAPER, sheet_image
from dr_eureka.vision.tubes import TubeResult, TubeSettings, locate_tubes

YAW_RAD = np.radians(25.0)
SHEET_M = 0.02  # how far the sheet's centre is off its nominal place, along x and y
APART_M = 0.06  # between the axes of two tubes: fingers must fit between them
APART_RAD = 0.10  # as seen from the robot: none stands behind another
HEAD_PITCH_RAD, HEAD_YAW_RAD = (0.74, 0.86), (-0.02, 0.10)  # tubes at the far edge are in view, too, up to their mouths
LIGHT, NOISE_GREY_LEVELS = 0.4, (0.5, 6.0)
# A wider board than the game's: a sheet turned by 25 degrees must not hang over its edges, or tubes would fall.
BOARD_CENTRE, BOARD_SIZE = (0.55, 0.0, 0.7625), (0.60, 0.80, 0.025)


@dataclass(frozen=True)
class Series:
    """What all scenes of a series have in common; equal indices are otherwise equal scenes in every series."""

    name: str
    marker_hidden: bool = False
    distorted: bool = False

    @property
    def judged(self) -> bool:
        """Whether the share of states read has a goal: not where the sheet may be out of sight."""
        return not self.marker_hidden


SERIES = (Series("as it is"), Series("one marker hidden", marker_hidden=True), Series("lens distortion", distorted=True))


@dataclass(frozen=True, eq=False)
class Shot:
    """A picture, what the robot knows about it, and what is true: feet (3, 2) in base x, y [m] and state, left to right."""

    image: np.ndarray
    camera: CameraModel
    base_from_camera: np.ndarray
    feet: np.ndarray
    state: str


@dataclass(frozen=True, eq=False)
class Trial:
    """One scene judged: `errors_mm` of each tube's axis on the table, left to right, None unless three were located.

    Times are the processor's, so that other work on the machine does not count.
    """

    index: int
    result: str
    reason: str
    errors_mm: tuple[float, ...] | None
    sigmas_mm: tuple[float, ...]
    state: str
    contents: str
    read: str | None
    confidence: float
    locate_ms: float
    read_ms: float

    @property
    def right(self) -> bool:
        """The state was read, and is the true one."""
        return self.read == self.state

    @property
    def wrong(self) -> bool:
        """Another state was read than the true one: what must not be."""
        return self.read is not None and self.read != self.state


@dataclass(frozen=True, eq=False)
class Eyes:
    """The code under test with its settings."""

    pieces: Pieces
    tubes: TubeSettings
    contents: ContentsSettings

    @classmethod
    def load(cls, path: str = "config/dr_eureka_main.yaml") -> Eyes:
        """Read the settings the robot plays with."""
        contents = build(ContentsSettings, load_yaml(path).get("contents", {}), f"{path}: contents")
        return cls(load_pieces(), TubeSettings.load(path), contents)


@lru_cache(maxsize=1)
def _defaults() -> tuple[Pieces, WorldSettings, CameraSettings]:
    return load_pieces(), load_world_settings(), load_camera_settings()


def take_shot(stage: Stage, series: Series, seed: int, index: int) -> Shot:
    """Draw a scene, let its balls come to rest on a stage with a renderer, and take its picture."""
    rng = np.random.default_rng((seed, index))
    pieces, world_settings, camera_settings = _defaults()
    state = all_states()[rng.integers(len(all_states()))]
    head = {"head_p": rng.uniform(*HEAD_PITCH_RAD), "head_y": rng.uniform(*HEAD_YAW_RAD)}
    noise = float(rng.uniform(*NOISE_GREY_LEVELS))
    hidden = int(rng.choice(list(pieces.marker_centres)))
    sheet = sheet_image(pieces)
    if series.marker_hidden:
        _blank(sheet, hidden, pieces)
    settings, world_seed = _arrange(rng, {**world_settings.layout.start_joints, **head}, world_settings, pieces)
    camera_settings = replace(camera_settings, noise=noise, distortion=LAB_DISTORTION if series.distorted else (0.0,) * 5)
    world = World(settings, world_seed, state, SceneTextures(sheet=sheet), pieces, camera_settings, stage)
    image, pose = world.camera_image(), base_from_camera(world.joint_positions())
    feet = {name: world.tube_pose(name)[:2, 3] for name in TUBES}
    held = world.referee().tubes
    # The robot names tubes by where they stand, from its left to its right.
    order = sorted(TUBES, key=lambda name: -feet[name][1])
    seen = State(tuple(held[name] for name in order))
    return Shot(image, camera_model(camera_settings), pose, np.array([feet[name] for name in order]), str(seen))


def _arrange(
    rng: np.random.Generator, start_joints: dict[str, float], settings: WorldSettings, pieces: Pieces
) -> tuple[WorldSettings, int]:
    """Draw settings and seed of a world until no tube stands behind another."""
    scatter = replace(settings.scatter, sheet=SHEET_M, sheet_yaw=YAW_RAD, tubes=0.0, light=LIGHT)
    while True:
        tubes = {name: tuple(spot) for name, spot in zip(TUBES, _spots(rng, pieces))}
        layout = replace(
            settings.layout, tubes_in_sheet=tubes, board_centre=BOARD_CENTRE, board_size=BOARD_SIZE,
            start_joints=start_joints,
        )
        drawn, seed = replace(settings, layout=layout, scatter=scatter), int(rng.integers(1 << 31))
        feet = np.array(list(draw_placement(drawn, seed, np.zeros(3)).tubes.values()))
        directions = np.sort(np.arctan2(feet[:, 1], feet[:, 0]))
        if np.diff(directions).min() > APART_RAD:
            return drawn, seed


def judge(eyes: Eyes, shot: Shot, index: int) -> Trial:
    """Let the eyes look at a picture, and compare with the truth."""
    started = time.process_time()
    scene = locate_tubes(shot.image, shot.camera, shot.base_from_camera, eyes.pieces, eyes.tubes)
    located = time.process_time()
    errors, sigmas, contents, read, confidence = None, (), "", None, 0.0
    if scene.result == TubeResult.OK:
        reading = read_contents(
            shot.image, shot.camera, shot.base_from_camera, scene.tubes, eyes.pieces, eyes.contents, scene.base_from_sheet
        )
        contents, read, confidence = reading.result, reading.state, reading.confidence
    finished = time.process_time()
    if scene.result == TubeResult.OK:
        found = np.array([scene.tubes[name].position[:2] for name in TUBES])
        errors = tuple((1000 * np.linalg.norm(found - shot.feet, axis=1)).tolist())
        sigmas = tuple(1000 * scene.tubes[name].sigma_m for name in TUBES)
    return Trial(
        index, scene.result, scene.reason, errors, sigmas, shot.state, contents, read, confidence,
        1000 * (located - started), 1000 * (finished - located),
    )


def _spots(rng: np.random.Generator, pieces: Pieces) -> list[np.ndarray]:
    """Draw where three tubes stand in `sheet` [m]: wholly on the paper, on no marker, apart from one another."""
    spots: list[np.ndarray] = []
    limits = np.array([pieces.sheet_depth, pieces.sheet_width]) / 2 - pieces.foot_radius
    clear = pieces.marker_side / 2 + pieces.foot_radius
    while len(spots) < len(TUBES):
        spot = rng.uniform(-limits, limits)
        on_marker = any(np.abs(spot - np.array(centre)).max() < clear for centre in pieces.marker_centres.values())
        if not on_marker and all(np.linalg.norm(spot - other) > APART_M for other in spots):
            spots.append(spot)
    return spots


def _blank(sheet: np.ndarray, marker: int, pieces: Pieces) -> None:
    """Take a marker off a picture of the sheet, with the paper's white."""
    per_metre = sheet.shape[1] / pieces.sheet_width
    far_left = np.array([pieces.sheet_depth, pieces.sheet_width]) / 2
    corners = (far_left - pieces.marker_corners(marker)[[0, 2]]) * per_metre
    (top, left), (bottom, right) = np.rint(corners).astype(int)
    sheet[top:bottom, left:right] = PAPER
