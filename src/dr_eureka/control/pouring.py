"""Pouring from one held tube into the other: the lock-pour and the direct pour (paper 3.5, Figures 13 and 19)."""

from __future__ import annotations

from typing import Iterator

import numpy as np
from scipy.interpolate import CubicSpline

from dr_eureka.control.arm import Arm
from dr_eureka.control.body import Body
from dr_eureka.control.codes import ControlError, EngineCode
from dr_eureka.control.grasp import hand_for_tube
from dr_eureka.control.motion import Follow, Motion
from dr_eureka.control.pour_geometry import PourGeometry
from dr_eureka.control.settings import DirectPourSettings, LockPourSettings
from dr_eureka.control.trajectory import JointTrajectory, SampledTrajectory
from dr_eureka.kinematics.arms import mirror_transform

# Poses per keyframe: joint angles between them follow a cubic spline, which is then within 0.1 mm of the exact lip.
_POSES_PER_KEYFRAME = 8


class PourPlanner:
    """Turn tube poses of one pour into joint angles of the two arms that hold the tubes."""

    def __init__(self, body: Body, source_hand: str, target_hand: str, method: LockPourSettings | DirectPourSettings):
        self.geometry = PourGeometry(body.settings.pour_place, method.lip, body.pieces)
        self._body = body
        self._source, self._target = body.arms[source_hand], body.arms[target_hand]
        self._rest_source = self._source.posture(body.settings.postures.pour_source)
        self._rest_target = self._target.posture(body.settings.postures.pour_target)
        self._flip = source_hand == "right"

    def _placed(self, base_from_tube: np.ndarray) -> np.ndarray:
        return mirror_transform(base_from_tube) if self._flip else base_from_tube

    def target_joints(self) -> np.ndarray:
        """Return the receiving arm's joint angles (7,) for the whole pour."""
        held = self._body.held[self._target.hand]
        pose = hand_for_tube(self._placed(self.geometry.target()), held.end_from_tube)
        return self._target.solve(self._rest_target, pose, EngineCode.UNREACHABLE_POUR, "the receiving pose", self._rest_target)

    def source_joints(self, elevation: float, withdrawn: float) -> np.ndarray:
        """Return the pouring arm's joint angles (7,) with the tube at an elevation [rad], its lip withdrawn [m]."""
        pose = self._source_pose(elevation, withdrawn)
        return self._source.solve(self._rest_source, pose, EngineCode.UNREACHABLE_POUR, "the pouring pose", self._rest_source)

    def source_path(self, start: np.ndarray, elevations: np.ndarray, withdrawn: np.ndarray) -> np.ndarray:
        """Return the pouring arm's joint angles (k, 7) along elevations (k,) [rad] and withdrawals (k,) [m], without jumps."""
        poses = [self._source_pose(elevation, out) for elevation, out in zip(elevations, withdrawn)]
        return self._source.path(start, poses, EngineCode.UNREACHABLE_POUR, "a pose of the pour", self._rest_source)

    def _source_pose(self, elevation: float, withdrawn: float) -> np.ndarray:
        held = self._body.held[self._source.hand]
        return hand_for_tube(self._placed(self.geometry.source(elevation, withdrawn)), held.end_from_tube)


def raise_tubes(body: Body) -> Iterator[Motion]:
    """Bring both held tubes from a pour's ready pose back to upright, side by side."""
    tracks = []
    for hand, upright in body.upright.items():
        if hand in body.held:
            tracks.append((body.arms[hand], body.commanded(hand), upright))
    yield _together(body, tracks)
    body.pour_ready = None


def _together(body: Body, moves: list[tuple[Arm, np.ndarray, np.ndarray]]) -> Follow:
    """Return joint-space moves of several arms, each from one posture (7,) to another [rad], that start and end together."""
    trajectories = [(arm, arm.move(start, end, body.settings.speeds.carry)) for arm, start, end in moves]
    longest = max(trajectory.duration for _, trajectory in trajectories)
    return Follow(tuple((arm.joints, JointTrajectory(trajectory.points, longest)) for arm, trajectory in trajectories))


