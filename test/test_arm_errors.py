"""Hidden errors of the simulated arms, and the markers by which the camera sees what they do."""

from dataclasses import replace

import numpy as np
import pytest

from dr_eureka.bench.simulated_calibration import SimulatedRobot, imperfect, tubes_aside
from dr_eureka.kinematics.arms import BASE_LINK, URDF, arm_chain, arm_joint_names
from dr_eureka.kinematics.chain import Chain
from dr_eureka.kinematics.transforms import rotation_vector
from dr_eureka.pieces import load_pieces
from dr_eureka.resources import resource_path
from dr_eureka.simulation.arm_errors import ArmErrorSettings, draw_arm_errors, stretch_links
from dr_eureka.simulation.camera_model import camera_model
from dr_eureka.simulation.settings import load_camera_settings, load_world_settings
from dr_eureka.simulation.world import World
from dr_eureka.vision.hand_marker import HandMarkerError, locate_hand

SETTINGS = ArmErrorSettings(robot=5, joint=np.radians(1.0), link=0.002)


def test_robots_differ_but_each_is_always_the_same():
    first, again, other = (draw_arm_errors(replace(SETTINGS, robot=robot)) for robot in (5, 5, 6))
    assert first == again and first != other
    assert len(first.offsets) == len(first.stretches) == 14
    assert max(map(abs, first.offsets.values())) <= SETTINGS.joint
    assert max(map(abs, first.stretches.values())) <= SETTINGS.link


def test_robots_are_as_drawn_unless_told_otherwise():
    assert load_world_settings().arm_errors.robot == 0
    errors = draw_arm_errors(load_world_settings().arm_errors)
    assert not errors.offsets and not errors.stretches


def test_a_link_is_stretched_along_itself():
    errors = draw_arm_errors(SETTINGS)
    urdf = resource_path(URDF).read_text()
    texts = (urdf, stretch_links(urdf, errors.stretches))
    drawn, stretched = (Chain.from_urdf(text, "chest_link", "l_arm_end_link").forward_all(np.zeros(7)) for text in texts)
    before, after = (links["l_arm_sh_p1_link"][:3, 3] for links in (drawn, stretched))
    assert np.linalg.norm(after) - np.linalg.norm(before) == pytest.approx(errors.stretches["l_arm_sh_p1"])
    assert np.cross(before, after) == pytest.approx(np.zeros(3), abs=1e-9)


def test_the_camera_sees_where_an_imperfect_hand_really_is_and_the_joints_do_not_tell():
    pieces, camera = load_pieces(), replace(load_camera_settings(), hand_markers=True)
    settings = tubes_aside(imperfect(load_world_settings(), SETTINGS.robot))
    joints = np.array([-0.413, 1.032, 0.747, 0.424, 0.982, -0.351, -0.326])
    world = World(settings, 1, camera=camera)
    try:
        robot = SimulatedRobot(world, camera_model(camera))
        robot.move(dict(zip(arm_joint_names("left"), joints)) | {"head_y": 0.2, "head_p": 0.7})
        view, true = robot.look(), world.link_pose("l_arm_end_link")
    finally:
        world.close()
    reported = np.array([view.joints[name] for name in arm_joint_names("left")])
    drawn = arm_chain("left").forward(reported)
    assert reported == pytest.approx(joints, abs=0.005)
    assert np.linalg.norm(drawn[:3, 3] - true[:3, 3]) > 0.003

    errors = draw_arm_errors(settings.arm_errors)
    urdf = stretch_links(resource_path(URDF).read_text(), errors.stretches)
    chain = Chain.from_urdf(urdf, BASE_LINK, "l_arm_end_link", held={"torso_y": view.joints["torso_y"]})
    assert chain.forward(reported + [errors.offsets[name] for name in chain.joint_names]) == pytest.approx(true, abs=1e-5)

    expected = np.linalg.inv(view.base_from_camera) @ drawn
    seen = view.base_from_camera @ locate_hand(view.image, view.camera, pieces, "left", expected)
    assert np.linalg.norm(seen[:3, 3] - true[:3, 3]) < 0.0015
    assert np.linalg.norm(rotation_vector(seen[:3, :3].T @ true[:3, :3])) < 0.01

    with pytest.raises(HandMarkerError, match="marker 11 on the right hand is not in the picture; seen"):
        locate_hand(view.image, view.camera, pieces, "right", expected)
