"""The control engine: runs a strategy of picks, pours and places, one control cycle at a time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from types import MappingProxyType
from typing import Iterator, Mapping, Sequence

import numpy as np

from dr_eureka.control.arm_calibration import ArmCalibration
from dr_eureka.control.body import Body
from dr_eureka.control.codes import POUR_METHODS, ControlError, EngineCode, EngineState
from dr_eureka.control.limits import CommandLimiter, JointLimit
from dr_eureka.control.motion import Follow, Motion, Wait
from dr_eureka.control.picking import go_home, pick, place
from dr_eureka.control.port import CONTROLLED_JOINTS, grip_joint
from dr_eureka.control.pouring import pour, raise_tubes
from dr_eureka.control.settings import ControlSettings
from dr_eureka.control.trajectory import JointTrajectory
from dr_eureka.game.actions import Action
from dr_eureka.game.hands import HANDS
from dr_eureka.kinematics.network import ArmNetwork
from dr_eureka.pieces import Pieces

HEAD_AND_TORSO_RANGES = {"head_y": (-1.5708, 1.5708), "head_p": (-1.0472, 1.5184), "torso_y": (-1.5708, 1.5708)}
GRIP_RANGE = (0.0, 1.15)


@dataclass(frozen=True)
class EngineStatus:
    """What the engine is doing, or why it stopped; `action_index` counts the strategy's actions from 0, -1 outside one.

    `paused`: it holds both tubes after a pour, for somebody to look at them, until `go_on`.
    """

    state: str
    code: str
    action_index: int
    message: str
    paused: bool = False


class ControlEngine:
    """Tick me with the time and the joints, write what I return; the very code for the robot and for the simulator.

    Source: paper Figure 5 (Control Engine), 3.4 and 3.5.
    """

    def __init__(
        self,
        settings: ControlSettings,
        pieces: Pieces,
        network: ArmNetwork | None = None,
        calibrations: Mapping[str, ArmCalibration] = MappingProxyType({}),
    ):
        self.body = Body.build(settings, pieces, network, calibrations)
        self.settings = settings
        self.ranges = self._ranges()
        self._limiter = CommandLimiter(
            {name: JointLimit(low, high, settings.speeds.hardware) for name, (low, high) in self.ranges.items()},
            settings.speeds.longest_step,
        )
        self._script: Iterator[Motion] | None = None
        self._motion: Motion | None = None
        self._motion_start = 0.0
        self._now = 0.0
        self._last_tick: float | None = None
        self._lagging_since: dict[str, float] = {}
        self._action_index = -1
        self._put_down = False
        self.status = EngineStatus(EngineState.IDLE, EngineCode.OK, -1, "ready")
        self.durations: list[tuple[int, float, float]] = []
        """(action index, start, end) [s] of every finished action of the strategy."""

    def _ranges(self) -> dict[str, tuple[float, float]]:
        ranges = {grip_joint(hand): GRIP_RANGE for hand in HANDS} | HEAD_AND_TORSO_RANGES
        for arm in self.body.arms.values():
            ranges |= {name: (float(low), float(high)) for name, low, high in zip(arm.joints, arm.chain.lower, arm.chain.upper)}
        return ranges

    def start(
        self,
        actions: Sequence[Action],
        places: Mapping[str, Sequence[float]],
        balls: Mapping[str, int],
        method: str = "lock",
        pause_after_pours: bool = False,
    ) -> None:
        """Begin a strategy. Raises ControlError (BUSY, INVALID_VALUE, INVALID_ACTION).

        Tubes stand with their feet at `places` (3,) [m] in base and hold that many `balls` each; `method` is one of POUR_METHODS.
        With `pause_after_pours` it waits for `go_on` after each pour but the last.
        """
        self._refuse_when_busy()
        if method not in POUR_METHODS:
            raise ControlError(EngineCode.INVALID_ACTION, f"pour method {method!r}, expected one of {', '.join(POUR_METHODS)}")
        for tube, foot in places.items():
            if len(foot) != 3 or not all(isfinite(value) for value in foot):
                raise ControlError(EngineCode.INVALID_VALUE, f"place of tube {tube!r} is {list(foot)}, expected three finite metres")
        self._check_actions(actions, places)
        self._check_hands_are_empty()
        torso = self.body.joints.get("torso_y", 0.0)
        if abs(torso) > self.settings.guards.torso:
            raise ControlError(EngineCode.OUT_OF_LIMITS, f"torso_y is at {torso:.3f} rad, expected at most {self.settings.guards.torso} from 0")
        self.body.places = {tube: np.array(foot, dtype=float) for tube, foot in places.items()}
        self.durations = []
        self._begin(self._strategy(tuple(actions), dict(balls), method, pause_after_pours), "strategy accepted")

    @staticmethod
    def _check_actions(actions: Sequence[Action], places: Mapping[str, Sequence[float]]) -> None:
        """Raise ControlError for an action that names an unknown kind, a hand the robot lacks or a tube without a place."""
        for index, action in enumerate(actions):
            pours = action.kind == "pour"
            hands = (action.hand, action.target_hand) if pours else (action.hand,)
            tubes = (action.tube, action.target_tube) if pours else (action.tube,)
            for name, known in (((action.kind,), ("pick", "place", "pour")), (hands, HANDS), (tubes, tuple(places))):
                strange = [word for word in name if word not in known]
                if strange:
                    raise ControlError(
                        EngineCode.INVALID_ACTION, f"action {index} ({action}): {strange[0]!r}, expected one of {', '.join(known) or 'none'}"
                    )

    def _check_hands_are_empty(self) -> None:
        """Raise ControlError while a tube is known to be held, or while fingers stand where only a tube stops them."""
        low, high = self.settings.grip.on_tube
        for hand in HANDS:
            angle = self.body.joints.get(grip_joint(hand), 0.0)
            if hand in self.body.held and angle < low:
                # Opened by request since: whatever was held is no longer.
                del self.body.held[hand]
                self.body.pour_ready = None
            if hand in self.body.held or low <= angle <= high:
                raise ControlError(
                    EngineCode.INVALID_ACTION,
                    f"a strategy starts with empty hands, {hand} fingers are at {angle:.3f} rad, as on a tube; open them first",
                )

    def move_joints(self, goals: Mapping[str, float], duration: float) -> None:
        """Move named joints to positions [rad] in `duration` seconds (0: as quickly as the limits allow). Raises ControlError."""
        if not goals or not isfinite(duration) or duration < 0.0:
            raise ControlError(EngineCode.INVALID_VALUE, f"{len(goals)} joints in {duration} s, expected at least one and a finite time")
        for name, goal in goals.items():
            if name not in self.ranges:
                raise ControlError(EngineCode.UNKNOWN_JOINT, f"joint {name!r}, expected one of {', '.join(sorted(self.ranges))}")
            if not isfinite(goal):
                raise ControlError(EngineCode.INVALID_VALUE, f"{name} to {goal} rad, expected a finite angle")
            low, high = self.ranges[name]
            if not low - 1e-6 <= goal <= high + 1e-6:
                raise ControlError(EngineCode.OUT_OF_LIMITS, f"{name} to {goal:.3f} rad, expected {low:.3f} to {high:.3f}")
        self._refuse_when_busy()
        if not self.body.goals:
            raise ControlError(EngineCode.JOINT_STATES_LOST, "no joint state has been received yet")
        self._begin(self._joint_move(dict(goals), duration), f"moving {', '.join(goals)}")

    def go_on(self, put_down: bool) -> None:
        """End a pause: carry the strategy on, or leave it and put down what is held. Raises ControlError (INVALID_ACTION)."""
        if not self.status.paused:
            raise ControlError(EngineCode.INVALID_ACTION, f"no pour waits to be looked at: {self.status.message}")
        self.status = replace(self.status, paused=False)
        self._put_down = put_down

    def stop(self) -> None:
        """Stop in this cycle and hold; what is held stays held."""
        self._script = self._motion = None
        self.status = EngineStatus(EngineState.IDLE, EngineCode.STOPPED, self._action_index, "stopped on request")

    def lose(self, message: str) -> None:
        """Note that joint states no longer arrive; the robot holds. When they come back, holding starts from what they say."""
        self._fail(EngineCode.JOINT_STATES_LOST, message)
        self.body.goals = {}

    def tick(self, time_s: float, joints: Mapping[str, float]) -> dict[str, float]:
        """Return this cycle's joint goals [rad] given the time [s] and the measured joints [rad]; never NaN, never outside limits."""
        missing = [name for name in CONTROLLED_JOINTS if name not in joints]
        if missing or not all(isfinite(joints[name]) for name in CONTROLLED_JOINTS):
            bad = missing or [name for name in CONTROLLED_JOINTS if not isfinite(joints[name])]
            self._fail(EngineCode.INVALID_VALUE, f"joint state lacks a finite position of {', '.join(bad)}")
            return dict(self.body.goals)
        self.body.joints = joints
        if not self.body.goals:
            self.body.goals = {name: float(joints[name]) for name in CONTROLLED_JOINTS}
            self._limiter.reset(time_s, self.body.goals)
        try:
            self._skip_gap(time_s)
            self._check_tracking(time_s)
            self._advance(time_s)
            wanted = dict(self.body.goals)
            if self._motion is not None:
                wanted.update(self._motion.goals(time_s - self._motion_start))
            self.body.goals.update(self._limiter.apply(time_s, wanted))
        except ControlError as error:
            self._fail(error.code, error.message)
        except Exception as error:
            # Whatever went wrong in planning a motion, the robot holds, and nobody is told that all went well.
            self._fail(EngineCode.INTERNAL_ERROR, f"{type(error).__name__}: {error}")
        return dict(self.body.goals)

    def _skip_gap(self, time_s: float) -> None:
        """Let a motion go on where it was when joint states were missing for a while, or the clock jumped."""
        if self._last_tick is not None:
            elapsed = time_s - self._last_tick
            self._motion_start += elapsed - min(max(elapsed, 0.0), self.settings.speeds.longest_step)
        self._last_tick = time_s

    def _advance(self, time_s: float) -> None:
        """Take the next motion of the script when the present one is over."""
        if self._script is None:
            return
        if self._motion is not None and not self._motion.over(time_s - self._motion_start, self.body.joints):
            return
        if self._motion is not None:
            # A motion that ended between two ticks still ends exactly at its last point.
            self.body.goals.update(self._limiter.apply(time_s, self.body.goals | self._motion.goals(time_s - self._motion_start)))
        self._now = time_s
        self._motion = next(self._script, None)
        self._motion_start = time_s
        if self._motion is None:
            self._script = None
            self.status = EngineStatus(EngineState.DONE, EngineCode.OK, self._action_index, "done")

    def _strategy(self, actions: tuple[Action, ...], balls: dict[str, int], method: str, pauses: bool) -> Iterator[Motion]:
        body = self.body
        homes = dict(body.places)
        self._put_down = False
        yield from go_home(body)
        for index, action in enumerate(actions):
            self._action_index, started = index, self._now
            self.status = EngineStatus(EngineState.BUSY, EngineCode.OK, index, str(action))
            if body.pour_ready is not None and not (action.kind == "pour" and body.pour_ready == (action.hand, method)):
                yield from raise_tubes(body)
            if action.kind == "pick":
                yield from pick(body, action.hand, action.tube)
            elif action.kind == "place":
                yield from place(body, action.hand, action.tube, homes[action.tube])
            elif action.kind == "pour":
                body.held_in(action.hand, action.tube)
                body.held_in(action.target_hand, action.target_tube)
                if not 1 <= action.count <= balls.get(action.tube, 0):
                    raise ControlError(
                        EngineCode.INVALID_ACTION, f"{action}: the tube holds {balls.get(action.tube, 0)} balls as far as is known"
                    )
                yield from pour(body, action.hand, action.target_hand, method, balls[action.tube], action.count)
                balls[action.tube] -= action.count
                balls[action.target_tube] = balls.get(action.target_tube, 0) + action.count
            else:
                raise ControlError(EngineCode.INVALID_ACTION, f"action {index} is {action.kind!r}, expected pick, place or pour")
            self.durations.append((index, started, self._now))
            if pauses and action.kind == "pour" and any(later.kind == "pour" for later in actions[index + 1 :]):
                self.status = replace(self.status, paused=True)
                yield Wait(lambda *_: not self.status.paused, self.settings.guards.pause_seconds)
                self.status = replace(self.status, paused=False)
            if self._put_down:
                yield from raise_tubes(body)
                for hand, held in tuple(body.held.items()):
                    yield from place(body, hand, held.tube, homes[held.tube])
                break
        yield from go_home(body)

    def _joint_move(self, goals: dict[str, float], duration: float) -> Iterator[Motion]:
        names = tuple(goals)
        points = np.array([[self.body.goals[name] for name in names], [goals[name] for name in names]])
        quickest = JointTrajectory.within(points, self.settings.speeds.move)
        yield Follow(((names, JointTrajectory(points, max(duration, quickest.duration))),))

    def _begin(self, script: Iterator[Motion], message: str) -> None:
        self._script, self._motion, self._action_index = script, None, -1
        self._lagging_since = {}
        self.status = EngineStatus(EngineState.BUSY, EngineCode.OK, -1, message)

    def _refuse_when_busy(self) -> None:
        if self._script is not None:
            raise ControlError(EngineCode.BUSY, f"busy with: {self.status.message}")

    def _check_tracking(self, time_s: float) -> None:
        """Raise ControlError when an arm or head joint stays away from its goal: blocked, limp or colliding."""
        guards = self.settings.guards
        for name in CONTROLLED_JOINTS:
            if name.endswith("grip"):
                continue
            error = abs(self.body.goals[name] - self.body.joints[name])
            if error <= guards.tracking_error:
                self._lagging_since.pop(name, None)
            elif time_s - self._lagging_since.setdefault(name, time_s) > guards.tracking_seconds and self._script is not None:
                raise ControlError(EngineCode.TRACKING_ERROR, f"{name} is {error:.3f} rad from its goal")

    def _fail(self, code: str, message: str) -> None:
        if self.status.code != code or self.status.state != EngineState.FAULT:
            self.status = EngineStatus(EngineState.FAULT, code, self._action_index, message)
        self._script = self._motion = None

