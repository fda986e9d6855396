"""What the detector shall answer for a crop, and how far an answer is from it: YOLO's grid and loss."""

from __future__ import annotations

import numpy as np
import torch
from torch.nn import functional

from dr_eureka.vision.card_architecture import FIRST_FOOT, GRID
from dr_eureka.vision.card_network import centre_offsets, log_size

_CELL_OVERLAP = 0.1  # a ball this close to a neighbouring cell [cells] is that cell's ball too


def encode(balls: np.ndarray, feet: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the grids to learn: balls (13, 13, 5) present, x, y offsets [cells], log size, class; feet (13, 13, 3).

    balls (n, 4): x, y, diameter, class index, and feet (m, 2): x, y, as fractions of the crop.
    """
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
    """Return YOLO's loss of raw grids (N, 10, 13, 13): confidence and class (cross entropy), place and size (squares)."""
    raw = raw.permute(0, 2, 3, 1)
    loss = _confidence_loss(raw[..., 0], ball_grid[..., 0])
    loss = loss + _confidence_loss(raw[..., FIRST_FOOT], foot_grid[..., 0])
    full = ball_grid[..., 0] > 0
    if full.any():
        seen, wanted = raw[full], ball_grid[full]
        loss = loss + 5.0 * functional.mse_loss(centre_offsets(seen[:, 1:3]), wanted[:, 1:3])
        loss = loss + 2.0 * functional.mse_loss(seen[:, 3], wanted[:, 3])
        loss = loss + functional.cross_entropy(seen[:, 4:FIRST_FOOT], wanted[:, 4].long())
    full = foot_grid[..., 0] > 0
    if full.any():
        loss = loss + 5.0 * functional.mse_loss(centre_offsets(raw[full][:, FIRST_FOOT + 1:]), foot_grid[full][:, 1:])
    return loss


def _confidence_loss(raw: torch.Tensor, present: torch.Tensor) -> torch.Tensor:
    """Return cross entropy per thing present, so that the many empty cells do not drown the few full ones."""
    return functional.binary_cross_entropy_with_logits(raw, present, reduction="sum") / present.sum().clamp(min=1.0)
