"""The course of one or several games: look at the card, plan, find the tubes, have the plan carried out, check.

A pure state machine. The node calls `step` with what it has seen; the flow commands the robot through `Robot` and
tells everything it finds out to a `Listener`. It never waits: each wait is a phase with a limit and a name.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import Any, Callable, Mapping, Optional, Protocol, Sequence

from dr_eureka.behaviour.flow_settings import FlowSettings
from dr_eureka.behaviour.guided_look import GuidedLook, HeadMotion, LookFailure
from dr_eureka.behaviour.observation import NO_ANSWER, Answer, Gaze, Look, Observation, Robot
from dr_eureka.behaviour.report import ActionRecord, GameCode, GameReport, Phase
from dr_eureka.control.codes import EngineCode, EngineState
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.actions import Action, actions_for
from dr_eureka.game.planner import plan_pours
from dr_eureka.game.state import TUBES, Pour, State


class Listener(Protocol):
    """Who is told what the flow finds out."""

    def on_card(self, finding: Any) -> None:
        """A card was read (what the card look returned)."""

    def on_plan(self, start: State, goal: State, pours: Sequence[Pour], actions: Sequence[Action]) -> None:
        """A plan was made."""

    def on_tubes(self, finding: Any) -> None:
        """The tubes were located (what the tube or result look returned)."""

    def on_report(self, report: GameReport) -> None:
        """Phase, code or action changed."""


@dataclass(frozen=True)
class Looks:
    """Makers of the looks: at the card, at the tubes' places, and at places and contents after the pours."""

    card: Callable[[], Look]
    tubes: Callable[[], Look]
    result: Callable[[], Look]