def pour(body: Body, source_hand: str, target_hand: str, method: str, balls_before: int, count: int) -> Iterator[Motion]:
    """Pour `count` balls out of the tube in one hand into the tube in the other; raises ControlError.

    Both tubes stay at the ready pose, so that a pour of the same kind can follow at once.
    """
    if source_hand not in body.held or target_hand not in body.held or source_hand == target_hand:
        raise ControlError(EngineCode.INVALID_ACTION, f"a pour needs a tube in each hand, held: {sorted(body.held)}")
    settings = {"lock": body.settings.lock_pour, "direct": body.settings.direct_pour}[method]
    planner = PourPlanner(body, source_hand, target_hand, settings)
    source, target = body.arms[source_hand], body.arms[target_hand]
    ready = planner.source_joints(settings.ready_elevation, settings.ready_withdrawn)
    receiving = planner.target_joints()
    if body.pour_ready is None:
        body.upright = {hand: body.commanded(hand) for hand in (source_hand, target_hand)}
    yield _together(body, [(source, body.commanded(source_hand), ready), (target, body.commanded(target_hand), receiving)])
    body.pour_ready = (source_hand, method)
    body.check_grip(source_hand, EngineCode.TUBE_SLIPPED, "ready to pour")
    body.check_grip(target_hand, EngineCode.TUBE_SLIPPED, "ready to receive")
    if method == "lock":
        for _ in range(count):
            yield from _lock(planner, settings, source.joints, ready)
    else:
        yield from _direct(planner, settings, source.joints, ready, balls_before, count)
    body.check_grip(source_hand, EngineCode.TUBE_SLIPPED, "after the pour")
    body.check_grip(target_hand, EngineCode.TUBE_SLIPPED, "after receiving")


def _lock(planner: PourPlanner, settings: LockPourSettings, joints: tuple[str, ...], ready: np.ndarray) -> Iterator[Motion]:
    """Dock, dip until one ball lies on both lips, raise so that the others roll back, withdraw so that it drops."""
    elevation, withdrawn, here = settings.ready_elevation, settings.ready_withdrawn, ready
    shares = np.linspace(0.0, 1.0, _POSES_PER_KEYFRAME + 1)[1:]
    for frame in settings.keyframes:
        path = planner.source_path(
            here, elevation + shares * (frame.elevation - elevation), withdrawn + shares * (frame.withdrawn - withdrawn)
        )
        yield Follow(((joints, JointTrajectory(np.vstack([here, path]), frame.seconds)),))
        elevation, withdrawn, here = frame.elevation, frame.withdrawn, path[-1]


def dip_profile(settings: DirectPourSettings, dip_seconds: float, step: float = 0.002) -> tuple[np.ndarray, np.ndarray]:
    """Return times (k,) [s] and elevations (k,) [rad]: down for `dip_seconds`, then up to the return elevation, then a hold.

    The rate is limited in speed and acceleration, so the tube accelerates the train of balls, then brakes it (facts: pouring.md 5A).
    """
    times, elevations = [0.0], [settings.ready_elevation]
    rate = 0.0
    arrived: float | None = None
    while arrived is None or times[-1] - arrived < settings.hold_seconds:
        goal = settings.dip_elevation if times[-1] < dip_seconds else settings.return_elevation
        gap = goal - elevations[-1]
        braking = np.sqrt(2.0 * settings.acceleration * abs(gap))
        wanted = np.sign(gap) * min(settings.rate, braking, abs(gap) / step)
        change = settings.acceleration * step
        rate += float(np.clip(wanted - rate, -change, change))
        times.append(times[-1] + step)
        elevations.append(elevations[-1] + rate * step)
        if arrived is None and times[-1] > dip_seconds and abs(settings.return_elevation - elevations[-1]) < 0.002:
            arrived = times[-1]
    return np.array(times), np.array(elevations)


def _direct(
    planner: PourPlanner, settings: DirectPourSettings, joints: tuple[str, ...], ready: np.ndarray, balls_before: int, count: int
) -> Iterator[Motion]:
    """Dock, dip for as long as it takes `count` of the balls to pass, come back before the next one does, withdraw."""
    staying = balls_before - count
    if not 0 <= staying < len(settings.dip_seconds):
        raise ControlError(EngineCode.INVALID_ACTION, f"a direct pour of {count} out of {balls_before} balls is not possible")
    times, elevations = dip_profile(settings, settings.dip_seconds[staying])
    low, high = float(elevations.min()), float(elevations.max())
    grid = np.linspace(high, low, 25)
    top = planner.source_joints(high, 0.0)
    spline = CubicSpline(grid[::-1], planner.source_path(top, grid, np.zeros(len(grid)))[::-1])
    start = spline(settings.ready_elevation)
    yield Follow(((joints, JointTrajectory(np.array([ready, start]), 0.4)),))
    yield Follow(((joints, SampledTrajectory(times, spline(elevations))),))
    end = spline(elevations[-1])
    out = planner.source_joints(settings.return_elevation, settings.ready_withdrawn)
    yield Follow(((joints, JointTrajectory(np.array([end, out]), 0.3)),))
    yield Follow(((joints, JointTrajectory(np.array([out, ready]), 0.5)),))
