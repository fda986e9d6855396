"""The command `plan_game`: print the pours and actions from one state to another."""
from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any, Optional

from dr_eureka.game.actions import actions_for
from dr_eureka.game.drawing import draw_state
from dr_eureka.game.planner import plan_pours
from dr_eureka.game.state import START, Pour, State, StateError


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code, 2 for bad input."""
    arguments = _parser().parse_args(argv)
    try:
        start, goal = State.parse(arguments.start), State.parse(arguments.goal)
    except StateError as error:
        print(f"plan_game: {error}", file=sys.stderr)
        return 2
    pours = plan_pours(start, goal)
    if arguments.json:
        print(json.dumps(plan_as_mapping(start, goal, pours)))
    else:
        print("\n".join(plan_as_lines(start, goal, pours)))
    return 0


def plan_as_mapping(start: State, goal: State, pours: Sequence[Pour]) -> dict[str, Any]:
    """Return a plan in the shape of `--json`: cost in balls moved, pours, and actions without their unused fields."""
    return {
        "start": str(start),
        "goal": str(goal),
        "strategy": "fewest",
        "cost": sum(pour.count for pour in pours),
        "pours": [asdict(pour) for pour in pours],
        "actions": [{key: value for key, value in asdict(action).items() if value} for action in actions_for(pours)],
    }


def plan_as_lines(start: State, goal: State, pours: Sequence[Pour]) -> Iterator[str]:
    """Yield the lines of a plan that a person can follow: numbered actions, the tubes drawn after each pour."""
    actions = actions_for(pours)
    handling = sum(action.kind != "pour" for action in actions)
    pour_count = f"{len(pours)} {'pour' if len(pours) == 1 else 'pours'}"
    yield f"{start} to {goal}: {pour_count}, {handling} picks and places"
    yield ""
    yield draw_state(start)
    state = start
    for number, action in enumerate(actions, 1):
        if number == 1 or actions[number - 2].kind == "pour":
            yield ""
        yield f"{number:3}. {action}"
        if action.kind == "pour":
            state = state.after(Pour(action.tube, action.target_tube, action.count))
            yield ""
            yield f"{draw_state(state)}    {state}"
    if not actions:
        yield ""
        yield "Nothing to do: the goal is the start."


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="plan_game",
        description="Print the shortest plan (fewest pours, then fewest picks and places) that leads to a goal.",
        epilog="A state is written RR|GG|PP: tubes left to right as the robot sees them, balls bottom to top, "
        "R red, G green, P purple; an empty tube is empty, as in RRGG||PP. Quote it: | is special to a shell.",
    )
    parser.add_argument("goal", metavar="GOAL", help="the state to reach")
    parser.add_argument(
        "--start", default=str(START), metavar="STATE", help="the state to begin with (default: %(default)s)"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of text")
    return parser
