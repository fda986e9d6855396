"""What a solve of the inverse kinematics answers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


class IkCode:
    """How a solve ended."""

    CONVERGED = "CONVERGED"  # within both tolerances and the limits
    NO_CONVERGENCE = "NO_CONVERGENCE"  # cycles, time or progress ran out; the last errors say how near
    UNREACHABLE = "UNREACHABLE"  # farther from the shoulder than the arm is long
    OUT_OF_LIMITS = "OUT_OF_LIMITS"  # the start is outside the limits, or the target was reached only when they were ignored
    INVALID_TARGET = "INVALID_TARGET"  # target or start is not finite, of the wrong shape, or not a rigid transform


@dataclass(frozen=True)
class IkResult:
    """The answer of a solve.

    joints: (n,) [rad], the best found even when not CONVERGED, inside the limits; the start as given when nothing was tried.
    Errors are those of `joints`, NaN when nothing was tried; for UNREACHABLE the position error is what the reach falls
    short. cycles counts all steps of all attempts, network_cycles those that the network made. path: joint vectors from the
    start to `joints`, step by step, of the attempt that gave the answer; with restarts > 0 that attempt began elsewhere, so
    the path's first step is a jump.
    """

    code: str
    joints: np.ndarray
    position_error_m: float
    orientation_error_rad: float
    cycles: int = 0
    network_cycles: int = 0
    restarts: int = 0
    path: list[np.ndarray] = field(default_factory=list)
    reason: str = ""
