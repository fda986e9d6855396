"""The command `play_human`: by lines as a script plays it, and at a terminal as a person does."""
import io
import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import termios
import time
from argparse import Namespace
from pathlib import Path

import pytest

from dr_eureka.bench.human_cards import Card
from dr_eureka.bench.people import read_played_cards
from dr_eureka.cli.card_display import card_lines
from dr_eureka.cli.card_round import CardRound, NothingToUndo
from dr_eureka.cli.keys import line_keys
from dr_eureka.cli.play_human import chosen_cards, main
from dr_eureka.game.planner import plan_pours
from dr_eureka.game.state import START, PourError, State

PACKAGE = Path(__file__).resolve().parent.parent
EASY = State.parse("RR|G|PPG")
EPOCH = "2026-11-22T12:00:00+00:00"


class Clock:
    """A clock that a test sets [s]."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def play(monkeypatch, capsys):
    """Run the command with these lines on stdin; returns exit code, stdout and stderr."""

    def run(lines, *arguments):
        monkeypatch.setattr(sys, "stdin", io.StringIO(lines))
        code = main(list(arguments))
        return code, *capsys.readouterr()

    return run


def environment(**more):
    kept = {key: value for key, value in os.environ.items() if not key.startswith("ROS_") and key != "NO_COLOR"}
    return {**kept, "PYTHONPATH": str(PACKAGE / "src"), "TERM": "xterm", **more}


class Terminal:
    """The command in a process of its own, at a pseudo-terminal."""

    def __init__(self, *arguments, **variables):
        try:
            self._end, end = pty.openpty()
        except OSError as error:
            pytest.skip(f"this machine has no terminals to play at: {error}")
        self.process = subprocess.Popen(
            [sys.executable, str(PACKAGE / "scripts" / "play_human"), *arguments],
            stdin=end, stdout=end, stderr=end, env=environment(**variables), start_new_session=True,
            # Tests run in the background may have been told to ignore it, which a child inherits.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )
        os.close(end)
        self.output = ""

    def until(self, pattern):
        """Read until the output of this call matches; returns what was read."""
        read, deadline = "", time.monotonic() + 30
        while not re.search(pattern, read):
            assert time.monotonic() < deadline, f"{pattern} not in {self.output[-2000:]}"
            if select.select([self._end], [], [], 1)[0]:
                try:
                    piece = os.read(self._end, 4096).decode()
                except OSError:
                    piece = ""
                read += piece
                self.output += piece
        return read

    def press(self, keys):
        os.write(self._end, keys.encode())

    def echoes(self):
        """Tell whether the terminal shows what is typed, as a shell expects it to."""
        return bool(termios.tcgetattr(self._end)[3] & termios.ECHO)

    def close(self):
        self.process.kill()
        self.process.wait()
        os.close(self._end)


@pytest.fixture
def terminal():
    opened = []

    def start(*arguments, **variables):
        opened.append(Terminal(*arguments, **variables))
        return opened[-1]

    yield start
    for one in opened:
        one.close()


def test_a_round_counts_pours_and_their_times_and_takes_them_back_by_pouring():
    clock = Clock()
    card_round = CardRound(Card(START, EASY, 1), EPOCH, clock)
    clock.now += 2.0
    card_round.pour("left", "center")
    clock.now += 1.5
    card_round.undo()
    assert card_round.state == START and not card_round.solved
    card_round.pour("center", "right")
    clock.now += 60.0
    assert card_round.solved and card_round.seconds == 3.5
    played = card_round.played()
    assert [(move.seconds, move.source, move.target, move.undo) for move in played.moves] == [
        (2.0, "left", "center", False), (3.5, "center", "left", True), (3.5, "center", "right", False),
    ]
    assert (played.began, played.start, played.goal, played.optimum) == (EPOCH, "RR|GG|PP", "RR|G|PPG", 1)
    assert (played.solved, played.seconds) == (True, 3.5)


def test_a_restart_pours_every_ball_back_the_last_first():
    card_round = CardRound(Card(START, State.parse("G|R|GPRP"), 12), EPOCH, Clock())
    card_round.pour("left", "center")
    card_round.pour("center", "right")
    card_round.restart()
    assert card_round.state == START
    assert [(move.source, move.target) for move in card_round.moves[2:]] == [("right", "center"), ("center", "left")]
    with pytest.raises(NothingToUndo, match="nothing to undo"):
        card_round.restart()


def test_a_refused_pour_changes_nothing():
    card_round = CardRound(Card(State.parse("RRGG||PP"), EASY, 3), EPOCH, Clock())
    with pytest.raises(PourError, match="0 balls in the center tube"):
        card_round.pour("center", "left")
    assert (card_round.state, card_round.moves) == (State.parse("RRGG||PP"), [])


def test_words_of_keys_are_taken_apart_and_others_stay_whole():
    assert list(line_keys(["12\n", " 2 3 U\n", "\n"])) == ["1", "2", "2", "3", "u"]
    assert list(line_keys(["hello 1x\n", "\x1b[A\n"])) == ["hello", "1x", "\x1b[a"]


def test_the_card_shows_tubes_goal_keys_pours_and_clock():
    clock = Clock()
    card_round = CardRound(Card(START, EASY, 1), EPOCH, clock)
    card_round.pour("left", "center")
    clock.now += 83
    assert card_lines("Card 1 of 2", card_round, coloured=False) == [
        "Card 1 of 2   1 pour   1:23",
        "",
        "  tubes                          goal",
        "  |   |    |   |    |   |        |   |    |   |    |   |",
        "  |   |    | R |    |   |        |   |    |   |    | G |",
        "  |   |    | G |    | P |        | R |    |   |    | P |",
        "  | R |    | G |    | P |        | R |    | G |    | P |",
        "  +---+    +---+    +---+        +---+    +---+    +---+",
        "   left    center   right         left    center   right",
        "     1        2       3",
    ]


def test_colours_stand_behind_the_letters_and_change_no_letter():
    card_round = CardRound(Card(START, EASY, 1), EPOCH, Clock())
    plain, coloured = (card_lines("Card", card_round, colours) for colours in (False, True))
    assert "".join(coloured).count("48;5;160m R \x1b[0m") == 4
    assert [re.sub(r"\x1b\[[\d;]*m", "", line) for line in coloured] == plain


def test_a_card_is_solved_by_lines_and_told_against_the_optimum(play):
    code, out, err = play("12\nu\n2 3\n", "--goal", str(EASY))
    assert (code, err) == (0, "")
    assert "Solved with 3 pours in 0:00; the fewest is 1.\nA shortest way: 23\n" in out
    assert out.endswith("RR|GG|PP to RR|G|PPG: 3 pours, fewest 1, 0:00\n")
    assert "\x1b" not in out


def test_the_shortest_plan_is_told_as_such(play):
    goal = State.parse("RRP|PG|G")
    key_of = {"left": "1", "center": "2", "right": "3"}
    lines = "\n".join(key_of[pour.source] + key_of[pour.target] for pour in plan_pours(START, goal))
    code, out, _ = play(lines, "--goal", str(goal))
    assert code == 0
    assert "Solved with 6 pours in 0:00; the fewest is 6.\n" in out
    assert "shortest way" not in out


@pytest.mark.parametrize(
    "line, problem",
    [
        ("hello", "key 'hello': expected 1 left, 2 center, 3 right, u undo, r restart or q quit"),
        ("11", "pour left to left, count 1: source and target are the same tube, expected two"),
        ("u", "nothing to undo, the tubes are as at the start"),
        ("1x", "key '1x': expected 1 left, 2 center, 3 right, u undo, r restart or q quit"),
    ],
)
def test_what_cannot_be_done_is_one_line_and_the_card_goes_on(play, line, problem):
    code, out, err = play(f"{line}\n23\n", "--goal", str(EASY))
    assert (code, err) == (0, f"play_human: {problem}\n")
    assert "Solved with 1 pour " in out


def test_cards_and_times_go_to_the_log_solved_or_not(play, tmp_path):
    log = tmp_path / "me.jsonl"
    assert play("23\n", "--goal", str(EASY), "--log", str(log))[0] == 0
    assert play("12\nq\n23\n", "--goal", str(EASY), "--log", str(log))[0] == 0
    solved, left = read_played_cards(tmp_path)
    assert (solved.solved, solved.optimum) == (True, 1)
    assert [(move.source, move.target) for move in solved.moves] == [("center", "right")]
    assert (left.solved, len(left.moves)) == (False, 1)


def test_input_that_ends_leaves_the_card_unsolved(play):
    code, out, _ = play("12\n", "--seed", "3", "--cards", "4")
    assert code == 0
    assert re.search(r"^RR\|GG\|PP to \S+: not solved, 0:00$", out, re.MULTILINE)


@pytest.mark.parametrize(
    "arguments, problem",
    [
        (["--goal", "RRR|GG|PP"], "play_human: RRR|GG|PP: 3 red balls, expected 2\n"),
        (["--start", "RR|GG"], "play_human: RR|GG: 2 tubes, expected 3 separated by '|'\n"),
        (
            ["--log", "missing/me.jsonl"],
            "play_human: --log missing/me.jsonl: No such file or directory; expected a file that can be written\n",
        ),
    ],
)
def test_bad_arguments_end_with_one_line_and_code_2(play, tmp_path, monkeypatch, arguments, problem):
    monkeypatch.chdir(tmp_path)
    assert play("", *arguments) == (2, "", problem)


@pytest.mark.parametrize("arguments", [["--cards", "0"], ["--cards", "99999999"], ["--cards", "few"], ["--cards", "2", "--goal", "RR|G|PPG"]])
def test_bad_options_are_refused(arguments, capsys):
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert "argument --" in capsys.readouterr().err


def test_the_seed_draws_the_cards_easier_ones_first():
    def cards(**changes):
        return chosen_cards(Namespace(**{"seed": 1, "start": str(START), "goal": None, "cards": 30, **changes}))

    drawn = cards()
    assert drawn == cards() != cards(seed=2)
    costs = [card.optimum for card in drawn]
    assert costs == sorted(costs) and costs[0] < 4 and costs[-1] > 9
    assert {card.start for card in drawn} == {START}
    for card in drawn[::10]:
        assert len(plan_pours(card.start, card.goal)) == card.optimum
    assert len({card.start for card in cards(start="random", cards=5)}) > 1


def test_a_person_plays_at_a_terminal_with_single_keys_colours_and_a_running_clock(terminal, tmp_path):
    person = terminal("--goal", str(EASY), "--log", str(tmp_path / "me.jsonl"))
    assert "48;5;160m R " in person.until(r"q: quit")
    person.until("0:01")
    person.press("1")
    person.until(r"from left to \.\.\.")
    person.press("\x1b[A")
    person.until(r"key '\\x1b\[a': expected 1 left")
    person.until(r"key '\\x1b\[a': expected 1 left")  # still there when the clock has moved on
    person.press("23")
    person.until(r"Solved with 1 pour in 0:0\d; the fewest is 1\.")
    assert person.process.wait(30) == 0
    (card,) = read_played_cards(tmp_path)
    assert card.solved and card.seconds >= 1.0


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_and_a_kill_lose_nothing_and_end_with_130(terminal, tmp_path, stop):
    person = terminal("--goal", "G|R|GPRP", "--log", str(tmp_path / "me.jsonl"), NO_COLOR="1")
    assert "48;5" not in person.until(r"q: quit")
    person.press("3132")
    person.until("2 pours")
    os.kill(person.process.pid, stop)
    person.until("not solved")
    assert person.process.wait(30) == 130
    (card,) = read_played_cards(tmp_path)
    assert [(move.source, move.target) for move in card.moves] == [("right", "left"), ("right", "center")]


def test_a_terminal_waits_for_a_key_between_cards_and_is_left_as_it_was(terminal):
    card = chosen_cards(Namespace(seed=1, start=str(START), goal=None, cards=2))[0]
    key_of = {"left": "1", "center": "2", "right": "3"}
    person = terminal("--seed", "1", "--cards", "2")
    person.until(r"Card 1 of 2[^$]*q: quit")
    assert not person.echoes()
    person.press("".join(key_of[pour.source] + key_of[pour.target] for pour in plan_pours(card.start, card.goal)))
    person.until("Any key shows the next card")
    person.press("\n")
    person.until(r"Card 2 of 2")
    person.press("\x04")
    person.until("not solved")
    assert person.process.wait(30) == 0
    assert person.echoes()


def test_help_needs_no_master_and_documents_the_log():
    command = [sys.executable, str(PACKAGE / "scripts" / "play_human"), "--help"]
    finished = subprocess.run(command, env=environment(), capture_output=True, text=True, timeout=30)
    assert finished.returncode == 0
    card_round = CardRound(Card(START, EASY, 1), EPOCH, Clock())
    card_round.pour("center", "right")
    card = json.loads(card_round.played().as_line())
    assert {*card, *card["moves"][0]} <= set(re.findall(r"\w+", finished.stdout))
