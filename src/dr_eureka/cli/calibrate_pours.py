"""The command `calibrate_pours`: when the direct pours turn back, found on the simulated robot, and the engine told so."""
from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Optional

from dr_eureka.errors import DrEurekaError
from dr_eureka.resources import load_yaml, resource_path

_CONTROL = "config/control_engine.yaml"


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code, 2 for bad input."""
    arguments = _parser().parse_args(argv)
    # Bullet takes a second to import: only once the arguments are known to be good
    from dr_eureka.bench.planner_file import rewrite
    from dr_eureka.bench.pour_calibration import Notes, linear_steps, profiled_seconds
    from dr_eureka.bench.pour_rig import PourRig
    from dr_eureka.bench.pour_spread import NONE
    from dr_eureka.control.settings import ControlSettings
    from dr_eureka.pieces import load_pieces
    from dr_eureka.simulation.settings import load_world_settings
    from dr_eureka.simulation.stage import Stage

    try:
        control = ControlSettings.from_mapping(load_yaml(_CONTROL), _CONTROL)
        notes = Notes(arguments.notes)
        rig = PourRig(control, load_world_settings(), load_pieces(), NONE, arguments.seed, Stage(None))
        seconds = profiled_seconds(rig, control, notes)
        steps = linear_steps(rig, control, notes)
        print("profiled: the dip lasts, by balls that stay behind [s]:", seconds)
        for held, by_count in steps.items():
            print(f"linear, {held} balls: it turns back at step, by balls to pour:", by_count)
        if arguments.write:
            file = resource_path(_CONTROL)
            figures = {("linear_pour", "return_steps", str(held)): _as_words(turns) for held, turns in steps.items()}
            figures["profiled_pour", "dip_seconds"] = _as_words(seconds)
            text = rewrite(file.read_text(encoding="utf-8"), figures)
            file.write_text(text, encoding="utf-8")
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
        description="Find on the simulated robot's own arms when linear and profiled pours must turn back; some 100 pours.",
    )
    parser.add_argument("--notes", type=Path, metavar="FILE", help="keep what was tried there, so that a search can go on later")
    parser.add_argument("--seed", type=int, default=1, help="seed of the simulated world (default: %(default)s)")
    parser.add_argument("--write", action="store_true", help=f"write what was found into {_CONTROL}; comments stay")
    return parser
