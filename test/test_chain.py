"""Chains against THORMANG3's published vectors, finite differences, a second implementation, and the mirror."""
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dr_eureka.kinematics.arms import (
    SIDES, UnknownSideError, arm_chain, arm_joint_names, base_from_camera, head_chain, mirror, mirror_transform, side_of,
)
from dr_eureka.kinematics.chain import Chain, ChainError
from dr_eureka.kinematics.transforms import matrix_to_quaternion, rotation_vector

# Left arm [rad], then position [m] and quaternion x, y, z, w of the end link in `base`; from the forward kinematics of the
# ROBOTIS manager (two of its stored postures and zero).
MANAGER_VECTORS = [
    ([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.43, 0.462, 1.0145], [0.0, 0.0, 0.0, 1.0]),
    (
        [0.436332313, 1.308996939, 0.0872664626, -0.5235987756, 0.0, 0.0, 0.0],
        [0.124317572, 0.297002645, 0.468184775],
        [-0.525940469, 0.353503711, 0.300446656, 0.712848901],
    ),
    (
        [1.1684979342, 1.0520844731, -0.1869247629, 0.6010913944, 1.0403907671, -0.1478293876, 0.5578072289],
        [0.149980013, 0.310010458, 0.780445969],
        [-0.00010687, 4.9186e-05, 7.8923e-05, 0.99999999],
    ),
    (
        [0.5689773362, 1.0316641209, -0.1153662636, 0.4944517771, 1.0410888988, -0.1574286985, 0.0851720675],
        [0.299977516, 0.309993686, 0.799481262],
        [-0.000146443, 0.000110445, 6.386e-05, 0.999999981],
    ),
    (
        [0.3, 0.0, 0.0, -0.5, 0.0, 0.0, 0.0],
        [0.338749083, 0.650097692, 0.907889317],
        [0.036971586, 0.144792463, 0.244625879, 0.95803258],
    ),
]

SMALL_ROBOT = """
<robot name="small">
  <link name="floor"/> <link name="post"/> <link name="upper"/> <link name="lower"/> <link name="tool"/> <link name="slide"/>
  <joint name="foot" type="fixed"><parent link="floor"/><child link="post"/><origin xyz="0 0 1" rpy="0 0 1.2"/></joint>
  <joint name="first" type="revolute"><parent link="post"/><child link="upper"/>
    <origin xyz="0.1 0 0.2" rpy="0.3 -0.4 0.5"/><axis xyz="1 2 -2"/><limit lower="-1" upper="2" velocity="3"/></joint>
  <joint name="second" type="continuous"><parent link="upper"/><child link="lower"/>
    <origin xyz="0 0.5 0"/><axis xyz="0 0 -1"/></joint>
  <joint name="flange" type="fixed"><parent link="lower"/><child link="tool"/><origin xyz="0 0.4 0.1" rpy="0 1 0"/></joint>
  <joint name="rail" type="prismatic"><parent link="post"/><child link="slide"/><limit lower="0" upper="1"/></joint>
</robot>
"""


def small_robot_by_scipy(first, second):
    """Compute floor_from_tool of SMALL_ROBOT step by step with scipy."""

    def place(xyz, rotation):
        result = np.eye(4)
        result[:3, :3], result[:3, 3] = rotation.as_matrix(), xyz
        return result

    turn = lambda axis, angle: place([0, 0, 0], Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis)))
    fixed = lambda xyz, rpy: place(xyz, Rotation.from_euler("xyz", rpy))
    return (
        fixed([0, 0, 1], [0, 0, 1.2]) @ fixed([0.1, 0, 0.2], [0.3, -0.4, 0.5]) @ turn([1, 2, -2], first)
        @ fixed([0, 0.5, 0], [0, 0, 0]) @ turn([0, 0, -1], second) @ fixed([0, 0.4, 0.1], [0, 1, 0])
    )


@pytest.mark.parametrize("joints, position, quaternion", MANAGER_VECTORS)
def test_the_arms_end_where_the_manager_says(joints, position, quaternion):
    pose = arm_chain("left").forward(np.array(joints))
    np.testing.assert_allclose(pose[:3, 3], position, atol=1e-9)
    np.testing.assert_allclose(matrix_to_quaternion(pose), quaternion, atol=1e-9)


def test_the_camera_is_where_the_manager_says():
    joints = {"torso_y": 0.0, "head_y": 0.0, "head_p": 0.0, "l_arm_el_y": 1.0}
    np.testing.assert_allclose(base_from_camera(joints)[:3, 3], [0.0682, 0.0, 1.2175], atol=1e-12)
    looking_down = base_from_camera({**joints, "head_p": 0.87})
    np.testing.assert_allclose(looking_down[:3, 2], [np.cos(0.87), 0.0, -np.sin(0.87)], atol=1e-8)


def test_a_general_chain_agrees_with_scipy():
    chain = Chain.from_urdf(SMALL_ROBOT, "floor", "tool")
    assert chain.joint_names == ("first", "second")
    np.testing.assert_array_equal(chain.lower, [-1.0, -np.inf])
    np.testing.assert_array_equal(chain.velocity, [3.0, np.inf])
    for joints in np.random.default_rng(0).uniform(-3, 3, (20, 2)):
        np.testing.assert_allclose(chain.forward(joints), small_robot_by_scipy(*joints), atol=1e-14)


