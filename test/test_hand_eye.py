"""Hand-eye calibration: what is fitted, what is refused, what is kept in the file, and what it does to an arm."""

import cv2
import numpy as np
import pytest

from dr_eureka.behaviour.arm_calibration import ArmCalibrationSettings
from dr_eureka.control.arm import Arm
from dr_eureka.control.arm_calibration import ArmCalibration, ArmCalibrationError, load_calibration, save_calibration
from dr_eureka.control.codes import EngineCode
from dr_eureka.control.hand_eye import SeenHand, calibrate, check_spread, fit_affine, reference_poses
from dr_eureka.control.settings import ControlSettings
from dr_eureka.kinematics.arms import BASE_LINK, URDF, arm_chain
from dr_eureka.kinematics.chain import Chain
from dr_eureka.kinematics.transforms import rotation_about, rotation_vector
from dr_eureka.resources import load_yaml, resource_path
from dr_eureka.settings import SettingsError
from dr_eureka.simulation.arm_errors import ArmErrorSettings, draw_arm_errors, stretch_links

CONTROL = ControlSettings.from_mapping(load_yaml("config/control_engine.yaml"), "config/control_engine.yaml")
SETTINGS = ArmCalibrationSettings.load().hand_eye
HANDS = pytest.mark.parametrize("hand", ["left", "right"])


def imperfect_arm(hand, robot):
    """Return a function from reported joints (7,) to the true base_from_end: another URDF, not `Chain.adjusted`."""
    errors = draw_arm_errors(ArmErrorSettings(robot, np.radians(1.0), 0.002))
    urdf = stretch_links(resource_path(URDF).read_text(), errors.stretches)
    chain = Chain.from_urdf(urdf, BASE_LINK, f"{hand[0]}_arm_end_link", held={"torso_y": 0.0})
    offsets = np.array([errors.offsets[name] for name in chain.joint_names])
    return lambda joints: chain.forward(joints + offsets)


def looks_at(hand, true, noise_m=0.0, seed=0):
    """Return what a camera sees of an imperfect arm at the reference points; the turn is seen as well as the place."""
    rng, arm = np.random.default_rng(seed), Arm(hand, CONTROL.kinematics, None)
    rest, looks = arm.posture(CONTROL.postures.pick), []
    for pose in reference_poses(hand, SETTINGS, CONTROL.pick):
        joints = arm.solve(rest, pose, EngineCode.UNREACHABLE_TUBE, "a reference point", rest)
        seen, axis = true(joints), rng.normal(size=3)
        seen[:3, 3] += rng.normal(0.0, noise_m, 3)
        seen[:3, :3] = rotation_about(axis / np.linalg.norm(axis), rng.normal(0.0, 5.0 * noise_m)) @ seen[:3, :3]
        looks.append(SeenHand(joints, seen))
    return looks


def test_an_affine_map_is_found_as_opencv_finds_it():
    rng = np.random.default_rng(1)
    wanted = rng.uniform((0.3, -0.2, 0.8), (0.5, 0.2, 1.0), (5, 3))
    affine = np.column_stack([np.eye(3) + rng.normal(0.0, 0.02, (3, 3)), rng.normal(0.0, 0.01, 3)])
    commanded = wanted @ affine[:, :3].T + affine[:, 3]
    found = fit_affine(wanted, commanded)
    _, by_opencv, _ = cv2.estimateAffine3D(wanted, commanded)
    assert found == pytest.approx(affine, abs=1e-9)
    assert found == pytest.approx(by_opencv, abs=1e-4)


def test_points_on_a_table_are_refused_and_the_direction_that_is_missing_is_named():
    points = np.random.default_rng(2).uniform((0.3, -0.2, 0.88), (0.5, 0.2, 0.881), (9, 3))
    words = r"9 reference points do not span space: .* along \(.*, 1.00\) of base, expected at least 20 mm"
    with pytest.raises(ArmCalibrationError, match=words):
        check_spread(points, 0.02)


@pytest.mark.parametrize("count, words", [(4, "4 reference points, expected at least 5"), (0, "0 reference points")])
def test_fewer_than_five_points_are_refused(count, words):
    points = np.random.default_rng(3).uniform(0.0, 1.0, (count, 3))
    with pytest.raises(ArmCalibrationError, match=words):
        check_spread(points, 0.02)
    with pytest.raises(ArmCalibrationError, match=words):
        calibrate("left", [SeenHand(np.zeros(7), np.eye(4))] * count, SETTINGS)


