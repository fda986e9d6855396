"""The arm network as a torch module, for training; at run time `network.py` does without torch."""

from __future__ import annotations

import numpy as np
import torch
from torch import nn

from dr_eureka.kinematics.chain import Chain
from dr_eureka.kinematics.network import BATCH_NORM_EPSILON, HIDDEN, INPUTS, OUTPUTS


def build_model() -> nn.Sequential:
    """Return the paper's network, 13-256x4-128x3-7 with batch norm and ReLU: 273,415 numbers with the norm's statistics."""
    layers: list[nn.Module] = []
    fan_in = INPUTS
    for width in HIDDEN:
        layers += [nn.Linear(fan_in, width), nn.BatchNorm1d(width, eps=BATCH_NORM_EPSILON, momentum=0.01), nn.ReLU()]
        fan_in = width
    return nn.Sequential(*layers, nn.Linear(fan_in, OUTPUTS))


def parameter_count(model: nn.Module) -> int:
    """Count weights and batch-norm statistics, as Keras and the paper count."""
    return sum(tensor.numel() for name, tensor in model.state_dict().items() if not name.endswith("num_batches_tracked"))


class TorchChain(nn.Module):
    """Forward kinematics of a chain as differentiable torch operations."""

    def __init__(self, chain: Chain) -> None:
        super().__init__()
        constant, sine, cosine, tip = chain.local_parts()
        for name, array in (("constant", constant), ("sine", sine), ("cosine", cosine), ("tip", tip)):
            self.register_buffer(name, torch.tensor(array, dtype=torch.float32))

    def forward(self, joints: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return rotations (n, 3, 3) and positions (n, 3) [m] of the tip for joints (n, k) [rad]."""
        sines, cosines = torch.sin(joints)[:, :, None, None], torch.cos(joints)[:, :, None, None]
        local = self.constant[:, :3, :3] + sines * self.sine[:, :3, :3] + cosines * self.cosine[:, :3, :3]
        rotation, position = local[:, 0], self.constant[0, :3, 3].expand(len(joints), 3)
        for index in range(1, joints.shape[1]):
            position = position + rotation @ self.constant[index, :3, 3]
            rotation = torch.bmm(rotation, local[:, index])
        return rotation @ self.tip[:3, :3], position + rotation @ self.tip[:3, 3]


def weights_of(model: nn.Sequential, lower: np.ndarray, upper: np.ndarray) -> dict[str, np.ndarray]:
    """Return the weights as `ArmNetwork` reads them: float32 arrays by name, batch norm kept apart from the dense layers.

    lower, upper: (7,) [rad], the joints that become -0.5 and 0.5.
    """
    arrays = {"joint_lower": np.asarray(lower), "joint_upper": np.asarray(upper)}
    for index, layer in enumerate(layer for layer in model if isinstance(layer, nn.Linear)):
        arrays[f"dense{index}_weight"], arrays[f"dense{index}_bias"] = layer.weight, layer.bias
    for index, layer in enumerate(layer for layer in model if isinstance(layer, nn.BatchNorm1d)):
        parts = {"gamma": layer.weight, "beta": layer.bias, "mean": layer.running_mean, "variance": layer.running_var}
        arrays.update({f"norm{index}_{part}": tensor for part, tensor in parts.items()})
    plain = {key: value.detach().numpy() if isinstance(value, torch.Tensor) else value for key, value in arrays.items()}
    return {key: value.astype(np.float32) for key, value in plain.items()}
