"""The course of a game, with fakes for the robot and for what is looked at."""

from dataclasses import replace
from functools import reduce
from types import SimpleNamespace

import numpy as np
import pytest

from dr_eureka.behaviour.card_confirmation import ConfirmCode
from dr_eureka.behaviour.flow_settings import FlowSettings
from dr_eureka.behaviour.game_flow import GameFlow
from dr_eureka.behaviour.looks import BallLost, Looks
from dr_eureka.behaviour.observation import NO_ANSWER, Answer, EngineView, Frame, Gaze, ImageHeader, Observation
from dr_eureka.behaviour.plan_parts import next_part
from dr_eureka.behaviour.report import GameCode, Phase
from dr_eureka.control.codes import EngineCode, EngineState
from dr_eureka.game.planner import Planner
from dr_eureka.game.state import START, TUBES, Pour, State

CARD_GAZE, SHEET_GAZE, SECOND_GAZE, WATCH_GAZE = Gaze(0.0, 0.5), Gaze(0.0, 0.87), Gaze(0.0, 0.8), Gaze(0.0, 0.4)
SETTINGS = FlowSettings(
    engine_limit=10.0,
    held_limit=1.0,
    held_images=2,
    engine_silence=3.0,
    camera_limit=5.0,
    frozen_limit=2.0,
    head_limit=4.0,
    card_limit=20.0,
    confirm_limit=30.0,
    tubes_limit=20.0,
    check_limit=20.0,
    pours_per_look=3,
    most_replans=2,
    head_duration=1.0,
    head_tolerance=0.02,
    card_gaze=CARD_GAZE,
    sheet_gaze=SHEET_GAZE,
    second_sheet_gaze=SECOND_GAZE,
    watch_gaze=WATCH_GAZE,
)
GOAL = State.parse("R|GG|PPR")
PLANNER = Planner("fewest", "lock")
PLACES = {"left": (0.44, 0.11, 0.775), "center": (0.44, 0.0, 0.775), "right": (0.44, -0.11, 0.775)}


class FakeLook:
    """Decides after three images, or never."""

    def __init__(self, finding, code):
        self.finding, self.code, self.images = finding, code, 0

    def add(self, frame):
        self.images += 1
        return self.finding if self.images == 3 else None

    def failure(self):
        return self.code, f"{self.images} images"


