"""The command `train_arm_network`: train the shipped arm network again."""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from dr_eureka.errors import DrEurekaError
from dr_eureka.kinematics.network import WEIGHTS
from dr_eureka.resources import WEIGHTS_FOLDER, load_weights, resource_path, save_weights


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line of train_arm_network and return its exit code: 1 when it fails, 2 for bad arguments."""
    parser = _parser()
    options = vars(parser.parse_args(argv))
    out, install = options.pop("out"), options.pop("install")
    given = {name: value for name, value in options.items() if value is not None}
    if min(value for name, value in [("", 1), *given.items()] if name != "seed") < 1 or given.get("seed", 0) < 0:
        parser.error("rounds and batch must be at least 1, and the seed at least 0")
    # torch takes a second to import: only once the arguments are known to be good
    from dr_eureka.kinematics.training import LOG, TrainingPlan, train

    plan = replace(TrainingPlan(), **given)
    try:
        print(f"{plan.rounds} rounds of {plan.block} new samples, into {out}", flush=True)
        train(plan, out)
        print(f"weights and log are in {out}", flush=True)
        if install:
            file = save_weights(WEIGHTS, load_weights(WEIGHTS, out))
            shutil.copy(out / LOG, resource_path(WEIGHTS_FOLDER))
            print(f"installed {file}")
    except (DrEurekaError, OSError) as error:
        print(f"train_arm_network: {error}", file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="train_arm_network",
        description="Train the network that turns a wanted hand step into joint increments, on ten million samples drawn as "
        "it goes.",
    )
    parser.add_argument("--out", type=Path, default=Path("arm_network"), metavar="FOLDER",
                        help="for weights, log and checkpoint; a run that was broken off goes on from there, if asked for "
                        "the same (default: %(default)s)")
    parser.add_argument("--install", action="store_true",
                        help="put the finished weights and their log into the package's config/weights")
    parser.add_argument("--rounds", type=int, help="rounds of 31,250 new samples each, by default 320")
    parser.add_argument("--batch", type=int, help="samples a step, by default 1024; the paper: 16384")
    parser.add_argument("--seed", type=int, help="seed of the samples and the first weights, by default 1")
    return parser
