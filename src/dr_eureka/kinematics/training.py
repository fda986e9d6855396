"""Training of the arm network: the paper's architecture, on ten million streamed samples, with a loss that knows the hand.

The paper's loss is the mean squared joint error. A joint error hurts only as far as it moves the hand, so the squared
position and rotation errors of the hand, through differentiable forward kinematics, outweigh it here; what is left of it
picks the smallest of the joint steps that serve. Needs torch (Debian's python3-torch).
"""

from __future__ import annotations

import math
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch

from dr_eureka.checkpoint import load_checkpoint, save_checkpoint
from dr_eureka.kinematics.arms import arm_chain
from dr_eureka.kinematics.network import WEIGHTS, ArmNetwork
from dr_eureka.kinematics.sample_stream import DELTA, JOINTS, WANTED, SampleStream
from dr_eureka.kinematics.samples import Samples, SampleSettings, draw_samples, pose_errors
from dr_eureka.kinematics.torch_network import TorchChain, build_model, weights_of
from dr_eureka.resources import save_weights

CHECKPOINT = "checkpoint.npz"
LOG = "arm_network.csv"
_VALIDATION = 3000
_BAR = 30


@dataclass(frozen=True)
class TrainingPlan:
    """How the network is trained; see `train`.

    rounds: each draws `block` new samples, of which the latest blocks_kept are at hand, and steps through round_samples of
    those, `batch` at a time. peak_rate: of Adam, after a warm-up over so many rounds, along a cosine down to zero (the
    paper: 0.005 throughout). held_from: share of the rounds after which the batch norm keeps its statistics, as it does in
    use: those of a batch differ from them at random, which the network otherwise spends itself on. position_weight [1/m^2],
    rotation_weight [1/rad^2] of the hand's error and joint_weight [1/rad^2].

    batch: the paper took 16,384. For as many samples, batches of 1024 take sixteen times the steps and end nearer.
    """

    rounds: int = 320
    block: int = 31_250
    blocks_kept: int = 64
    round_samples: int = 180_000
    batch: int = 1024
    peak_rate: float = 0.003
    warm_up: float = 2.0
    held_from: float = 0.15
    position_weight: float = 1000.0
    rotation_weight: float = 8.0
    joint_weight: float = 0.3
    seed: int = 1

    def rate(self, rounds_done: float) -> float:
        """Return the learning rate after so many rounds."""
        warm_up = min(1.0, (rounds_done + 0.01) / self.warm_up)
        return self.peak_rate * warm_up * 0.5 * (1.0 + math.cos(math.pi * rounds_done / self.rounds))


def hand_loss(
    kinematics: TorchChain, plan: TrainingPlan, joints: torch.Tensor, predicted: torch.Tensor, wanted: torch.Tensor
) -> torch.Tensor:
    """Return the mean loss of predicted joint steps; wanted (n, 19): least-norm step, target's rotation and position."""
    rotation, position = kinematics(joints + predicted)
    joint_error = ((predicted - wanted[:, :7]) ** 2).sum(1)
    # half the squared Frobenius distance of two rotations is the squared angle between them, for small angles
    turn_error = 0.5 * ((rotation.reshape(-1, 9) - wanted[:, 7:16]) ** 2).sum(1)
    shift_error = ((position - wanted[:, 16:19]) ** 2).sum(1)
    return (plan.joint_weight * joint_error + plan.rotation_weight * turn_error + plan.position_weight * shift_error).mean()


