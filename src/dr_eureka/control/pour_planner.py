"""One pour as motions of two arms: from how the mouths are to one another to joint angles (paper 3.5, Figures 13 and 19)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from dr_eureka.control.arm import Arm
from dr_eureka.control.body import Body
from dr_eureka.control.codes import EngineCode
from dr_eureka.control.collision import tube_body
from dr_eureka.control.grasp import hand_for_tube
from dr_eureka.control.motion import Follow
from dr_eureka.control.pour_geometry import PourGeometry
from dr_eureka.control.pour_tilt import Tilt, linear_tilt, profiled_tilt
from dr_eureka.control.settings import ControlSettings, LinearPourSettings, LockPourSettings, ProfiledPourSettings
from dr_eureka.control.trajectory import JointTrajectory, SampledTrajectory, TrajectorySequence
from dr_eureka.game.hands import other_hand
from dr_eureka.kinematics.arms import mirror_transform

# Poses per keyframe: joint angles between them follow a cubic spline, which is then within 0.1 mm of the exact lip.
_POSES_PER_KEYFRAME = 8
_TILT_SPACING = 0.05  # [rad] between solved poses of a tilt, for the same reason


def pour_settings(settings: ControlSettings, method: str) -> LockPourSettings | LinearPourSettings | ProfiledPourSettings:
    """Return the settings of a way to pour, one of POUR_METHODS."""
    return {"lock": settings.lock_pour, "linear": settings.linear_pour, "profiled": settings.profiled_pour}[method]


@dataclass(frozen=True)
class _Side:
    """One arm in a pour.

    `rest`: the posture (7,) [rad] that it is drawn to; `hand`: base_from_end (4, 4) by elevation [rad] and withdrawal [m].
    """

    arm: Arm
    rest: np.ndarray
    hand: Callable[[float, float], np.ndarray]

    def path(self, start: np.ndarray, elevations: np.ndarray, withdrawn: np.ndarray) -> np.ndarray:
        """Return joint angles (k, 7) along elevations (k,) [rad] and withdrawals (k,) [m], without jumps.

        Raises ControlError (UNREACHABLE_POUR).
        """
        poses = [self.hand(elevation, out) for elevation, out in zip(elevations, withdrawn)]
        return self.arm.path(start, poses, EngineCode.UNREACHABLE_POUR, "a pose of the pour", self.rest)


class PourPlanner:
    """Turn the way of one tube's mouth to the other's into joint angles of the two arms that hold the tubes.

    How the tubes sit in the hands is taken from `body`. The receiving arm moves only where it has a share of the tilt.
    """

    def __init__(self, body: Body, source_hand: str, method: str):
        self.settings = pour_settings(body.settings, method)
        target_hand = other_hand(source_hand)
        self.source, self.target = body.arms[source_hand], body.arms[target_hand]
        # The pour's own geometry keeps the lips apart by less than any margin.
        self.lips = frozenset({frozenset(tube_body(held.tube) for held in body.held.values())})
        self._geometry = PourGeometry(body.settings.pour_place, self.settings.lip, body.pieces)
        self._target_share = 1.0 - body.settings.pour_place.source_share
        self._held = body.held
        postures = body.settings.postures
        self._source = _Side(self.source, self.source.posture(postures.pour_source), self._source_hand)
        self._target = _Side(self.target, self.target.posture(postures.pour_target), self._target_hand)

    def _turn(self, elevation: float) -> float:
        """Return how far [rad] both tubes are turned because the receiving arm does its share of the tilt."""
        return self._target_share * (self.settings.ready_elevation - elevation)

    def _source_hand(self, elevation: float, withdrawn: float) -> np.ndarray:
        return self._holding(self.source, self._geometry.source(elevation, withdrawn, self._turn(elevation)))

    def _target_hand(self, elevation: float, _: float) -> np.ndarray:
        return self._holding(self.target, self._geometry.target(self._turn(elevation)))

    def _holding(self, arm: Arm, base_from_tube: np.ndarray) -> np.ndarray:
        """Return base_from_end (4, 4) with which an arm holds its tube at a pose given for a pour from the left hand."""
        pose = base_from_tube if self.source.hand == "left" else mirror_transform(base_from_tube)
        return hand_for_tube(pose, self._held[arm.hand].end_from_tube)

    @cached_property
    def receiving(self) -> np.ndarray:
        """The receiving arm's joint angles (7,) at the ready pose."""
        return self._ready(self._target, "the receiving pose")

    @cached_property
    def ready(self) -> np.ndarray:
        """The pouring arm's joint angles (7,) at the ready pose."""
        return self._ready(self._source, "the ready pose")

    def _ready(self, side: _Side, what: str) -> np.ndarray:
        pose = side.hand(self.settings.ready_elevation, self.settings.ready_withdrawn)
        return side.arm.solve(side.rest, pose, EngineCode.UNREACHABLE_POUR, what, side.rest)

    @cached_property
    def docking(self) -> np.ndarray:
        """The pouring arm's joint angles (k, 7) from beside the other tube straight to the ready pose, not turning."""
        settings = self.settings
        out = np.linspace(settings.ready_withdrawn, settings.undocked, _POSES_PER_KEYFRAME + 1)[1:]
        way = self._source.path(self.ready, np.full(len(out), settings.ready_elevation), out)
        return np.vstack([way[::-1], self.ready])

    def motions(self, balls_before: int, count: int) -> list[Follow]:
        """Return the arms' way from ready to ready, once or ball by ball; raises ControlError."""
        settings = self.settings
        if isinstance(settings, LockPourSettings):
            return [self._motion(lambda side, ready: _keyframed(side, ready, settings))] * count
        if isinstance(settings, LinearPourSettings):
            tilt = linear_tilt(settings, balls_before, count)
        else:
            tilt = profiled_tilt(settings, balls_before, count)
        return [self._motion(lambda side, ready: _tilted(side, ready, settings, tilt))]

    def _motion(self, way: Callable[[_Side, np.ndarray], TrajectorySequence | SampledTrajectory]) -> Follow:
        """Return the motion of the arms that move, given the way (side, ready posture) that each of them goes."""
        tracks = [(self.source.joints, way(self._source, self.ready))]
        if self._target_share > 0.0:
            tracks.append((self.target.joints, way(self._target, self.receiving)))
        return Follow(tuple(tracks), self.lips)


