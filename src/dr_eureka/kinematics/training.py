"""Training of the arm network: the paper's architecture, on fresh samples, with a loss that knows where the hand ends up.

The paper's loss is the mean squared joint error. A joint error hurts only as far as it moves the hand, so the squared position
and rotation errors of the hand, through differentiable forward kinematics, are added. Needs torch (Debian's python3-torch).

The shipped weights took 20,000 steps, the first 7,000 of them under the learning-rate schedule of a run of 32,000 that was cut
short; so a run from scratch does not repeat them digit by digit.
"""

from __future__ import annotations

import logging
import math
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import nn

from dr_eureka.kinematics.arms import arm_chain
from dr_eureka.kinematics.chain import Chain
from dr_eureka.kinematics.network import ArmNetwork
from dr_eureka.kinematics.samples import Samples, SampleSettings, draw_samples, pose_errors
from dr_eureka.kinematics.torch_network import TorchChain, build_model, weights_of
from dr_eureka.resources import save_weights

_LOG = logging.getLogger(__name__)
_JOINTS, _DELTA, _WANTED = slice(0, 7), slice(7, 13), slice(13, 32)  # columns of a row of the pool


@dataclass(frozen=True)
class TrainingSettings:
    """How the network is trained; see `train`.

    steps of `batch` samples each; pool: samples kept at hand, of which `refresh` are replaced by new ones every `round_steps`
    steps. learning_rate falls along a cosine to zero (the paper: 0.005 and batches of 16,384 throughout). position_weight [1/m^2]
    and rotation_weight [1/rad^2] of the hand's error beside the squared joint error [rad^2].
    """

    steps: int = 20000
    batch: int = 1024
    pool: int = 2_000_000
    first_pool: int = 300_000
    refresh: int = 50_000
    round_steps: int = 250
    learning_rate: float = 0.003
    warm_up: int = 500
    position_weight: float = 200.0
    rotation_weight: float = 8.0
    seed: int = 1


def hand_loss(
    kinematics: TorchChain, settings: TrainingSettings, joints: torch.Tensor, predicted: torch.Tensor, wanted: torch.Tensor
) -> torch.Tensor:
    """Return the mean loss of predicted joint steps; wanted (n, 19): least-norm step, then rotation and position of the target."""
    rotation, position = kinematics(joints + predicted)
    joint_error = ((predicted - wanted[:, :7]) ** 2).sum(1)
    # half the squared Frobenius distance of two rotations is the squared angle between them, for small angles
    turn_error = 0.5 * ((rotation.reshape(-1, 9) - wanted[:, 7:16]) ** 2).sum(1)
    shift_error = ((position - wanted[:, 16:19]) ** 2).sum(1)
    return (joint_error + settings.rotation_weight * turn_error + settings.position_weight * shift_error).mean()


def train(
    out: Path,
    checkpoint: Path,
    settings: TrainingSettings = TrainingSettings(),
    sample_settings: SampleSettings = SampleSettings(),
) -> None:
    """Train on the left arm and write the weights to `out`; resumes from `checkpoint` when that file exists.

    Progress goes to the log once a round. The samples of round r come from a generator seeded with (seed, r), so a resumed run
    sees the samples of an unbroken one (in another order, as the pool is drawn anew).
    """
    chain = arm_chain("left")
    torch.manual_seed(settings.seed)
    model, kinematics = build_model(), TorchChain(chain)
    optimiser = torch.optim.Adam(model.parameters(), lr=settings.learning_rate)
    first_step = _resume(checkpoint, model, optimiser)
    pool = _Pool(chain, settings, sample_settings)
    lower, upper = (torch.tensor(limits, dtype=torch.float32) for limits in (sample_settings.lower, sample_settings.upper))
    started, losses = time.monotonic(), []
    model.train()
    for step in range(first_step, settings.steps):
        if step == first_step or step % settings.round_steps == 0:
            pool.refresh(step // settings.round_steps)
        for group in optimiser.param_groups:
            group["lr"] = _learning_rate(step, settings)
        rows = pool.batch()
        joints = rows[:, _JOINTS]
        predicted = model(torch.cat([rows[:, _DELTA], (joints - lower) / (upper - lower) - 0.5], 1))
        loss = hand_loss(kinematics, settings, joints, predicted, rows[:, _WANTED])
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        optimiser.step()
        losses.append(loss.item())
        if (step + 1) % settings.round_steps == 0 or step + 1 == settings.steps:
            torch.save({"step": step + 1, "model": model.state_dict(), "optimiser": optimiser.state_dict()}, checkpoint)
            error = pool.validation_error(ArmNetwork(weights_of(model, sample_settings.lower, sample_settings.upper)))
            seconds = (time.monotonic() - started) / (step + 1 - first_step)
            _LOG.info(
                "step %d/%d  loss %.5f  hand error %.2f cm  %.0f ms/step  %.0f s to go",
                step + 1, settings.steps, np.mean(losses), 100.0 * error, 1000.0 * seconds, seconds * (settings.steps - step - 1),
            )
            losses.clear()
    save_weights(out.name, weights_of(model, sample_settings.lower, sample_settings.upper), out.parent)


class _Pool:
    """Samples at hand as rows of float32; old ones are overwritten by new ones round by round."""

    def __init__(self, chain: Chain, settings: TrainingSettings, sample_settings: SampleSettings) -> None:
        self._chain, self._settings, self._sample_settings = chain, settings, sample_settings
        self._rows = torch.empty((settings.pool, 32))
        self._filled = self._next = 0
        self._order = torch.Generator().manual_seed(settings.seed)
        self._validation = draw_samples(chain, 3000, np.random.default_rng([settings.seed, 2**31]), sample_settings)

    def refresh(self, round_number: int) -> None:
        """Add the new samples of a round."""
        count = self._settings.refresh if self._filled else self._settings.first_pool
        samples = draw_samples(self._chain, count, np.random.default_rng([self._settings.seed, round_number]), self._sample_settings)
        places = (self._next + np.arange(count)) % self._settings.pool
        self._rows[torch.from_numpy(places)] = torch.from_numpy(_rows(samples))
        self._next = int(places[-1] + 1) % self._settings.pool
        self._filled = min(self._filled + count, self._settings.pool)

    def batch(self) -> torch.Tensor:
        return self._rows[torch.randint(self._filled, (self._settings.batch,), generator=self._order)]

    def validation_error(self, network: ArmNetwork) -> float:
        """Return the mean position error [m] of the network on samples it has never seen."""
        samples = self._validation
        poses = self._chain.forward(samples.joints + network.step(samples.joints, samples.delta))
        return float(np.linalg.norm(pose_errors(poses, samples.target)[:, :3], axis=1).mean())


def _rows(samples: Samples) -> np.ndarray:
    rotation = samples.target[:, :3, :3].reshape(-1, 9)
    return np.hstack([samples.joints, samples.delta, samples.change, rotation, samples.target[:, :3, 3]]).astype(np.float32)


def _learning_rate(step: int, settings: TrainingSettings) -> float:
    warm_up = min(1.0, (step + 1) / settings.warm_up)
    return settings.learning_rate * warm_up * 0.5 * (1.0 + math.cos(math.pi * step / settings.steps))


def _resume(checkpoint: Path, model: nn.Module, optimiser: torch.optim.Optimizer) -> int:
    """Load a checkpoint if there is one; return the step to go on from."""
    if not checkpoint.exists():
        return 0
    state = torch.load(checkpoint)
    model.load_state_dict(state["model"])
    optimiser.load_state_dict(state["optimiser"])
    _LOG.info("resuming from %s at step %d", checkpoint, state["step"])
    return int(state["step"])
