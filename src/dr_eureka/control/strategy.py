"""A strategy as motions: its actions one after the other, or two at a time where both hands are free to work at once."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Iterator, Mapping, Sequence

import numpy as np

from dr_eureka.control.at_once import at_once
from dr_eureka.control.body import Body
from dr_eureka.control.codes import ControlError, EngineCode
from dr_eureka.control.motion import Motion, Wait
from dr_eureka.control.picking import go_home, pick, place
from dr_eureka.control.pouring import pour, raise_tubes
from dr_eureka.control.recovery import put_all_down
from dr_eureka.game.actions import Action
from dr_eureka.game.hands import HANDS
from dr_eureka.game.state import TUBE_CAPACITY

_KINDS = ("pick", "place", "pour")


@dataclass
class Script:
    """What the engine carries out: motions, each worked out when the one before is over, and how far it has come.

    `action_index`, `at_once`: of a strategy's actions, the last one under way and how many are; -1 and 0 outside one.
    `paused`: it waits for somebody to look at the tubes. `put_down`: it shall leave the rest and put down what is held.
    `now`: when the motion before ended [s]. `durations`: (action index, start, end) [s] of the actions that are done.
    """

    message: str
    motions: Iterator[Motion] = field(default_factory=lambda: iter(()))
    action_index: int = -1
    at_once: int = 0
    paused: bool = False
    put_down: bool = False
    now: float = 0.0
    durations: list[tuple[int, float, float]] = field(default_factory=list)


def check_actions(actions: Sequence[Action], places: Mapping[str, Sequence[float]]) -> None:
    """Raise ControlError for an action that names an unknown kind, a hand the robot lacks or a tube without a place."""
    for index, action in enumerate(actions):
        pours = action.kind == "pour"
        hands = (action.hand, action.target_hand) if pours else (action.hand,)
        tubes = (action.tube, action.target_tube) if pours else (action.tube,)
        for name, known in (((action.kind,), _KINDS), (hands, HANDS), (tubes, tuple(places))):
            strange = [word for word in name if word not in known]
            if strange:
                expected = ", ".join(known) or "none"
                raise ControlError(
                    EngineCode.INVALID_ACTION, f"action {index} ({action}): {strange[0]!r}, expected one of {expected}"
                )


def _check_counts(actions: Sequence[Action], balls: Mapping[str, int]) -> None:
    """Raise ControlError for a pour of more balls than its tube will hold by then, or than the other one has room for."""
    held = dict(balls)
    for index, action in enumerate(actions):
        if action.kind != "pour":
            continue
        there, room = held.get(action.tube, 0), TUBE_CAPACITY - held.get(action.target_tube, 0)
        if not 1 <= action.count <= min(there, room):
            problem = f"the tube will hold {there} balls by then, the other one have room for {room}"
            raise ControlError(EngineCode.INVALID_ACTION, f"action {index} ({action}): {problem}")
        held[action.tube], held[action.target_tube] = there - action.count, TUBE_CAPACITY - room + action.count


def strategy(
    body: Body, actions: Sequence[Action], balls: Mapping[str, int], method: str, pauses: bool, hands_at_once: bool
) -> Script:
    """Return the script that carries actions out; see `ControlEngine.start`."""
    _check_counts(actions, balls)
    script = Script("strategy accepted")
    homes = dict(body.places)
    motions = _motions(script, body, homes, tuple(actions), dict(balls), method, pauses, hands_at_once)
    script.motions = _tidied(body, homes, motions)
    return script


def _tidied(body: Body, homes: Mapping[str, np.ndarray], motions: Iterator[Motion]) -> Iterator[Motion]:
    """Yield a strategy's motions; when a hand fails to hold its tube, put everything down before saying so."""
    try:
        yield from motions
    except ControlError as fault:
        if fault.code not in EngineCode.PUT_DOWN:
            raise
        try:
            yield from put_all_down(body, homes)
        except ControlError as second:
            raise ControlError(second.code, f"{second.message}; before that, {fault}") from fault
        raise


def _motions(
    script: Script,
    body: Body,
    homes: Mapping[str, np.ndarray],
    actions: tuple[Action, ...],
    balls: dict[str, int],
    method: str,
    pauses: bool,
    hands_at_once: bool,
) -> Iterator[Motion]:
    def skill(action: Action) -> Iterator[Motion]:
        if action.kind == "pick":
            return pick(body, action.hand, action.tube)
        if action.kind == "place":
            return place(body, action.hand, action.tube, homes[action.tube])
        return _pour(body, action, balls, method)

    yield from go_home(body)
    index = 0
    while index < len(actions) and not script.put_down:
        under_way = actions[index : index + (2 if hands_at_once and _of_both_hands(actions[index : index + 2]) else 1)]
        started, last = script.now, index + len(under_way) - 1
        script.action_index, script.at_once, script.message = last, len(under_way), " and ".join(map(str, under_way))
        pours = under_way[0].kind == "pour"
        if body.pour_ready is not None and not (pours and body.pour_ready == (under_way[0].hand, method)):
            yield from raise_tubes(body)
        skills = [skill(action) for action in under_way]
        yield from skills[0] if len(skills) == 1 else at_once(body, *skills)
        script.durations += [(number, started, script.now) for number in range(index, last + 1)]
        index = last + 1
        if pauses and pours and any(action.kind == "pour" for action in actions[index:]):
            script.paused = True
            yield Wait(lambda *_: not script.paused, body.settings.guards.pause_seconds)
            script.paused = False
    if script.put_down:
        yield from raise_tubes(body)
        for hand, held in tuple(body.held.items()):
            yield from place(body, hand, held.tube, homes[held.tube])
    yield from go_home(body)


def _of_both_hands(actions: Sequence[Action]) -> bool:
    """Tell whether two actions are picks or places of different tubes by different hands."""
    return (
        len(actions) == 2
        and all(action.kind != "pour" for action in actions)
        and actions[0].hand != actions[1].hand
        and actions[0].tube != actions[1].tube
    )


def _pour(body: Body, action: Action, balls: dict[str, int], method: str) -> Iterator[Motion]:
    body.held_in(action.hand, action.tube)
    body.held_in(action.target_hand, action.target_tube)
    yield from pour(body, action.hand, action.target_hand, method, balls[action.tube], action.count)
    balls[action.tube] -= action.count
    balls[action.target_tube] = balls.get(action.target_tube, 0) + action.count
