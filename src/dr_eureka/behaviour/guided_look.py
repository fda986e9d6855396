"""One look at something: the head turned there and at rest, images fed until they decide, every wait limited."""

from __future__ import annotations

from typing import Any, Optional

from dr_eureka.behaviour.failure import Failure
from dr_eureka.behaviour.flow_settings import FlowSettings
from dr_eureka.behaviour.observation import Frame, Gaze, Look, Observation
from dr_eureka.behaviour.report import GameCode
from dr_eureka.control.codes import EngineState


class HeadMotion:
    """The head on its way to a gaze."""

    def __init__(self, gaze: Gaze, settings: FlowSettings, now: Observation):
        self._gaze = gaze
        self._settings = settings
        self._began_s = now.wall_s

    def step(self, now: Observation) -> bool | Failure:
        """Return whether the head has arrived, or a Failure when the limit is over."""
        head, engine, limit_s = now.head, now.engine, self._settings.head_limit
        off = max(abs(head.head_y - self._gaze.head_y), abs(head.head_p - self._gaze.head_p)) if head else float("inf")
        if off <= self._settings.head_tolerance and engine.state != EngineState.BUSY:
            return True
        if now.wall_s - self._began_s <= limit_s:
            return False
        state = f"control_engine {engine.state} {engine.code} {engine.message}"
        message = f"head at {head} after {limit_s:g} s, expected {self._gaze} ({state})"
        return Failure(GameCode.HEAD_NOT_STILL, message)


class GuidedLook:
    """Feeds a `Look` with images taken after the head came to rest at `gaze`; without a gaze (a recording), with all."""

    def __init__(self, look: Look, gaze: Optional[Gaze], limit_s: float, settings: FlowSettings, now: Observation):
        self._look = look
        self._head = HeadMotion(gaze, settings, now) if gaze else None
        self._limit_s = limit_s
        self._camera_limit_s = settings.camera_limit
        self._frozen_limit_s = settings.frozen_limit
        self._looking_since: Optional[Observation] = None if gaze else now
        self._frame_seen_s = now.wall_s

    def step(self, now: Observation) -> Any:
        """Return what the look found, a Failure when a limit is over, else None."""
        if self._looking_since is None:
            arrived = self._head.step(now)
            if isinstance(arrived, Failure):
                return arrived
            if arrived:
                self._looking_since, self._frame_seen_s = now, now.wall_s
            return None
        if self._usable(now.frame):
            self._frame_seen_s = now.wall_s
            finding = self._look.add(now.frame)
            if finding is not None:
                return finding
        if now.camera_frozen and now.wall_s - self._frame_seen_s > self._frozen_limit_s:
            message = f"nothing new from the camera for {self._frozen_limit_s:g} s: {now.camera_problem}"
            return Failure(GameCode.CAMERA_FROZEN, message)
        if now.wall_s - self._frame_seen_s > self._camera_limit_s:
            return self._miss_the_camera(now)
        if now.wall_s - self._looking_since.wall_s > self._limit_s:
            code, reason = self._look.failure()
            return Failure(code, f"{reason} within {self._limit_s:g} s", seen=True)
        return None

    def begin_again(self, look: Look) -> None:
        """Forget the images seen so far; the limit goes on."""
        self._look = look

    def _usable(self, frame: Optional[Frame]) -> bool:
        return frame is not None and (self._head is None or frame.stamp_s >= self._looking_since.robot_s)

    def _miss_the_camera(self, now: Observation) -> Failure:
        limit_s = self._camera_limit_s
        if self._head is None:
            # A recording has simply come to its end: what matters is what was not found in it.
            code, reason = self._look.failure()
            return Failure(code, f"{reason}, and the recording gave no image for {limit_s:g} s", seen=True)
        return Failure(GameCode.NO_CAMERA, f"{now.camera_problem or 'no image'} within {limit_s:g} s")