class World:
    """A robot that obeys at once, a camera, clocks, and a record of what the flow tells."""

    def __init__(self, goal=None, games=1, cards=("R|GG|PPR",), robot=True, settings=SETTINGS, results=(),
                 confirm_card=False, start=START):
        self.present = start
        self.cards = list(cards)
        self.results = list(results)
        self.reports, self.plans, self.found_cards, self.found_tubes = [], [], [], []
        self.confirmations, self.surprises, self.answers, self.faults, self.hands = [], [], [], [], []
        self.gazes, self.strategies, self.stops = [], [], 0
        self.answer = EngineCode.OK
        self.now = Observation(
            wall_s=100.0,
            robot_s=7.0,
            engine=EngineView(EngineState.IDLE, EngineCode.OK, 0, -1, "", 100.0),
            camera_seen=True,
            head=Gaze(0.0, 0.0),
        )
        self.frames = True
        self.engine_speaks = True
        self.flow = GameFlow(
            settings, goal, games, PLANNER, Looks(self.card_look, self.tube_look, self.read_held), self,
            self if robot else None, confirm_card,
        )

    def card_look(self):
        state = self.cards.pop(0) if self.cards else None
        return FakeLook(SimpleNamespace(state=State.parse(state)) if state else None, GameCode.NO_CARD)

    def tube_look(self):
        """See what the tubes hold: after pours the next of `results`, or what the pours should have led to.

        An empty result is never seen, one that begins with ~ only from the second gaze.
        """
        seen = str(self.present)
        if self.flow.report().phase == Phase.PLAYING:
            seen = self.results.pop(0) if self.results else str(reduce(State.after, self.part_pours(), self.present))
            self.hidden = seen if seen[:1] in ("", "~") else None
        elif self.flow.report().phase == Phase.CHECKING and self.hidden is not None:
            seen = self.hidden.lstrip("~")
        if seen[:1] in ("", "~"):
            return FakeLook(None, GameCode.NO_CONTENTS)
        if seen == "ball gone":
            return FakeLook(BallLost("red seen"), GameCode.NO_CONTENTS)
        self.present = State.parse(seen)
        return FakeLook(SimpleNamespace(tubes=PLACES, state=self.present), GameCode.NO_TUBES)

    def read_held(self, frame, held):
        """See in the hands what the world says; of other tubes nothing."""
        return SimpleNamespace(tubes={name: SimpleNamespace(colours=self.in_hands[name]) for name in held})

    def pause(self, action_index, **in_hands):
        """Let the engine pause after a pour, with these balls in the tubes that it holds."""
        self.in_hands = in_hands
        held = dict.fromkeys(in_hands, np.eye(4))
        self.engine(EngineState.BUSY, strategy_id=len(self.strategies), action_index=action_index)
        self.now = replace(self.now, engine=replace(self.now.engine, held=held))

    def go_on(self, put_down):
        self.answers.append(put_down)
        return Answer(EngineCode.OK, "fake")

    def part_pours(self):
        return [Pour(action.tube, action.target_tube, action.count) for action in self.strategies[-1][0] if action.kind == "pour"]

    def look_at(self, gaze, duration_s):
        self.gazes.append(gaze)
        if self.answer == EngineCode.OK:
            self.now = replace(self.now, head=gaze)
        return Answer(self.answer, "fake")

    def execute(self, actions, tubes, balls, pour):
        self.strategies.append((actions, tubes, balls, pour))
        number = len(self.strategies)
        self.engine(EngineState.BUSY, strategy_id=number)
        return Answer(self.answer, "fake", number)

    def stop(self):
        self.stops += 1
        return Answer(EngineCode.OK, "fake")

    def engine(self, state, code=EngineCode.OK, strategy_id=1, action_index=-1, message=""):
        self.now = replace(self.now, engine=EngineView(state, code, strategy_id, action_index, message, self.now.wall_s))

    def on_card(self, finding):
        self.found_cards.append(str(finding.state))

    def on_confirmation(self, card, goal):
        self.confirmations.append((str(card), str(goal)))

    def on_plan(self, start, goal, pours, actions):
        self.plans.append((str(start), str(goal), len(pours), actions))

    def on_tubes(self, finding):
        self.found_tubes.append(finding.tubes)

    def on_surprise(self, expected, seen):
        self.surprises.append((str(expected), str(seen)))

    def on_hands(self, message):
        self.hands.append(message)

    def on_fault(self, message):
        self.faults.append(message)

    def on_report(self, report):
        self.reports.append(report)

    def step(self, seconds=0.1):
        robot_s, wall_s = self.now.robot_s + seconds, self.now.wall_s + seconds
        frame = Frame(ImageHeader(round(robot_s * 1e9), "cam"), np.zeros((4, 4, 3), np.uint8), None, np.eye(4)) if self.frames else None
        engine = self.now.engine
        if engine and self.engine_speaks:
            engine = replace(engine, heard_wall_s=wall_s)
        self.now = replace(self.now, robot_s=robot_s, wall_s=wall_s, frame=frame, engine=engine)
        self.flow.step(self.now)
        return self.flow.report()

    def until_playing(self):
        """Go on until the engine carries a strategy out that it was not given before."""
        before = len(self.strategies)
        while len(self.strategies) == before:
            self.step()
            assert self.flow.report().phase != Phase.FAILED, self.flow.report()

    def until(self, phase, steps=400):
        for _ in range(steps):
            if self.step().phase == phase:
                return self.flow.report()
        raise AssertionError(f"never {phase}: {self.flow.report()}")

    @property
    def phases(self):
        phases = [report.phase for report in self.reports]
        return [phase for index, phase in enumerate(phases) if index == 0 or phases[index - 1] != phase]


