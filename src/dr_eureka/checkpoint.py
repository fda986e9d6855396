"""Checkpoints of a training run as plain arrays: nothing in them is executed when they are read."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Mapping

import numpy as np

from dr_eureka.errors import DrEurekaError

if TYPE_CHECKING:
    import torch


class CheckpointError(DrEurekaError):
    """A checkpoint that cannot be read or is of another network."""


def save_checkpoint(path: Path, modules: Mapping[str, torch.nn.Module], optimiser: torch.optim.Optimizer, done: int) -> None:
    """Write modules by name, the optimiser's moments and how much is done; a broken write leaves the old file."""
    arrays = {"done": np.array(done)}
    for part, module in modules.items():
        arrays.update({f"{part}/{name}": tensor.numpy() for name, tensor in module.state_dict().items()})
    for index, moments in optimiser.state_dict()["state"].items():
        arrays.update({f"optimiser/{index}/{name}": tensor.numpy() for name, tensor in moments.items()})
    partial = path.with_name(path.name + ".partial")
    with partial.open("wb") as file:
        np.savez(file, **arrays)
    os.replace(partial, path)


def load_checkpoint(path: Path, modules: Mapping[str, torch.nn.Module], optimiser: torch.optim.Optimizer) -> int:
    """Fill the modules and the optimiser from a checkpoint; return how much is done.

    Raises CheckpointError naming the file when it cannot be read or does not fit.
    """
    import torch  # takes a second: only once there is something to load

    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: torch.from_numpy(archive[name]) for name in archive.files}
        for part, module in modules.items():
            module.load_state_dict(_below(arrays, part))
        state: dict[int, dict[str, torch.Tensor]] = {}
        for name, tensor in _below(arrays, "optimiser").items():
            index, moment = name.split("/")
            state.setdefault(int(index), {})[moment] = tensor
        optimiser.load_state_dict({"state": state, "param_groups": optimiser.state_dict()["param_groups"]})
        return int(arrays["done"])
    except (OSError, EOFError, TypeError, ValueError, KeyError, RuntimeError, zipfile.BadZipFile) as error:
        reason = str(error).splitlines()[0]
        raise CheckpointError(f"{path}: not a checkpoint of this network: {reason}; delete it to start anew") from error


def _below(arrays: Mapping[str, torch.Tensor], part: str) -> dict[str, torch.Tensor]:
    """Return the tensors whose name starts with `part/`, without that start."""
    return {name[len(part) + 1:]: tensor for name, tensor in arrays.items() if name.startswith(f"{part}/")}
