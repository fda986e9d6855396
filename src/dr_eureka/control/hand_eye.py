"""Hand-eye calibration of an arm: which places the hand shows to the camera, and what follows from where it was seen."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Sequence

import numpy as np

from dr_eureka.control.arm_calibration import ArmCalibration, ArmCalibrationError
from dr_eureka.control.grasp import level_hand
from dr_eureka.control.settings import PickSettings
from dr_eureka.kinematics.arm_fit import ArmFitSettings, fit_arm
from dr_eureka.kinematics.arms import arm_chain, mirror_transform
from dr_eureka.kinematics.transforms import rotation_vector, rpy_to_matrix, transform

FEWEST_POINTS = 5


@dataclass(frozen=True)
class HandEyeSettings:
    """Places that the hand shows, and how much they must tell; see config/calibrate_arm.yaml."""

    points: tuple[tuple[float, float, float, float, float, float], ...]
    smallest_spread: float = field(metadata={"min": 1e-4, "max": 1.0})
    fit: ArmFitSettings


@dataclass(frozen=True, eq=False)
class SeenHand:
    """One look at the hand: joints (7,) [rad] as reported, base_from_end (4, 4) as the camera saw it."""

    joints: np.ndarray
    base_from_end: np.ndarray


@dataclass(frozen=True, eq=False)
class HandEyeFit:
    """A calibration and what it is worth: errors of each look before and after, (k,) lengths [m] and turns [rad].

    `place_after` and `turn_after` are of looks that the calibration did not know: each is predicted from the others.
    """

    calibration: ArmCalibration
    place_before: np.ndarray
    turn_before: np.ndarray
    place_after: np.ndarray
    turn_after: np.ndarray


def reference_poses(hand: str, settings: HandEyeSettings, pick: PickSettings) -> list[np.ndarray]:
    """Return the poses base_from_end (4, 4) that a hand shows to the camera.

    Each point of the settings is where the left hand's grasp centre goes [m] and how it is turned there, roll, pitch and
    yaw [rad] about its own axes from the level approach of a pick; the right hand's poses are their mirror images.
    """
    poses = []
    for x, y, z, roll, pitch, yaw in settings.points:
        level = level_hand(np.array([x, y, z]), pick.approach_yaw, pick.centre_beyond_end)
        centre = transform(np.eye(3), np.array([pick.centre_beyond_end, 0.0, 0.0]))
        turned = level @ centre @ transform(rpy_to_matrix((roll, pitch, yaw))) @ np.linalg.inv(centre)
        poses.append(turned if hand == "left" else mirror_transform(turned))
    return poses


def check_spread(points: np.ndarray, smallest_spread: float) -> None:
    """Raise ArmCalibrationError unless points (k, 3) [m] span space well enough to fit an affine map of space.

    Refused: fewer than five, or points in a plane, on a line or in one place: their spread (standard deviation) in some
    direction is below `smallest_spread` [m], and the map in that direction would be made up. So was the authors' own,
    whose points lay on a table.
    """
    count = len(points)
    if count < FEWEST_POINTS:
        raise ArmCalibrationError(f"{count} reference points, expected at least {FEWEST_POINTS}")
    _, lengths, directions = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    spread, narrow = lengths[-1] / np.sqrt(count), directions[-1]
    if not spread >= smallest_spread:
        along = ", ".join(f"{value:.2f}" for value in narrow * np.sign(narrow[np.abs(narrow).argmax()]))
        raise ArmCalibrationError(
            f"{count} reference points do not span space: they spread {1000 * spread:.1f} mm along ({along}) of base, "
            f"expected at least {1000 * smallest_spread:.0f} mm"
        )


def fit_affine(wanted: np.ndarray, commanded: np.ndarray) -> np.ndarray:
    """Return the affine map (3, 4) that takes points (k, 3) [m] nearest to others (k, 3), least squares (paper 3.2)."""
    # About the centre, so that the constant and the linear part do not disturb one another.
    centre, commanded_centre = wanted.mean(axis=0), commanded.mean(axis=0)
    linear = np.linalg.lstsq(wanted - centre, commanded - commanded_centre, rcond=None)[0].T
    return np.column_stack([linear, commanded_centre - linear @ centre])


def fit_calibration(hand: str, looks: Sequence[SeenHand], settings: HandEyeSettings) -> ArmCalibration:
    """Return the calibration that explains looks at a hand best. Raises ArmCalibrationError as `check_spread`.

    First the joints and links, which explain how the hand is turned as well, then the paper's affine map for what they
    leave, such as a camera that does not sit where it is drawn.
    """
    joints, seen = _stacked(looks)
    check_spread(seen[:, :3, 3], settings.smallest_spread)
    offsets, stretches = fit_arm(arm_chain(hand), joints, seen, settings.fit)
    found = arm_chain(hand).adjusted(offsets, stretches).forward(joints)
    affine = fit_affine(seen[:, :3, 3], found[:, :3, 3])
    return ArmCalibration(hand, tuple(offsets.tolist()), tuple(stretches.tolist()), tuple(map(tuple, affine.tolist())))


def calibrate(hand: str, looks: Sequence[SeenHand], settings: HandEyeSettings) -> HandEyeFit:
    """Return the calibration of an arm and what it is worth. Raises ArmCalibrationError as `check_spread`."""
    calibration = fit_calibration(hand, looks, settings)
    joints, seen = _stacked(looks)
    before = errors(ArmCalibration(hand), joints, seen)
    after = np.empty_like(before)
    for index in range(len(looks)):
        others = [*looks[:index], *looks[index + 1 :]]
        one = slice(index, index + 1)
        after[index] = errors(fit_calibration(hand, others, settings), joints[one], seen[one])
    return HandEyeFit(calibration, *before.T, *after.T)


def errors(calibration: ArmCalibration, joints: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Return how far [m] and how much turned [rad] seen hands (k, 4, 4) are from where a calibration puts them: (k, 2)."""
    believed = np.array([calibration.reached(pose) for pose in calibration.chain().forward(joints)])
    places = np.linalg.norm(believed[:, :3, 3] - seen[:, :3, 3], axis=1)
    turns = [np.linalg.norm(rotation_vector(a.T @ b)) for a, b in zip(believed[:, :3, :3], seen[:, :3, :3])]
    return np.column_stack([places, turns])


def _stacked(looks: Sequence[SeenHand]) -> tuple[np.ndarray, np.ndarray]:
    """Return joints (k, 7) and poses (k, 4, 4) of looks; raise ArmCalibrationError for too few."""
    if len(looks) < FEWEST_POINTS:
        raise ArmCalibrationError(f"{len(looks)} reference points, expected at least {FEWEST_POINTS}")
    return np.array([look.joints for look in looks]), np.array([look.base_from_end for look in looks])