def test_a_game_goes_from_card_to_plan_to_tubes_to_the_last_action():
    world = World()
    world.until_playing()
    actions, tubes, balls, pour = world.strategies[0]
    assert tubes == PLACES and pour == "lock"
    assert balls == {"left": 2, "center": 2, "right": 2}
    for index in range(len(actions)):
        world.engine(EngineState.BUSY, action_index=index)
        world.step()
    world.engine(EngineState.DONE, action_index=len(actions) - 1)
    report = world.until(Phase.FINISHED)
    assert (report.phase, report.code, report.goal) == (Phase.FINISHED, GameCode.SOLVED, "R|GG|PPR")
    assert [record.action for record in report.actions] == list(actions)
    assert world.flow.over
    assert world.gazes == [CARD_GAZE, SHEET_GAZE, WATCH_GAZE, SHEET_GAZE]
    assert world.phases == [
        Phase.WAITING_FOR_ENGINE, Phase.WAITING_FOR_CAMERA, Phase.LOOKING_FOR_CARD, Phase.LOOKING_FOR_TUBES,
        Phase.PLANNING, Phase.PLAYING, Phase.CHECKING, Phase.FINISHED,
    ]


def test_actions_carry_the_times_between_which_the_engine_was_at_them():
    world = World(goal=GOAL)
    world.until_playing()
    began_s = world.reports[0].robot_seconds
    for index, steps in ((0, 5), (1, 10), (3, 1)):
        world.engine(EngineState.BUSY, action_index=index)
        for _ in range(steps):
            report = world.step()
    first, second, third, fourth = report.actions
    assert began_s < first.start_s < first.end_s == second.start_s
    assert second.end_s - second.start_s == pytest.approx(1.0)
    assert third.start_s == third.end_s == fourth.start_s


def test_actions_of_both_hands_at_once_begin_and_end_together():
    world = World(goal=GOAL)
    world.until_playing()
    for index, at_once, steps in ((1, 2, 10), (2, 1, 5)):
        world.engine(EngineState.BUSY, action_index=index)
        world.now = replace(world.now, engine=replace(world.now.engine, at_once=at_once))
        for _ in range(steps):
            report = world.step()
    first, second, third = report.actions
    assert (first.start_s, first.end_s) == (second.start_s, second.end_s)
    assert first.end_s - first.start_s == pytest.approx(1.0) and third.start_s == first.end_s


def test_a_given_goal_is_played_without_looking_for_a_card():
    world = World(goal=GOAL)
    world.until_playing()
    assert world.gazes == [SHEET_GAZE, WATCH_GAZE]
    assert Phase.LOOKING_FOR_CARD not in world.phases


def test_the_plan_begins_with_what_is_seen_in_the_tubes():
    world = World(goal=GOAL, start=State.parse("|GG|PPRR"))
    world.until_playing()
    assert world.flow.report().start == "|GG|PPRR"
    assert world.plans[0][:3] == ("|GG|PPRR", "R|GG|PPR", 1)
    assert world.strategies[0][2] == {"left": 0, "center": 2, "right": 4}


def test_until_the_tubes_are_seen_the_start_is_not_known():
    world = World()
    assert world.until(Phase.LOOKING_FOR_TUBES).start == ""
    world.until_playing()
    assert world.flow.report().start == "RR|GG|PP"


def test_every_game_tells_what_plans_make_best_and_how_balls_are_poured():
    world = World(goal=START, games=2)
    world.until(Phase.LOOKING_FOR_CARD)
    told = {(report.game, report.strategy, report.pour) for report in world.reports}
    assert told == {(0, "fewest", "lock"), (1, "fewest", "lock")}


def test_a_goal_that_the_tubes_hold_already_is_solved_without_a_motion_of_the_arms():
    world = World(goal=START)
    report = world.until(Phase.FINISHED)
    assert (report.code, report.actions, world.strategies) == (GameCode.SOLVED, (), [])


def finish(world):
    """Let the engine be done, and the robot look at the tubes until the phase after that."""
    world.engine(EngineState.DONE, strategy_id=len(world.strategies), action_index=0)
    world.until(Phase.CHECKING)
    while world.step().phase == Phase.CHECKING:
        pass


def test_a_pour_that_went_wrong_is_seen_and_the_rest_planned_anew():
    world = World(goal=GOAL, results=["RR|GG|PP", "R|GGR|PP"])
    world.until_playing()
    finish(world)
    assert world.surprises == [("R|GG|PPR", "RR|GG|PP")]
    assert world.flow.report().replans == 1
    assert world.plans[1][:3] == ("RR|GG|PP", "R|GG|PPR", 1)
    world.until_playing()
    finish(world)
    assert world.plans[2][:2] == ("R|GGR|PP", "R|GG|PPR")
    world.until_playing()
    assert world.strategies[2][2] == {"left": 1, "center": 3, "right": 2}
    finish(world)
    report = world.flow.report()
    assert (report.phase, report.code, report.replans) == (Phase.FINISHED, GameCode.SOLVED, 2)
    assert [record.action.kind for record in report.actions] == ["pick"] * 3
    assert len(report.pours) == 1 + 1 + world.plans[2][2]


