"""The two detectors: YOLO-Dr. Eureka (paper section 3.1, Figure 7) and YOLOv2-tiny, which it was narrowed from.

Both take a 416x416 crop of a card and give a 13x13 grid of raw outputs, which `card_network.decode` turns into x, y,
confidence and class of one ball a cell. Two things the paper's figure does not have share the last layer: each ball's
diameter (for boxes, hence mAP) and the feet of the tubes, which tell which way is up and where an empty tube stands.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Mapping

import numpy as np
import torch
from torch import nn

from dr_eureka.game.state import COLOURS

INPUT_PX = 416
GRID = 13
FIRST_FOOT = 4 + len(COLOURS)
# Channels of the raw output: ball confidence, x, y, log diameter, a score a class; foot confidence, x, y.
RAW_CHANNELS = FIRST_FOOT + 3


@dataclass(frozen=True)
class _Block:
    """A 3x3 convolution with batch norm and leaky ReLU: output channels, stride, and the stride of pooling (0: none)."""

    outputs: int
    stride: int = 1
    pool: int = 0


_BLOCKS = {
    # 250 thousand parameters; the third and fourth convolutions have stride 2 in place of pooling.
    "eureka": (_Block(8, pool=2), _Block(16, pool=2), _Block(32, 2), _Block(64, 2), _Block(64, pool=2), _Block(128),
               _Block(96)),
    # 11 million: Redmon and Farhadi, YOLO9000 (2017), yolov2-tiny.cfg, with our output layer.
    "tiny": (_Block(16, pool=2), _Block(32, pool=2), _Block(64, pool=2), _Block(128, pool=2), _Block(256, pool=2),
             _Block(512, pool=1), _Block(1024), _Block(512)),
}
MODELS = tuple(_BLOCKS)


class CardDetector(nn.Module):
    """A detector: images (N, 3, 416, 416) in 0..1 to raw grids (N, 10, 13, 13)."""

    def __init__(self, model: str) -> None:
        super().__init__()
        inputs, features = 3, []
        for block in _BLOCKS[model]:
            features.append(_layers(inputs, block))
            inputs = block.outputs
        self.features = nn.Sequential(*features)
        self.output = nn.Conv2d(inputs, RAW_CHANNELS, 1)
        with torch.no_grad():  # few cells hold anything: start from a low confidence
            self.output.bias.zero_()
            self.output.bias[[0, FIRST_FOOT]] = -4.0

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        """Return the raw grids (N, 10, 13, 13)."""
        return self.output(self.features(images))


def _layers(inputs: int, block: _Block) -> nn.Sequential:
    """Return a block's layers.

    Pooling stands before the ReLU: the two commute (it is monotone), and fewer values are left to rectify.
    """
    pooling = {
        0: nn.Identity(),
        1: nn.Sequential(nn.ZeroPad2d((0, 1, 0, 1)), nn.MaxPool2d(2, 1)),  # as in Darknet: the grid keeps its size
        2: nn.MaxPool2d(2),
    }[block.pool]
    return nn.Sequential(
        nn.Conv2d(inputs, block.outputs, 3, block.stride, 1, bias=False),
        nn.BatchNorm2d(block.outputs),
        pooling,
        nn.LeakyReLU(0.1, inplace=True),
    )


def build_network(model: str) -> CardDetector:
    """Return an untrained detector, `eureka` or `tiny`. Raises KeyError for any other name."""
    return CardDetector(model)


def parameter_count(network: nn.Module) -> int:
    """Return the number of trainable parameters."""
    return sum(p.numel() for p in network.parameters() if p.requires_grad)


def to_arrays(network: CardDetector) -> dict[str, np.ndarray]:
    """Return the network's weights as plain arrays with batch norm folded into the convolutions."""
    arrays: dict[str, np.ndarray] = {}
    for index, block in enumerate(network.features):
        convolution, norm = block[0], block[1]
        gain = norm.weight / torch.sqrt(norm.running_var + norm.eps)
        arrays[f"kernel{index}"] = (convolution.weight * gain[:, None, None, None]).detach().numpy()
        arrays[f"bias{index}"] = (norm.bias - norm.running_mean * gain).detach().numpy()
    arrays["kernel_output"] = network.output.weight.detach().numpy()
    arrays["bias_output"] = network.output.bias.detach().numpy()
    return arrays


def from_arrays(arrays: Mapping[str, np.ndarray], model: str) -> CardDetector:
    """Return a detector for use from folded weights as to_arrays() gives them.

    Raises ValueError when a shape does not fit.
    """
    network = build_network(model).eval()
    for index, block in enumerate(network.features):
        folded = nn.Conv2d(block[0].in_channels, block[0].out_channels, 3, block[0].stride, 1)
        _fill(folded, arrays, f"kernel{index}", f"bias{index}")
        block[0], block[1] = folded, nn.Identity()
    _fill(network.output, arrays, "kernel_output", "bias_output")
    return network


def _fill(layer: nn.Conv2d, arrays: Mapping[str, np.ndarray], kernel: str, bias: str) -> None:
    """Copy a layer's weights out of the arrays."""
    for name, parameter in ((kernel, layer.weight), (bias, layer.bias)):
        found = arrays[name].shape if name in arrays else None
        if found != tuple(parameter.shape):
            raise ValueError(f"card detector weights: {name} has shape {found}, expected {tuple(parameter.shape)}")
        with torch.no_grad():
            parameter.copy_(torch.from_numpy(np.asarray(arrays[name], np.float32)))
