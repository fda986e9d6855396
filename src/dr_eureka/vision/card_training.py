"""Training of YOLO-Dr. Eureka on drawn cards (paper sections 3.1 and 4.1).

Every sample is drawn: a pool of cards that is renewed all the time, each seen through a random camera. Epochs are seeded
by their number, so a run that was broken off and resumed sees the same cards as one that was not.
"""

from __future__ import annotations

import argparse
import copy
import math
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from torch.nn import functional

from dr_eureka.errors import DrEurekaError
from dr_eureka.resources import save_weights
from dr_eureka.vision.card_checkpoint import load_checkpoint, save_checkpoint
from dr_eureka.vision.card_detections import collect
from dr_eureka.vision.card_metrics import mean_average_precision
from dr_eureka.vision.card_network import (
    CLASSES, GRID, INPUT_PX, YoloDrEureka, centre_offsets, decode, log_size, parameter_count, to_arrays,
)
from dr_eureka.vision.card_renderer import CardDrawing, draw_card, sample_style
from dr_eureka.vision.card_scenes import ViewRanges, clutter, decoy, degrade, rectified_sample

WEIGHTS = "card_detector.npz"
CHECKPOINT = "checkpoint.npz"
_CELL_OVERLAP = 0.1  # a ball this close to a neighbouring cell [cells] is that cell's ball too
_FIRST_FOOT = 4 + len(CLASSES)
_POOL_SIDE_PX = 256
_COUNTS = [(a, b, 6 - a - b) for a in range(5) for b in range(5) if 0 <= 6 - a - b <= 4]


@dataclass(frozen=True)
class TrainingPlan:
    """How long and on what to train."""

    epochs: int = 9
    samples_per_epoch: int = 2500
    batch: int = 8
    peak_rate: float = 3e-3
    seed: int = 1
    pool: int = 250
    validation_samples: int = 160
    averaging: float = 0.99  # of the weights kept for use, per step