def world_in_pause(**in_hands):
    """Return a game of three pours whose engine pauses after the first, left to right, and the steps it took to answer."""
    world = World(goal=State.parse("R|G|PPRG"), results=[])
    world.until_playing()
    pours = world.part_pours()
    assert len(pours) > 1
    first = next(index for index, action in enumerate(world.strategies[0][0]) if action.kind == "pour")
    assert not world.flow.looking
    world.pause(first, **in_hands)
    return world, pours


def test_tubes_in_the_hands_are_looked_at_after_a_pour_and_what_is_right_goes_on():
    after = START.after(PLANNER.pours(START, State.parse("R|G|PPRG"))[0])
    world, pours = world_in_pause(**{tube: after.tube(tube) for tube in (pours_tubes(START, "R|G|PPRG"))})
    world.step()
    assert world.flow.looking and world.answers == []
    for _ in range(5):
        world.step()
    assert world.answers == [False] and not world.flow.looking and world.hands == []
    assert world.flow.report().pours == tuple(pours)
    pour = world.flow.report().actions[-1]
    assert pour.action.kind == "pour" and pour.end_s < world.flow.report().robot_seconds - 0.3
    paused = world.now.engine.action_index
    world.engine(EngineState.BUSY, action_index=paused + 1)
    world.step()
    assert world.flow.report().actions[paused] == pour
    assert world.flow.report().actions[paused + 1].start_s == pytest.approx(world.flow.report().robot_seconds)


def test_a_pour_that_is_seen_in_the_hands_to_have_gone_wrong_ends_the_part():
    tubes = pours_tubes(START, "R|G|PPRG")
    world, pours = world_in_pause(**{tube: START.tube(tube) for tube in tubes})
    for _ in range(5):
        world.step()
    assert world.answers == [True]
    after = START.after(pours[0])
    assert world.hands == [", ".join(
        f"{tube} tube in a hand seen to hold {START.tube(tube)}, expected {after.tube(tube)}" for tube in tubes
    ) + ": putting the tubes down to look again"]
    assert world.flow.report().pours == tuple(pours[:1])
    world.results = [str(START)]
    finish(world)
    assert (world.flow.report().replans, world.plans[-1][:2]) == (1, ("RR|GG|PP", "R|G|PPRG"))


def test_a_false_alarm_about_tubes_in_the_hands_costs_no_new_plan():
    tubes = pours_tubes(START, "R|G|PPRG")
    world, pours = world_in_pause(**{tube: START.tube(tube) for tube in tubes})
    for _ in range(5):
        world.step()
    world.results = [str(START.after(pours[0]))]
    finish(world)
    assert (world.flow.report().replans, len(world.plans)) == (0, 1)
    world.until_playing()
    assert world.part_pours() == pours[1:]


def test_what_the_fingers_hide_is_taken_for_right():
    after = START.after(PLANNER.pours(START, State.parse("R|G|PPRG"))[0])
    hidden = {tube: "?" * min(2, len(after.tube(tube))) + after.tube(tube)[2:] for tube in pours_tubes(START, "R|G|PPRG")}
    world, _ = world_in_pause(**hidden)
    for _ in range(5):
        world.step()
    assert world.answers == [False]


def test_hands_of_which_no_image_comes_are_taken_for_right_at_the_limit():
    world, _ = world_in_pause(**dict.fromkeys(pours_tubes(START, "R|G|PPRG"), ""))
    world.frames = False
    for _ in range(9):
        world.step()
    assert world.answers == []
    for _ in range(5):
        world.step()
    assert world.answers == [False]
    assert world.hands == ["no image of the tubes in the hands within 1 s: going on"]


def pours_tubes(start, goal):
    """Return the two tubes of the first pour from a state to another."""
    first = PLANNER.pours(start, State.parse(goal))[0]
    return first.source, first.target


