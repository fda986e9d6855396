"""Training of the arm's network by direct-inverse modelling (paper 5.1, Figure 6): from hand positions to joints.

Two ways to learn the same 162 samples. The paper's is error back-propagation, 100,000 cycles on the squared error of the
normalised outputs. Ours is Levenberg-Marquardt on how far each joint's error moves the hand: hundreds of cycles, and an
order of magnitude nearer. The shipped weights are of the second kind.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from dr_eureka.catching.arm_network import HIDDEN, INPUTS, OUTPUTS, normalised, sigmoid, trained_for
from dr_eureka.catching.saika import SaikaArm
from dr_eureka.catching.unique_postures import PostureChooser
from dr_eureka.catching.working_area import WorkingArea
from dr_eureka.errors import DrEurekaError

SAMPLES = 162
CYCLES = 100_000  # the paper's
# Outputs of a sigmoid come near 0 and 1 only far out: the samples' joints take the middle of its range.
_MARGIN = 0.1
# How much a joint's error counts that leaves the hand where it is [m/rad]: enough to keep the posture the samples have.
_POSTURE_WEIGHT_M = 0.05
_WEIGHT_DECAY_M = 1e-6
_PARAMETERS = HIDDEN * INPUTS + HIDDEN + OUTPUTS * HIDDEN + OUTPUTS


class SaikaTrainingError(DrEurekaError):
    """Report samples from which nothing can be learnt."""


@dataclass(frozen=True, eq=False)
class ArmSamples:
    """Where the hand is (n, 3) [m] in base, and the joints a, b, c, d (n, 4) [rad] that put it there."""

    positions: np.ndarray
    joints: np.ndarray


@dataclass(frozen=True, eq=False)
class LearntNetwork:
    """Weights as `SaikaNetwork` takes them, and the learning curve: cycles (k,) and summed squared output errors (k,)."""

    weights: dict[str, np.ndarray]
    cycles: np.ndarray
    total_error: np.ndarray


def draw_samples(arm: SaikaArm, area: WorkingArea, rng: np.random.Generator, count: int = SAMPLES) -> ArmSamples:
    """Return samples spread over the area, with unique postures; their hand positions are those of forward kinematics.

    Raises SaikaTrainingError when the area has places that no allowed posture reaches.
    """
    joints = PostureChooser(arm).joints(area.spread(count, rng))
    if np.isnan(joints).any():
        missed = np.isnan(joints[:, 0]).sum()
        raise SaikaTrainingError(f"{missed} of {count} places cannot be reached; expected a smaller working_area")
    return ArmSamples(arm.basket_centre(joints), joints)


def learn(
    arm: SaikaArm, area: WorkingArea, samples: ArmSamples, rng: np.random.Generator, cycles: int = 300
) -> LearntNetwork:
    """Learn samples by Levenberg-Marquardt (scipy's trust-region variant) on the hand's error."""
    problem = _Problem(arm, area, samples)
    effect = problem.effect_on_hand(arm, samples)
    history: list[float] = []

    def residuals(parameters: np.ndarray) -> np.ndarray:
        errors = problem.errors(parameters)
        history.append(float(np.sum(errors**2)))
        return np.concatenate([np.einsum("nij,nj->ni", effect, errors).ravel(), _WEIGHT_DECAY_M * parameters])

    def slopes(parameters: np.ndarray) -> np.ndarray:
        by_output = np.einsum("nij,njk->nik", effect, problem.slopes(parameters))
        return np.concatenate([by_output.reshape(-1, _PARAMETERS), _WEIGHT_DECAY_M * np.eye(_PARAMETERS)])

    found = least_squares(residuals, _first_parameters(rng), slopes, max_nfev=cycles, xtol=1e-12, ftol=1e-12, gtol=1e-12)
    best_so_far = np.minimum.accumulate(history)
    return LearntNetwork(problem.weights(found.x, arm, area), np.arange(1, len(history) + 1), best_so_far)


def learn_by_back_propagation(
    arm: SaikaArm, area: WorkingArea, samples: ArmSamples, rng: np.random.Generator, cycles: int = CYCLES
) -> LearntNetwork:
    """Learn samples as the paper does, on the squared error of the normalised outputs, all samples a cycle.

    The paper does not say how it chose its rate; ours grows while the error falls and shrinks when it rises, with momentum.
    """
    problem = _Problem(arm, area, samples)
    parameters, step = _first_parameters(rng), np.zeros(_PARAMETERS)
    rate, momentum = 0.01, 0.9
    error, gradient = problem.error_and_gradient(parameters)
    kept_cycles, kept_errors = [0], [error]
    for cycle in range(1, cycles + 1):
        step = momentum * step - rate * gradient
        new_error, new_gradient = problem.error_and_gradient(parameters + step)
        if new_error > 1.02 * error:
            rate, step = 0.5 * rate, np.zeros(_PARAMETERS)
        else:
            rate *= 1.02 if new_error < error else 1.0
            parameters, error, gradient = parameters + step, new_error, new_gradient
        if cycle >= 1.05 * kept_cycles[-1] or cycle == cycles:
            kept_cycles.append(cycle)
            kept_errors.append(error)
    return LearntNetwork(problem.weights(parameters, arm, area), np.array(kept_cycles), np.array(kept_errors))


class _Problem:
    """The network's outputs, their errors against samples, and how both change with the parameters, one flat array."""

    def __init__(self, arm: SaikaArm, area: WorkingArea, samples: ArmSamples) -> None:
        self._inputs = normalised(samples.positions, area)
        least, most = samples.joints.min(axis=0), samples.joints.max(axis=0)
        self.scale = (most - least) / (1.0 - 2.0 * _MARGIN)
        self.offset = least - _MARGIN * self.scale
        self._wanted = (samples.joints - self.offset) / self.scale

    def effect_on_hand(self, arm: SaikaArm, samples: ArmSamples) -> np.ndarray:
        """Return (n, 7, 4) [m]: what an error of each normalised output does to the hand, and four rows for the posture."""
        flat = np.concatenate([samples.joints, np.zeros((len(samples.joints), 1))], axis=1)
        hand = arm.chain.jacobian(flat)[:, :3, :4]
        posture = np.broadcast_to(_POSTURE_WEIGHT_M * np.eye(OUTPUTS), (len(hand), OUTPUTS, OUTPUTS))
        return np.concatenate([hand, posture], axis=1) * self.scale

    def errors(self, parameters: np.ndarray) -> np.ndarray:
        """Return the errors (n, 4) of the normalised outputs."""
        return self._forward(parameters)[1] - self._wanted

    def slopes(self, parameters: np.ndarray) -> np.ndarray:
        """Return how the normalised outputs change with the parameters, (n, 4, parameters)."""
        hidden, output = self._forward(parameters)
        _, _, output_weight, _ = _parts(parameters)
        by_sum = output * (1.0 - output)
        by_hidden = by_sum[:, :, None] * output_weight * (hidden * (1.0 - hidden))[:, None, :]
        count, unit = len(hidden), np.eye(OUTPUTS)
        return np.concatenate(
            [
                (by_hidden[..., None] * self._inputs[:, None, None, :]).reshape(count, OUTPUTS, -1),
                by_hidden,
                np.einsum("no,ok,nh->nokh", by_sum, unit, hidden).reshape(count, OUTPUTS, -1),
                by_sum[:, :, None] * unit,
            ],
            axis=2,
        )

    def error_and_gradient(self, parameters: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the summed squared error of the normalised outputs and its gradient (back-propagation)."""
        hidden, output = self._forward(parameters)
        _, _, output_weight, _ = _parts(parameters)
        errors = output - self._wanted
        at_output = 2.0 * errors * output * (1.0 - output)
        at_hidden = (at_output @ output_weight) * hidden * (1.0 - hidden)
        gradient = (at_hidden.T @ self._inputs, at_hidden.sum(axis=0), at_output.T @ hidden, at_output.sum(axis=0))
        return float(np.sum(errors**2)), np.concatenate([part.ravel() for part in gradient])

    def _forward(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        hidden_weight, hidden_bias, output_weight, output_bias = _parts(parameters)
        hidden = sigmoid(self._inputs @ hidden_weight.T + hidden_bias)
        return hidden, sigmoid(hidden @ output_weight.T + output_bias)

    def weights(self, parameters: np.ndarray, arm: SaikaArm, area: WorkingArea) -> dict[str, np.ndarray]:
        """Return the arrays that `SaikaNetwork` takes."""
        names = ("hidden_weight", "hidden_bias", "output_weight", "output_bias")
        return {
            **dict(zip(names, _parts(parameters))), "joint_offset": self.offset, "joint_scale": self.scale,
            "trained_for": trained_for(arm, area),
        }


def _parts(parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return hidden weights, hidden biases, output weights and output biases of the flat array."""
    first, second = HIDDEN * INPUTS, HIDDEN * INPUTS + HIDDEN
    third = second + OUTPUTS * HIDDEN
    return (
        parameters[:first].reshape(HIDDEN, INPUTS), parameters[first:second],
        parameters[second:third].reshape(OUTPUTS, HIDDEN), parameters[third:],
    )


def _first_parameters(rng: np.random.Generator) -> np.ndarray:
    """Return random first weights; the output biases put the first outputs to the middle of the sigmoid."""
    hidden_weight, hidden_bias = rng.normal(0.0, 1.0, HIDDEN * INPUTS), rng.uniform(-1.5, 1.5, HIDDEN)
    output_weight = rng.normal(0.0, 0.3, (OUTPUTS, HIDDEN))
    return np.concatenate([hidden_weight, hidden_bias, output_weight.ravel(), -0.5 * output_weight.sum(axis=1)])
