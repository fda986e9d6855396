"""The located tubes against the simulator's truth: another renderer, another projection, another pose of the camera."""

import numpy as np
import pytest

from dr_eureka.game.state import TUBES, State
from dr_eureka.kinematics.arms import head_chain
from dr_eureka.pieces import load_pieces
from dr_eureka.simulation.rendering import SceneTextures
from dr_eureka.simulation.settings import load_camera_settings, load_world_settings
from dr_eureka.simulation.world import World
from dr_eureka.vision.camera import CameraModel
from dr_eureka.vision.sheet_renderer import sheet_image
from dr_eureka.vision.tubes import TubeResult, TubeSettings, locate_tubes


@pytest.mark.parametrize("seed, state", [(1, "RR|GG|PP"), (2, "RRGG||PP"), (3, "P|RGRG|P")])
def test_tubes_in_the_simulators_picture_are_within_a_millimetre(seed, state):
    pieces, camera_settings = load_pieces(), load_camera_settings()
    matrix = ((camera_settings.fx, 0, camera_settings.cx), (0, camera_settings.fy, camera_settings.cy), (0, 0, 1))
    camera = CameraModel(camera_settings.width, camera_settings.height, matrix, camera_settings.distortion)
    textures = SceneTextures(sheet=sheet_image(pieces))
    world = World(load_world_settings(), seed, State.parse(state), textures, camera=camera_settings)
    try:
        world.set_joint_goals({"head_p": 0.87})
        for _ in range(125):
            world.advance_cycle()
        head, joints = head_chain(), world.joint_positions()
        base_from_camera = head.forward(np.array([joints[name] for name in head.joint_names]))
        found = locate_tubes(world.camera_image(), camera, base_from_camera, pieces, TubeSettings.load())
        true = [world.tube_pose(name)[:3, 3] for name in TUBES]
    finally:
        world.close()
    assert (found.result, found.reason) == (TubeResult.OK, "")
    assert found.markers_seen == (0, 1, 2, 3)
    errors = np.linalg.norm([found.tubes[name].position for name in TUBES] - np.array(true), axis=1)
    assert errors.max() < 0.001
