"""Saika's arms and head: the chain against PyBullet, signs, postures and the joint that keeps the basket upright."""

from __future__ import annotations

import numpy as np
import pybullet
import pytest
from pybullet_utils.bullet_client import BulletClient

from dr_eureka.catching.description import describe_saika
from dr_eureka.catching.saika import JOINTS, LEFT_ARM, RIGHT_ARM, SaikaArm, SaikaHead
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.catching.unique_postures import PostureChooser
from dr_eureka.catching.working_area import WorkingArea
from dr_eureka.kinematics.arms import UnknownSideError
from dr_eureka.resources import resource_path
from dr_eureka.settings import SettingsError
from dr_eureka.simulation.quiet import quiet_stdout

SETTINGS = SaikaSettings.load()
ARM = SaikaArm(SETTINGS)
AREA = WorkingArea(SETTINGS.working_area, ARM)
PLACES = AREA.draw(150, np.random.default_rng(1))


@pytest.fixture(scope="module")
def bullet(tmp_path_factory):
    file = tmp_path_factory.mktemp("saika") / "saika_of_tests.urdf"
    file.write_text(describe_saika(SETTINGS))
    with quiet_stdout():
        client = BulletClient(pybullet.DIRECT)
    client.body = client.loadURDF(str(file), useFixedBase=True)
    infos = [client.getJointInfo(client.body, index) for index in range(client.getNumJoints(client.body))]
    client.joints = {info[1].decode(): info[0] for info in infos}
    client.links = {info[12].decode(): info[0] for info in infos}
    yield client
    client.disconnect()


def stand(client, joints):
    for name, angle in zip(JOINTS, joints):
        client.resetJointState(client.body, client.joints[name], angle)


def link_pose(client, link):
    state = client.getLinkState(client.body, client.links[link], computeForwardKinematics=True)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.reshape(client.getMatrixFromQuaternion(state[5]), (3, 3)), state[4]
    return pose


def test_hands_and_cameras_are_where_pybullet_has_them(bullet):
    rng = np.random.default_rng(2)
    for _ in range(5):
        joints = np.concatenate([rng.uniform(-0.5, 0.5, 2), rng.uniform(ARM.lower, ARM.upper, (2, 5)).ravel()])
        stand(bullet, joints)
        for side, part in (("left", LEFT_ARM), ("right", RIGHT_ARM)):
            hand = SaikaArm(SETTINGS, side).forward(joints[part])
            assert hand == pytest.approx(link_pose(bullet, f"{side}_hand"), abs=1e-6)
            camera = SaikaHead(SETTINGS).base_from_camera(side, neck=joints[:2])
            assert camera == pytest.approx(link_pose(bullet, f"{side}_camera"), abs=1e-6)


def test_it_has_twelve_joints_and_each_camera_two(bullet):
    kinds = [bullet.getJointInfo(bullet.body, index)[2] for index in bullet.joints.values()]
    assert len(JOINTS) == 12
    assert kinds.count(pybullet.JOINT_REVOLUTE) == 12 + 4


def test_it_is_as_high_as_a_woman_of_158_cm():
    eyes = SETTINGS.body.floor_below_shoulders_m + SaikaHead(SETTINGS).base_from_camera("left")[2, 3]
    assert eyes == pytest.approx(0.936 * 1.58, abs=0.002)
    assert ARM.upper_arm_m == pytest.approx(0.186 * 1.58, abs=0.001)


@pytest.mark.parametrize("joint, axis, sign", [
    ("shoulder_pitch", 1, 1), ("shoulder_roll", 0, -1), ("elbow", 1, 1),
])
def test_positive_angles_lift_the_left_hand_forward_and_outward(joint, axis, sign):
    joints = np.zeros(5)
    joints[["shoulder_pitch", "shoulder_roll", "upper_arm_yaw", "elbow", "forearm_roll"].index(joint)] = 0.3
    moved = ARM.basket_centre(joints) - ARM.basket_centre(np.zeros(5))
    assert sign * moved[axis] > 0.05 and moved[2] > 0.0


def test_the_right_arm_mirrors_the_left_one():
    joints = np.random.default_rng(3).uniform(ARM.lower, ARM.upper, (20, 5))
    right = SaikaArm(SETTINGS, "right").basket_centre(joints)
    assert right * [-1.0, 1.0, 1.0] == pytest.approx(ARM.basket_centre(joints), abs=1e-12)


