"""What is known of one arm beyond its drawing, and the file that keeps it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dr_eureka.errors import DrEurekaError
from dr_eureka.kinematics.arms import ARM_JOINTS, SIDES, arm_chain
from dr_eureka.kinematics.chain import Chain
from dr_eureka.resources import load_yaml
from dr_eureka.settings import build

_IDENTITY = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))
# An affine map that shrinks, mirrors or shears space is no calibration of an arm.
_LARGEST_CHANGE = 0.2
_HEADER = """# Hand-eye calibration of the {hand} arm, written by calibrate_arm on {day}:
# {points} places of the hand seen by the camera.
# Off by {before} as drawn, by {after} with this file
# (mean, each place predicted from the others). The control engine reads it when it starts.
"""
_LINES = """hand: {hand}
# [rad] {order}: a joint that reports q stands at q + offset
joint_offsets: {offsets}
# [m] how much farther each joint sits from the one before it than drawn
link_stretches: {stretches}
# Row by row: point of base where the end link is wanted (x, y, z, 1) [m] -> point to command so that it really gets there
affine:
{affine}
"""


class ArmCalibrationError(DrEurekaError):
    """A calibration that cannot be used, read or written."""


@dataclass(frozen=True)
class ArmCalibration:
    """One arm's calibration: how its joints and links differ from the drawing, and the paper's affine map for the rest.

    `joint_offsets` (7) [rad] and `link_stretches` (7) [m] as in `Chain.adjusted`; they also set right how the hand is
    turned, which no map of points can. `affine` (3, 4): wanted point of the end link in base -> point to command.
    Source: paper 3.2.
    """

    hand: str = field(metadata={"choices": SIDES})
    joint_offsets: tuple[float, ...] = field(default=(0.0,) * 7, metadata={"min": -0.2, "max": 0.2})
    link_stretches: tuple[float, ...] = field(default=(0.0,) * 7, metadata={"min": -0.05, "max": 0.05})
    affine: tuple[tuple[float, float, float, float], ...] = _IDENTITY

    def __post_init__(self) -> None:
        for name, values, count in (
            ("joint_offsets", self.joint_offsets, 7), ("link_stretches", self.link_stretches, 7), ("affine", self.affine, 3)
        ):
            if len(values) != count:
                raise ArmCalibrationError(f"{name} of the {self.hand} arm has {len(values)} entries, expected {count}")
        change = np.abs(np.array(self.affine)[:, :3] - np.eye(3)).max()
        if not change <= _LARGEST_CHANGE:
            raise ArmCalibrationError(
                f"affine of the {self.hand} arm is {change:.3g} away from the identity, expected at most {_LARGEST_CHANGE}"
            )

    def chain(self) -> Chain:
        """Return the arm's chain as calibrated, from base to the end link, taking joint angles as the robot reports them."""
        return arm_chain(self.hand).adjusted(np.array(self.joint_offsets), np.array(self.link_stretches))

    def commanded(self, wanted: np.ndarray) -> np.ndarray:
        """Return base_from_end (4, 4) to command so that the hand gets to `wanted` (4, 4); the chain sees to its turn."""
        affine = np.array(self.affine)
        pose = np.array(wanted, dtype=float)
        pose[:3, 3] = affine[:, :3] @ pose[:3, 3] + affine[:, 3]
        return pose

    def reached(self, commanded: np.ndarray) -> np.ndarray:
        """Return where the hand is, base_from_end (4, 4), when the chain says `commanded` (4, 4); undoes `commanded`."""
        affine = np.array(self.affine)
        pose = np.array(commanded, dtype=float)
        pose[:3, 3] = np.linalg.solve(affine[:, :3], pose[:3, 3] - affine[:, 3])
        return pose


def calibration_file(folder: Path, hand: str) -> Path:
    """Name the file that holds one arm's calibration."""
    return folder / f"{hand}.yaml"


def load_calibration(folder: Path, hand: str) -> ArmCalibration:
    """Load one arm's calibration, the identity when there is no file.

    Raises:
        ResourceError, SettingsError, ArmCalibrationError: the file is no calibration, or another arm's.
    """
    file = calibration_file(folder, hand)
    if not file.exists():
        return ArmCalibration(hand)
    try:
        calibration = build(ArmCalibration, load_yaml(file.absolute()), str(file))
    except ArmCalibrationError as error:
        raise ArmCalibrationError(f"{file}: {error}") from error
    if calibration.hand != hand:
        raise ArmCalibrationError(f"{file}: is of the {calibration.hand} arm, expected the {hand} arm's")
    return calibration


def save_calibration(
    calibration: ArmCalibration, folder: Path, day: str, points: int, before: str, after: str
) -> Path:
    """Write one arm's calibration as commented yaml, the folder made when missing, and return the file.

    `before` and `after` say in words how far off the arm was and is. Raises ArmCalibrationError.
    """
    file = calibration_file(folder, calibration.hand)
    text = _HEADER.format(hand=calibration.hand, day=day, points=points, before=before, after=after) + _LINES.format(
        hand=calibration.hand,
        order=" ".join(ARM_JOINTS),
        offsets=_numbers(calibration.joint_offsets),
        stretches=_numbers(calibration.link_stretches),
        affine="\n".join(f"- {_numbers(row)}" for row in calibration.affine),
    )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ArmCalibrationError(f"{file}: cannot be written: {error.strerror}; expected a folder to write to") from error
    return file


def _numbers(values: tuple[float, ...]) -> str:
    return "[" + ", ".join(f"{value:.6f}" for value in values) + "]"
