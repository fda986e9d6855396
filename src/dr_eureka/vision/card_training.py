"""Training of YOLO-Dr. Eureka and of its baseline YOLOv2-tiny on drawn cards (paper sections 3.1 and 4.1).

Epochs are seeded by their number, so a run that was broken off and resumed sees the same crops as one that was not, and
both networks see the same.
"""

from __future__ import annotations

import copy
import math
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import numpy as np
import torch

from dr_eureka.checkpoint import load_checkpoint, save_checkpoint
from dr_eureka.game.state import COLOURS
from dr_eureka.vision.card_architecture import CardDetector, build_network, to_arrays
from dr_eureka.vision.card_detections import collect
from dr_eureka.vision.card_metrics import mean_average_precision
from dr_eureka.vision.card_network import decode
from dr_eureka.vision.card_stream import CardStream
from dr_eureka.vision.card_targets import detection_loss, encode
from dr_eureka.vision.card_weights import log_name, save_detector

CHECKPOINT = "checkpoint.npz"


@dataclass(frozen=True)
class TrainingPlan:
    """How long and on what to train."""

    epochs: int
    peak_rate: float
    model: str = "eureka"
    samples_per_epoch: int = 2500
    batch: int = 8
    seed: int = 1
    pool: int = 250
    validation_samples: int = 240
    averaging: float = 0.99  # of the weights kept for use, per step
    bfloat16: bool = False

    def rate(self, epoch: float) -> float:
        """Return the learning rate after so many epochs: a short warm-up, then half a cosine down to nearly nothing."""
        done, warm_up = epoch / self.epochs, 0.03
        if done < warm_up:
            return self.peak_rate * done / warm_up
        return self.peak_rate * (0.5 * (1 + math.cos(math.pi * (done - warm_up) / (1 - warm_up))) + 1e-3)


PLANS = {
    "eureka": TrainingPlan(epochs=20, peak_rate=3e-3),
    "tiny": TrainingPlan(epochs=8, peak_rate=1e-3, model="tiny"),
}


def _to_batch(crops: list[np.ndarray]) -> torch.Tensor:
    images = torch.from_numpy(np.stack(crops)).permute(0, 3, 1, 2)  # stays channels-last: twice as fast on a CPU
    return images.float().div_(255.0)


def validate(network: CardDetector, samples: list[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> tuple[float, float]:
    """Return mAP@0.5 and the share of crops with exactly the right balls and feet, over the given samples."""
    network.eval()
    seen, exact = [], 0
    for crop, balls, feet in samples:
        with torch.no_grad():
            grid = decode(network(_to_batch([crop])))
        arrays = [a[0].numpy() for a in (grid.balls, grid.diameters, grid.class_scores, grid.feet)]
        seen.append(collect(*arrays, threshold=0.05).balls)
        sure = collect(*arrays, threshold=0.5)
        exact += _same([(b.x, b.y, COLOURS.index(b.colour)) for b in sure.balls], balls[:, (0, 1, 3)]) and _same(
            [(f.x, f.y, 0) for f in sure.feet], np.column_stack((feet, np.zeros(len(feet)))))
    return mean_average_precision(seen, [balls for _, balls, _ in samples]), exact / len(samples)


def _same(found: list[tuple[float, float, int]], wanted: np.ndarray) -> bool:
    """Tell whether each wanted (x, y, class) has a found one within 0.04 of the crop, and none is left over."""
    if len(found) != len(wanted):
        return False
    return all(any(c == k and np.hypot(x - u, y - v) < 0.04 for u, v, c in found) for x, y, k in wanted)


def train(plan: TrainingPlan, folder: Path) -> CardDetector:
    """Train and return the averaged network, going on from the checkpoint in the folder when there is one.

    Raises CheckpointError for one that cannot be read or was begun with another plan. After each epoch the folder gets the
    weights as they ship, checkpoint.npz, and a line in the log (a .csv).
    """
    folder.mkdir(parents=True, exist_ok=True)
    checkpoint, log = folder / CHECKPOINT, folder / log_name(plan.model)
    torch.set_num_threads(1)
    cv2.setNumThreads(1)
    torch.manual_seed(plan.seed)
    network = build_network(plan.model).to(memory_format=torch.channels_last)
    averaged = copy.deepcopy(network)
    optimiser = torch.optim.AdamW(network.parameters(), weight_decay=1e-4)
    modules = {"network": network, "averaged": averaged}
    first_epoch = 0
    if checkpoint.exists():
        first_epoch = load_checkpoint(checkpoint, modules, optimiser, asdict(plan))
    else:
        log.write_text("epoch,samples,loss,map50,exact,seconds\n")
    held_out = CardStream(np.random.default_rng((plan.seed, 10**6)), min(plan.validation_samples, plan.pool))
    samples = [held_out.sample() for _ in range(plan.validation_samples)]
    steps = plan.samples_per_epoch // plan.batch
    for epoch in range(first_epoch, plan.epochs):
        started, losses = time.monotonic(), []
        stream = CardStream(np.random.default_rng((plan.seed, epoch)), plan.pool)
        network.train()
        for step in range(steps):
            for group in optimiser.param_groups:
                group["lr"] = plan.rate(epoch + step / steps)
            losses.append(_step(network, optimiser, stream, plan))
            _average(averaged, network, min(plan.averaging, (epoch * steps + step) / (epoch * steps + step + 10)))
            _show_progress(epoch, step + 1, steps, float(np.mean(losses[-50:])))
        map50, exact = validate(averaged, samples)
        save_detector(plan.model, to_arrays(averaged), folder)
        save_checkpoint(checkpoint, modules, optimiser, epoch + 1, asdict(plan))
        line = (f"{epoch + 1},{(epoch + 1) * steps * plan.batch},{np.mean(losses):.4f},{map50:.4f},{exact:.4f},"
                f"{time.monotonic() - started:.0f}\n")
        with log.open("a") as file:
            file.write(line)
    return averaged


def _step(network: CardDetector, optimiser: torch.optim.Optimizer, stream: CardStream, plan: TrainingPlan) -> float:
    """Take one step on a fresh batch and return its loss."""
    stream.renew()
    crops, balls, feet = zip(*(stream.sample() for _ in range(plan.batch)))
    grids = [encode(b, f) for b, f in zip(balls, feet)]
    ball_grid, foot_grid = (torch.from_numpy(np.stack(g)) for g in zip(*grids))
    with torch.autocast("cpu", torch.bfloat16, enabled=plan.bfloat16):
        raw = network(_to_batch(list(crops)))
    loss = detection_loss(raw.float(), ball_grid, foot_grid)
    optimiser.zero_grad()
    loss.backward()
    torch.nn.utils.clip_grad_norm_(network.parameters(), 10.0)
    optimiser.step()
    return float(loss.detach())


def _average(averaged: torch.nn.Module, network: torch.nn.Module, keep: float) -> None:
    """Move the averaged weights towards the network's."""
    with torch.no_grad():
        for slow, fast in zip(averaged.state_dict().values(), network.state_dict().values()):
            if slow.dtype.is_floating_point:
                slow.mul_(keep).add_(fast, alpha=1 - keep)
            else:
                slow.copy_(fast)


def _show_progress(epoch: int, step: int, steps: int, loss: float) -> None:
    if sys.stderr.isatty():
        bar = "#" * (30 * step // steps)
        sys.stderr.write(f"\repoch {epoch + 1} [{bar:<30}] {step}/{steps} loss {loss:.3f} ")
        sys.stderr.write("\n" if step == steps else "")
        sys.stderr.flush()
