"""A trained card detector in use: a crop in, decoded grids out (paper section 3.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Mapping

import numpy as np
import torch
from torch import nn

from dr_eureka.memory import keep_freed_memory
from dr_eureka.vision.card_architecture import FIRST_FOOT, GRID, from_arrays

_BALL_SIZE = 0.125  # diameter a zero output stands for, as a fraction of the crop
_CELLS = torch.stack(torch.meshgrid(torch.arange(GRID), torch.arange(GRID), indexing="xy"), -1)  # column, row of each
_CELL_STRETCH = 1.4  # a cell reaches 0.2 of a cell into its neighbours, so no centre lies where none is sure


@dataclass(frozen=True)
class GridDetections:
    """Decoded output for a batch, lengths as fractions of the crop (x right, y down).

    balls: (N, 13, 13, 4) x, y, confidence, class index; diameters: (N, 13, 13); class_scores: (N, 13, 13, 3) summing to
    one; feet: (N, 13, 13, 3) x, y, confidence.
    """

    balls: torch.Tensor
    diameters: torch.Tensor
    class_scores: torch.Tensor
    feet: torch.Tensor


def centre_offsets(raw: torch.Tensor) -> torch.Tensor:
    """Return offsets within a cell, in cells, for raw x, y outputs of any shape."""
    return _CELL_STRETCH * torch.sigmoid(raw) - (_CELL_STRETCH - 1) / 2


def log_size(diameter: np.ndarray) -> np.ndarray:
    """Return the raw output that stands for a diameter given as a fraction of the crop."""
    return np.log(diameter / _BALL_SIZE)


def decode(raw: torch.Tensor) -> GridDetections:
    """Decode raw grids (N, 10, 13, 13) into centres, confidences and classes."""
    raw = raw.permute(0, 2, 3, 1)
    cells = _CELLS.to(raw)
    scores = torch.softmax(raw[..., 4:FIRST_FOOT], -1)
    ball_centres = (cells + centre_offsets(raw[..., 1:3])) / GRID
    foot_centres = (cells + centre_offsets(raw[..., FIRST_FOOT + 1:])) / GRID
    classes = scores.argmax(-1, keepdim=True).to(raw)
    return GridDetections(
        balls=torch.cat([ball_centres, torch.sigmoid(raw[..., :1]), classes], -1),
        diameters=_BALL_SIZE * torch.exp(raw[..., 3]),
        class_scores=scores,
        feet=torch.cat([foot_centres, torch.sigmoid(raw[..., FIRST_FOOT:FIRST_FOOT + 1])], -1),
    )


class _PairedMaximum(nn.Module):
    """What MaxPool2d(2) does to maps of even size kept channels last, at a third of its time where channels are few."""

    def forward(self, maps: torch.Tensor) -> torch.Tensor:
        """Return the maxima (n, c, h / 2, w / 2) of squares of maps (n, c, h, w)."""
        count, channels, height, width = maps.shape
        rows = maps.permute(0, 2, 3, 1).reshape(count, height // 2, 2, width * channels)
        pairs = torch.maximum(rows[:, :, 0], rows[:, :, 1]).view(count, height // 2, width // 2, 2, channels)
        return torch.maximum(pairs[..., 0, :], pairs[..., 1, :]).permute(0, 3, 1, 2)


class CardNetwork:
    """A trained detector for use: RGB crops in, decoded grids out."""

    def __init__(self, arrays: Mapping[str, np.ndarray], threads: int = 1, model: str = "eureka") -> None:
        """Build from folded weights (card_architecture.to_arrays). Raises ValueError when a shape does not fit."""
        torch.set_num_threads(threads)
        keep_freed_memory()
        network = from_arrays(arrays, model)
        with torch.no_grad():
            network.features[0][0].weight.div_(255.0)  # here once instead of for each pixel
        for block in network.features:
            for index, layer in enumerate(block):
                if isinstance(layer, nn.MaxPool2d) and layer.stride == 2:
                    block[index] = _PairedMaximum()
        self._network = network.to(memory_format=torch.channels_last)

    def detect(self, crop_rgb: np.ndarray) -> GridDetections:
        """Return what is seen in one crop (416, 416, 3) uint8 RGB, as a batch of one."""
        image = torch.from_numpy(np.ascontiguousarray(crop_rgb)).permute(2, 0, 1)[None].float()
        with torch.no_grad():
            return decode(self._network(image))
