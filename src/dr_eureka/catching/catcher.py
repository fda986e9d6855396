"""The catcher: waits, follows the ball, moves the basket under its path, and looks whether the ball is in it.

It knows views and joint angles only. `see` takes what a camera saw; `step` is called once a control cycle and answers with
the goals of all joints.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from dr_eureka.catching.arm_motion import ArmMotion
from dr_eureka.catching.arm_network import OutOfReachError
from dr_eureka.catching.ball_track import BallTrack, View
from dr_eureka.catching.basket_look import BasketLook
from dr_eureka.catching.catch_report import CatchPhase, CatchReason, CatchReport, CatchResult
from dr_eureka.catching.catcher_settings import CatcherSettings, GazeSettings
from dr_eureka.catching.posture import Posture
from dr_eureka.catching.prediction import Prediction, PredictionReason, PredictionRefused
from dr_eureka.catching.saika import JOINTS, LEFT_ARM, NECK, SaikaArm
from dr_eureka.catching.settings import SaikaSettings

# A hand farther than this from its goal when the ball comes was late: half of what the basket is wider than the ball.
_LATE_M = 0.0125

# After a longer gap between joint states the arm starts anew from where it is, instead of leaping to where it would be [s].
_LONGEST_GAP_S = 0.1


class InverseKinematics(Protocol):
    """What tells the left arm's joints, such as `arm_network.SaikaNetwork`."""

    def joints(self, position: np.ndarray) -> np.ndarray:
        """Return the joints (5,) [rad] that put the middle of the rim to (3,) [m] in base. Raises OutOfReachError."""


@dataclass
class _Catch:
    """What is known of the ball that is being followed; times [s]."""

    track: BallTrack
    first_s: float
    seen_s: float
    prediction: Prediction | None = None
    refusals: Counter[str] = field(default_factory=Counter)
    goal: np.ndarray | None = None
    reachable: bool = True
    moves: int = 0
    late_m: float | None = None

    @property
    def main_refusal(self) -> str:
        """What mostly stood in the way of a prediction; that the points were few only if nothing else did."""
        others = Counter(self.refusals)
        del others[PredictionReason.TOO_FEW_POINTS]
        return others.most_common(1)[0][0] if others else PredictionReason.TOO_FEW_POINTS