def train(plan: TrainingPlan, folder: Path, sample_settings: SampleSettings = SampleSettings()) -> ArmNetwork:
    """Train on the left arm and return the network, going on from the checkpoint in the folder when there is one.

    Raises CheckpointError for one that cannot be read or was begun with another plan or other samples. After each round the
    folder gets the weights as they ship, checkpoint.npz, and a line in arm_network.csv. A round depends on plan and
    checkpoint only: a run that was broken off ends with the weights of one that was not.
    """
    folder.mkdir(parents=True, exist_ok=True)
    checkpoint, log = folder / CHECKPOINT, folder / LOG
    torch.set_num_threads(1)
    torch.manual_seed(plan.seed)
    chain = arm_chain("left")
    model, kinematics = build_model(), TorchChain(chain)
    optimiser = torch.optim.Adam(model.parameters(), lr=plan.peak_rate)
    held_out = draw_samples(chain, _VALIDATION, np.random.default_rng([plan.seed, 2**31]), sample_settings)
    stream = SampleStream(chain, sample_settings, plan.seed, plan.block, plan.blocks_kept)
    first_round, course = 0, asdict(plan) | asdict(sample_settings)
    if checkpoint.exists():
        first_round = load_checkpoint(checkpoint, {"model": model}, optimiser, course)
    else:
        log.write_text("round,samples_drawn,samples_seen,loss,hand_error_cm,seconds\n")
    network = ArmNetwork(weights_of(model, sample_settings.lower, sample_settings.upper))
    steps = max(1, plan.round_samples // plan.batch)
    for number in range(first_round, plan.rounds):
        started = time.monotonic()
        loss = _train_round(model, kinematics, optimiser, stream, plan, sample_settings, number, steps)
        weights = weights_of(model, sample_settings.lower, sample_settings.upper)
        network = ArmNetwork(weights)
        error_cm = 100.0 * validation_error(network, held_out)
        save_weights(WEIGHTS, weights, folder)
        save_checkpoint(checkpoint, {"model": model}, optimiser, number + 1, course)
        done, seconds = number + 1, time.monotonic() - started
        with log.open("a") as file:
            file.write(f"{done},{done * plan.block},{done * steps * plan.batch},{loss:.5f},{error_cm:.4f},{seconds:.0f}\n")
    return network


def validation_error(network: ArmNetwork, samples: Samples) -> float:
    """Return the mean position error [m] of the left hand after the network's steps."""
    poses = arm_chain("left").forward(samples.joints + network.step(samples.joints, samples.delta))
    return float(np.linalg.norm(pose_errors(poses, samples.target)[:, :3], axis=1).mean())


def _train_round(
    model: torch.nn.Sequential,
    kinematics: TorchChain,
    optimiser: torch.optim.Optimizer,
    stream: SampleStream,
    plan: TrainingPlan,
    sample_settings: SampleSettings,
    number: int,
    steps: int,
) -> float:
    """Step through the batches of a round and return their mean loss."""
    lower, upper = (torch.tensor(limits, dtype=torch.float32) for limits in (sample_settings.lower, sample_settings.upper))
    model.train(number < plan.held_from * plan.rounds)
    losses = []
    for step, rows in enumerate(stream.batches(number, plan.batch, steps)):
        for group in optimiser.param_groups:
            group["lr"] = plan.rate(number + step / steps)
        joints = rows[:, JOINTS]
        predicted = model(torch.cat([rows[:, DELTA], (joints - lower) / (upper - lower) - 0.5], 1))
        loss = hand_loss(kinematics, plan, joints, predicted, rows[:, WANTED])
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        optimiser.step()
        losses.append(loss.item())
        _show_progress(plan, number + (step + 1) / steps, losses)
    return float(np.mean(losses))


def _show_progress(plan: TrainingPlan, rounds_done: float, losses: list[float]) -> None:
    """Draw how much is done on stderr, where that is a terminal."""
    if sys.stderr.isatty():
        bar = "#" * int(_BAR * rounds_done / plan.rounds)
        sys.stderr.write(f"\rround {rounds_done:.2f}/{plan.rounds} [{bar:<{_BAR}}] loss {np.mean(losses[-50:]):.4f} ")
        sys.stderr.write("\n" if rounds_done >= plan.rounds else "")
        sys.stderr.flush()
