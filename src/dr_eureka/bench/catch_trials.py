"""One ball let go in the simulated world, and what catcher and referee say of it: a trial of the benchmark `catch`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from dr_eureka.catching.ball_finder import find_balls
from dr_eureka.catching.ball_track import View
from dr_eureka.catching.catch_report import CatchPhase, CatchReport
from dr_eureka.catching.catcher import Catcher, InverseKinematics
from dr_eureka.catching.catcher_settings import CatcherSettings
from dr_eureka.catching.description import SIDES
from dr_eureka.catching.saika import NECK, SaikaHead
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.simulation.saika import FLYING, SaikaWorld
from dr_eureka.simulation.saika_settings import SaikaWorldSettings
from dr_eureka.simulation.throws import Throw

_CYCLE_S = 0.008
_LIMIT_S = 8.0
# What camera tilt and servos need to come to rest.
_SETTLE_S = 0.2


@dataclass(frozen=True)
class Conditions:
    """What a trial is run under: expected ball, method, feedback, and how late views come [s] after they were taken.

    `to_the_end`: whether to wait for the robot's own word, which takes another second, or for the referee's only.
    `rendered`: whether the ball is found in rendered pictures, or seen by the analytic cameras.
    """

    ball: str
    method: str
    feedback: bool = True
    latency_s: float = 0.016
    to_the_end: bool = True
    rendered: bool = False
    saika: SaikaSettings = field(default_factory=SaikaSettings.load)
    world: SaikaWorldSettings = field(default_factory=SaikaWorldSettings.load)


@dataclass(frozen=True, eq=False)
class Trial:
    """How one ball ended: the referee's and the robot's word, and the largest speed of a joint of the arms [rad/s]."""

    verdict: str
    report: CatchReport | None
    joint_speed: float


class CatchRun:
    """Robot, world and ball in one process; the robot gets what its cameras see and its joints' angles."""

    def __init__(self, conditions: Conditions, settings: CatcherSettings, arm: InverseKinematics, seed: int):
        self._conditions = conditions
        self._catcher = Catcher(
            settings.with_method(conditions.method), conditions.saika, arm, conditions.ball, conditions.feedback
        )
        self._head = SaikaHead(conditions.saika)
        self._world = SaikaWorld(
            conditions.saika, seed, conditions.rendered, start=self._catcher.waiting.joints, world=conditions.world
        )
        self._views: list[tuple[float, View]] = []
        self._tick = 0
        self._exposures = {side: self._world.next_exposure(side) for side in SIDES}
        self._speed = 0.0
        self._last_joints = self._world.joints()

    def run(self, throw: Throw, watch: Callable[[SaikaWorld, float], None] | None = None) -> Trial:
        """Let the ball go once the robot watches; return how it ended.

        `watch` is called with the world and the time since the release [s] once a control cycle.
        """
        while self._catcher.phase != CatchPhase.WATCHING or self._world.time_s < _SETTLE_S:
            self._advance()
        released_s = self._world.time_s
        self._world.throw_ball(throw.position, throw.velocity)
        verdict = self._world.referee()
        while self._world.time_s - released_s < _LIMIT_S:
            # A robot that still watches once the ball has come down saw none, and will say nothing of it.
            said = self._catcher.reports or self._catcher.phase == CatchPhase.WATCHING
            if verdict.result != FLYING and (said or not self._conditions.to_the_end):
                break
            if watch is not None:
                watch(self._world, self._world.time_s - released_s)
            self._advance()
            verdict = self._world.referee()
        reports = self._catcher.reports
        self._world.close()
        return Trial(verdict.result, reports[0] if reports else None, self._speed)

    def _advance(self) -> None:
        """Go on to the end of the control cycle, taking pictures when they are due."""
        self._tick += 1
        end_s = self._tick * _CYCLE_S
        while True:
            side = min(self._exposures, key=self._exposures.get)
            if self._exposures[side] > end_s:
                break
            self._world.step(self._exposures[side] - self._world.time_s)
            self._take(side)
            self._exposures[side] = self._world.next_exposure(side)
        self._world.step(end_s - self._world.time_s)
        while self._views and self._views[0][0] <= end_s:
            self._catcher.see(self._views.pop(0)[1])
        joints = self._world.joints()
        self._speed = max(self._speed, float(np.abs(joints - self._last_joints)[2:].max()) / _CYCLE_S)
        self._last_joints = joints
        posture = self._catcher.step(end_s, joints)
        self._world.command(posture.joints)
        self._world.aim_cameras((0.0, posture.camera_tilt), (0.0, posture.camera_tilt))

    def _take(self, side: str) -> None:
        if self._conditions.rendered:
            time_s, picture = self._world.capture(side)
            balls = find_balls(picture, self._conditions.saika)
        else:
            time_s, balls = self._world.observe(side)
        pose = self._head.base_from_camera(side, self._world.camera_pan_tilt(side), self._world.joints()[NECK])
        self._views.append((time_s + self._conditions.latency_s, View(time_s, side, balls, pose)))
