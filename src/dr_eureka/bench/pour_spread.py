"""How far things are off in trials of pours, and pours that are timed a little wrongly."""
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dr_eureka.control.settings import ControlSettings


@dataclass(frozen=True)
class Spread:
    """How far things are off in each trial, evenly drawn between minus and plus these.

    materials: share of friction and of bounce; placement: where a tube stands to where it was located, x and y [m]; grasp and tilt:
    how a tube sits in the hand to how it is believed to, along [m] and about [rad] the tube's axes; timing: of each stretch of a
    pour [s].
    """

    materials: float
    placement: float
    grasp: float
    tilt: float
    timing: float


NONE = Spread(0.0, 0.0, 0.0, 0.0, 0.0)


def mistimed(settings: ControlSettings, spread: Spread, rng: np.random.Generator) -> ControlSettings:
    """Return settings whose pours last a little longer or shorter: each keyframe of the lock, the way down of the others."""
    def late() -> float:
        return float(rng.uniform(-spread.timing, spread.timing))

    lock, linear, profiled = settings.lock_pour, settings.linear_pour, settings.profiled_pour
    keyframes = tuple(replace(frame, seconds=frame.seconds + late()) for frame in lock.keyframes)
    # Some 150 steps lead down.
    step = linear.step_seconds + late() / 150.0
    shift = late()
    return replace(
        settings,
        lock_pour=replace(lock, keyframes=keyframes),
        linear_pour=replace(linear, step_seconds=step),
        profiled_pour=replace(profiled, dip_seconds={staying: seconds + shift for staying, seconds in profiled.dip_seconds.items()}),
    )
