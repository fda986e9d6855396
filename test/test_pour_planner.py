"""Pours as motions of both arms: the mouths go the same way to one another, whoever does it and however tubes are held."""

from dataclasses import replace

import numpy as np
import pytest

from dr_eureka.bench.pour_rig import PourKind, PourRig
from dr_eureka.bench.pour_spread import NONE
from dr_eureka.control.body import Body, Held
from dr_eureka.control.grasp import UP, level_hand, tube_in_hand
from dr_eureka.control.port import CONTROLLED_JOINTS
from dr_eureka.control.pour_planner import PourPlanner
from dr_eureka.control.pouring import pour
from dr_eureka.control.settings import ControlSettings
from dr_eureka.game.hands import HANDS, other_hand
from dr_eureka.kinematics.arms import arm_joint_names
from dr_eureka.kinematics.transforms import invert, rotation_about, rotation_vector, transform
from dr_eureka.pieces import load_pieces
from dr_eureka.resources import load_yaml
from dr_eureka.simulation.settings import load_world_settings
from dr_eureka.simulation.stage import Stage

WHERE = "config/control_engine.yaml"
SETTINGS = ControlSettings.from_mapping(load_yaml(WHERE), WHERE)
PIECES = load_pieces()
METHODS = ["lock", "linear", "profiled"]
# Both arms solve for their hands within 0.2 mm and 2 mrad, 0.1 m from the mouths.
NEAR_M, NEAR_RAD = 0.8e-3, 6e-3
TURNED = transform(rotation_about((0.3, 1.0, 0.2), 0.05), (0.003, 0.0, -0.004))


def sharing(share: float) -> ControlSettings:
    return replace(SETTINGS, pour_place=replace(SETTINGS.pour_place, source_share=share))


def holding(settings: ControlSettings, held_from_believed: np.ndarray = np.eye(4)) -> Body:
    """Return a body with a tube lifted in each hand; both sit a little differently in the hands if told so."""
    body = Body.build(settings, PIECES, None, {})
    body.goals = dict.fromkeys(CONTROLLED_JOINTS, 0.0)
    pick = settings.pick
    for hand, y in zip(HANDS, (0.11, -0.11)):
        arm, foot = body.arms[hand], np.array([0.44, y, 0.775]) + pick.lift * UP
        yaw = pick.yaw_of(hand)
        rest = arm.posture(settings.postures.pick)
        pose = level_hand(foot + pick.grip_height * UP, yaw, pick.centre_beyond_end)
        body.goals.update(zip(arm.joints, arm.solve(rest, pose, "", "the lifted tube", rest).tolist()))
        body.goals[f"{hand[0]}_arm_grip"] = 0.96
        body.held[hand] = Held(hand, tube_in_hand(pose, foot) @ held_from_believed)
    body.joints = dict(body.goals)
    return body


