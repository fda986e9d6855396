"""The command `calibrate_arm`: hand-eye calibration of one arm of a running robot."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from datetime import date
from pathlib import Path
from typing import Optional, Protocol

import numpy as np

from dr_eureka.behaviour.arm_calibration import ArmCalibrationSettings, CalibrationRobot, HandShow
from dr_eureka.control.arm_calibration import ArmCalibrationError, save_calibration
from dr_eureka.control.hand_eye import HandEyeFit, calibrate
from dr_eureka.control.settings import ControlSettings
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.hands import HANDS
from dr_eureka.pieces import load_pieces
from dr_eureka.resources import load_yaml
from dr_eureka.vision.camera import CameraModel, load_camera
from dr_eureka.vision.tubes import TubeSettings

_CONTROL = "config/control_engine.yaml"


class RunningRobot(CalibrationRobot, Protocol):
    """A robot that also knows where its control engine looks for calibrations."""

    calibration_folder: Optional[str]

    def close(self) -> None:
        """Let go of the robot."""


def main(
    argv: Optional[Sequence[str]] = None, *, connect: Callable[[str, Optional[CameraModel], float], RunningRobot]
) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code, 1 when nothing was calibrated.

    `connect(camera, calibration, settle_seconds)` gives the running robot; it comes from the caller because only nodes touch
    ROS.
    """
    arguments = _parser().parse_args(argv)
    robot = None
    try:
        settings = ArmCalibrationSettings.load()
        control = ControlSettings.from_mapping(load_yaml(_CONTROL), _CONTROL)
        calibration = load_camera(arguments.calibration) if arguments.calibration else None
        robot = connect(arguments.camera, calibration, settings.settle_seconds)
        folder = arguments.out or robot.calibration_folder
        if folder is None:
            problem = "the control engine looks for no calibration; give its launch file arm_calibration:= or me --out"
            raise ArmCalibrationError(problem)
        show = HandShow(robot, arguments.hand, control, TubeSettings.load().sheet, load_pieces(), settings)
        looks = show.collect(lambda line: print(line, flush=True))
        fit = calibrate(arguments.hand, looks, settings.hand_eye)
        before, after = fit_as_words(fit)
        file = save_calibration(fit.calibration, Path(folder), str(date.today()), len(looks), before, after)
    except DrEurekaError as error:
        print(f"calibrate_arm: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("calibrate_arm: interrupted, nothing written", file=sys.stderr)
        return 130
    finally:
        if robot is not None:
            robot.close()
    print(f"{arguments.hand} hand, {len(looks)} reference points")
    print(f"before: {before}")
    print(f"after:  {after}, each point predicted from the others")
    print(f"{file}: written; the control engine reads it when it starts")
    return 0


def fit_as_words(fit: HandEyeFit) -> tuple[str, str]:
    """Return how far off the arm was and is, such as `8.2 mm and 1.50 deg (largest 9.1 mm)`."""
    return tuple(
        f"{1000 * place.mean():.2f} mm and {np.degrees(turn.mean()):.2f} deg (largest {1000 * place.max():.2f} mm)"
        for place, turn in ((fit.place_before, fit.turn_before), (fit.place_after, fit.turn_after))
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="calibrate_arm",
        description="Measure by the head camera where an arm's hand really gets, and write what the control engine must "
        "know to send it where it shall go. The robot and its control engine must be running (roslaunch dr_eureka "
        "calibrate_arm.launch); the sheet lies in front of the robot, the tubes are off it or on its far edge, and the "
        "hand's marker is glued on (config/pieces.yaml says where). The arm moves by itself: keep clear.",
    )
    parser.add_argument("hand", choices=HANDS, help="the arm to calibrate")
    parser.add_argument(
        "--out", metavar="FOLDER", help="folder for left.yaml or right.yaml (default: where the control engine looks for it)"
    )
    parser.add_argument(
        "--camera", metavar="NAMESPACE", default="camera", help="of the camera's topics (default: %(default)s)"
    )
    parser.add_argument(
        "--calibration", metavar="FILE", help="as calibrate_camera wrote it (default: the camera's own camera_info)"
    )
    return parser
