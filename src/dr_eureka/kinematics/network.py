"""The learned step: a neural network that turns a wanted hand motion into joint increments (paper section 3.4).

13 inputs (displacement, rotation vector, joints), four layers of 256 and three of 128 neurons, each dense, batch norm, ReLU,
then 7 joint increments. Inference is plain numpy on weights into which the batch norm has been folded.
"""

from __future__ import annotations

from typing import Mapping

import numpy as np

from dr_eureka.errors import DrEurekaError
from dr_eureka.kinematics.arms import mirror, mirror_delta
from dr_eureka.resources import load_weights

HIDDEN = (256, 256, 256, 256, 128, 128, 128)
INPUTS, OUTPUTS = 13, 7
WEIGHTS = "arm_network.npz"
BATCH_NORM_EPSILON = 1e-3


class ArmNetworkError(DrEurekaError):
    """Report weights that do not make up the network."""


class ArmNetwork:
    """Joint increments of the left arm for a step of its end link; the right arm is served through the mirror."""

    def __init__(self, weights: Mapping[str, np.ndarray]) -> None:
        """Fold the batch norm of `weights` (keys as `torch_network.weights_of` gives them) into the dense layers.

        Raises ArmNetworkError for a missing array or one of the wrong shape.
        """
        sizes = (INPUTS,) + HIDDEN + (OUTPUTS,)
        self.lower = _array(weights, "joint_lower", (OUTPUTS,))
        self.upper = _array(weights, "joint_upper", (OUTPUTS,))
        self._layers: list[tuple[np.ndarray, np.ndarray]] = []
        for index, (fan_in, fan_out) in enumerate(zip(sizes[:-1], sizes[1:])):
            dense = _array(weights, f"dense{index}_weight", (fan_out, fan_in))
            bias = _array(weights, f"dense{index}_bias", (fan_out,))
            if index < len(HIDDEN):
                gamma, beta, mean, variance = (
                    _array(weights, f"norm{index}_{part}", (fan_out,)) for part in ("gamma", "beta", "mean", "variance")
                )
                scale = gamma / np.sqrt(variance + BATCH_NORM_EPSILON)
                dense, bias = dense * scale[:, None], (bias - mean) * scale + beta
            self._layers.append((np.ascontiguousarray(dense, np.float32), bias.astype(np.float32)))

    @classmethod
    def load(cls, name: str = WEIGHTS) -> ArmNetwork:
        """Load the shipped weights, checked against their SHA-256; raises WeightsError or ArmNetworkError."""
        return cls(load_weights(name))

    def step(self, joints: np.ndarray, delta: np.ndarray, side: str = "left") -> np.ndarray:
        """Return joint increments (..., 7) [rad] that move the end link of an arm by `delta` (..., 6).

        joints: (..., 7) [rad]. delta: displacement [m] and rotation vector [rad], both in `base`. side: "left" or "right".
        """
        if side == "right":
            return mirror(self.step(mirror(joints), mirror_delta(np.asarray(delta))))
        values = np.concatenate([np.asarray(delta, dtype=float), self.normalise(joints)], axis=-1).astype(np.float32)
        for dense, bias in self._layers[:-1]:
            values = np.maximum(values @ dense.T + bias, 0.0)
        dense, bias = self._layers[-1]
        return (values @ dense.T + bias).astype(float)

    def normalise(self, joints: np.ndarray) -> np.ndarray:
        """Map joints (..., 7) [rad] so that the training limits become -0.5 and 0.5."""
        return (np.asarray(joints, dtype=float) - self.lower) / (self.upper - self.lower) - 0.5


def _array(weights: Mapping[str, np.ndarray], key: str, shape: tuple[int, ...]) -> np.ndarray:
    if key not in weights:
        raise ArmNetworkError(f"arm network weights have no '{key}', they have {', '.join(sorted(weights))}")
    if weights[key].shape != shape:
        raise ArmNetworkError(f"arm network weight '{key}' has shape {weights[key].shape}, expected {shape}")
    return np.asarray(weights[key], dtype=float)
