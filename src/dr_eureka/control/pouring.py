"""Pouring from one held tube into the other: the lock-pour and the direct pour (paper 3.5, Figures 13 and 19)."""

from __future__ import annotations

from functools import cached_property
from typing import Iterator

import numpy as np
from scipy.interpolate import CubicSpline

from dr_eureka.control.arm import Arm
from dr_eureka.control.body import Body
from dr_eureka.control.codes import ControlError, EngineCode
from dr_eureka.control.collision import tube_body
from dr_eureka.control.grasp import hand_for_tube
from dr_eureka.control.motion import Follow, Motion, Trajectory
from dr_eureka.control.pour_geometry import PourGeometry
from dr_eureka.control.pour_tilt import Tilt, linear_tilt, profiled_tilt
from dr_eureka.control.settings import ControlSettings, LinearPourSettings, LockPourSettings, ProfiledPourSettings
from dr_eureka.control.trajectory import JointTrajectory, SampledTrajectory, TrajectorySequence
from dr_eureka.game.hands import HANDS
from dr_eureka.kinematics.arms import mirror_transform

# Poses per keyframe: joint angles between them follow a cubic spline, which is then within 0.1 mm of the exact lip.
_POSES_PER_KEYFRAME = 8
_TILT_SPACING = 0.05  # [rad] between solved poses of a tilt, for the same reason


def pour_settings(settings: ControlSettings, method: str) -> LockPourSettings | LinearPourSettings | ProfiledPourSettings:
    """Return the settings of a way to pour, one of POUR_METHODS."""
    return {"lock": settings.lock_pour, "linear": settings.linear_pour, "profiled": settings.profiled_pour}[method]


class PourPlanner:
    """Turn tube poses of one pour into joint angles of the two arms that hold the tubes."""

    def __init__(self, body: Body, source_hand: str, method: str):
        self.settings = pour_settings(body.settings, method)
        self.source, self.target = body.arms[source_hand], body.arms[_other(source_hand)]
        # The pour's own geometry keeps the lips apart by less than any margin.
        self.lips = frozenset({frozenset(tube_body(held.tube) for held in body.held.values())})
        self._geometry = PourGeometry(body.settings.pour_place, self.settings.lip, body.pieces)
        self._held = body.held
        self._rest_source = self.source.posture(body.settings.postures.pour_source)
        self._rest_target = self.target.posture(body.settings.postures.pour_target)

    def _placed(self, base_from_tube: np.ndarray) -> np.ndarray:
        return base_from_tube if self.source.hand == "left" else mirror_transform(base_from_tube)

    @cached_property
    def receiving(self) -> np.ndarray:
        """The receiving arm's joint angles (7,) for the whole pour."""
        pose = hand_for_tube(self._placed(self._geometry.target()), self._held[self.target.hand].end_from_tube)
        return self.target.solve(self._rest_target, pose, EngineCode.UNREACHABLE_POUR, "the receiving pose", self._rest_target)

    @cached_property
    def ready(self) -> np.ndarray:
        """The pouring arm's joint angles (7,) at the ready pose."""
        settings = self.settings
        pose = self._source_pose(settings.ready_elevation, settings.ready_withdrawn)
        return self.source.solve(self._rest_source, pose, EngineCode.UNREACHABLE_POUR, "the ready pose", self._rest_source)

    @cached_property
    def docking(self) -> np.ndarray:
        """The pouring arm's joint angles (k, 7) from beside the other tube to the ready pose: along a straight line, not turning."""
        settings = self.settings
        out = np.linspace(settings.ready_withdrawn, settings.undocked, _POSES_PER_KEYFRAME + 1)[1:]
        way = self._path(self.ready, np.full(len(out), settings.ready_elevation), out)
        return np.vstack([way[::-1], self.ready])

    def _path(self, start: np.ndarray, elevations: np.ndarray, withdrawn: np.ndarray) -> np.ndarray:
        """Return the pouring arm's joint angles (k, 7) along elevations (k,) [rad] and withdrawals (k,) [m], without jumps."""
        poses = [self._source_pose(elevation, out) for elevation, out in zip(elevations, withdrawn)]
        return self.source.path(start, poses, EngineCode.UNREACHABLE_POUR, "a pose of the pour", self._rest_source)

    def _source_pose(self, elevation: float, withdrawn: float) -> np.ndarray:
        held = self._held[self.source.hand]
        return hand_for_tube(self._placed(self._geometry.source(elevation, withdrawn)), held.end_from_tube)

    def motions(self, balls_before: int, count: int) -> list[Trajectory]:
        """Return the pouring arm's way from ready to ready, once or ball by ball; raises ControlError."""
        settings = self.settings
        if isinstance(settings, LockPourSettings):
            return [self._keyframed(settings)] * count
        if isinstance(settings, LinearPourSettings):
            return [self._tilted(linear_tilt(settings, balls_before, count))]
        return [self._tilted(profiled_tilt(settings, balls_before, count))]

    def _keyframed(self, settings: LockPourSettings) -> TrajectorySequence:
        """Dock, dip until one ball lies on both lips, raise so that the others roll back, withdraw so that it drops."""
        elevation, withdrawn, here = settings.ready_elevation, settings.ready_withdrawn, self.ready
        shares = np.linspace(0.0, 1.0, _POSES_PER_KEYFRAME + 1)[1:]
        parts = []
        for frame in settings.keyframes:
            path = self._path(
                here, elevation + shares * (frame.elevation - elevation), withdrawn + shares * (frame.withdrawn - withdrawn)
            )
            parts.append(JointTrajectory.lasting(np.vstack([here, path]), frame.seconds))
            elevation, withdrawn, here = frame.elevation, frame.withdrawn, path[-1]
        return TrajectorySequence(parts)

    def _tilted(self, tilt: Tilt) -> SampledTrajectory:
        """Turn the tube about its lip as a tilt says."""
        times, elevations = tilt
        level = self.settings.ready_elevation
        nodes, joints = [level], [self.ready]
        for end in (elevations.min(), elevations.max()):
            steps = int(np.ceil(abs(end - level) / _TILT_SPACING))
            way = np.linspace(level, end, steps + 1)[1:]
            nodes += way.tolist()
            joints += list(self._path(self.ready, way, np.full(steps, self.settings.ready_withdrawn)))
        order = np.argsort(nodes)
        return SampledTrajectory(times, CubicSpline(np.array(nodes)[order], np.array(joints)[order])(elevations))


