"""A part of a plan while the control engine carries it out."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Callable, Mapping, Optional

from dr_eureka.behaviour.failure import Failure, failure_in
from dr_eureka.behaviour.flow_settings import FlowSettings
from dr_eureka.behaviour.guided_look import HeadMotion
from dr_eureka.behaviour.held_look import HeldLook, ReadHeld
from dr_eureka.behaviour.observation import EngineView, Observation, Robot
from dr_eureka.behaviour.plan_parts import Part
from dr_eureka.behaviour.report import ActionRecord, GameCode
from dr_eureka.control.codes import EngineState
from dr_eureka.game.state import Pour


class PartInPlay:
    """Turns the head to where the pours will be seen, then gives the engine its actions and follows them.

    After each pour but the last it looks at the tubes in the hands; if a pour went wrong, `part` ends there, and `left_out`
    are the pours that were not made. `pours` are those of the part, after a fault only those that were begun.

    `places` are `vision.tubes.TubePlace` by name, `method` is lock, linear or profiled, `game_s` tells the robot time since
    the game began [s], `tell` takes a line on tubes in the hands that were not seen to hold what they should.
    """

    def __init__(
        self,
        part: Part,
        places: Mapping[str, Any],
        method: str,
        robot: Robot,
        settings: FlowSettings,
        now: Observation,
        game_s: Callable[[Observation], float],
        read_held: ReadHeld,
        tell: Callable[[str], None],
    ):
        self.part = part
        self.pours = part.pours
        self.left_out: tuple[Pour, ...] = ()
        self._read_held = read_held
        self._tell = tell
        self._held_look: Optional[HeldLook] = None
        self._paused_at = self._answered = -1
        self._under_way = 1
        self._settings = settings
        self._actions = part.actions
        self._places = places
        self._method = method
        self._robot = robot
        self._game_s = game_s
        self._strategy_id: Optional[int] = None
        self._records: list[ActionRecord] = []
        gaze = settings.watch_gaze
        self._head = HeadMotion(gaze, settings, now)
        self._refused = failure_in(robot.look_at(gaze, settings.head_duration))

    @property
    def records(self) -> tuple[ActionRecord, ...]:
        """The actions begun so far; their times are seconds since the game began."""
        return tuple(self._records)

    def step(self, now: Observation) -> bool | Failure:
        """Return whether all is done, or a Failure when the head, the engine or an action failed."""
        if self._refused:
            return self._refused
        if self._strategy_id is None:
            return self._begin(now)
        engine = now.engine
        if engine.strategy_id != self._strategy_id:
            return False
        self._follow(engine, self._game_s(now))
        if engine.held and engine.action_index > self._answered:
            return self._look_at_hands(now)
        if engine.state in (EngineState.BUSY, EngineState.DONE):
            return engine.state == EngineState.DONE
        self.pours = self.part.after_action(engine.action_index).pours
        self._records[-self._under_way :] = [replace(record, failed=True) for record in self._records[-self._under_way :]]
        doing = f"action {engine.action_index}: " if engine.action_index >= 0 else ""
        return Failure(GameCode.ENGINE_FAULT, f"control_engine: {engine.code}: {doing}{engine.message}")

    @property
    def looking(self) -> bool:
        """Tell whether images are wanted."""
        return self._held_look is not None

    def _look_at_hands(self, now: Observation) -> bool | Failure:
        """Look at what the tubes in the hands hold after a pour; if not what they should, leave the rest of the part."""
        done = self.part.after_action(now.engine.action_index)
        if self._held_look is None:
            self._paused_at = now.engine.action_index
            self._held_look = HeldLook(self._read_held, done.expected, self._settings, now)
        right = self._held_look.step(now)
        if right is None:
            return False
        if self._held_look.problem:
            self._tell(f"{self._held_look.problem}: {'going on' if right else 'putting the tubes down to look again'}")
        self._held_look, self._answered = None, now.engine.action_index
        if not right:
            self.part, self.pours, self.left_out = done, done.pours, self.part.pours[len(done.pours) :]
        return failure_in(self._robot.go_on(put_down=not right)) or False

    def _begin(self, now: Observation) -> bool | Failure:
        arrived = self._head.step(now)
        if arrived is not True:
            return arrived
        answer = self._robot.execute(self._actions, self._places, self.part.balls, self._method)
        self._strategy_id = answer.strategy_id
        return failure_in(answer) or False

    def _follow(self, engine: EngineView, now_s: float) -> None:
        """Note when actions begin and end; the engine may have finished several since the last status.

        A pour ends when the engine pauses for the look after it, actions of both hands at once end together.
        """
        if self._records and len(self._records) - 1 != self._paused_at:
            under_way = self._records[-self._under_way :]
            self._records[-self._under_way :] = [replace(record, end_s=now_s) for record in under_way]
        self._under_way = engine.at_once
        news = self._actions[len(self._records) : engine.action_index + 1]
        self._records += [ActionRecord(action, now_s, now_s) for action in news]
