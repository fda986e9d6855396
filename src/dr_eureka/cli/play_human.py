"""The command `play_human`: a person plays cards in the terminal, against the clock and the fewest pours."""
from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime, timezone
from pathlib import Path
from typing import NamedTuple, Optional

from dr_eureka.bench.human_cards import Card, draw_cards, optima
from dr_eureka.bench.people import PlayedCard
from dr_eureka.cli.card_display import Display, LineDisplay, TerminalDisplay, clock_text, pours_text
from dr_eureka.cli.card_round import CardRound
from dr_eureka.cli.keys import BLANK, QUIT, RESTART, TUBE_KEYS, UNDO, line_keys, terminal_keys, unbuffered
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.planner import plan_pours
from dr_eureka.game.state import START, State, all_states

CARDS = 5
MOST_CARDS = 1000
ANY_START = "random"
INTERRUPTED = 130

_EPILOG = """\
A state is written RR|GG|PP: tubes left to right, balls bottom to top, R red, G green, P purple; an empty tube is empty,
as in RRGG||PP. Quote it: | is special to a shell.

Without a terminal the keys are read from the lines of stdin, such as 12, and the tubes are printed after each pour.
NO_COLOR=1 leaves the colours away.

A line of the log is one card, whether it was solved or not:
  began    when it was shown, ISO 8601        solved   true or false
  start    state                              seconds  until the last pour, or until you stopped
  goal     state                              moves    every pour: seconds since the card was shown, source, target,
  optimum  fewest pours from start to goal             undo (true: it took another back)
`benchmark human --out FOLDER` shows the cards of all FOLDER/*.jsonl beside its model of a person.
"""


class LogError(DrEurekaError):
    """A log that cannot be written."""


class UnknownKey(DrEurekaError):
    """A key that means nothing here."""


class Surface(NamedTuple):
    """Where a person plays: keys pressed (None: a second has passed), what shows the card, whether to wait between cards."""

    keys: Iterator[Optional[str]]
    display: Display
    waits: bool


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code.

    0 however many cards were solved; 2 for bad arguments or a log that cannot be written; 130 after Ctrl-C.
    """
    arguments = _parser().parse_args(argv)
    played: list[PlayedCard] = []
    try:
        cards = chosen_cards(arguments)
        with _log(arguments.log) as write, _stops_like_ctrl_c(), _surface() as surface:

            def record(card: PlayedCard) -> None:
                played.append(card)
                write(card)

            play_cards(cards, surface, record)
    except DrEurekaError as error:
        print(f"play_human: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return INTERRUPTED
    finally:
        for line in summary_lines(played):
            print(line)
    return 0


def chosen_cards(arguments: argparse.Namespace) -> list[Card]:
    """Return the cards that the arguments ask for, the easier ones first. Raises StateError for an impossible state."""
    chance = random.Random(arguments.seed)
    start = None if arguments.start == ANY_START else State.parse(arguments.start)
    if arguments.goal is not None:
        start = start or chance.choice(all_states())
        goal = State.parse(arguments.goal)
        return [Card(start, goal, len(plan_pours(start, goal)))]
    # Each cost is as likely as any other: cards drawn evenly would nearly all need 6 to 10 pours.
    costs = sorted(chance.choices(optima(start), k=arguments.cards))
    return [card for cost in costs for card in draw_cards(cost, 1, chance, start)]


def play_cards(cards: Sequence[Card], surface: Surface, record: Callable[[PlayedCard], None]) -> None:
    """Let a person play cards until all are solved, the person quits or the keys end; each one shown is recorded."""
    for number, card in enumerate(cards, 1):
        card_round = CardRound(card, datetime.now(timezone.utc).isoformat(timespec="seconds"), time.monotonic)
        try:
            _play_card(card_round, f"Card {number} of {len(cards)}", surface)
        finally:
            record(card_round.played())
        if not card_round.solved:
            return
        print(*result_lines(card_round.played()), sep="\n", end="\n\n", flush=True)
        if surface.waits and number < len(cards) and not _goes_on(surface.keys):
            return


def _play_card(card_round: CardRound, title: str, surface: Surface) -> None:
    """Let a person pour until the card is solved, the person quits or the keys end."""
    pending = problem = ""
    surface.display.show(title, card_round, pending, problem)
    while not card_round.solved:
        key = next(surface.keys, QUIT)
        if key == QUIT:
            return
        if key not in (None, BLANK):
            try:
                pending, problem = _press(card_round, pending, key), ""
            except DrEurekaError as error:
                pending, problem = "", str(error)
        surface.display.show(title, card_round, pending, problem)


def _press(card_round: CardRound, pending: str, key: str) -> str:
    """Do what a key says and return the key of the tube that a pour begins with, if it lacks its second.

    Raises UnknownKey, PourError or NothingToUndo when it cannot be done; the tubes stay as they are.
    """
    if key == UNDO:
        card_round.undo()
    elif key == RESTART:
        card_round.restart()
    elif key not in TUBE_KEYS:
        tubes = ", ".join(f"{tube_key} {tube}" for tube_key, tube in TUBE_KEYS.items())
        raise UnknownKey(f"key {key!r}: expected {tubes}, {UNDO} undo, {RESTART} restart or {QUIT} quit")
    elif not pending:
        return key
    else:
        card_round.pour(TUBE_KEYS[pending], TUBE_KEYS[key])
    return ""


def _goes_on(keys: Iterator[Optional[str]]) -> bool:
    """Wait for a key; tell whether it was another than quit."""
    print("Any key shows the next card.", flush=True)
    return next((key for key in keys if key is not None), QUIT) != QUIT


def result_lines(card: PlayedCard) -> Iterator[str]:
    """Yield how a solved card went, with a shortest way if the person's was longer."""
    taken = pours_text(len(card.moves))
    yield f"Solved with {taken} in {clock_text(card.seconds)}; the fewest is {card.optimum}."
    if len(card.moves) > card.optimum:
        pours = plan_pours(State.parse(card.start), State.parse(card.goal))
        key_of = {tube: key for key, tube in TUBE_KEYS.items()}
        yield f"A shortest way: {' '.join(key_of[pour.source] + key_of[pour.target] for pour in pours)}"