def test_a_held_joint_is_folded_into_the_chain():
    chain = Chain.from_urdf(SMALL_ROBOT, "floor", "tool", held={"second": 0.7})
    np.testing.assert_allclose(chain.forward(np.array([0.2])), small_robot_by_scipy(0.2, 0.7), atol=1e-14)


@pytest.mark.parametrize("side", SIDES)
def test_the_jacobian_agrees_with_finite_differences(side):
    chain = arm_chain(side)
    step = 1e-6
    for joints in np.random.default_rng(1).uniform(chain.lower, chain.upper, (50, 7)):
        jacobian = chain.jacobian(joints)
        for index in range(7):
            after, before = (chain.forward(joints + sign * step * np.eye(7)[index]) for sign in (1, -1))
            turn = rotation_vector(after[:3, :3] @ before[:3, :3].T)
            numeric = np.concatenate([after[:3, 3] - before[:3, 3], turn]) / (2 * step)
            np.testing.assert_allclose(jacobian[:, index], numeric, atol=1e-8)


def test_a_batch_gives_what_its_members_give():
    chain = arm_chain("left")
    joints = np.random.default_rng(2).uniform(chain.lower, chain.upper, (3, 4, 7))
    poses, jacobians = chain.forward_and_jacobian(joints)
    assert poses.shape == (3, 4, 4, 4) and jacobians.shape == (3, 4, 6, 7)
    np.testing.assert_allclose(chain.forward(joints), poses, atol=1e-15)
    for place in np.ndindex(3, 4):
        pose, jacobian = chain.forward_and_jacobian(joints[place])
        np.testing.assert_allclose(poses[place], pose, atol=1e-14)
        np.testing.assert_allclose(jacobians[place], jacobian, atol=1e-14)


def test_every_link_is_where_a_chain_to_that_link_says():
    joints = np.array([0.3, 0.9, 0.2, 0.5, 1.0, -0.2, 0.1])
    links = arm_chain("left").forward_all(joints)
    np.testing.assert_allclose(links["l_arm_end_link"], arm_chain("left").forward(joints), atol=1e-15)
    np.testing.assert_allclose(links["chest_link"][:3, 3], [0.0, 0.0, 0.723 + 0.1705], atol=1e-12)
    # the grasp frame is 0.145 m along x and 0.045 m along y of the last link
    np.testing.assert_allclose(links["l_arm_wr_p_link"] @ [0.145, 0.045, 0, 1], links["l_arm_end_link"][:, 3], atol=1e-12)


def test_the_right_arm_is_the_left_one_in_the_mirror():
    left, right = arm_chain("left"), arm_chain("right")
    joints = np.random.default_rng(3).uniform(left.lower, left.upper, (1000, 7))
    np.testing.assert_allclose(right.forward(mirror(joints)), mirror_transform(left.forward(joints)), atol=1e-12)
    np.testing.assert_allclose(right.lower, -left.upper)
    assert side_of(left) == "left" and side_of(right) == "right"


def test_limits_are_the_robots():
    chain = arm_chain("left")
    np.testing.assert_allclose(np.degrees(chain.lower), [-90, -90, -30, -45, -150, -81, -81], atol=1e-3)
    np.testing.assert_allclose(np.degrees(chain.upper), [90, 90, 90, 72, 150, 81, 81], atol=1e-3)
    assert chain.within_limits(chain.clip(np.full(7, 9.0))) and not chain.within_limits(chain.upper + 1e-3)
    assert chain.within_limits(chain.upper + 1e-3, tolerance=2e-3)


@pytest.mark.parametrize(
    "root, tip, held, complaint",
    [
        ("floor", "hand", {}, "no link 'hand', it has floor, lower"),
        ("tool", "floor", {}, "'floor' does not hang from link 'tool'"),
        ("floor", "slide", {}, "joint 'rail' is 'prismatic'"),
        ("floor", "post", {}, "no moving joint between"),
        ("floor", "tool", {"rail": 0.0}, "held joints \\['rail'\\]"),
    ],
)
def test_an_impossible_chain_is_refused_by_name(root, tip, held, complaint):
    with pytest.raises(ChainError, match=complaint):
        Chain.from_urdf(SMALL_ROBOT, root, tip, held)


def test_a_broken_or_missing_description_is_refused(tmp_path):
    with pytest.raises(ChainError, match="is not XML"):
        Chain.from_urdf("<robot>", "a", "b")
    with pytest.raises(ChainError, match="absent.urdf: No such file"):
        Chain.from_urdf(tmp_path / "absent.urdf", "a", "b")


def test_wrong_joint_counts_and_sides_are_refused():
    with pytest.raises(ChainError, match=r"shape \(6,\), expected \(..., 7\)"):
        arm_chain("left").forward(np.zeros(6))
    with pytest.raises(UnknownSideError, match="no arm 'middle', expected one of left, right"):
        arm_joint_names("middle")
    with pytest.raises(UnknownSideError, match="torso_y, head_y, head_p are not those of an arm"):
        side_of(head_chain())