def test_a_long_plan_is_carried_out_in_parts_with_a_look_after_each():
    goal = State.parse("PR|PRG|G")
    whole = PLANNER.pours(START, goal)
    part = next_part(START, whole, 3)
    middle = part.expected
    world = World(goal=goal, results=[str(middle)])
    world.until_playing()
    first = world.strategies[0][0]
    assert sum(action.kind == "pour" for action in first) == len(part.pours) < len(whole)
    assert [action.kind for action in first].count("pick") == [action.kind for action in first].count("place")
    finish(world)
    assert (world.flow.report().phase, world.flow.report().replans) == (Phase.PLAYING, 0)
    world.until_playing()
    assert world.strategies[1][2] == {tube: len(balls) for tube, balls in zip(TUBES, middle.tubes)}
    assert len(world.plans) == 1


@pytest.mark.parametrize("least, count", [(1, 2), (2, 2), (3, 3), (4, 5), (9, 5)])
def test_a_look_waits_while_the_same_two_tubes_are_poured(least, count):
    pours = [Pour("left", "right"), Pour("right", "left"), Pour("left", "center"), Pour("center", "right"), Pour("center", "right")]
    assert next_part(START, pours, least).pours == tuple(pours[:count])


def test_a_game_that_no_new_plan_saves_is_not_solved():
    world = World(goal=GOAL, results=["RR|GG|PP"] * 3)
    for _ in range(3):
        world.until_playing()
        finish(world)
    report = world.flow.report()
    assert (report.phase, report.code) == (Phase.FAILED, GameCode.NOT_SOLVED)
    assert report.message == "the tubes hold RR|GG|PP instead of R|GG|PPR after 2 replans"


def test_tubes_that_cannot_be_read_leave_a_finished_game_unchecked():
    world = World(goal=GOAL, results=[""])
    world.until_playing()
    finish(world)
    report = world.flow.report()
    assert (report.phase, report.code) == (Phase.FINISHED, GameCode.UNCHECKED)
    assert "images within 5 s" in report.message
    assert world.gazes[-4:] == [SHEET_GAZE, SECOND_GAZE] * 2


def test_tubes_that_cannot_be_read_from_one_gaze_are_looked_at_from_the_other():
    world = World(goal=GOAL, results=["~R|GG|PPR"])
    world.until_playing()
    finish(world)
    assert (world.flow.report().phase, world.flow.report().code) == (Phase.FINISHED, GameCode.SOLVED)
    assert world.gazes[-2:] == [SHEET_GAZE, SECOND_GAZE]
    told = [report.message for report in world.reports if "looking from elsewhere" in report.message]
    assert len(told) == 1 and "images within 5 s" in told[0]


def test_tubes_that_cannot_be_read_before_the_last_pour_end_the_game():
    world = World(goal=State.parse("PR|PRG|G"), results=[""])
    world.until_playing()
    finish(world)
    report = world.flow.report()
    assert (report.phase, report.code) == (Phase.FAILED, GameCode.NO_CONTENTS)


@pytest.mark.parametrize("goal", ["R|GG|PPR", "PR|PRG|G"])
def test_a_ball_lost_by_a_pour_ends_the_game(goal):
    world = World(goal=State.parse(goal), results=["ball gone"], games=2)
    world.until_playing()
    finish(world)
    report = world.flow.report()
    assert (report.phase, report.code, report.message) == (Phase.FAILED, GameCode.BALL_LOST, "red seen")
    assert world.flow.over and len(world.strategies) == 1


def waiting_for_confirmation(**arguments):
    world = World(confirm_card=True, **arguments)
    report = world.until(Phase.WAITING_FOR_CONFIRMATION)
    assert (report.card, report.goal) == ("R|GG|PPR", "")
    assert "read as R|GG|PPR" in report.message
    return world


def test_nothing_goes_on_before_a_person_has_confirmed_the_card():
    world = waiting_for_confirmation()
    for _ in range(100):
        assert world.step().phase == Phase.WAITING_FOR_CONFIRMATION
    assert (world.gazes, world.plans) == ([CARD_GAZE], [])
    answer = world.flow.confirm_card("")
    assert (answer.code, answer.message) == (ConfirmCode.OK, "the goal is R|GG|PPR, confirmed")
    world.until_playing()
    report = world.flow.report()
    assert (report.card, report.goal, world.confirmations) == ("R|GG|PPR", "R|GG|PPR", [("R|GG|PPR", "R|GG|PPR")])


