"""The command `plan_game`: print the pours and actions from one state to another."""
from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from itertools import accumulate
from typing import Any, Optional

from dr_eureka.errors import DrEurekaError
from dr_eureka.game.actions import actions_for
from dr_eureka.game.planner import STRATEGIES, Plan, Planner, Result
from dr_eureka.game.planner_settings import load_planner_settings
from dr_eureka.game.state import START, Pour, State, draw_state

_UNITS = {"fewest": "balls", "fastest": "s", "surest": "s"}


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code, 2 for bad input."""
    try:
        arguments = _parser().parse_args(argv)
        start, goal = State.parse(arguments.start), State.parse(arguments.goal)
        planner = Planner(arguments.strategy, arguments.pour)
        plan = planner.plan(start, goal)
    except DrEurekaError as error:
        print(f"plan_game: {error}", file=sys.stderr)
        return 2
    print(json.dumps(plan_as_mapping(plan, planner)) if arguments.json else "\n".join(plan_as_lines(plan, planner)))
    return 0


def plan_as_mapping(plan: Plan, planner: Planner) -> dict[str, Any]:
    """Return a plan in the shape of `--json`: `states` are those after each pour, actions are without their unused fields.

    `surest` adds the chance to reach the goal, and `otherwise`: for each pour the other ways in which it may end, each
    with its share, the state (null: a ball is lost) and what to pour then.
    """
    mapping = {
        "start": str(plan.start),
        "goal": str(plan.goal),
        "strategy": plan.strategy,
        "pour": planner.method,
        "cost": int(plan.cost) if plan.strategy == "fewest" else round(plan.cost, 3),
        "unit": _UNITS[plan.strategy],
        "seconds": round(plan.seconds, 3),
        "pours": [asdict(pour) for pour in plan.pours],
        "states": [str(state) for state in accumulate(plan.pours, State.after, initial=plan.start)][1:],
        "actions": [{k: v for k, v in asdict(action).items() if v} for action in actions_for(plan.pours, planner.reach)],
    }
    if plan.chance is not None:
        mapping["chance"] = plan.chance
        mapping["otherwise"] = [[_result_as_mapping(result) for result in results] for results in _otherwise(plan, planner)]
    return mapping


def plan_as_lines(plan: Plan, planner: Planner) -> Iterator[str]:
    """Yield the lines of a plan that a person can follow: numbered actions, the tubes drawn after each pour."""
    actions = actions_for(plan.pours, planner.reach)
    handling = sum(action.kind != "pour" for action in actions)
    pour_count = f"{len(plan.pours)} {'pour' if len(plan.pours) == 1 else 'pours'}"
    yield f"{plan.start} to {plan.goal}: {pour_count}, {handling} picks and places, about {plan.seconds:.0f} s"
    if plan.chance is not None:
        yield f"Solved {plan.chance:.1%} of the time, in {plan.cost:.0f} s on average, if each pour is looked at."
    yield ""
    yield draw_state(plan.start)
    otherwise = iter(_otherwise(plan, planner) if plan.chance is not None else [()] * len(plan.pours))
    state = plan.start
    for number, action in enumerate(actions, 1):
        if number == 1 or actions[number - 2].kind == "pour":
            yield ""
        yield f"{number:3}. {action}"
        if action.kind == "pour":
            state = state.after(Pour(action.tube, action.target_tube, action.count))
            yield ""
            yield f"{draw_state(state)}    {state}"
            yield from map(_result_as_line, next(otherwise))
    if not actions:
        yield ""
        yield "Nothing to do: the goal is the start."


def _otherwise(plan: Plan, planner: Planner) -> list[tuple[Result, ...]]:
    """Return for each pour of a plan the other ways in which it may end."""
    states = accumulate(plan.pours, State.after, initial=plan.start)
    return [planner.results_of(pour, state, plan.goal) for pour, state in zip(plan.pours, states)]


def _result_as_mapping(result: Result) -> dict[str, Any]:
    return {
        "share": result.share,
        "state": None if result.state is None else str(result.state),
        "pour": None if result.pour is None else asdict(result.pour),
    }


def _result_as_line(result: Result) -> str:
    share = f"     {result.share:.1%} of the time"
    if result.state is None:
        return f"{share} a ball is lost"
    if result.pour is None:
        return f"{share} {result.state} instead: the goal"
    return f"{share} {result.state} instead: then pour {result.pour.count} from {result.pour.source} to {result.pour.target}"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="plan_game",
        description="Print the best plan that leads to a goal.",
        epilog="A state is written RR|GG|PP: tubes left to right as the robot sees them, balls bottom to top, "
        "R red, G green, P purple; an empty tube is empty, as in RRGG||PP. Quote it: | is special to a shell.",
    )
    methods = load_planner_settings().methods
    parser.add_argument("goal", metavar="GOAL", help="the state to reach")
    parser.add_argument(
        "--start", default=str(START), metavar="STATE", help="the state to begin with (default: %(default)s)"
    )
    parser.add_argument(
        "--strategy",
        choices=STRATEGIES,
        default=STRATEGIES[0],
        help="fewest: balls poured, one a pour, then picks and places; fastest: seconds; surest: chance to reach the goal "
        "when pours go wrong, then seconds (default: %(default)s)",
    )
    parser.add_argument(
        "--pour",
        choices=methods,
        default=methods[0],
        help="how balls are poured, on which time and chance depend (default: %(default)s)",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of text")
    return parser
