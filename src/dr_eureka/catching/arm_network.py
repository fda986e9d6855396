"""Inverse kinematics of the left arm by the paper's network: 3 inputs, 25 hidden and 4 output neurons, all sigmoid (5.1)."""

from __future__ import annotations

from typing import Mapping

import numpy as np

from dr_eureka.catching.saika import SaikaArm
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.catching.working_area import WorkingArea
from dr_eureka.errors import DrEurekaError
from dr_eureka.resources import load_weights

INPUTS, HIDDEN, OUTPUTS = 3, 25, 4
WEIGHTS = "saika_network.npz"
OUT_OF_REACH = "OUT_OF_REACH"
SHAPES = {
    "hidden_weight": (HIDDEN, INPUTS), "hidden_bias": (HIDDEN,),
    "output_weight": (OUTPUTS, HIDDEN), "output_bias": (OUTPUTS,),
    "joint_offset": (OUTPUTS,), "joint_scale": (OUTPUTS,), "trained_for": (11,),
}


class SaikaNetworkError(DrEurekaError):
    """Report weights that do not make up the network, or that belong to another arm."""


class OutOfReachError(DrEurekaError):
    """Report a place where the hand cannot be put, or was never trained to be; `reason` is OUT_OF_REACH."""

    reason = OUT_OF_REACH


class SaikaNetwork:
    """Joints of the left arm that put its hand to a place in the working area."""

    def __init__(self, weights: Mapping[str, np.ndarray], settings: SaikaSettings) -> None:
        """Take the arrays of SHAPES. Raises SaikaNetworkError for a missing or misshapen one, or another arm or area."""
        for key, shape in SHAPES.items():
            found = np.shape(weights[key]) if key in weights else None
            if found != shape:
                raise SaikaNetworkError(f"Saika's network: {key} has shape {found}, expected {shape}")
        self._arm = SaikaArm(settings)
        self.area = WorkingArea(settings.working_area, self._arm)
        if not np.allclose(weights["trained_for"], trained_for(self._arm, self.area), atol=1e-9):
            raise SaikaNetworkError("Saika's network: trained for another arm or area; run train_saika_network")
        self._weights = {key: np.asarray(weights[key], dtype=float) for key in SHAPES}

    @classmethod
    def load(cls, settings: SaikaSettings | None = None) -> SaikaNetwork:
        """Load the shipped weights, checked against their SHA-256; raises WeightsError or SaikaNetworkError."""
        return cls(load_weights(WEIGHTS), settings or SaikaSettings.load())

    def four_joints(self, positions: np.ndarray) -> np.ndarray:
        """Return a, b, c, d (..., 4) [rad] for places of the hand (..., 3) [m] in base, in the working area or not."""
        weights = self._weights
        hidden = sigmoid(normalised(positions, self.area) @ weights["hidden_weight"].T + weights["hidden_bias"])
        output = sigmoid(hidden @ weights["output_weight"].T + weights["output_bias"])
        return weights["joint_offset"] + weights["joint_scale"] * output

    def joints(self, position: np.ndarray) -> np.ndarray:
        """Return a, b, c, d, e (5,) [rad] that put the hand to a place (3,) [m] in base, within the joints' limits.

        Raises OutOfReachError for a place outside the working area, or one that is not finite.
        """
        position = np.asarray(position, dtype=float)
        if not self.area.contains(position):
            box = ", ".join(f"{low:g}..{high:g}" for low, high in zip(self.area.lower, self.area.upper))
            raise OutOfReachError(
                f"{OUT_OF_REACH}: hand at {np.round(position, 3).tolist()} m; expected x, y, z in {box}, "
                f"at most {self.area.most_reach_m:g} m from the shoulder"
            )
        return self._arm.with_posture(np.clip(self.four_joints(position), self._arm.lower[:4], self._arm.upper[:4]))


def trained_for(arm: SaikaArm, area: WorkingArea) -> np.ndarray:
    """Return what weights depend on: the arm's lengths, its shoulder's x, y, z, and the working area, (11,) [m]."""
    return np.array([arm.upper_arm_m, arm.elbow_to_hand_m, *area.shoulder[:2], *area.lower, *area.upper, area.most_reach_m])


def normalised(positions: np.ndarray, area: WorkingArea) -> np.ndarray:
    """Return positions (..., 3) [m] scaled so that the area's box becomes -1..1."""
    return 2.0 * (np.asarray(positions, dtype=float) - area.lower) / (area.upper - area.lower) - 1.0


def sigmoid(values: np.ndarray) -> np.ndarray:
    """Return 1 / (1 + exp(-values)), without overflow."""
    return 0.5 * (1.0 + np.tanh(0.5 * values))
