"""How far things are off in trials of pours, and pours that are timed a little wrongly."""
from __future__ import annotations

from dataclasses import dataclass, replace
from math import radians

import numpy as np

from dr_eureka.control.settings import ControlSettings


@dataclass(frozen=True)
class Spread:
    """How far things are off in each trial, evenly drawn between minus and plus these.

    materials: share of friction and of bounce of ball on tube; placement: where a tube stands to its nominal place, x and y [m], from where
    the robot's camera locates it; grasp and tilt: how a tube sits in the hand to how it is believed to, along [m] and about
    [rad] the tube's axes, which nothing tells the robot; timing: of each stretch of a pour [s].
    """

    materials: float
    placement: float
    grasp: float
    tilt: float
    timing: float


NONE = Spread(0.0, 0.0, 0.0, 0.0, 0.0)
STATED = Spread(materials=0.20, placement=0.003, grasp=0.001, tilt=radians(1.0), timing=0.002)
WIDE = Spread(materials=0.50, placement=0.003, grasp=0.002, tilt=radians(2.0), timing=0.002)


def mistimed(settings: ControlSettings, spread: Spread, rng: np.random.Generator, held: int, count: int) -> ControlSettings:
    """Return settings whose pours of `count` out of `held` balls are timed a little otherwise.

    Of the lock it is how long each keyframe lasts, of the others when they turn back.
    """
    def late() -> float:
        return float(rng.uniform(-spread.timing, spread.timing))

    lock, linear, profiled = settings.lock_pour, settings.linear_pour, settings.profiled_pour
    keyframes = tuple(replace(frame, seconds=frame.seconds + late()) for frame in lock.keyframes)
    step = linear.step_seconds + late() / linear.return_steps[held][count]
    shift = late()
    dips = {staying: seconds + shift for staying, seconds in profiled.dip_seconds.items()}
    return replace(
        settings,
        lock_pour=replace(lock, keyframes=keyframes),
        linear_pour=replace(linear, step_seconds=step),
        profiled_pour=replace(profiled, dip_seconds=dips),
    )
