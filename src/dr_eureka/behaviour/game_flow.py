"""The course of one or several games: look at the card, look at the tubes, plan, have the plan carried out, look again.

A pure state machine. The node calls `step` with what it has seen; the flow commands the robot through `Robot` and
tells everything it finds out to a `Listener`. It never waits: each wait is a phase with a limit and a name.
"""

from __future__ import annotations

from typing import Optional

from dr_eureka.behaviour.card_confirmation import CardConfirmation, ConfirmAnswer, ConfirmCode
from dr_eureka.behaviour.failure import Failure, failure_in
from dr_eureka.behaviour.flow_settings import FlowSettings
from dr_eureka.behaviour.game_record import GameRecord
from dr_eureka.behaviour.guided_look import GuidedLook
from dr_eureka.behaviour.looks import BallLost, Looks, TubesFinding
from dr_eureka.behaviour.observation import Gaze, Look, Observation, Robot
from dr_eureka.behaviour.part_in_play import PartInPlay
from dr_eureka.behaviour.plan_parts import next_part
from dr_eureka.behaviour.report import ActionRecord, GameCode, GameReport, Listener, Phase
from dr_eureka.control.codes import EngineCode, EngineState
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.actions import actions_for
from dr_eureka.game.planner import Planner
from dr_eureka.game.state import Pour, State

_LOOKS_FROM_EACH_GAZE = 2


