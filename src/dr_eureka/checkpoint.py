"""Checkpoints of a training run as plain arrays: nothing in them is executed when they are read."""

from __future__ import annotations

import json
import os
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Mapping

import numpy as np

from dr_eureka.errors import DrEurekaError

if TYPE_CHECKING:
    import torch


class CheckpointError(DrEurekaError):
    """A checkpoint that cannot be read, or is of another network or another training."""


def save_checkpoint(
    path: Path, modules: Mapping[str, torch.nn.Module], optimiser: torch.optim.Optimizer, done: int, plan: Mapping[str, Any]
) -> None:
    """Write modules by name, the optimiser's moments, how much is done and of what; a broken write leaves the old file.

    plan: by name, all that the course of the training depends on, as JSON knows it.
    """
    arrays = {"done": np.array(done), "plan": np.array(json.dumps(plan))}
    for part, module in modules.items():
        arrays.update({f"{part}/{name}": tensor.numpy() for name, tensor in module.state_dict().items()})
    for index, moments in optimiser.state_dict()["state"].items():
        arrays.update({f"optimiser/{index}/{name}": tensor.numpy() for name, tensor in moments.items()})
    partial = path.with_name(path.name + ".partial")
    with partial.open("wb") as file:
        np.savez(file, **arrays)
    os.replace(partial, path)


def load_checkpoint(
    path: Path, modules: Mapping[str, torch.nn.Module], optimiser: torch.optim.Optimizer, plan: Mapping[str, Any]
) -> int:
    """Fill the modules and the optimiser from a checkpoint; return how much is done.

    Raises CheckpointError naming the file when it cannot be read or does not fit, or was begun with another plan: half a
    run by one plan and half by another is a run by none.
    """
    import torch  # takes a second: only once there is something to load

    try:
        with np.load(path, allow_pickle=False) as archive:
            _check_plan(path, json.loads(archive["plan"].item()), json.loads(json.dumps(plan)))
            arrays = {name: torch.from_numpy(archive[name]) for name in archive.files if name != "plan"}
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


def _check_plan(path: Path, begun: dict[str, Any], wanted: dict[str, Any]) -> None:
    names = [name for name in {**begun, **wanted} if begun.get(name) != wanted.get(name)]
    if names:
        theirs, ours = (", ".join(f"{name} {plan.get(name)}" for name in names) for plan in (begun, wanted))
        problem = f"begun with {theirs}, now asked for {ours}; go on as begun or start in another folder"
        raise CheckpointError(f"{path}: {problem}")


def _below(arrays: Mapping[str, torch.Tensor], part: str) -> dict[str, torch.Tensor]:
    """Return the tensors whose name starts with `part/`, without that start."""
    return {name[len(part) + 1:]: tensor for name, tensor in arrays.items() if name.startswith(f"{part}/")}