def tubes_on_the_way(body: Body, source: str, method: str, samples: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Return base_from_tube (samples, 4, 4) of source and target in a pour of 1 or 2 out of 4, by forward kinematics."""
    target = other_hand(source)
    for motion in pour(body, source, target, method, 4, 1 if method == "lock" else 2):
        assert body.hit(motion) is None
        times = np.linspace(0.0, motion.duration, samples)
        goals = [{**body.goals, **motion.goals(time)} for time in times]
        body.goals.update(goals[-1])
        body.joints = dict(body.goals)
    poses = [[body.arms[hand].pose(joints) @ body.held[hand].end_from_tube for joints in goals] for hand in (source, target)]
    return np.array(poses[0]), np.array(poses[1])


def elevations(poses: np.ndarray) -> np.ndarray:
    return np.arcsin(poses[:, 2, 2])


def assert_same_way(ways: tuple[np.ndarray, np.ndarray], expected: tuple[np.ndarray, np.ndarray]) -> None:
    """Compare the source's mouth seen from the target's, pose by pose."""
    up_to_mouth = transform(translation=PIECES.tube_height * UP)
    for source, target, source_there, target_there in zip(*ways, *expected):
        here = invert(target @ up_to_mouth) @ source @ up_to_mouth
        there = invert(target_there @ up_to_mouth) @ source_there @ up_to_mouth
        assert np.linalg.norm(here[:3, 3] - there[:3, 3]) < NEAR_M
        assert np.linalg.norm(rotation_vector(here[:3, :3] @ there[:3, :3].T)) < NEAR_RAD


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("source, share", [("left", 0.7), ("right", 0.8)])
def test_the_mouths_go_the_same_way_to_one_another_whichever_arm_does_it(method, source, share):
    alone = tubes_on_the_way(holding(SETTINGS), source, method)
    both = tubes_on_the_way(holding(sharing(share)), source, method)
    assert_same_way(both, alone)
    swing = np.ptp(elevations(alone[0]))
    assert np.ptp(elevations(alone[1])) < 1e-9 < swing
    assert np.ptp(elevations(both[0])) == pytest.approx(share * swing, abs=NEAR_RAD)
    assert np.ptp(elevations(both[1])) == pytest.approx((1.0 - share) * swing, abs=NEAR_RAD)


@pytest.mark.parametrize("share", [1.0, 0.7])
def test_tubes_that_sit_differently_in_the_hands_go_the_same_way(share):
    expected = tubes_on_the_way(holding(sharing(share)), "left", "profiled")
    assert_same_way(tubes_on_the_way(holding(sharing(share), TURNED), "left", "profiled"), expected)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("share", [1.0, 0.7])
def test_no_joint_is_asked_for_more_than_it_may_do(method, share):
    body = holding(sharing(share), TURNED)
    motion = PourPlanner(body, "left", method).motions(4, 1)[0]
    step = 0.001
    sampled = motion.sampled(np.arange(0.0, motion.duration, step))
    ranges = {name: ends for arm in body.arms.values() for name, *ends in zip(arm.joints, arm.chain.lower, arm.chain.upper)}
    for name, angles in sampled.items():
        low, high = ranges[name]
        assert low < angles.min() and angles.max() < high
        assert np.abs(np.diff(angles)).max() / step < SETTINGS.speeds.hardware


@pytest.mark.parametrize("method", METHODS)
def test_an_arm_without_a_share_of_the_tilt_gets_no_command(method):
    def moving(share):
        return set(PourPlanner(holding(sharing(share)), "left", method).motions(4, 1)[0].goals(0.0))

    left, right = (set(arm_joint_names(hand)) for hand in HANDS)
    assert moving(1.0) == left and moving(0.7) == left | right


def test_a_lock_pour_that_both_arms_make_moves_one_ball():
    share, ready = 0.7, SETTINGS.lock_pour.ready_elevation
    # As far down as when the pouring arm does it alone, with the other tube leaning towards it by what is left.
    keyframes = [
        replace(frame, elevation=ready + (frame.elevation - ready) / share) for frame in SETTINGS.lock_pour.keyframes
    ]
    settings = replace(sharing(share), lock_pour=replace(SETTINGS.lock_pour, keyframes=tuple(keyframes)))
    rig = PourRig(settings, load_world_settings(), PIECES, NONE, 3, Stage(None))
    leans = []

    def watch(_: float) -> None:
        leans.append([np.arcsin(rig.world.tube_pose(hand)[2, 2]) for hand in HANDS])

    poured = rig.pour(PourKind("lock", "left", 3, 1, 1), each_cycle=watch)
    assert (poured.arrived, poured.lost) == (1, 0)
    lowest = min(frame.elevation for frame in SETTINGS.lock_pour.keyframes)
    source, target = np.array(leans).T
    assert source.min() == pytest.approx(lowest, abs=0.02)
    assert np.ptp(target) == pytest.approx((ready - lowest) * (1.0 - share) / share, abs=0.02)