class GameFlow:
    """Plays `games` games in a row.

    What the tubes hold is seen before each game, never believed. `goal` replaces the card of the first game. With
    `confirm_card` a person must confirm or correct what was read from a card before the robot goes on. The pours of a plan
    are carried out in parts. What the tubes hold after each is looked at, and if a pour went wrong, the rest is planned
    from what was seen; so it is after a grasp that failed. A ball that is in no tube ends the game. Without a `robot` (a
    replayed recording) nothing is commanded and nothing asked: every image is looked at, for the card first and then for the
    tubes, and the game ends when both are found.
    """

    def __init__(
        self,
        settings: FlowSettings,
        goal: Optional[State],
        games: int,
        planner: Planner,
        looks: Looks,
        listener: Listener,
        robot: Optional[Robot],
        confirm_card: bool = False,
    ):
        self._settings = settings
        self._planner = planner
        self._looks = looks
        self._listener = listener
        self._robot = robot
        self._confirm_card = confirm_card and robot is not None
        self._games = games
        self._phase = Phase.WAITING_FOR_ENGINE
        self._phase_began_s = 0.0
        self._message = ""
        self._now: Optional[Observation] = None
        self._look: Optional[GuidedLook] = None
        self._gazes_left: list[Gaze] = []
        self._gaze_limit_s = 0.0
        self._confirmation: Optional[CardConfirmation] = None
        self._game = GameRecord(0, planner.strategy, planner.method, goal=goal)
        self._pours_ahead: tuple[Pour, ...] = ()
        self._playing: Optional[PartInPlay] = None
        self._fault: Optional[Failure] = None
        self._earlier: tuple[tuple[Pour, ...], tuple[ActionRecord, ...]] = (), ()

    @property
    def over(self) -> bool:
        """Tell whether all games are finished or one has failed."""
        return self._now is not None and self.report().last

    @property
    def looking(self) -> bool:
        """Tell whether images are wanted now."""
        if self._phase == Phase.PLAYING:
            return self._playing is not None and self._playing.looking
        return self._phase != Phase.WAITING_FOR_CONFIRMATION

    def report(self) -> GameReport:
        """Return the present game as it stands."""
        return self._game.report(self._games, self._phase, self._message, self._now)

    def fail(self, code: str, message: str) -> None:
        """End the game, and any that should follow, with a named code and one line that says why; the robot stops."""
        engine = self._now.engine if self._now else None
        if self._robot and engine and engine.state == EngineState.BUSY:
            self._robot.stop()
        self._game.code = code
        self._enter(Phase.FAILED, message)

    def step(self, now: Observation) -> None:
        """Take what was seen and go on as far as that allows."""
        if self.over:
            return
        first = self._now is None
        self._now = now
        if first:
            self._game.began = now
            self._enter(Phase.WAITING_FOR_ENGINE if self._robot else Phase.WAITING_FOR_CAMERA)
        if self._robot and self._phase != Phase.WAITING_FOR_ENGINE and self._engine_is_silent():
            self.fail(GameCode.ENGINE_LOST, f"control_engine has sent no status for {self._settings.engine_silence:g} s")
            return
        {
            Phase.WAITING_FOR_ENGINE: self._wait_for_engine,
            Phase.WAITING_FOR_CAMERA: self._wait_for_camera,
            Phase.LOOKING_FOR_CARD: self._look_for_card,
            Phase.WAITING_FOR_CONFIRMATION: self._wait_for_confirmation,
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
        heard_robot = engine and engine.code != EngineCode.NO_JOINT_STATES and self._now.head
        if heard_robot and engine.state != EngineState.BUSY and not self._engine_is_silent():
            self._enter(Phase.WAITING_FOR_CAMERA)
        elif self._waited_s() > self._settings.engine_limit:
            missing = "present joint states" if engine else "status of control_engine"
            self.fail(GameCode.NO_ENGINE, f"no {missing} within {self._settings.engine_limit:g} s")

    def _wait_for_camera(self) -> None:
        if self._now.camera_seen:
            if self._game.goal is None:
                self._begin_card_look()
            else:
                self._begin_tube_look(Phase.LOOKING_FOR_TUBES, self._settings.tubes_limit)
        elif self._waited_s() > self._settings.camera_limit:
            problem = self._now.camera_problem or "no image"
            self.fail(GameCode.NO_CAMERA, f"{problem} within {self._settings.camera_limit:g} s")

    def _begin_card_look(self) -> None:
        self._begin_look(Phase.LOOKING_FOR_CARD, self._settings.card_gaze, self._looks.card(), self._settings.card_limit)

    def _begin_tube_look(self, phase: str, limit_s: float) -> None:
        """Look at the tubes from either gaze in turn: a picture that cannot be read stays the same while nothing moves."""
        gazes = self._settings.sheet_gaze, self._settings.second_sheet_gaze
        first, *self._gazes_left = gazes * _LOOKS_FROM_EACH_GAZE if self._robot else gazes[:1]
        self._gaze_limit_s = limit_s / (len(self._gazes_left) + 1)
        self._begin_look(phase, first, self._looks.tubes(), self._gaze_limit_s)

    def _begin_look(self, phase: str, gaze: Gaze, look: Look, limit_s: float, message: str = "") -> None:
        self._look = GuidedLook(look, gaze if self._robot else None, limit_s, self._settings, self._now)
        self._enter(phase, message)
        refused = failure_in(self._robot.look_at(gaze, self._settings.head_duration)) if self._robot else None
        if refused:
            self.fail(refused.code, refused.message)

    def _look_for_card(self) -> None:
        finding = self._look.step(self._now)
        if finding is None:
            return
        if isinstance(finding, Failure):
            self.fail(finding.code, finding.message)
            return
        if finding.state == self._game.start:
            # The card of the last game is still being shown: wait for the next one, within the same limit.
            self._look.begin_again(self._looks.card())
            return
        self._game.card = finding.state
        self._listener.on_card(finding)
        if self._confirm_card:
            limit_s = self._settings.confirm_limit
            self._confirmation = CardConfirmation(finding.state, limit_s, self._now)
            message = f"the card was read as {finding.state}: confirm or correct it by ~confirm_card within {limit_s:g} s"
            self._enter(Phase.WAITING_FOR_CONFIRMATION, message)
        else:
            self._play_for(finding.state)

    def confirm_card(self, text: str) -> ConfirmAnswer:
        """Take a person's word about the card: empty confirms it, a state such as RR|GG|PP corrects it."""
        if self._phase != Phase.WAITING_FOR_CONFIRMATION:
            return ConfirmAnswer(ConfirmCode.NOT_WAITING, f"no card waits for confirmation: the game is {self._phase}")
        return self._confirmation.answer(text)

    def _wait_for_confirmation(self) -> None:
        outcome = self._confirmation.step(self._now)
        if isinstance(outcome, Failure):
            self.fail(outcome.code, outcome.message)
        elif outcome is not None:
            self._listener.on_confirmation(self._game.card, outcome)
            self._play_for(outcome)

    def _play_for(self, goal: State) -> None:
        self._game.goal = goal
        self._begin_tube_look(Phase.LOOKING_FOR_TUBES, self._settings.tubes_limit)

    def _look_for_tubes(self) -> None:
        finding = self._found_tubes()
        if isinstance(finding, Failure):
            self.fail(finding.code, finding.message)
        elif finding:
            self._game.start = finding.state
            self._listener.on_tubes(finding)
            self._plan_from(finding)

    def _found_tubes(self) -> TubesFinding | Failure | None:
        outcome = self._look.step(self._now)
        if isinstance(outcome, BallLost):
            return Failure(GameCode.BALL_LOST, outcome.message)
        if isinstance(outcome, Failure) and outcome.seen and self._gazes_left:
            gaze, message = self._gazes_left.pop(0), f"{outcome.message}: looking from elsewhere"
            self._begin_look(self._phase, gaze, self._looks.tubes(), self._gaze_limit_s, message)
            return None
        return outcome

    def _plan_from(self, seen: TubesFinding) -> None:
        """Plan from what the tubes hold to the goal, and begin to carry that out."""
        goal = self._game.goal
        self._enter(Phase.PLANNING)
        try:
            self._pours_ahead = self._planner.pours(seen.state, goal)
            actions = actions_for(self._pours_ahead)
        except DrEurekaError as error:
            self.fail(GameCode.NO_PLAN, str(error))
            return
        self._listener.on_plan(seen.state, goal, self._pours_ahead, actions)
        if self._robot is None:
            self._finish(GameCode.REPLAYED, "card, plan and tubes found in the recording")
        elif not actions:
            self._finish(GameCode.SOLVED, "the tubes hold the goal already: nothing to pour")
        else:
            self._play_on(seen)

    def _play_on(self, seen: TubesFinding) -> None:
        """Give the next part of the plan to the engine."""
        part = next_part(seen.state, self._pours_ahead, self._settings.pours_per_look)
        self._pours_ahead = self._pours_ahead[len(part.pours) :]
        self._earlier = self._game.pours, self._game.actions
        self._game.pours += part.pours
        self._enter(Phase.PLAYING)
        self._playing = PartInPlay(
            part, seen.tubes, self._game.pour, self._robot, self._settings, self._now, self._game.since_began_s,
            self._looks.read_held, self._listener.on_hands,
        )

    def _play(self) -> None:
        outcome = self._playing.step(self._now)
        begun = len(self._game.actions)
        earlier_pours, earlier_actions = self._earlier
        self._game.pours = earlier_pours + self._playing.pours
        self._game.actions = earlier_actions + self._playing.records
        if len(self._game.actions) > begun:
            self._listener.on_report(self.report())
        if isinstance(outcome, Failure):
            if outcome.code == GameCode.ENGINE_FAULT and self._now.engine.code in EngineCode.PUT_DOWN:
                self._look_again(outcome)
            else:
                self.fail(outcome.code, outcome.message)
        elif outcome:
            self._pours_ahead = self._playing.left_out + self._pours_ahead
            self._begin_tube_look(Phase.CHECKING, self._settings.check_limit)

    def _look_again(self, fault: Failure) -> None:
        """Let what the tubes hold be looked at after a fault of a hand, and the rest planned from that; not without end."""
        if self._game.replans == self._settings.most_replans:
            self.fail(fault.code, f"{fault.message}, after {self._game.replans} replans")
            return
        self._listener.on_fault(fault.message)
        self._fault = fault
        self._begin_tube_look(Phase.CHECKING, self._settings.check_limit)

    def _check(self) -> None:
        found = self._found_tubes()
        if isinstance(found, Failure):
            if self._fault:
                self.fail(self._fault.code, f"{self._fault.message}; afterwards {found.code}: {found.message}")
            elif found.seen and not self._pours_ahead:
                self._finish(GameCode.UNCHECKED, found.message)
            else:
                self.fail(found.code, found.message)
        elif found:
            self._fault = None
            self._listener.on_tubes(found)
            self._judge(found)

    def _judge(self, seen: TubesFinding) -> None:
        """Compare what the tubes hold with what the pours should have led to, and go on from what is there."""
        goal, replans, expected = self._game.goal, self._game.replans, self._playing.part.expected
        if seen.state == goal:
            self._finish(GameCode.SOLVED, "")
        elif seen.state == expected:
            self._play_on(seen)
        elif replans == self._settings.most_replans:
            self.fail(GameCode.NOT_SOLVED, f"the tubes hold {seen.state} instead of {goal} after {replans} replans")
        else:
            self._game.replans += 1
            self._listener.on_surprise(expected, seen.state)
            self._plan_from(seen)

    def _finish(self, code: str, message: str) -> None:
        self._game.code = code
        self._enter(Phase.FINISHED, message)
        if self._game.number + 1 < self._games:
            ended = self._game
            self._game = GameRecord(ended.number + 1, ended.strategy, ended.pour, start=ended.goal, began=self._now)
            self._message = ""
            self._begin_card_look()