def test_the_reference_points_of_the_right_hand_mirror_the_lefts_and_span_space():
    left, right = (np.array(reference_poses(hand, SETTINGS, CONTROL.pick))[:, :3, 3] for hand in ("left", "right"))
    assert right == pytest.approx(left * (1.0, -1.0, 1.0))
    assert len(left) >= 5
    check_spread(left, SETTINGS.smallest_spread)


@HANDS
def test_a_calibrated_arm_gets_to_where_an_imperfect_one_does_not(hand):
    true = imperfect_arm(hand, robot=7)
    fit = calibrate(hand, looks_at(hand, true, noise_m=0.0003), SETTINGS)
    assert fit.place_before.mean() > 0.003
    assert fit.place_after.mean() < 0.001
    assert fit.turn_after.mean() < 0.2 * fit.turn_before.mean()
    drawn, calibrated = (Arm(hand, CONTROL.kinematics, None, calibration) for calibration in (None, fit.calibration))
    wanted = arm_chain(hand).forward(drawn.posture(CONTROL.postures.pick))
    places, turns = [], []
    for arm in (drawn, calibrated):
        joints = arm.solve(arm.posture(CONTROL.postures.home), wanted, EngineCode.UNREACHABLE_TUBE, "a tube")
        places.append(np.linalg.norm(true(joints)[:3, 3] - wanted[:3, 3]))
        turns.append(np.linalg.norm(rotation_vector(true(joints)[:3, :3].T @ wanted[:3, :3])))
        assert arm.forward(joints) == pytest.approx(wanted, abs=0.005)
    assert places[0] > 0.002 and places[1] < 0.001
    assert turns[1] < 0.005


def test_an_arm_as_drawn_is_left_alone():
    fit = calibrate("left", looks_at("left", arm_chain("left").forward), SETTINGS)
    assert np.array(fit.calibration.joint_offsets) == pytest.approx(np.zeros(7), abs=1e-5)
    assert np.array(fit.calibration.affine) == pytest.approx(np.eye(3, 4), abs=1e-4)


def test_what_is_commanded_undoes_what_is_reached():
    affine = ((1.01, 0.02, 0.0, 0.003), (0.0, 0.99, 0.01, -0.01), (0.03, 0.0, 1.0, 0.002))
    calibration = ArmCalibration("left", affine=affine)
    pose = arm_chain("left").forward(np.array(CONTROL.postures.pick))
    assert calibration.reached(calibration.commanded(pose)) == pytest.approx(pose)
    assert calibration.commanded(pose)[:3, 3] == pytest.approx(np.array(calibration.affine) @ np.append(pose[:3, 3], 1.0))


def test_a_calibration_is_read_as_it_was_written(tmp_path):
    calibration = calibrate("right", looks_at("right", imperfect_arm("right", robot=3)), SETTINGS).calibration
    file = save_calibration(calibration, tmp_path / "new", "2026-11-22", 24, "8.0 mm", "0.2 mm")
    loaded = load_calibration(tmp_path / "new", "right")
    assert file == tmp_path / "new" / "right.yaml"
    assert loaded.hand == "right"
    for name in ("joint_offsets", "link_stretches", "affine"):
        assert np.array(getattr(loaded, name)) == pytest.approx(np.array(getattr(calibration, name)), abs=1e-6)
    assert "8.0 mm" in file.read_text() and "0.2 mm" in file.read_text()


def test_an_arm_without_a_file_is_as_drawn(tmp_path):
    calibration = load_calibration(tmp_path, "left")
    joints = np.array(CONTROL.postures.pick)
    assert calibration.reached(calibration.chain().forward(joints)) == pytest.approx(arm_chain("left").forward(joints))


@pytest.mark.parametrize(
    "text, error, words",
    [
        ("hand: right\n", ArmCalibrationError, "is of the right arm, expected the left arm's"),
        ("hand: left\njoint_offsets: [0.0]\n", ArmCalibrationError, "joint_offsets of the left arm has 1 entries"),
        ("hand: left\naffine: [[2.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]\n",
         ArmCalibrationError, "affine of the left arm is 1 away from the identity"),
        ("hand: left\nspeed: 1.0\n", SettingsError, "speed: unknown key"),
    ],
)
def test_a_file_that_is_no_calibration_of_this_arm_is_refused_by_name(tmp_path, text, error, words):
    (tmp_path / "left.yaml").write_text(text)
    with pytest.raises(error, match=words) as caught:
        load_calibration(tmp_path, "left")
    assert "left.yaml" in str(caught.value)