def test_cameras_look_ahead_and_positive_angles_turn_them_left_and_up():
    head = SaikaHead(SETTINGS)
    assert head.base_from_camera("left")[:3, 2] == pytest.approx([0.0, 1.0, 0.0], abs=1e-8)
    assert head.base_from_camera("left", (0.3, 0.0))[0, 2] < 0.0 < head.base_from_camera("left", (0.0, 0.3))[2, 2]
    apart = head.base_from_camera("right")[:3, 3] - head.base_from_camera("left")[:3, 3]
    assert apart == pytest.approx([SETTINGS.cameras.baseline_m, 0.0, 0.0])


def test_a_third_side_is_refused():
    with pytest.raises(UnknownSideError, match="no side 'middle', expected one of left, right"):
        SaikaArm(SETTINGS, "middle")


def test_the_posture_joint_leaves_the_hand_and_puts_normal_and_forearm_into_a_vertical_plane():
    for four in PostureChooser(ARM).joints(PLACES):
        joints = ARM.with_posture(four)
        pose = ARM.forward(joints)
        assert pose[:3, 3] == pytest.approx(ARM.basket_centre(four), abs=1e-12)
        forearm = pose[:3, 3] - elbow(four)
        across = np.cross(forearm, pose[:3, 2])
        assert across[2] == pytest.approx(0.0, abs=1e-9)
        assert pose[2, 2] > 0.7


def elbow(four):
    """Return where the elbow is, by three turns written out."""
    a, b, _, _ = four
    along = np.array([-np.sin(b), np.sin(a) * np.cos(b), -np.cos(a) * np.cos(b)])
    return ARM.shoulder + ARM.upper_arm_m * along


def test_the_rim_is_level_at_the_angle_that_the_settings_say():
    rise = np.radians(SETTINGS.body.basket_rim_level_at_deg)
    pose = ARM.forward(np.array([0.2, 0.0, 0.0, 0.5 * np.pi - 0.2 + rise, 0.0]))
    assert pose[:3, 2] == pytest.approx([0.0, 0.0, 1.0], abs=1e-8)


def test_chosen_postures_reach_their_places():
    joints = PostureChooser(ARM).joints(PLACES)
    assert ARM.basket_centre(joints) == pytest.approx(PLACES, abs=1e-6)
    assert np.all((joints >= ARM.lower[:4] - 1e-6) & (joints <= ARM.upper[:4]))


def test_outside_of_the_shoulder_no_posture_has_a_smaller_norm():
    """Against a brute force: random postures, each pulled onto the place by Newton's method."""
    rng, place = np.random.default_rng(4), np.array([-0.35, 0.42, -0.2])
    (chosen,) = PostureChooser(ARM).joints(place)
    for _ in range(100):
        joints = rng.uniform(ARM.lower[:4], ARM.upper[:4])
        for _ in range(30):
            missing = place - ARM.basket_centre(joints)
            joints = joints + np.linalg.pinv(ARM.chain.jacobian(np.append(joints, 0.0))[:3, :4]) @ missing
        if np.linalg.norm(missing) < 1e-9:
            assert np.linalg.norm(joints) >= np.linalg.norm(chosen) - 1e-6


def test_no_chosen_posture_touches_the_torso(bullet):
    links = ("left_upper_arm_yaw_link", "left_forearm_roll_link", "left_hand")
    for four in PostureChooser(ARM).joints(PLACES):
        joints = np.zeros(12)
        joints[LEFT_ARM] = ARM.with_posture(four)
        stand(bullet, joints)
        for link in links:
            touching = bullet.getClosestPoints(bullet.body, bullet.body, 0.0, bullet.links[link], bullet.links["torso"])
            assert not touching, f"{link} is {-touching[0][8]:.3f} m inside the torso"


def test_a_place_that_no_posture_reaches_has_none():
    assert np.isnan(PostureChooser(ARM).joints(np.array([[0.0, 2.0, 0.0]]))).all()


def test_the_working_area_is_a_box_within_reach():
    assert AREA.contains(PLACES).all()
    assert np.linalg.norm(PLACES - ARM.shoulder, axis=1).max() <= SETTINGS.working_area.most_reach_m
    assert not AREA.contains([[-0.2, 0.45, 0.3], [-0.46, 0.54, -0.34], [np.nan, 0.4, -0.2]]).any()


def test_a_joint_without_limits_is_named(tmp_path):
    file = tmp_path / "saika.yaml"
    lines = resource_path("config/saika.yaml").read_text().splitlines()
    file.write_text("\n".join(line for line in lines if not line.startswith("  elbow:")))
    with pytest.raises(SettingsError, match="joints: are .* expected .*elbow"):
        SaikaSettings.load(file)