class Catcher:
    """Decides from views and joint angles where the basket goes.

    `ball`: which kind is expected, thrown or falling; it sets where to look and where the basket waits. `feedback`: whether
    the basket moves again whenever the prediction improves; without, it is sent once, by the first prediction.
    """

    def __init__(
        self, settings: CatcherSettings, saika: SaikaSettings, arm: InverseKinematics, ball: str, feedback: bool = True
    ):
        self._settings, self._saika, self._inverse, self._feedback = settings, saika, arm, feedback
        self._arm = SaikaArm(saika)
        self._stance = settings.stances[ball]
        self._ready = arm.joints(np.array(self._stance.ready_m))
        self._shown = arm.joints(np.array(settings.judging.basket_m))
        self._phase = CatchPhase.GETTING_READY
        self._catch: _Catch | None = None
        self._look: BasketLook | None = None
        self._joints: np.ndarray | None = None
        self._motion = ArmMotion(self._arm.speed, settings.acceleration, settings.jerk)
        self._now_s = 0.0
        self._reports: list[CatchReport] = []
        self.refusals: Counter[str] = Counter()

    @property
    def phase(self) -> str:
        """What it is doing, a CatchPhase."""
        return self._phase

    @property
    def waiting(self) -> Posture:
        """The posture in which it waits for a ball."""
        return _posture(self._stance.gaze, self._ready)

    @property
    def reports(self) -> tuple[CatchReport, ...]:
        """One report a ball, oldest first."""
        return tuple(self._reports)

    @property
    def prediction(self) -> Prediction | None:
        """The last prediction of the ball that is being followed."""
        return self._catch.prediction if self._catch else None

    @property
    def track(self) -> BallTrack | None:
        """The ball that is being followed."""
        return self._catch.track if self._catch else None

    def see(self, view: View) -> None:
        """Take what a camera saw; views may come late, but each camera's in order."""
        if not math.isfinite(view.time_s):
            self.refusals[PredictionReason.NOT_FINITE] += 1
            return
        if self._phase == CatchPhase.WATCHING and view.balls:
            self._catch = _Catch(BallTrack(self._settings.method, self._saika), view.time_s, view.time_s)
            self._phase = CatchPhase.FOLLOWING
        if self._phase == CatchPhase.FOLLOWING:
            self._follow(self._catch, view)
        elif self._phase == CatchPhase.JUDGING:
            self._look.add(view, self._arm.basket_centre(self._joints[LEFT_ARM]))

    def step(self, now_s: float, joints: np.ndarray) -> Posture:
        """Return the goals for this control cycle; joints (12,) [rad] are the present angles."""
        elapsed_s, self._now_s = max(now_s - self._now_s, 0.0), now_s
        self._joints = np.array(joints, float)
        if not self._motion.started or elapsed_s > _LONGEST_GAP_S:
            self._motion.start(self._joints[LEFT_ARM])
            elapsed_s = 0.0
        if self._phase == CatchPhase.GETTING_READY and self._still():
            self._phase = CatchPhase.WATCHING
        elif self._phase == CatchPhase.FOLLOWING:
            self._end_flight(self._catch)
        elif self._phase == CatchPhase.JUDGING:
            self._judge(self._catch, self._look)
        # A ball that lies in the basket is carried slowly, there and back.
        carrying = self._phase in (CatchPhase.JUDGING, CatchPhase.GETTING_READY)
        share = self._settings.judging.carry_share if carrying else 1.0
        posture = self._wanted()
        posture.joints[LEFT_ARM] = self._motion.step(posture.joints[LEFT_ARM], elapsed_s, share)
        return posture

    def _wanted(self) -> Posture:
        """Return where head and arm are on their way to."""
        if self._phase == CatchPhase.JUDGING:
            return _posture(self._settings.judging.gaze, self._shown)
        following = self._phase == CatchPhase.FOLLOWING and self._catch.goal is not None
        return _posture(self._stance.gaze, self._catch.goal if following else self._ready)

    def _still(self) -> bool:
        """Tell whether head and arm are where they are on their way to."""
        if self._joints is None:
            return False
        off = np.abs(self._joints - self._wanted().joints)
        return bool(max(off[NECK].max(), off[LEFT_ARM].max()) < self._settings.still_rad)

    def _follow(self, catch: _Catch, view: View) -> None:
        """Add a view to the path of the ball, and send the basket under it."""
        if catch.prediction and self._has_come(catch.prediction, view.time_s):
            return
        if view.balls:
            catch.seen_s = max(catch.seen_s, view.time_s)
        try:
            if not catch.track.add(view):
                return
            prediction = catch.track.predict(self._stance.plane)
        except PredictionRefused as refusal:
            self._refuse(catch, refusal.reason)
            return
        flight_s = prediction.time_s - catch.first_s
        if prediction.sigma_m > self._settings.largest_sigma_m or not 0.0 < flight_s < self._settings.longest_flight_s:
            self._refuse(catch, CatchReason.UNSURE)
            return
        catch.prediction = prediction
        if catch.moves == 0 or self._feedback:
            self._send(catch, prediction)

    def _has_come(self, prediction: Prediction, time_s: float) -> bool:
        """Tell whether the ball surely touched the basket by then: what is seen of it is no flight any more."""
        return time_s > prediction.time_s + 2.0 * prediction.time_sigma_s - self._settings.blind_s

    def _refuse(self, catch: _Catch, reason: str) -> None:
        catch.refusals[reason] += 1
        self.refusals[reason] += 1

    def _send(self, catch: _Catch, prediction: Prediction) -> None:
        """Send the basket under the ball as far as the prediction is sure; where the arm cannot reach, let it stay."""
        waiting = np.array(self._stance.ready_m)
        scatter = self._settings.scatter_m**2 * np.eye(3)
        # The mean of where the ball comes down, given the prediction and how balls scatter about where the basket waits.
        trust = scatter @ np.linalg.inv(scatter + prediction.covariance)
        try:
            self._inverse.joints(prediction.position)
            goal = self._inverse.joints(waiting + trust @ (prediction.position - waiting))
        except OutOfReachError:
            catch.reachable = False
            return
        catch.goal, catch.reachable = goal, True
        catch.moves += 1

    def _end_flight(self, catch: _Catch) -> None:
        """End the flight when the ball has come, or was lost before there was a prediction."""
        if catch.prediction is None:
            lost = self._now_s - catch.seen_s > self._settings.lost_s
            if lost or self._now_s - catch.first_s > self._settings.longest_flight_s:
                self._report(catch, CatchResult.NOT_PREDICTED, catch.main_refusal)
            return
        over_s = self._now_s - catch.prediction.time_s
        if over_s >= 0.0 and catch.late_m is None and catch.goal is not None:
            there = self._arm.basket_centre(self._joints[LEFT_ARM])
            catch.late_m = float(np.linalg.norm(there - self._arm.basket_centre(catch.goal)))
        if over_s < self._settings.judging.after_s:
            return
        if catch.goal is None:
            self._report(catch, CatchResult.OUT_OF_REACH, CatchResult.OUT_OF_REACH)
        else:
            self._phase = CatchPhase.JUDGING
            self._look = BasketLook(self._settings.judging, self._saika, self._now_s)

    def _judge(self, catch: _Catch, look: BasketLook) -> None:
        """Look into the basket, and say what is there once enough views tell."""
        if self._still():
            look.be_still(self._now_s)
        if not look.decided(self._now_s):
            return
        if look.ball_in_basket:
            self._report(catch, CatchResult.CAUGHT, "")
        elif not catch.reachable:
            self._report(catch, CatchResult.OUT_OF_REACH, CatchResult.OUT_OF_REACH)
        elif not look.seen:
            self._report(catch, CatchResult.MISSED, CatchReason.BASKET_NOT_SEEN)
        else:
            late = catch.late_m is not None and catch.late_m > _LATE_M
            self._report(catch, CatchResult.MISSED, CatchReason.TOO_LATE if late else CatchReason.NOT_IN_BASKET)

    def _report(self, catch: _Catch, result: str, reason: str) -> None:
        self._reports.append(CatchReport(result, reason, catch.prediction, catch.moves, catch.late_m))
        self._phase, self._catch, self._look = CatchPhase.GETTING_READY, None, None


def _posture(gaze: GazeSettings, left_arm: np.ndarray) -> Posture:
    """Return the whole posture; the right arm hangs."""
    joints = np.zeros(len(JOINTS))
    joints[NECK] = np.radians((gaze.neck_pan_deg, gaze.neck_tilt_deg))
    joints[LEFT_ARM] = left_arm
    return Posture(joints, float(np.radians(gaze.camera_tilt_deg)))