class CardStream:
    """Endless training crops: cards of all 1710 states, some impossible ones, and some crops of other things."""

    def __init__(self, rng: np.random.Generator, pool: int, wide: bool = True) -> None:
        self._rng = rng
        self._wide = wide
        self._pool = [self._draw() for _ in range(pool)]

    def _draw(self) -> CardDrawing:
        if self._rng.random() < 0.06:
            return decoy(self._rng, _POOL_SIDE_PX)
        if self._rng.random() < 0.8:
            order = "".join(self._rng.permutation(list("RRGGPP")))
            first, second, _ = _COUNTS[self._rng.integers(len(_COUNTS))]
            tubes = order[:first], order[first:first + second], order[first + second:]
        else:
            tubes = ["".join(self._rng.choice(list(CLASSES), self._rng.integers(5))) for _ in range(3)]
        return draw_card("|".join(tubes), self._rng, _POOL_SIDE_PX, sample_style(self._rng, self._wide))

    def renew(self) -> None:
        """Draw a new card in place of one of the pool."""
        self._pool[self._rng.integers(len(self._pool))] = self._draw()

    def sample(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return a crop (416, 416, 3) uint8, its balls (n, 4) and its feet (m, 2), as rectified_sample does."""
        if self._rng.random() < 0.03:
            side = int(self._rng.integers(60, 200))
            scene = clutter(self._rng, side, side, int(self._rng.integers(0, 12)))
            crop = cv2.resize(degrade(scene, self._rng, ViewRanges()), (INPUT_PX, INPUT_PX))
            return crop, np.zeros((0, 4)), np.zeros((0, 2))
        drawing = self._pool[self._rng.integers(len(self._pool))]
        return rectified_sample(drawing, self._rng, ViewRanges())


def encode(balls: np.ndarray, feet: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the grids to learn: balls (13, 13, 5) present, x, y offsets [cells], log size, class; feet (13, 13, 3)."""
    ball_grid, foot_grid = np.zeros((GRID, GRID, 5), np.float32), np.zeros((GRID, GRID, 3), np.float32)
    for grid, things in ((ball_grid, balls), (foot_grid, feet)):
        for margin in (_CELL_OVERLAP, 0.0):  # a cell's own ball comes last and wins
            for thing in things:
                place = thing[:2] * GRID
                for row in range(*_cells(place[1], margin)):
                    for column in range(*_cells(place[0], margin)):
                        grid[row, column, :3] = 1.0, place[0] - column, place[1] - row
                        if grid is ball_grid:
                            grid[row, column, 3:] = log_size(thing[2]), thing[3]
    return ball_grid, foot_grid


def _cells(place: float, margin: float) -> tuple[int, int]:
    """Return the first and one past the last cell that a coordinate [cells] belongs to."""
    return max(int(np.floor(place - margin)), 0), min(int(np.floor(place + margin)), GRID - 1) + 1


def detection_loss(raw: torch.Tensor, ball_grid: torch.Tensor, foot_grid: torch.Tensor) -> torch.Tensor:
    """Return YOLO's loss: confidence (cross entropy), offsets and size (squares), class (cross entropy)."""
    raw = raw.permute(0, 2, 3, 1)
    loss = _confidence_loss(raw[..., 0], ball_grid[..., 0])
    loss = loss + _confidence_loss(raw[..., _FIRST_FOOT], foot_grid[..., 0])
    full = ball_grid[..., 0] > 0
    if full.any():
        seen, wanted = raw[full], ball_grid[full]
        loss = loss + 5.0 * functional.mse_loss(centre_offsets(seen[:, 1:3]), wanted[:, 1:3])
        loss = loss + 2.0 * functional.mse_loss(seen[:, 3], wanted[:, 3])
        loss = loss + functional.cross_entropy(seen[:, 4:_FIRST_FOOT], wanted[:, 4].long())
    full = foot_grid[..., 0] > 0
    if full.any():
        loss = loss + 5.0 * functional.mse_loss(centre_offsets(raw[full][:, _FIRST_FOOT + 1:]), foot_grid[full][:, 1:])
    return loss


def _confidence_loss(raw: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
    """Return cross entropy per thing present, so that the many empty cells do not drown the few full ones."""
    return functional.binary_cross_entropy_with_logits(raw, present, reduction="sum") / present.sum().clamp(min=1.0)


def _to_batch(crops: list[np.ndarray]) -> torch.Tensor:
    images = torch.from_numpy(np.stack(crops)).permute(0, 3, 1, 2)  # stays channels-last: twice as fast on a CPU
    return images.float().div_(255.0)


def validate(network: YoloDrEureka, samples: list[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> tuple[float, float]:
    """Return mAP@0.5 and the share of crops with exactly the right balls and feet, over the given samples."""
    network.eval()
    seen, exact = [], 0
    for crop, balls, feet in samples:
        with torch.no_grad():
            grid = decode(network(_to_batch([crop])))
        arrays = [a[0].numpy() for a in (grid.balls, grid.diameters, grid.class_scores, grid.feet)]
        seen.append(collect(*arrays, threshold=0.05).balls)
        sure = collect(*arrays, threshold=0.5)
        exact += _same([(b.x, b.y, CLASSES.index(b.colour)) for b in sure.balls], balls[:, (0, 1, 3)]) and _same(
            [(f.x, f.y, 0) for f in sure.feet], np.column_stack((feet, np.zeros(len(feet)))))
    return mean_average_precision(seen, [balls for _, balls, _ in samples]), exact / len(samples)


def _same(found: list[tuple[float, float, int]], wanted: np.ndarray) -> bool:
    """Tell whether each wanted (x, y, class) has a found one within 0.04 of the crop, and none is left over."""
    if len(found) != len(wanted):
        return False
    return all(any(c == k and np.hypot(x - u, y - v) < 0.04 for u, v, c in found) for x, y, k in wanted)


def train(plan: TrainingPlan, folder: Path) -> YoloDrEureka:
    """Train and return the averaged network, going on from the checkpoint in the folder when there is one.

    After each epoch the folder gets card_detector.npz (weights), checkpoint.npz, and a line in card_detector.csv (log).
    """
    folder.mkdir(parents=True, exist_ok=True)
    checkpoint, log = folder / CHECKPOINT, folder / "card_detector.csv"
    torch.set_num_threads(1)
    cv2.setNumThreads(1)
    torch.manual_seed(plan.seed)
    held_out = CardStream(np.random.default_rng((plan.seed, 10**6)), min(plan.validation_samples, plan.pool))
    samples = [held_out.sample() for _ in range(plan.validation_samples)]
    network = YoloDrEureka().to(memory_format=torch.channels_last)
    averaged = copy.deepcopy(network)
    optimiser = torch.optim.AdamW(network.parameters(), lr=plan.peak_rate, weight_decay=1e-4)
    first_epoch = 0
    if checkpoint.exists():
        first_epoch = load_checkpoint(checkpoint, network, averaged, optimiser)
    else:
        log.write_text("epoch,samples,loss,map50,exact,seconds\n")
    steps = plan.samples_per_epoch // plan.batch
    for epoch in range(first_epoch, plan.epochs):
        started, losses = time.monotonic(), []
        stream = CardStream(np.random.default_rng((plan.seed, epoch)), plan.pool)
        network.train()
        for step in range(steps):
            done = (epoch * steps + step) / (plan.epochs * steps)
            for group in optimiser.param_groups:
                group["lr"] = plan.peak_rate * _rate_factor(done)
            losses.append(_step(network, optimiser, stream, plan.batch))
            _average(averaged, network, min(plan.averaging, (epoch * steps + step) / (epoch * steps + step + 10)))
            _show_progress(epoch, step + 1, steps, float(np.mean(losses[-50:])))
        map50, exact = validate(averaged, samples)
        save_weights(WEIGHTS, to_arrays(averaged), folder)
        save_checkpoint(checkpoint, network, averaged, optimiser, epoch + 1)
        line = (f"{epoch + 1},{(epoch + 1) * steps * plan.batch},{np.mean(losses):.4f},{map50:.4f},{exact:.4f},"
                f"{time.monotonic() - started:.0f}\n")
        with log.open("a") as file:
            file.write(line)
    return averaged


def _step(network: YoloDrEureka, optimiser: torch.optim.Optimizer, stream: CardStream, batch: int) -> float:
    """Take one step on a fresh batch and return its loss."""
    stream.renew()
    crops, balls, feet = zip(*(stream.sample() for _ in range(batch)))
    grids = [encode(b, f) for b, f in zip(balls, feet)]
    ball_grid, foot_grid = (torch.from_numpy(np.stack(g)) for g in zip(*grids))
    loss = detection_loss(network(_to_batch(list(crops))), ball_grid, foot_grid)
    optimiser.zero_grad()
    loss.backward()
    torch.nn.utils.clip_grad_norm_(network.parameters(), 10.0)
    optimiser.step()
    return float(loss.detach())


def _rate_factor(done: float) -> float:
    """Return the learning rate's share of its peak: a short warm-up, then a half cosine down to nothing."""
    warm_up = 0.03
    return done / warm_up if done < warm_up else 0.5 * (1 + math.cos(math.pi * (done - warm_up) / (1 - warm_up))) + 1e-3


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


def main(argv: list[str] | None = None) -> int:
    """Run the command line of train_card_detector and return its exit code."""
    plan = TrainingPlan()
    parser = argparse.ArgumentParser(
        prog="train_card_detector", description="Train YOLO-Dr. Eureka, the card detector, on drawn cards."
    )
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER",
                        help="for weights, log and checkpoint; a run that was broken off goes on from there")
    parser.add_argument("--install", action="store_true", help="put the finished weights into the package's config/weights")
    parser.add_argument("--epochs", type=int, default=plan.epochs)
    parser.add_argument("--samples", type=int, default=plan.samples_per_epoch, help="crops an epoch")
    parser.add_argument("--batch", type=int, default=plan.batch)
    parser.add_argument("--seed", type=int, default=plan.seed)
    parser.add_argument("--pool", type=int, default=plan.pool, help="cards drawn ahead")
    arguments = parser.parse_args(argv)
    if min(arguments.epochs, arguments.batch, arguments.pool) < 1 or arguments.samples < arguments.batch:
        parser.error("epochs, batch and pool must be at least 1, and samples at least a batch")
    plan = TrainingPlan(epochs=arguments.epochs, samples_per_epoch=arguments.samples, batch=arguments.batch,
                        seed=arguments.seed, pool=arguments.pool)
    try:
        print(f"YOLO-Dr. Eureka, {parameter_count(YoloDrEureka())} parameters, into {arguments.out}")
        network = train(plan, arguments.out)
        if arguments.install:
            print(f"installed {save_weights(WEIGHTS, to_arrays(network))}")
    except (DrEurekaError, OSError) as error:
        print(f"train_card_detector: {error}", file=sys.stderr)
        return 1
    return 0
