"""The control engine: runs a strategy of picks, pours and places, one control cycle at a time."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from math import isfinite
from types import MappingProxyType
from typing import Iterator, Mapping, Sequence

import numpy as np

from dr_eureka.control.arm_calibration import ArmCalibration
from dr_eureka.control.body import Body
from dr_eureka.control.codes import POUR_METHODS, ControlError, EngineCode, EngineState
from dr_eureka.control.limits import CommandLimiter, JointLimit, joint_ranges
from dr_eureka.control.motion import Brake, Follow, Motion
from dr_eureka.control.port import CONTROLLED_JOINTS, grip_joint
from dr_eureka.control.settings import ControlSettings
from dr_eureka.control.strategy import Script, check_actions, strategy
from dr_eureka.control.trajectory import JointTrajectory
from dr_eureka.game.actions import Action
from dr_eureka.game.hands import HANDS
from dr_eureka.game.state import TUBES
from dr_eureka.kinematics.network import ArmNetwork
from dr_eureka.pieces import Pieces

_ROUNDED = 1e-4  # [rad] a limit that is given with four decimals is that limit

@dataclass(frozen=True)
class EngineStatus:
    """What the engine is doing, or why it stopped; `action_index` counts the strategy's actions from 0, -1 outside one.

    `at_once`: how many actions, up to that one, are under way at the same time; 0 outside a strategy.
    `paused`: it holds both tubes after a pour, for somebody to look at them, until `go_on`.
    """

    state: str
    code: str
    action_index: int
    message: str
    paused: bool = False
    at_once: int = 0


class ControlEngine:
    """Tick me with the time and the joints, write what I return; the very code for the robot and for the simulator.

    Motions are worked out, and checked for collisions, in a thread beside the control cycle. With `wait_for_plans` a cycle
    lasts until the next motion is there, so that a simulation does not depend on how fast the machine is; without, the robot
    holds meanwhile and every cycle is answered at once.
    Source: paper Figure 5 (Control Engine), 3.4 and 3.5.
    """

    def __init__(
        self,
        settings: ControlSettings,
        pieces: Pieces,
        network: ArmNetwork | None = None,
        calibrations: Mapping[str, ArmCalibration] = MappingProxyType({}),
        wait_for_plans: bool = True,
    ):
        self.body = Body.build(settings, pieces, network, calibrations)
        self.settings = settings
        self.ranges = joint_ranges()
        self._limiter = CommandLimiter(
            {name: JointLimit(low, high, settings.speeds.hardware) for name, (low, high) in self.ranges.items()},
            settings.speeds.longest_step,
        )
        self._wait_for_plans = wait_for_plans
        self._planner = ThreadPoolExecutor(max_workers=1, thread_name_prefix="planner")
        self._planned: Future[Motion | None] | None = None
        self._script: Script | None = None
        self._motion: Motion | Brake | None = None
        self._motion_start = 0.0
        self._last_tick: float | None = None
        self._lagging_since: dict[str, float] = {}
        self.status = EngineStatus(EngineState.IDLE, EngineCode.NO_JOINT_STATES, -1, "no joint state has been received yet")
        self.durations: list[tuple[int, float, float]] = []
        """(action index, start, end) [s] of every finished action of the strategy."""

    def start(
        self,
        actions: Sequence[Action],
        places: Mapping[str, Sequence[float]],
        balls: Mapping[str, int],
        method: str = "lock",
        pause_after_pours: bool = False,
        hands_at_once: bool = False,
    ) -> None:
        """Begin a strategy. Raises ControlError (BUSY, INVALID_VALUE, INVALID_ACTION).

        Tubes stand with their feet at `places` (3,) [m] in base and hold that many `balls` each; `method` is one of
        POUR_METHODS. With `pause_after_pours` it waits for `go_on` after each pour but the last. With `hands_at_once`,
        neighbouring picks and places of different hands are carried out together, as far as neither is in the other's way.
        """
        self._refuse_when_busy()
        if method not in POUR_METHODS:
            known = ", ".join(POUR_METHODS)
            raise ControlError(EngineCode.INVALID_ACTION, f"pour method {method!r}, expected one of {known}")
        for tube, foot in places.items():
            if tube not in TUBES:
                raise ControlError(EngineCode.INVALID_VALUE, f"tube {tube!r}, expected some of {', '.join(TUBES)}")
            if len(foot) != 3 or not all(isfinite(value) for value in foot):
                problem = f"place of tube {tube!r} is {list(foot)}, expected three finite metres"
                raise ControlError(EngineCode.INVALID_VALUE, problem)
        check_actions(actions, places)
        self._check_hands_are_empty()
        torso, most = self.body.joints.get("torso_y", 0.0), self.settings.guards.torso
        if abs(torso) > most:
            raise ControlError(EngineCode.OUT_OF_LIMITS, f"torso_y is at {torso:.3f} rad, expected at most {most} from 0")
        self.body.places = {tube: np.array(foot, dtype=float) for tube, foot in places.items()}
        self._begin(strategy(self.body, actions, balls, method, pause_after_pours, hands_at_once))

    def _check_hands_are_empty(self) -> None:
        """Raise ControlError while a tube is known to be held, or while fingers stand where only a tube stops them."""
        low, high = self.settings.grip.on_tube
        for hand in HANDS:
            angle = self.body.joints.get(grip_joint(hand), 0.0)
            if hand in self.body.held and angle < low:
                # Opened by request since: whatever was held is no longer.
                del self.body.held[hand]
                self.body.pour_ready, self.body.upright = None, {}
            if hand in self.body.held or low <= angle <= high:
                fingers = f"{hand} fingers are at {angle:.3f} rad, as on a tube; open them first"
                raise ControlError(EngineCode.INVALID_ACTION, f"a strategy starts with empty hands, {fingers}")

    def move_joints(self, goals: Mapping[str, float], duration: float) -> None:
        """Move named joints to positions [rad] in `duration` [s], 0: as quickly as the limits allow; raise ControlError."""
        if not goals or not isfinite(duration) or duration < 0.0:
            problem = f"{len(goals)} joints in {duration} s, expected at least one and a finite time"
            raise ControlError(EngineCode.INVALID_VALUE, problem)
        for name, goal in goals.items():
            if name not in self.ranges:
                known = ", ".join(sorted(self.ranges))
                raise ControlError(EngineCode.UNKNOWN_JOINT, f"joint {name!r}, expected one of {known}")
            if not isfinite(goal):
                raise ControlError(EngineCode.INVALID_VALUE, f"{name} to {goal} rad, expected a finite angle")
            low, high = self.ranges[name]
            if not low - _ROUNDED <= goal <= high + _ROUNDED:
                raise ControlError(EngineCode.OUT_OF_LIMITS, f"{name} to {goal:.3f} rad, expected {low:.3f} to {high:.3f}")
        self._refuse_when_busy()
        if not self.body.goals:
            raise ControlError(EngineCode.NO_JOINT_STATES, "no joint state has been received, or none since they were lost")
        self._begin(Script(f"moving {', '.join(goals)}", self._joint_move(dict(goals), duration)))

    def go_on(self, put_down: bool) -> None:
        """End a pause: carry the strategy on, or leave it and put down what is held; raise ControlError (INVALID_ACTION)."""
        # The pause may have just timed out, with the next motion being planned.
        if not (self.status.paused and self._script.paused):
            raise ControlError(EngineCode.INVALID_ACTION, f"no pour waits to be looked at: {self.status.message}")
        self._script.paused, self._script.put_down = False, put_down
        self.status = replace(self.status, paused=False)

    def stop(self) -> None:
        """Leave what is under way: from the next cycle on joints brake on their path, then hold; hands keep their tubes."""
        self._halt()
        self.status = replace(
            self.status, state=EngineState.IDLE, code=EngineCode.STOPPED, message="stopped on request", paused=False
        )

    def lose(self, message: str) -> None:
        """Note that joint states no longer arrive; the robot holds. When they are back, it holds what they say."""
        self._fail(EngineCode.JOINT_STATES_LOST, message)
        self._motion = None
        self.body.goals = {}

    def tick(self, time_s: float, joints: Mapping[str, float]) -> dict[str, float]:
        """Return this cycle's joint goals [rad], finite and inside limits, given the time [s] and measured joints [rad]."""
        missing = [name for name in CONTROLLED_JOINTS if name not in joints]
        if missing or not all(isfinite(joints[name]) for name in CONTROLLED_JOINTS):
            bad = missing or [name for name in CONTROLLED_JOINTS if not isfinite(joints[name])]
            self._fail(EngineCode.INVALID_VALUE, f"joint state lacks a finite position of {', '.join(bad)}")
        else:
            self.body.joints = joints
        if not self.body.joints:
            return {}
        if not self.body.goals:
            joints = self.body.joints
            self.body.goals = {name: float(joints[name]) for name in CONTROLLED_JOINTS}
            self._limiter.reset(time_s, self.body.goals)
            if self.status.code == EngineCode.NO_JOINT_STATES:
                self.status = replace(self.status, code=EngineCode.OK, message="ready")
        try:
            self._skip_gap(time_s)
            self._check_tracking(time_s)
            self._advance(time_s)
            self._command(time_s)
        except ControlError as error:
            self._fail(error.code, error.message)
        except Exception as error:
            # Whatever went wrong in planning a motion, the robot holds, and nobody is told that all went well.
            self._fail(EngineCode.INTERNAL_ERROR, f"{type(error).__name__}: {error}")
        return dict(self.body.goals)

    def _command(self, time_s: float) -> None:
        """Move the goals to where the motion under way has them now, as far as the joints may go."""
        moved = self._motion.goals(time_s - self._motion_start) if self._motion is not None else {}
        try:
            self.body.goals.update(self._limiter.apply(time_s, {**self.body.goals, **moved}))
        except ControlError:
            self._motion = None  # not even to brake on it
            raise

    def _skip_gap(self, time_s: float) -> None:
        """Let a motion go on where it was when joint states were missing for a while, or the clock jumped."""
        if self._last_tick is not None:
            elapsed = time_s - self._last_tick
            self._motion_start += elapsed - min(max(elapsed, 0.0), self.settings.speeds.longest_step)
        self._last_tick = time_s

    def _advance(self, time_s: float) -> None:
        """Have the next motion of the script planned when the present one is over, and take it once it is there."""
        if self._motion is not None:
            if not self._motion.over(time_s - self._motion_start, self.body.joints):
                return
            # A motion that ended between two ticks still ends exactly at its last point.
            self._command(time_s)
            self._motion = None
        if self._script is None:
            return
        if self._planned is None:
            self._script.now = time_s
            self._planned = self._planner.submit(self._next_motion, self._script)
        if self._wait_for_plans or self._planned.done():
            planned, self._planned = self._planned, None
            self._take(planned, time_s)

    def _next_motion(self, script: Script) -> Motion | None:
        """Work out the next motion of a script, None at its end; raises ControlError COLLISION and what the skills raise."""
        motion = next(script.motions, None)
        hit = self.body.hit(motion) if isinstance(motion, Follow) else None
        if hit is not None:
            raise ControlError(EngineCode.COLLISION, str(hit))
        return motion

    def _take(self, planned: Future[Motion | None], time_s: float) -> None:
        """Begin a planned motion, or end the script; raises what planning raised."""
        script = self._script
        wait([planned])
        self.durations = script.durations
        self.status = EngineStatus(
            EngineState.BUSY, EngineCode.OK, script.action_index, script.message, script.paused, script.at_once
        )
        self._motion, self._motion_start = planned.result(), time_s
        if self._motion is None:
            self._script = None
            self.status = replace(self.status, state=EngineState.DONE, message="done")

    def _joint_move(self, goals: dict[str, float], duration: float) -> Iterator[Motion]:
        names = tuple(goals)
        points = np.array([[self.body.goals[name] for name in names], [goals[name] for name in names]])
        yield Follow(((names, JointTrajectory.within(points, self.settings.speeds.move, at_least=duration)),))

    def _begin(self, script: Script) -> None:
        self._script, self._lagging_since = script, {}
        self.durations = script.durations
        self.status = EngineStatus(EngineState.BUSY, EngineCode.OK, -1, script.message)

    def _refuse_when_busy(self) -> None:
        if self._script is not None:
            raise ControlError(EngineCode.BUSY, f"busy with: {self.status.message}")
        if self._planned is not None:
            # A stop leaves what was just being planned; the planner must be done with the body before anything new begins.
            wait([self._planned])
            self._planned = None

    def _check_tracking(self, time_s: float) -> None:
        """Raise ControlError when an arm or head joint stays away from its goal: blocked, limp or colliding."""
        guards = self.settings.guards
        for name in CONTROLLED_JOINTS:
            if name.endswith("grip"):
                continue
            error = abs(self.body.goals[name] - self.body.joints[name])
            if error <= guards.tracking_error:
                self._lagging_since.pop(name, None)
                continue
            lagging = time_s - self._lagging_since.setdefault(name, time_s)
            if lagging > guards.tracking_seconds and self._script is not None:
                raise ControlError(EngineCode.TRACKING_ERROR, f"{name} is {error:.3f} rad from its goal")

    def _fail(self, code: str, message: str) -> None:
        if self.status.code != code or self.status.state != EngineState.FAULT:
            self.status = replace(self.status, state=EngineState.FAULT, code=code, message=message, paused=False)
        self._halt()

    def _halt(self) -> None:
        """Leave the script; a motion that is under way is braked on its path."""
        self._script = None
        if isinstance(self._motion, Brake):
            return
        elapsed = (self._last_tick or 0.0) - self._motion_start
        braking = isinstance(self._motion, Follow) and not self._motion.over(elapsed, self.body.joints)
        self._motion = Brake(self._motion, elapsed, self.settings.speeds.stop) if braking else None
        self._motion_start = self._last_tick or 0.0
