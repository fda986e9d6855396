"""The direct pour as the pouring tube's tilt over time, in its two forms (paper 3.5, Figure 13)."""

from __future__ import annotations

from math import copysign, sqrt
from typing import Callable

import numpy as np

from dr_eureka.control.codes import ControlError, EngineCode
from dr_eureka.control.settings import LinearPourSettings, ProfiledPourSettings, TiltLimits

STEP_S = 0.001
_ARRIVED = 0.002  # [rad]

Tilt = tuple[np.ndarray, np.ndarray]
"""Times (k,) [s] and elevations (k,) [rad]."""


def linear_tilt(settings: LinearPourSettings, balls_before: int, count: int) -> Tilt:
    """Return the tilt that goes evenly from the ready to the pouring elevation and, at the step of this pour, back at once.

    The paper's comes back to the ready elevation; ours first goes past it, to the return elevation. Raises ControlError for a
    pour that has no return step.
    """
    step = settings.return_steps.get(balls_before, {}).get(count)
    if step is None:
        raise _impossible("linear", balls_before, count)
    way = settings.pouring_elevation - settings.ready_elevation
    forward = settings.step_seconds * (settings.poses + 1)
    turn = step * settings.step_seconds

    def command(time: float) -> float:
        return settings.ready_elevation + way * min(time / forward, 1.0) if time < turn else settings.return_elevation

    return _then_ready(_followed(command, settings.ready_elevation, settings.limits, turn), settings)


def profiled_tilt(settings: ProfiledPourSettings, balls_before: int, count: int) -> Tilt:
    """Return the tilt that dips as quickly as it may, then rises well above level, then comes back to the ready elevation.

    So the tube accelerates the train of balls, then brakes it: how long the dip is commanded depends on how many balls stay
    behind, that is on where the first of them starts. Raises ControlError for a pour of more balls than there are.
    """
    turn = settings.dip_seconds.get(balls_before - count)
    if count < 1 or turn is None:
        raise _impossible("profiled", balls_before, count)
    there = _followed(
        lambda time: settings.dip_elevation if time < turn else settings.return_elevation,
        settings.ready_elevation, settings.limits, turn,
    )
    return _then_ready(there, settings)


def _then_ready(there: Tilt, settings: LinearPourSettings | ProfiledPourSettings) -> Tilt:
    """Let a tilt that has come to the return elevation stay there for a while, then go smoothly to the ready elevation."""
    times = np.arange(0.0, settings.back_seconds, STEP_S) + STEP_S
    share = np.clip(times / settings.back_seconds, 0.0, 1.0)
    smooth = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    back = settings.return_elevation + smooth * (settings.ready_elevation - settings.return_elevation)
    began = there[0][-1] + settings.hold_seconds
    return np.concatenate([there[0], [began], began + times]), np.concatenate([there[1], [settings.return_elevation], back])


def _impossible(method: str, balls_before: int, count: int) -> ControlError:
    return ControlError(EngineCode.INVALID_ACTION, f"a {method} pour of {count} out of {balls_before} balls is not possible")


def _followed(command: Callable[[float], float], start: float, limits: TiltLimits, turn: float) -> Tilt:
    """Return how a tilt at rest at `start` [rad] follows a command, time [s] -> elevation [rad], within limits.

    It ends at the goal that holds from `turn` [s] on.
    """
    times, elevations, rate, goal = [0.0], [start], 0.0, command(turn)
    while times[-1] <= turn or abs(goal - elevations[-1]) > _ARRIVED:
        gap = command(times[-1]) - elevations[-1]
        wanted = copysign(min(limits.rate, sqrt(2.0 * limits.acceleration * abs(gap)), abs(gap) / STEP_S), gap)
        change = limits.acceleration * STEP_S
        rate += min(max(wanted - rate, -change), change)
        times.append(times[-1] + STEP_S)
        elevations.append(elevations[-1] + rate * STEP_S)
    return np.array([*times, times[-1] + STEP_S]), np.array([*elevations, goal])
