"""The command calibrate_arm: what it prints, and that it ends in one line when the robot does not play along."""

import numpy as np
import pytest

from dr_eureka.behaviour.arm_calibration import View
from dr_eureka.cli.calibrate_arm import fit_as_words, main
from dr_eureka.control.arm_calibration import ArmCalibration, ArmCalibrationError
from dr_eureka.control.hand_eye import HandEyeFit
from dr_eureka.kinematics.arms import base_from_camera
from dr_eureka.vision.camera import CameraModel, save_camera


class BlindRobot:
    """A robot that goes where it is sent, and whose camera shows a grey wall."""

    def __init__(self, folder=None):
        self.calibration_folder = folder
        self.joints = {"torso_y": 0.0}
        self.closed = False

    def move(self, goals):
        self.joints |= goals

    def look(self):
        grey = np.full((480, 640, 3), 128, np.uint8)
        return View(grey, CameraModel.lab(), base_from_camera(self.joints), dict(self.joints))

    def close(self):
        self.closed = True


def test_a_sheet_that_is_not_seen_ends_the_command_in_one_line_and_writes_nothing(tmp_path, capsys):
    robot = BlindRobot()
    assert main(["left", "--out", str(tmp_path)], connect=lambda camera, calibration, settle: robot) == 1
    said = capsys.readouterr().err
    assert said.startswith("calibrate_arm: the sheet must be in view, as for a game: markers [] of [0, 1, 2, 3] seen")
    assert said.count("\n") == 1
    assert robot.closed and list(tmp_path.iterdir()) == []


def test_a_control_engine_that_looks_for_no_calibration_is_named(capsys):
    assert main(["right"], connect=lambda camera, calibration, settle: BlindRobot()) == 1
    assert "the control engine looks for no calibration" in capsys.readouterr().err


def test_a_robot_that_cannot_be_reached_ends_the_command_in_one_line(capsys):
    def connect(camera, calibration, settle_seconds):
        raise ArmCalibrationError("no robot")

    assert main(["left"], connect=connect) == 1
    assert capsys.readouterr().err == "calibrate_arm: no robot\n"


def test_the_robot_sees_by_the_calibration_that_it_is_given(tmp_path, capsys):
    given = []

    def connect(camera, calibration, settle_seconds):
        given.append(calibration)
        raise ArmCalibrationError("seen enough")

    save_camera(CameraModel.lab(distorted=True), tmp_path / "camera.yaml")
    assert main(["left", "--calibration", str(tmp_path / "camera.yaml")], connect=connect) == 1
    np.testing.assert_array_equal(given[0].distortion, CameraModel.lab(distorted=True).distortion)
    assert main(["left", "--calibration", str(tmp_path / "none.yaml")], connect=connect) == 1
    assert len(given) == 1 and "none.yaml" in capsys.readouterr().err.splitlines()[-1]


def test_an_arm_that_there_is_not_is_refused(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["middle"], connect=lambda camera, calibration, settle: BlindRobot())
    assert ended.value.code == 2
    assert "choose from 'left', 'right'" in capsys.readouterr().err


def test_errors_are_told_in_millimetres_and_degrees():
    places, turns = np.array([[0.008, 0.010], [0.0002, 0.0004]]), np.radians([[1.0, 2.0], [0.1, 0.1]])
    fit = HandEyeFit(ArmCalibration("left"), places[0], turns[0], places[1], turns[1])
    assert fit_as_words(fit) == ("9.00 mm and 1.50 deg (largest 10.00 mm)", "0.30 mm and 0.10 deg (largest 0.40 mm)")