def test_a_corrected_card_is_played_and_what_was_read_is_kept():
    world = waiting_for_confirmation()
    answer = world.flow.confirm_card(" |GGR|PPR ")
    assert (answer.code, answer.message) == (ConfirmCode.OK, "the goal is |GGR|PPR, corrected from R|GG|PPR")
    world.until_playing()
    assert world.plans[0][:2] == ("RR|GG|PP", "|GGR|PPR")
    finish(world)
    report = world.flow.report()
    assert (report.card, report.goal, report.code) == ("R|GG|PPR", "|GGR|PPR", GameCode.SOLVED)
    assert world.confirmations == [("R|GG|PPR", "|GGR|PPR")]


@pytest.mark.parametrize("text", ["RRR|GG|PP", "yes", "R|GG", "|||"])
def test_a_correction_that_is_no_state_changes_nothing(text):
    world = waiting_for_confirmation()
    answer = world.flow.confirm_card(text)
    assert answer.code == ConfirmCode.WRONG_STATE
    assert "still waiting: the card was read as R|GG|PPR" in answer.message and "\n" not in answer.message
    assert world.step().phase == Phase.WAITING_FOR_CONFIRMATION
    assert world.flow.confirm_card("").code == ConfirmCode.OK


def test_only_a_card_that_waits_can_be_confirmed_and_only_once():
    world = World(confirm_card=True)
    world.until(Phase.LOOKING_FOR_CARD)
    answer = world.flow.confirm_card("RRGG||PP")
    assert (answer.code, answer.message) == (
        ConfirmCode.NOT_WAITING, "no card waits for confirmation: the game is LOOKING_FOR_CARD",
    )
    world.until(Phase.WAITING_FOR_CONFIRMATION)
    assert [world.flow.confirm_card(text).code for text in ("", "RRGG||PP")] == [ConfirmCode.OK, ConfirmCode.NOT_WAITING]
    world.until_playing()
    assert world.flow.report().goal == "R|GG|PPR"


def test_a_card_that_nobody_confirms_ends_the_game_with_what_it_waited_for():
    world = waiting_for_confirmation()
    report = world.until(Phase.FAILED)
    assert (report.code, report.card, report.goal) == (GameCode.NOT_CONFIRMED, "R|GG|PPR", "")
    assert report.message == "nobody confirmed or corrected the card, read as R|GG|PPR, within 30 s"
    assert world.strategies == []


def test_neither_a_given_goal_nor_a_replay_waits_for_a_person():
    world = World(goal=GOAL, confirm_card=True)
    world.until_playing()
    replay = World(robot=False, confirm_card=True)
    replay.until(Phase.FINISHED)
    assert Phase.WAITING_FOR_CONFIRMATION not in world.phases + replay.phases


def test_each_card_of_several_games_is_confirmed():
    world = waiting_for_confirmation(games=2, cards=("R|GG|PPR", "|GGR|PPR"))
    world.flow.confirm_card("")
    world.until_playing()
    finish(world)
    world.until(Phase.WAITING_FOR_CONFIRMATION)
    assert world.flow.report().card == "|GGR|PPR"
    world.flow.confirm_card("")
    world.until_playing()


def test_each_game_starts_where_the_last_one_ended():
    world = World(games=2, cards=("R|GG|PPR", "|GGR|PPR"))
    world.until_playing()
    finish(world)
    assert not world.flow.over
    world.until_playing()
    assert world.strategies[1][2] == {"left": 1, "center": 2, "right": 3}
    finish(world)
    assert world.flow.over
    finished = [report for report in world.reports if report.phase == Phase.FINISHED]
    assert [(report.game, report.start, report.goal) for report in finished] == [
        (0, "RR|GG|PP", "R|GG|PPR"), (1, "R|GG|PPR", "|GGR|PPR"),
    ]
    assert finished[1].robot_seconds < world.now.robot_s - 7.0 - finished[0].robot_seconds + 0.2


def test_the_last_games_card_that_is_still_shown_is_not_taken_for_the_next():
    world = World(games=2, cards=("R|GG|PPR", "R|GG|PPR", "|GGR|PPR"))
    world.until_playing()
    finish(world)
    world.until_playing()
    assert world.found_cards == ["R|GG|PPR", "|GGR|PPR"]


