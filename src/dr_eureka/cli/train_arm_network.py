"""The command `train_arm_network`: make the weights of the arm network anew."""
from __future__ import annotations

import argparse
import dataclasses
import logging
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Optional

from dr_eureka.errors import DrEurekaError
from dr_eureka.resources import WEIGHTS_FOLDER, resource_path


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code, 2 for bad input."""
    arguments = _parser().parse_args(argv)
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    # torch takes a second to import: only once the arguments are known to be good
    from dr_eureka.kinematics.training import TrainingSettings, train

    settings = TrainingSettings(seed=arguments.seed)
    if arguments.steps is not None:
        settings = dataclasses.replace(settings, steps=arguments.steps)
    try:
        train(arguments.out, arguments.checkpoint, settings)
    except DrEurekaError as error:
        print(f"train_arm_network: {error}", file=sys.stderr)
        return 2
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="train_arm_network",
        description="Train the network that turns a wanted hand step into joint increments (about 15 minutes on one free core). "
        "Continues from the checkpoint if there is one.",
    )
    parser.add_argument("--out", type=Path, default=resource_path(WEIGHTS_FOLDER) / "arm_network.npz", help="weights file to write")
    parser.add_argument("--checkpoint", type=Path, default=Path("arm_network.checkpoint"), help="where to keep the state of the training")
    parser.add_argument("--steps", type=_positive, help="training steps instead of the default")
    parser.add_argument("--seed", type=int, default=1, help="seed of samples and first weights")
    return parser


def _positive(word: str) -> int:
    number = int(word)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{word} is not at least 1")
    return number
