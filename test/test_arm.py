"""One arm's trajectories: the hand goes straight, turns evenly, keeps its limits, and says by name what it cannot reach."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dr_eureka.control.arm import Arm
from dr_eureka.control.codes import ControlError, EngineCode
from dr_eureka.control.settings import ControlSettings
from dr_eureka.game.hands import HANDS
from dr_eureka.kinematics.transforms import rotation_about
from dr_eureka.resources import load_yaml

WHERE = "config/control_engine.yaml"
SETTINGS = ControlSettings.from_mapping(load_yaml(WHERE), WHERE)
LIMITS, SPACING, LIFT = SETTINGS.speeds.move, SETTINGS.pick.way_point_spacing, SETTINGS.pick.lift


@pytest.fixture(params=HANDS)
def arm(request):
    return Arm(request.param, SETTINGS.kinematics, None)


def poses_along(arm, trajectory, count=200):
    return np.array([arm.forward(joints) for joints in trajectory.at(np.linspace(0.0, trajectory.duration, count))])


def angles_between(rotations, rotation):
    return (Rotation.from_matrix(rotations) * Rotation.from_matrix(rotation).inv()).magnitude()


@pytest.mark.parametrize("height", [-LIFT, LIFT])
def test_a_line_over_a_tube_is_straight_unturned_and_no_faster_than_asked(arm, height):
    start = arm.posture(SETTINGS.postures.pick)
    line = arm.line(start, np.array([0.0, 0.0, height]), SPACING, SETTINGS.speeds.line, LIMITS, "CODE", "a tube")
    poses = poses_along(arm, line)
    begin = arm.forward(start)
    assert np.abs(poses[:, :2, 3] - begin[:2, 3]).max() < 0.001
    assert poses[-1][2, 3] - begin[2, 3] == pytest.approx(height, abs=3e-4)
    assert angles_between(poses[:, :3, :3], begin[:3, :3]).max() < 0.005
    speeds = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1) / (line.duration / (len(poses) - 1))
    assert 0.5 * SETTINGS.speeds.line < speeds.max() < 1.05 * SETTINGS.speeds.line


def test_a_glide_goes_straight_and_turns_evenly_within_the_limits_of_the_joints(arm):
    start = arm.posture(SETTINGS.postures.pick)
    begin, outward = arm.forward(start), 1.0 if arm.hand == "left" else -1.0
    end = begin.copy()
    end[:3, :3] = rotation_about([0.0, 0.0, 1.0], -0.4 * outward) @ begin[:3, :3]
    end[:3, 3] += [0.03, 0.12 * outward, 0.05]
    glide = arm.glide(start, end, SPACING, LIMITS, "CODE", "beside")
    poses = poses_along(arm, glide)
    np.testing.assert_allclose(poses[-1], end, atol=0.003)
    way = end[:3, 3] - begin[:3, 3]
    shares = (poses[:, :3, 3] - begin[:3, 3]) @ way / (way @ way)
    assert np.linalg.norm(poses[:, :3, 3] - begin[:3, 3] - np.outer(shares, way), axis=1).max() < 0.001
    assert np.abs(angles_between(poses[:, :3, :3], begin[:3, :3]) - 0.4 * shares).max() < 0.01
    assert (np.diff(shares) > -1e-4).all()
    speed, acceleration, _ = glide.peaks()
    assert speed < 1.01 * LIMITS.speed and acceleration < 1.02 * LIMITS.acceleration


def test_both_arms_go_the_same_ways_in_the_mirror():
    ways = []
    for hand, mirrored in zip(HANDS, (1.0, -1.0)):
        arm = Arm(hand, SETTINGS.kinematics, None)
        shift = np.array([0.05, 0.04 * mirrored, 0.02])
        line = arm.line(arm.posture(SETTINGS.postures.pick), shift, SPACING, 0.25, LIMITS, "CODE", "there")
        ways.append(mirrored * line.at(np.linspace(0.0, line.duration, 50)))
    np.testing.assert_allclose(ways[0], ways[1], atol=1e-4)


def test_what_is_out_of_reach_is_named_with_hand_place_and_reason(arm):
    start = arm.posture(SETTINGS.postures.pick)
    with pytest.raises(ControlError, match=f"{arm.hand} hand cannot reach the moon, end link at .* UNREACHABLE") as caught:
        arm.line(start, np.array([0.9, 0.0, 0.0]), SPACING, 0.25, LIMITS, EngineCode.UNREACHABLE_TUBE, "the moon")
    assert caught.value.code == EngineCode.UNREACHABLE_TUBE


def test_a_path_that_would_jump_is_refused(arm):
    start = arm.posture(SETTINGS.postures.pick)
    far = arm.forward(start)
    far[2, 3] += 0.25
    with pytest.raises(ControlError, match="would jump"):
        arm.path(start, [far], EngineCode.UNREACHABLE_POUR, "the next pose")