def test_the_last_games_card_shown_for_ever_ends_at_the_limit():
    world = World(games=2, cards=("R|GG|PPR",) * 2000)
    world.until_playing()
    finish(world)
    report = world.until(Phase.FAILED, steps=4000)
    assert report.code == GameCode.NO_CARD
    assert len(world.gazes) == 5


def test_a_game_that_fails_while_the_robot_moves_stops_it():
    world = World(goal=GOAL)
    world.until_playing()
    world.step()
    world.flow.fail(GameCode.INTERNAL_ERROR, "spoilt on purpose")
    assert world.stops == 1


def test_a_replay_commands_nothing_and_ends_when_card_and_tubes_are_found():
    world = World(robot=False)
    world.now = replace(world.now, engine=None, head=None)
    report = world.until(Phase.FINISHED)
    assert (report.code, world.gazes, world.strategies) == (GameCode.REPLAYED, [], [])
    assert world.found_cards == ["R|GG|PPR"] and world.found_tubes == [PLACES]
    assert world.plans[0][:3] == ("RR|GG|PP", "R|GG|PPR", 1)


def test_a_recording_without_a_card_ends_with_what_was_not_found_in_it():
    world = World(robot=False, cards=())
    world.until(Phase.LOOKING_FOR_CARD)
    world.frames = False
    report = world.until(Phase.FAILED)
    assert report.code == GameCode.NO_CARD
    assert "the recording gave no image for 5 s" in report.message


def test_images_taken_before_the_head_came_to_rest_are_not_looked_at():
    world = World()
    world.until(Phase.LOOKING_FOR_CARD)
    world.now = replace(world.now, head=Gaze(0.0, 0.3))
    for _ in range(10):
        world.step()
    world.now = replace(world.now, head=CARD_GAZE)
    world.step()
    for _ in range(2):
        assert world.step().phase == Phase.LOOKING_FOR_CARD
    assert world.step().phase == Phase.LOOKING_FOR_TUBES


def no_engine(world):
    world.now = replace(world.now, engine=None)


def engine_without_a_robot(world):
    world.engine(EngineState.IDLE, EngineCode.NO_JOINT_STATES)


def no_image_ever(world):
    world.now = replace(world.now, camera_seen=False, camera_problem="no image on camera/image_raw")
    world.frames = False


def no_image_while_looking(world):
    world.frames = False


def camera_frozen(world):
    world.frames = False
    problem = "image of 7.300 s repeats the one before pixel by pixel"
    world.now = replace(world.now, camera_frozen=True, camera_problem=problem)


def camera_frozen_after_the_pours(world):
    world.until_playing()
    world.engine(EngineState.DONE, action_index=0)
    world.until(Phase.CHECKING)
    camera_frozen(world)


def head_stuck_before_the_pours(world):
    world.until(Phase.LOOKING_FOR_TUBES)
    head_stuck(world)


def head_stuck(world):
    world.look_at = lambda gaze, duration_s: Answer(EngineCode.OK)


def unreadable_tubes(world):
    world.present = ""


def ball_beside_the_tubes(world):
    world.present = "ball gone"


def no_card(world):
    world.cards = []


def engine_refuses(world):
    world.answer = EngineCode.BUSY


def engine_hangs(world):
    world.answer = NO_ANSWER


def engine_dies(world):
    world.until(Phase.LOOKING_FOR_CARD)
    world.engine_speaks = False


@pytest.mark.parametrize(
    "fault, code, words",
    [
        (no_engine, GameCode.NO_ENGINE, "no status of control_engine within 10 s"),
        (engine_without_a_robot, GameCode.NO_ENGINE, "no present joint states within 10 s"),
        (no_image_ever, GameCode.NO_CAMERA, "no image on camera/image_raw within 5 s"),
        (no_image_while_looking, GameCode.NO_CAMERA, "no image within 5 s"),
        (camera_frozen, GameCode.CAMERA_FROZEN, "nothing new from the camera for 2 s: image of 7.300 s repeats the one before"),
        (camera_frozen_after_the_pours, GameCode.CAMERA_FROZEN, "nothing new from the camera for 2 s"),
        (head_stuck, GameCode.HEAD_NOT_STILL, "after 4 s"),
        (head_stuck_before_the_pours, GameCode.HEAD_NOT_STILL, "head_p=0.4"),
        (unreadable_tubes, GameCode.NO_CONTENTS, "images within 5 s"),
        (ball_beside_the_tubes, GameCode.BALL_LOST, "red seen"),
        (no_card, GameCode.NO_CARD, "images within 20 s"),
        (engine_refuses, GameCode.ENGINE_REFUSED, "control_engine: BUSY: fake"),
        (engine_hangs, GameCode.ENGINE_LOST, "fake"),
        (engine_dies, GameCode.ENGINE_LOST, "no status for 3 s"),
    ],
)
def test_every_wait_ends_with_a_name(fault, code, words):
    world = World()
    fault(world)
    report = world.until(Phase.FAILED)
    assert report.code == code
    assert words in report.message
    assert world.flow.over