def summary_lines(played: Sequence[PlayedCard]) -> Iterator[str]:
    """Yield a line for each card that was played and, after several, one for those solved."""
    solved = [card for card in played if card.solved]
    for card in played:
        verdict = f"{pours_text(len(card.moves))}, fewest {card.optimum}" if card.solved else "not solved"
        yield f"{card.start} to {card.goal}: {verdict}, {clock_text(card.seconds)}"
    if len(solved) > 1:
        total = sum(len(card.moves) for card in solved)
        seconds = sum(card.seconds for card in solved)
        fewest = sum(card.optimum for card in solved)
        yield f"{len(solved)} cards solved: {total} pours, fewest {fewest}, {clock_text(seconds)}"


@contextmanager
def _log(file: Optional[Path]) -> Iterator[Callable[[PlayedCard], None]]:
    """Open the log, if any; yields what adds a card to it at once. Raises LogError where nothing can be written."""
    if file is None:
        yield lambda card: None
        return
    with _log_errors(file):
        stream = file.open("a", encoding="utf-8")

    def write(card: PlayedCard) -> None:
        with _log_errors(file):
            stream.write(card.as_line())
            stream.flush()

    with stream:
        yield write


@contextmanager
def _log_errors(file: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise LogError(f"--log {file}: {error.strerror}; expected a file that can be written") from error


@contextmanager
def _stops_like_ctrl_c() -> Iterator[None]:
    """Have a closed terminal and a kill end the game as Ctrl-C does: with all that was played in the log."""
    before = {stop: signal.signal(stop, signal.default_int_handler) for stop in (signal.SIGHUP, signal.SIGTERM)}
    try:
        yield
    finally:
        for stop, handler in before.items():
            signal.signal(stop, handler)


@contextmanager
def _surface() -> Iterator[Surface]:
    """Yield the terminal with a running clock, or plain lines where there is none."""
    if sys.stdin.isatty() and sys.stdout.isatty() and os.environ.get("TERM", "dumb") != "dumb":
        with unbuffered(sys.stdin):
            yield Surface(terminal_keys(sys.stdin), TerminalDisplay(coloured=not os.environ.get("NO_COLOR")), waits=True)
    else:
        yield Surface(line_keys(sys.stdin), LineDisplay(), waits=False)


def _parser() -> argparse.ArgumentParser:
    tubes = ", ".join(f"{key} {tube}" for key, tube in TUBE_KEYS.items())
    parser = argparse.ArgumentParser(
        prog="play_human",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Play cards of Dr. Eureka: pour ball after ball until the tubes are as the goal beside them.\n"
        f"A pour is two keys, from tube and to tube: {tubes}. {UNDO} undo, {RESTART} restart, {QUIT} quit.\n"
        "Undo and restart pour the balls back, and each of these pours counts.",
        epilog=_EPILOG,
    )
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--cards", type=_count, default=CARDS, metavar="N", help="cards to draw (default: %(default)s)")
    what.add_argument("--goal", metavar="STATE", help="play this one card instead")
    parser.add_argument(
        "--start",
        default=str(START),
        metavar="STATE",
        help=f"what the tubes hold when a card is shown (default: %(default)s); {ANY_START}: drawn with each card",
    )
    parser.add_argument("--seed", type=int, help="draws the cards (default: other cards each time)")
    parser.add_argument("--log", type=Path, metavar="FILE", help="add each card to this file, one JSON object a line")
    return parser


def _count(word: str) -> int:
    if not word.isdecimal() or not 1 <= int(word) <= MOST_CARDS:
        raise argparse.ArgumentTypeError(f"{word!r} is no whole number from 1 to {MOST_CARDS}")
    return int(word)