def _keyframed(side: _Side, ready: np.ndarray, settings: LockPourSettings) -> TrajectorySequence:
    """Dip until one ball lies on both lips, raise so that the others roll back, withdraw so that it drops."""
    elevation, withdrawn, here = settings.ready_elevation, settings.ready_withdrawn, ready
    shares = np.linspace(0.0, 1.0, _POSES_PER_KEYFRAME + 1)[1:]
    parts = []
    for frame in settings.keyframes:
        path = side.path(
            here, elevation + shares * (frame.elevation - elevation), withdrawn + shares * (frame.withdrawn - withdrawn)
        )
        parts.append(JointTrajectory.lasting(np.vstack([here, path]), frame.seconds))
        elevation, withdrawn, here = frame.elevation, frame.withdrawn, path[-1]
    return TrajectorySequence(parts)


def _tilted(
    side: _Side, ready: np.ndarray, settings: LinearPourSettings | ProfiledPourSettings, tilt: Tilt
) -> SampledTrajectory:
    """Turn the tubes to one another about the pouring tube's lip as a tilt says."""
    times, elevations = tilt
    level = settings.ready_elevation
    nodes, joints = [level], [ready]
    for end in (elevations.min(), elevations.max()):
        steps = int(np.ceil(abs(end - level) / _TILT_SPACING))
        way = np.linspace(level, end, steps + 1)[1:]
        nodes += way.tolist()
        joints += list(side.path(ready, way, np.full(steps, settings.ready_withdrawn)))
    order = np.argsort(nodes)
    return SampledTrajectory(times, CubicSpline(np.array(nodes)[order], np.array(joints)[order])(elevations))
