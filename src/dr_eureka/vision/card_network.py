"""YOLO-Dr. Eureka: YOLOv2-tiny narrowed to about 250 thousand parameters (paper section 3.1, Figure 7).

The third and fourth convolutions have stride 2 in place of pooling; a 416x416 crop of a card gives a 13x13 grid that is
decoded to x, y, confidence and class of one ball a cell. Two things the paper's figure does not have share the last
layer: each ball's diameter (for boxes, hence mAP) and the feet of the tubes, which tell which way is up and where an
empty tube stands.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Mapping

import numpy as np
import torch
from torch import nn

INPUT_PX = 416
GRID = 13
CLASSES = "RGP"
# Channels of the raw output: ball confidence, x, y, log diameter, a score a class; foot confidence, x, y.
RAW_CHANNELS = 4 + len(CLASSES) + 3
_BALL_SIZE = 0.125  # diameter a zero output stands for, as a fraction of the crop
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


def _convolution(inputs: int, outputs: int, stride: int = 1, pool: bool = False) -> nn.Sequential:
    """Return convolution, batch norm and leaky ReLU as in YOLOv2, and pooling by 2 where asked.

    Pooling stands before the ReLU: the two commute (it is monotone), and a quarter of the values are left to rectify.
    """
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False),
        nn.BatchNorm2d(outputs),
        nn.MaxPool2d(2) if pool else nn.Identity(),
        nn.LeakyReLU(0.1, inplace=True),
    )


class YoloDrEureka(nn.Module):
    """The narrowed detector: images (N, 3, 416, 416) in 0..1 to raw grids (N, 10, 13, 13)."""

    def __init__(self) -> None:
        super().__init__()
        self.features = nn.Sequential(
            _convolution(3, 8, pool=True),
            _convolution(8, 16, pool=True),
            _convolution(16, 32, stride=2),
            _convolution(32, 64, stride=2),
            _convolution(64, 64, pool=True),
            _convolution(64, 128),
            _convolution(128, 96),
        )
        self.output = nn.Conv2d(96, RAW_CHANNELS, 1)
        with torch.no_grad():  # few cells hold anything: start from a low confidence
            self.output.bias.zero_()
            self.output.bias[[0, 4 + len(CLASSES)]] = -4.0

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        """Return the raw grids (N, 10, 13, 13)."""
        return self.output(self.features(images))


def centre_offsets(raw: torch.Tensor) -> torch.Tensor:
    """Return offsets within a cell, in cells, for raw x, y outputs of any shape."""
    return _CELL_STRETCH * torch.sigmoid(raw) - (_CELL_STRETCH - 1) / 2


def decode(raw: torch.Tensor) -> GridDetections:
    """Decode raw grids (N, 10, 13, 13) into centres, confidences and classes."""
    raw = raw.permute(0, 2, 3, 1)
    first_foot = 4 + len(CLASSES)
    cells = torch.stack(torch.meshgrid(torch.arange(GRID), torch.arange(GRID), indexing="xy"), -1).to(raw)
    scores = torch.softmax(raw[..., 4:first_foot], -1)
    ball_centres = (cells + centre_offsets(raw[..., 1:3])) / GRID
    foot_centres = (cells + centre_offsets(raw[..., first_foot + 1:])) / GRID
    classes = scores.argmax(-1, keepdim=True).to(raw)
    return GridDetections(
        balls=torch.cat([ball_centres, torch.sigmoid(raw[..., :1]), classes], -1),
        diameters=_BALL_SIZE * torch.exp(raw[..., 3]),
        class_scores=scores,
        feet=torch.cat([foot_centres, torch.sigmoid(raw[..., first_foot:first_foot + 1])], -1),
    )


def log_size(diameter: np.ndarray) -> np.ndarray:
    """Return the raw output that stands for a diameter given as a fraction of the crop."""
    return np.log(diameter / _BALL_SIZE)


def parameter_count(network: nn.Module) -> int:
    """Return the number of trainable parameters."""
    return sum(p.numel() for p in network.parameters() if p.requires_grad)


def to_arrays(network: YoloDrEureka) -> dict[str, np.ndarray]:
    """Return the network's weights as plain arrays with batch norm folded into the convolutions, for an npz."""
    arrays: dict[str, np.ndarray] = {}
    for index, block in enumerate(network.features):
        convolution, norm = block[0], block[1]
        gain = norm.weight / torch.sqrt(norm.running_var + norm.eps)
        arrays[f"kernel{index}"] = (convolution.weight * gain[:, None, None, None]).detach().numpy()
        arrays[f"bias{index}"] = (norm.bias - norm.running_mean * gain).detach().numpy()
    arrays["kernel_output"] = network.output.weight.detach().numpy()
    arrays["bias_output"] = network.output.bias.detach().numpy()
    return arrays


class CardNetwork:
    """The trained detector for use: RGB crops in, decoded grids out."""

    def __init__(self, arrays: Mapping[str, np.ndarray], threads: int = 1) -> None:
        """Build from folded weights as to_arrays() gives them. Raises ValueError when a shape does not fit."""
        torch.set_num_threads(threads)
        network = YoloDrEureka().eval()
        for index, block in enumerate(network.features):
            folded = nn.Conv2d(block[0].in_channels, block[0].out_channels, 3, block[0].stride, 1)
            _fill(folded, arrays, f"kernel{index}", f"bias{index}")
            block[0], block[1] = folded, nn.Identity()
        _fill(network.output, arrays, "kernel_output", "bias_output")
        self._network = network.to(memory_format=torch.channels_last)

    def detect(self, crop_rgb: np.ndarray) -> GridDetections:
        """Return what is seen in one crop (416, 416, 3) uint8 RGB, as a batch of one."""
        image = torch.from_numpy(np.ascontiguousarray(crop_rgb)).permute(2, 0, 1)[None].float().div_(255.0)
        with torch.no_grad():
            return decode(self._network(image))


def _fill(layer: nn.Conv2d, arrays: Mapping[str, np.ndarray], kernel: str, bias: str) -> None:
    """Copy a layer's weights out of the arrays."""
    for name, parameter in ((kernel, layer.weight), (bias, layer.bias)):
        found = arrays[name].shape if name in arrays else None
        if found != tuple(parameter.shape):
            raise ValueError(f"card detector weights: {name} has shape {found}, expected {tuple(parameter.shape)}")
        with torch.no_grad():
            parameter.copy_(torch.from_numpy(np.asarray(arrays[name], np.float32)))