class GameFlow:
    """Plays `games` games in a row, each from the state in which the last one ended.

    `goal` replaces the card of the first game. A plan is carried out in parts; what the tubes hold after each is looked at,
    and if a pour went wrong, the rest is planned from what was seen. Without a `robot` (a replayed recording) nothing is commanded: every image is
    looked at, for the card first and then for the tubes, and the game ends when both are found.
    """

    def __init__(
        self,
        settings: FlowSettings,
        start: State,
        goal: Optional[State],
        games: int,
        pour: str,
        looks: Looks,
        listener: Listener,
        robot: Optional[Robot],
    ):
        self._settings = settings
        self._looks = looks
        self._listener = listener
        self._robot = robot
        self._games = games
        self._pour_method = pour
        self._phase = Phase.WAITING_FOR_ENGINE
        self._phase_began_s = 0.0
        self._now: Optional[Observation] = None
        self._game_began: Optional[Observation] = None
        self._look: Optional[GuidedLook] = None
        self._head: Optional[HeadMotion] = None
        self._start_game(0, start, goal)

    def _start_game(self, game: int, start: State, goal: Optional[State]) -> None:
        self._game = game
        self._start = self._present = start
        self._goal = goal
        self._code = GameCode.UNDECIDED
        self._message = ""
        self._pours: tuple[Pour, ...] = ()
        self._pours_ahead: tuple[Pour, ...] = ()
        self._actions: tuple[Action, ...] = ()
        self._records: list[ActionRecord] = []
        self._part_length = 0
        self._earlier_records = 0
        self._replans = 0
        self._places: Mapping[str, Any] = {}
        self._strategy_id: Optional[int] = None
        self._game_began = self._now

    @property
    def over(self) -> bool:
        """Tell whether all games are finished or one has failed."""
        return self._now is not None and self.report().last

    def report(self) -> GameReport:
        """Return the present game as it stands."""
        began, now = self._game_began, self._now
        return GameReport(
            phase=self._phase,
            code=self._code,
            game=self._game,
            games=self._games,
            start=str(self._start),
            goal=str(self._goal) if self._goal else "",
            pours=self._pours,
            actions=tuple(self._records),
            replans=self._replans,
            robot_seconds=now.robot_s - began.robot_s if began else 0.0,
            wall_seconds=now.wall_s - began.wall_s if began else 0.0,
            message=self._message,
        )

    def fail(self, code: str, message: str) -> None:
        """End the game, and any that should follow, with a named code and one line that says why; the robot stops."""
        engine = self._now.engine if self._now else None
        if self._robot and engine and engine.state == EngineState.BUSY:
            self._robot.stop()
        self._code = code
        self._enter(Phase.FAILED, message)

    def step(self, now: Observation) -> None:
        """Take what was seen and go on as far as that allows."""
        if self.over:
            return
        first = self._now is None
        self._now = now
        if first:
            self._game_began = now
            self._enter(Phase.WAITING_FOR_ENGINE if self._robot else Phase.WAITING_FOR_CAMERA)
        if self._robot and self._phase != Phase.WAITING_FOR_ENGINE and self._engine_is_silent():
            self.fail(GameCode.ENGINE_LOST, f"control_engine has sent no status for {self._settings.engine_silence:g} s")
            return
        {
            Phase.WAITING_FOR_ENGINE: self._wait_for_engine,
            Phase.WAITING_FOR_CAMERA: self._wait_for_camera,
            Phase.LOOKING_FOR_CARD: self._look_for_card,
            Phase.LOOKING_FOR_TUBES: self._look_for_tubes,
            Phase.PLAYING: self._play,
            Phase.CHECKING: self._check,
        }[self._phase]()

    def _enter(self, phase: str, message: str = "") -> None:
        self._phase = phase
        self._message = message
        self._phase_began_s = self._now.wall_s if self._now else 0.0
        self._listener.on_report(self.report())

    def _waited_s(self) -> float:
        return self._now.wall_s - self._phase_began_s

    def _engine_is_silent(self) -> bool:
        return self._now.engine is None or self._now.wall_s - self._now.engine.heard_wall_s > self._settings.engine_silence

    def _wait_for_engine(self) -> None:
        engine = self._now.engine
        if engine and engine.state != EngineState.BUSY and self._now.head and not self._engine_is_silent():
            self._enter(Phase.WAITING_FOR_CAMERA)
        elif self._waited_s() > self._settings.engine_limit:
            missing = "present joint states" if engine else "status of control_engine"
            self.fail(GameCode.NO_ENGINE, f"no {missing} within {self._settings.engine_limit:g} s")

    def _wait_for_camera(self) -> None:
        if self._now.camera_seen:
            if self._goal is None:
                self._begin_card_look()
            elif self._make_plan():
                self._begin_tube_look()
        elif self._waited_s() > self._settings.camera_limit:
            problem = self._now.camera_problem or "no image"
            self.fail(GameCode.NO_CAMERA, f"{problem} within {self._settings.camera_limit:g} s")

    def _begin_card_look(self) -> None:
        self._begin_look(Phase.LOOKING_FOR_CARD, self._settings.card_gaze, self._looks.card(), self._settings.card_limit)

    def _begin_tube_look(self) -> None:
        self._begin_look(Phase.LOOKING_FOR_TUBES, self._settings.sheet_gaze, self._looks.tubes(), self._settings.tubes_limit)

    def _begin_look(self, phase: str, gaze: Gaze, look: Look, limit_s: float) -> None:
        self._look = GuidedLook(look, gaze if self._robot else None, limit_s, self._settings, self._now)
        self._enter(phase)
        if self._robot:
            self._accepted(self._robot.look_at(gaze, self._settings.head_duration))

    def _accepted(self, answer: Answer) -> bool:
        if answer.code == NO_ANSWER:
            self.fail(GameCode.ENGINE_LOST, answer.message)
        elif answer.code != EngineCode.OK:
            self.fail(GameCode.ENGINE_REFUSED, f"control_engine: {answer.code}: {answer.message}")
        return answer.code == EngineCode.OK

    def _found(self) -> Any:
        """Return what the present look has found by now, None for nothing yet; fail the game when it failed."""
        outcome = self._look.step(self._now)
        if isinstance(outcome, LookFailure):
            self.fail(outcome.code, outcome.message)
            return None
        return outcome

    def _look_for_card(self) -> None:
        finding = self._found()
        if finding is None:
            return
        if self._game > 0 and finding.state == self._start:
            # The card of the last game is still being shown: wait for the next one, within the same limit.
            self._look.begin_again(self._looks.card())
            return
        self._goal = finding.state
        self._listener.on_card(finding)
        if self._make_plan():
            self._begin_tube_look()

    def _make_plan(self) -> bool:
        """Plan from what the tubes hold to the goal; return whether there is anything to do."""
        self._enter(Phase.PLANNING)
        try:
            self._pours_ahead = plan_pours(self._present, self._goal)
            actions = actions_for(self._pours_ahead)
        except DrEurekaError as error:
            self.fail(GameCode.NO_PLAN, str(error))
            return False
        self._listener.on_plan(self._present, self._goal, self._pours_ahead, actions)
        if self._robot and not actions:
            self._finish(GameCode.SOLVED, "the goal is the start: nothing to pour")
            return False
        return True

    def _look_for_tubes(self) -> None:
        finding = self._found()
        if finding is None:
            return
        self._listener.on_tubes(finding)
        if self._robot is None:
            self._finish(GameCode.REPLAYED, "card, plan and tubes found in the recording")
        else:
            self._begin_playing(finding.tubes)

    def _begin_playing(self, tubes: Mapping[str, Any]) -> None:
        """Take the next part of the plan, and turn the head to where its pours will be seen before anything else moves."""
        gaze = self._settings.watch_gaze
        count = pours_until_look(self._pours_ahead, self._settings.pours_per_look)
        part, self._pours_ahead = self._pours_ahead[:count], self._pours_ahead[count:]
        self._actions = actions_for(part)
        self._part_length = count
        self._pours += part
        self._places = tubes
        self._strategy_id = None
        self._earlier_records = len(self._records)
        self._head = HeadMotion(gaze, self._settings, self._now)
        self._enter(Phase.PLAYING)
        self._accepted(self._robot.look_at(gaze, self._settings.head_duration))

    def _begin_strategy(self) -> None:
        arrived = self._head.step(self._now)
        if isinstance(arrived, LookFailure):
            self.fail(arrived.code, arrived.message)
        if arrived is not True:
            return
        balls = {tube: len(content) for tube, content in zip(TUBES, self._present.tubes)}
        answer = self._robot.execute(self._actions, self._places, balls, self._pour_method)
        if self._accepted(answer):
            self._strategy_id = answer.strategy_id

    def _play(self) -> None:
        engine = self._now.engine
        if self._strategy_id is None:
            self._begin_strategy()
            return
        if engine.strategy_id != self._strategy_id:
            return
        self._record(engine.action_index)
        if engine.state == EngineState.DONE:
            gaze, limit_s = self._settings.sheet_gaze, self._settings.check_limit
            self._begin_look(Phase.CHECKING, gaze, self._looks.result(), limit_s)
        elif engine.state != EngineState.BUSY:
            doing = f"action {engine.action_index}: " if engine.action_index >= 0 else ""
            self.fail(GameCode.ENGINE_FAULT, f"control_engine: {engine.code}: {doing}{engine.message}")

    def _record(self, action_index: int) -> None:
        """Note when actions begin and end; the engine may have finished several since the last status."""
        now_s = self._now.robot_s - self._game_began.robot_s
        begun = len(self._records) - self._earlier_records
        if begun:
            last = self._records[-1]
            self._records[-1] = ActionRecord(last.action, last.start_s, now_s)
        news = self._actions[begun : action_index + 1]
        self._records += [ActionRecord(action, now_s, now_s) for action in news]
        if news:
            self._listener.on_report(self.report())

    def _check(self) -> None:
        outcome = self._look.step(self._now)
        if outcome is None:
            return
        if isinstance(outcome, LookFailure):
            if outcome.seen:
                self._finish(GameCode.UNCHECKED, outcome.message)
            else:
                self.fail(outcome.code, outcome.message)
            return
        expected = reduce(State.after, self._pours[-self._part_length :], self._present)
        self._present = outcome.state
        if self._present == self._goal:
            self._finish(GameCode.SOLVED, "")
        elif self._present == expected:
            self._listener.on_tubes(outcome)
            self._begin_playing(outcome.tubes)
        elif self._replans == self._settings.most_replans:
            seen = f"the tubes hold {self._present} instead of {self._goal}"
            self.fail(GameCode.NOT_SOLVED, f"{seen} after {self._replans} replans")
        else:
            self._replans += 1
            self._listener.on_tubes(outcome)
            if self._make_plan():
                self._begin_playing(outcome.tubes)

    def _finish(self, code: str, message: str) -> None:
        self._code = code
        self._enter(Phase.FINISHED, message)
        if self._game + 1 < self._games:
            self._start_game(self._game + 1, self._goal, None)
            self._begin_card_look()


def pours_until_look(pours: Sequence[Pour], least: int) -> int:
    """Return how many pours to carry out before the next look: `least`, and those that follow with the same two tubes."""
    count = min(least, len(pours))
    while count < len(pours) and {pours[count].source, pours[count].target} == {pours[count - 1].source, pours[count - 1].target}:
        count += 1
    return count
