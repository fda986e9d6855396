"""The command `train_card_detector`: train the shipped card detector, or its baseline, again."""

from __future__ import annotations

import argparse
import shutil
import sys
from dataclasses import replace
from pathlib import Path

from dr_eureka.errors import DrEurekaError
from dr_eureka.resources import WEIGHTS_FOLDER, resource_path
from dr_eureka.vision.card_architecture import MODELS, build_network, parameter_count, to_arrays
from dr_eureka.vision.card_training import PLANS, train
from dr_eureka.vision.card_weights import log_name, save_detector


def main(argv: list[str] | None = None) -> int:
    """Run the command line of train_card_detector and return its exit code."""
    parser = argparse.ArgumentParser(
        prog="train_card_detector", description="Train a card detector on drawn cards.",
        epilog="; ".join(f"{name}: by default {plan.epochs} epochs" for name, plan in PLANS.items()),
    )
    parser.add_argument("--model", choices=MODELS, default="eureka",
                        help="eureka: YOLO-Dr. Eureka (default); tiny: YOLOv2-tiny, its baseline")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER",
                        help="for weights, log and checkpoint; a run that was broken off goes on from there, if asked for "
                        "the same")
    parser.add_argument("--install", action="store_true",
                        help="put the finished weights and their log into the package's config/weights")
    parser.add_argument("--epochs", type=int)
    parser.add_argument("--samples", type=int, dest="samples_per_epoch", help="crops an epoch")
    parser.add_argument("--batch", type=int)
    parser.add_argument("--seed", type=int, help="seed of the cards and the first weights")
    parser.add_argument("--pool", type=int, help="cards drawn ahead")
    parser.add_argument("--bfloat16", action="store_true", default=None,
                        help="multiply in half precision: twice as fast on processors made for it")
    options = vars(parser.parse_args(argv))
    model, out, install = (options.pop(name) for name in ("model", "out", "install"))
    plan = replace(PLANS[model], **{name: value for name, value in options.items() if value is not None})
    if min(plan.epochs, plan.batch, plan.pool) < 1 or plan.samples_per_epoch < plan.batch or plan.seed < 0:
        parser.error("epochs, batch and pool must be at least 1, samples at least a batch, and the seed at least 0")
    try:
        print(f"{model}: {parameter_count(build_network(model))} parameters, {plan.epochs} epochs, into {out}", flush=True)
        network = train(plan, out)
        if install:
            files = save_detector(model, to_arrays(network))
            shutil.copy(out / log_name(model), resource_path(WEIGHTS_FOLDER))
            print("installed " + ", ".join(str(file) for file in files))
    except (DrEurekaError, OSError) as error:
        print(f"train_card_detector: {error}", file=sys.stderr)
        return 1
    return 0
