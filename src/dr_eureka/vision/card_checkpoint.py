"""Checkpoints of a training run as plain arrays: nothing in them is executed when they are read."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path

import numpy as np
import torch
from torch import nn

from dr_eureka.errors import DrEurekaError


class CheckpointError(DrEurekaError):
    """A checkpoint that cannot be read or is of another network."""


def save_checkpoint(
    path: Path, network: nn.Module, averaged: nn.Module, optimiser: torch.optim.Optimizer, epochs_done: int
) -> None:
    """Write both networks, the optimiser's moments and the number of epochs done; a broken write leaves the old file."""
    arrays = {"epochs_done": np.array(epochs_done)}
    for part, module in (("network", network), ("averaged", averaged)):
        arrays.update({f"{part}/{name}": tensor.numpy() for name, tensor in module.state_dict().items()})
    for index, moments in optimiser.state_dict()["state"].items():
        arrays.update({f"optimiser/{index}/{name}": tensor.numpy() for name, tensor in moments.items()})
    partial = path.with_name(path.name + ".partial")
    with partial.open("wb") as file:
        np.savez(file, **arrays)
    os.replace(partial, path)


def load_checkpoint(
    path: Path, network: nn.Module, averaged: nn.Module, optimiser: torch.optim.Optimizer
) -> int:
    """Fill both networks and the optimiser from a checkpoint; return the number of epochs done.

    Raises CheckpointError naming the file when it cannot be read or does not fit.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        for part, module in (("network", network), ("averaged", averaged)):
            module.load_state_dict(_below(arrays, part))
        state: dict[int, dict[str, torch.Tensor]] = {}
        for name, tensor in _below(arrays, "optimiser").items():
            index, moment = name.split("/")
            state.setdefault(int(index), {})[moment] = tensor
        optimiser.load_state_dict({"state": state, "param_groups": optimiser.state_dict()["param_groups"]})
        return int(arrays["epochs_done"])
    except (OSError, EOFError, ValueError, KeyError, RuntimeError, zipfile.BadZipFile) as error:
        reason = str(error).splitlines()[0]
        raise CheckpointError(f"{path}: not a checkpoint of this network: {reason}; delete it to start anew") from error


def _below(arrays: dict[str, np.ndarray], part: str) -> dict[str, torch.Tensor]:
    """Return the tensors whose name starts with `part/`, without that start."""
    return {name[len(part) + 1:]: torch.from_numpy(array) for name, array in arrays.items() if name.startswith(f"{part}/")}
