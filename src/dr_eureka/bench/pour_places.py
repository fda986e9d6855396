"""Where the robot sees tubes that stand a little beside their nominal places: how trials of pours begin."""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from dr_eureka.bench.pour_spread import Spread
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.state import TUBES
from dr_eureka.kinematics.arms import base_from_camera
from dr_eureka.pieces import Pieces
from dr_eureka.simulation.camera_model import camera_model
from dr_eureka.simulation.rendering import SceneTextures
from dr_eureka.simulation.settings import CameraSettings, WorldSettings
from dr_eureka.simulation.stage import Stage
from dr_eureka.simulation.world import World
from dr_eureka.vision.sheet_renderer import sheet_image
from dr_eureka.vision.tubes import TubeResult, TubeSettings, locate_tubes

# [rad] as in a game: see `sheet_gaze` in config/dr_eureka_main.yaml.
SHEET_GAZE = {"head_y": 0.04, "head_p": 0.87}


class PourPlacesError(DrEurekaError):
    """Tubes that could not be located; `result` is one of TubeResult."""

    def __init__(self, result: str, reason: str):
        super().__init__(f"the tubes to pour with were not located: {result}: {reason}; expected three standing on the sheet")
        self.result = result


def scattered(world: WorldSettings, spread: Spread) -> WorldSettings:
    """Return settings of a world whose seed puts tubes and materials off by no more than a spread, and not the sheet."""
    scatter = replace(world.scatter, sheet=0.0, sheet_yaw=0.0, tubes=spread.placement, materials=spread.materials)
    return replace(world, scatter=scatter)


def nominal_feet(world: WorldSettings) -> dict[str, np.ndarray]:
    """Return the foot (3,) [m] in base of each tube, by its name, where the layout puts it."""
    return {tube: np.array([*world.layout.tubes_in_sheet[tube], 0.0]) + world.layout.sheet_centre for tube in TUBES}


def located_feet(
    world: WorldSettings, seed: int, pieces: Pieces, camera: CameraSettings, tubes: TubeSettings, stage: Stage
) -> dict[str, np.ndarray]:
    """Return the foot (3,) [m] in base of each tube as the robot's head sees it, hands out of the picture.

    A world of equal scatter and seed has its tubes in the same places. `stage`: one with a renderer. Raises PourPlacesError.
    """
    joints = {**world.layout.start_joints, **SHEET_GAZE}
    world = replace(world, layout=replace(world.layout, start_joints=joints))
    watched = World(world, seed, textures=SceneTextures(sheet=sheet_image(pieces)), pieces=pieces, camera=camera, stage=stage)
    pose = base_from_camera(watched.joint_positions())
    scene = locate_tubes(watched.camera_image(), camera_model(camera), pose, pieces, tubes)
    if scene.result != TubeResult.OK:
        raise PourPlacesError(scene.result, scene.reason)
    return {tube: scene.tubes[tube].position for tube in TUBES}