def raise_tubes(body: Body) -> Iterator[Motion]:
    """Bring both held tubes from a pour's ready pose back to upright, side by side."""
    if body.pour_ready is not None and all(hand in body.held for hand in HANDS):
        planner = PourPlanner(body, *body.pour_ready)
        points = np.vstack([body.commanded(planner.source.hand), planner.docking[-2::-1]])
        yield _along(body, planner, points)
    tracks = []
    for hand, upright in body.upright.items():
        if hand in body.held:
            tracks.append((body.arms[hand], body.commanded(hand), upright))
    yield _together(body, tracks)
    body.pour_ready, body.upright = None, {}


def _other(hand: str) -> str:
    return next(other for other in HANDS if other != hand)


def _together(body: Body, moves: list[tuple[Arm, np.ndarray, np.ndarray]]) -> Follow:
    """Return joint-space moves of several arms, each from one posture (7,) to another [rad], that start and end together."""
    limits = body.settings.speeds.carry
    longest = max(arm.move(start, end, limits).duration for arm, start, end in moves)
    return Follow(tuple((arm.joints, arm.move(start, end, limits, longest)) for arm, start, end in moves))


def _along(body: Body, planner: PourPlanner, points: np.ndarray) -> Follow:
    """Return the pouring arm's way through joint angles (k, 7) [rad] near the other tube."""
    return Follow(((planner.source.joints, JointTrajectory.within(points, body.settings.speeds.carry)),), planner.lips)


def pour(body: Body, source_hand: str, target_hand: str, method: str, balls_before: int, count: int) -> Iterator[Motion]:
    """Pour `count` balls out of the tube in one hand into the tube in the other; raises ControlError.

    Both tubes stay at the ready pose, so that a pour of the same kind can follow at once.
    """
    if source_hand not in body.held or target_hand not in body.held or source_hand == target_hand:
        raise ControlError(EngineCode.INVALID_ACTION, f"a pour needs a tube in each hand, held: {sorted(body.held)}")
    planner = PourPlanner(body, source_hand, method)
    motions = planner.motions(balls_before, count)
    if body.pour_ready != (source_hand, method):
        yield from _get_ready(body, planner)
        body.pour_ready = (source_hand, method)
    for motion in motions:
        yield Follow(((planner.source.joints, motion),), planner.lips)
    body.check_grip(source_hand, EngineCode.TUBE_SLIPPED, "after the pour")
    body.check_grip(target_hand, EngineCode.TUBE_SLIPPED, "after receiving")


def _get_ready(body: Body, planner: PourPlanner) -> Iterator[Motion]:
    """Bring the tubes, upright in the hands, to the ready pose: side by side first, then lip to lip."""
    source, target = planner.source, planner.target
    body.upright = {arm.hand: body.commanded(arm.hand) for arm in (source, target)}
    yield _together(
        body,
        [(source, body.commanded(source.hand), planner.docking[0]), (target, body.commanded(target.hand), planner.receiving)],
    )
    body.check_grip(source.hand, EngineCode.TUBE_SLIPPED, "ready to pour")
    body.check_grip(target.hand, EngineCode.TUBE_SLIPPED, "ready to receive")
    yield _along(body, planner, planner.docking)
