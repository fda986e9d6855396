"""The command `train_saika_network`: make the weights of Saika's arm network anew."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Optional

from dr_eureka.errors import DrEurekaError
from dr_eureka.resources import WEIGHTS_FOLDER, resource_path

_TEST_PLACES = 5000


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code, 2 for bad input."""
    arguments = _parser().parse_args(argv)
    try:
        arguments.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = f"{error.strerror}; expected a folder for the weights"
        print(f"train_saika_network: --out {arguments.out}: {reason}", file=sys.stderr)
        return 2
    # numpy and scipy take a second to import: only once the arguments are known to be good
    import numpy as np

    from dr_eureka.catching.arm_network import WEIGHTS, SaikaNetwork
    from dr_eureka.catching.arm_training import draw_samples, learn
    from dr_eureka.catching.saika import SaikaArm
    from dr_eureka.catching.settings import SaikaSettings
    from dr_eureka.catching.working_area import WorkingArea
    from dr_eureka.resources import save_weights

    try:
        settings = SaikaSettings.load()
        arm = SaikaArm(settings)
        area, rng = WorkingArea(settings.working_area, arm), np.random.default_rng(arguments.seed)
        samples = draw_samples(arm, area, rng)
        print(f"learning {len(samples.joints)} samples", file=sys.stderr)
        learnt = learn(arm, area, samples, rng)
        file = save_weights(WEIGHTS, learnt.weights, arguments.out)
        places = area.draw(_TEST_PLACES, rng)
        reached = arm.basket_centre(SaikaNetwork(learnt.weights, settings).four_joints(places))
    except DrEurekaError as error:
        print(f"train_saika_network: {error}", file=sys.stderr)
        return 2
    error_mm = 1000.0 * np.linalg.norm(reached - places, axis=1)
    print(f"{file}: the hand is {error_mm.mean():.2f} mm off in the mean, {error_mm.max():.1f} mm at most")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="train_saika_network",
        description="Train the network that puts Saika's left hand to a place (ten seconds on a free core): 162 samples "
        "of the arm and working area in config/saika.yaml, after a change of which the shipped weights are refused.",
    )
    parser.add_argument(
        "--out", type=Path, default=resource_path(WEIGHTS_FOLDER), help="folder of the weights (default: the package's)"
    )
    parser.add_argument("--seed", type=int, default=1, help="seed of samples and first weights")
    return parser