def test_a_fault_of_the_engine_ends_the_game_with_the_engines_own_code():
    world = World(goal=GOAL, games=3)
    world.until_playing()
    world.engine(EngineState.FAULT, EngineCode.TRACKING_ERROR, action_index=1, message="l_arm_el_y is 0.2 rad from its goal")
    report = world.step()
    assert (report.phase, report.code) == (Phase.FAILED, GameCode.ENGINE_FAULT)
    assert report.message == "control_engine: TRACKING_ERROR: action 1: l_arm_el_y is 0.2 rad from its goal"
    assert world.flow.over


@pytest.mark.parametrize("code", EngineCode.PUT_DOWN)
def test_a_grasp_that_failed_is_tried_again_from_what_is_seen_but_not_without_end(code):
    world = World(goal=GOAL, results=["RR|GG|PP"] * (SETTINGS.most_replans + 1))
    for attempt in range(1, SETTINGS.most_replans + 1):
        world.until_playing()
        world.engine(EngineState.FAULT, code, strategy_id=attempt, action_index=1, message="left hand closed on nothing")
        assert world.step().phase == Phase.CHECKING
        assert world.faults == [f"control_engine: {code}: action 1: left hand closed on nothing"] * attempt
    world.until_playing()
    world.engine(EngineState.FAULT, code, strategy_id=attempt + 1, action_index=1, message="left hand closed on nothing")
    report = world.step()
    assert (report.phase, report.code, report.replans) == (Phase.FAILED, GameCode.ENGINE_FAULT, SETTINGS.most_replans)
    assert report.pours == ()
    assert report.message == f"control_engine: {code}: action 1: left hand closed on nothing, after 2 replans"


@pytest.mark.parametrize("code", EngineCode.PUT_DOWN)
def test_a_fault_of_a_hand_after_which_nothing_can_be_read_ends_the_game_by_its_name(code):
    world = World(goal=GOAL, results=[""], games=2)
    world.until_playing()
    world.engine(EngineState.FAULT, code, action_index=1, message="left hand closed on nothing")
    world.until(Phase.FAILED)
    report = world.flow.report()
    assert report.code == GameCode.ENGINE_FAULT and world.flow.over
    assert report.message.startswith(f"control_engine: {code}: action 1: left hand closed on nothing; afterwards NO_CONTENTS: ")


def test_pours_that_a_fault_kept_from_beginning_are_not_counted():
    world, pours = world_in_pause(**dict.fromkeys(TUBES, ""))
    assert world.flow.report().pours == tuple(pours) and len(pours) > 1
    index = world.now.engine.action_index
    world.engine(EngineState.FAULT, EngineCode.TUBE_SLIPPED, strategy_id=1, action_index=index, message="left hand after the pour")
    world.step()
    report = world.flow.report()
    assert (report.phase, report.pours) == (Phase.CHECKING, tuple(pours[:1]))
    assert [record.failed for record in report.actions] == [False] * index + [True]


def test_a_stop_by_hand_ends_the_game():
    world = World(goal=GOAL)
    world.until_playing()
    world.engine(EngineState.IDLE, EngineCode.STOPPED, action_index=0, message="stopped on request")
    assert world.step().code == GameCode.ENGINE_FAULT


def test_the_status_of_an_earlier_strategy_does_not_end_the_game():
    world = World(goal=GOAL)
    world.until_playing()
    world.engine(EngineState.DONE, strategy_id=0)
    assert world.step().phase == Phase.PLAYING


def test_nothing_is_commanded_after_the_end():
    world = World(cards=())
    world.until(Phase.FAILED)
    told = len(world.reports)
    for _ in range(50):
        world.step()
    assert (len(world.reports), world.strategies) == (told, [])
