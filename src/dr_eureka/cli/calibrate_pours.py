"""The command `calibrate_pours`: when the direct pours turn back, found on the simulated robot, and the engine told so."""
from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Optional

from dr_eureka.errors import DrEurekaError
from dr_eureka.resources import load_yaml, resource_path

_CONTROL = "config/control_engine.yaml"
# Far from the worlds that `benchmark pour` draws from its seed: what was calibrated is judged on other grasps.
_FIRST_WORLD = 900_000_000


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code, 2 for bad input."""
    arguments = _parser().parse_args(argv)
    # Bullet takes a second to import: only once the arguments are known to be good
    from dr_eureka.bench.planner_file import rewrite
    from dr_eureka.bench.pour_calibration import NO_TURNS, Notes, search, told
    from dr_eureka.bench.pour_rig import PourRig
    from dr_eureka.bench.pour_spread import STATED
    from dr_eureka.control.settings import ControlSettings
    from dr_eureka.pieces import load_pieces
    from dr_eureka.simulation.settings import load_world_settings
    from dr_eureka.simulation.stage import Stage

    try:
        control = ControlSettings.from_mapping(load_yaml(_CONTROL), _CONTROL)
        world, pieces, stage, spread = load_world_settings(), load_pieces(), Stage(None), replace(STATED, placement=0.0)

        def make_rig(grasp: int) -> PourRig:
            return PourRig(control, world, pieces, spread, _FIRST_WORLD + 1000 * arguments.seed + grasp, stage)

        # All that an outcome depends on, but for the turns, which are what is searched for.
        same = repr((told(control, NO_TURNS), world, pieces, spread, arguments.seed))
        notes = Notes(arguments.notes, sha256(same.encode()).hexdigest())
        turns = search(make_rig, control, arguments.grasps, notes)
        for method, by_staying in turns.items():
            for staying, turn in by_staying.items():
                what = "ms" if method == "profiled" else "steps"
                print(f"{method}, {staying} balls stay behind: turn back after {turn.at} {what}; right in {turn.share:.0%} of grasps")
        if arguments.write:
            control = told(control, {method: {left: turn.at for left, turn in found.items()} for method, found in turns.items()})
            steps = control.linear_pour.return_steps
            figures = {("linear_pour", "return_steps", str(held)): _as_words(turns) for held, turns in steps.items()}
            figures["profiled_pour", "dip_seconds"] = _as_words(control.profiled_pour.dip_seconds)
            file = resource_path(_CONTROL)
            file.write_text(rewrite(file.read_text(encoding="utf-8"), figures), encoding="utf-8")
            print(f"written into {_CONTROL}")
    except (DrEurekaError, OSError) as error:
        print(f"calibrate_pours: {error}", file=sys.stderr)
        return 2
    return 0


def _as_words(figures: Mapping[int, float]) -> dict[str, float]:
    """Return figures by number with the numbers as words, as ROS wants the names of parameters."""
    return {str(number): figure for number, figure in figures.items()}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="calibrate_pours",
        description="Find on the simulated robot's own arms when linear and profiled pours must turn back: about a minute a grasp.",
    )
    parser.add_argument("--grasps", type=_positive, default=16, help="grasps of the tubes to try with (default: %(default)s)")
    parser.add_argument("--notes", type=Path, metavar="FILE", help="keep what was tried there, so that a search can go on later")
    parser.add_argument("--seed", type=int, default=1, help="seed of the grasps (default: %(default)s)")
    parser.add_argument("--write", action="store_true", help=f"write what was found into {_CONTROL}; comments stay")
    return parser


def _positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r}; expected a whole number, at least 1")
    return int(text)
