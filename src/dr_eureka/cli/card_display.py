"""What a person sees of a card in play: the tubes beside the goal, in colours where the output takes them."""
from __future__ import annotations

import re
import sys
from itertools import zip_longest
from typing import Protocol

from dr_eureka.cli.card_round import CardRound
from dr_eureka.cli.keys import QUIT, RESTART, TUBE_KEYS, UNDO
from dr_eureka.game.state import draw_state

#: 256-colour codes of letter and ground; the letters stay for those who cannot tell the colours apart.
_COLOURS = {"R": (231, 160), "G": (16, 40), "P": (231, 91)}
_HOME, _CLEAR_LINE, _CLEAR_BELOW = "\x1b[H", "\x1b[K", "\x1b[J"
_HELP = f"pour: from tube, to tube   {UNDO}: undo   {RESTART}: restart   {QUIT}: quit"
_GAP = "      "


class Display(Protocol):
    """Shows a card in play."""

    def show(self, title: str, card_round: CardRound, pending: str, problem: str) -> None:
        """Show the tubes, what is pressed of a pour (`pending`, a tube key or nothing), and what was wrong, if anything."""


class TerminalDisplay:
    """A terminal whose screen is drawn anew each time, with a running clock."""

    def __init__(self, coloured: bool) -> None:
        self._coloured = coloured

    def show(self, title: str, card_round: CardRound, pending: str, problem: str) -> None:
        """Draw all, whatever has changed."""
        tube = f"from {TUBE_KEYS[pending]} to ..." if pending else ""
        lines = [*card_lines(title, card_round, self._coloured), "", _HELP, tube or problem]
        sys.stdout.write(_HOME + "".join(f"{line}{_CLEAR_LINE}\n" for line in lines) + _CLEAR_BELOW)
        sys.stdout.flush()


class LineDisplay:
    """Plain lines, one drawing after the other, for files and pipes; what is wrong goes to stderr."""

    def show(self, title: str, card_round: CardRound, pending: str, problem: str) -> None:
        """Print the tubes, unless a pour is half pressed, or what was wrong."""
        if problem:
            print(f"play_human: {problem}", file=sys.stderr, flush=True)
        elif not pending:
            print("\n".join(card_lines(title, card_round, coloured=False)), end="\n\n", flush=True)


def card_lines(title: str, card_round: CardRound, coloured: bool) -> list[str]:
    """Return the lines that show a card in play: title, pours and clock, tubes and goal side by side, keys below."""
    now, goal = (draw_state(state).splitlines() for state in (card_round.state, card_round.card.goal))
    width = max(map(len, now))
    now.append(_keys_below(now[-1]))
    sides = zip_longest(["  tubes", *now], ["  goal", *goal], fillvalue="")
    drawing = [f"{left:{width}}{_GAP}{right}".rstrip() for left, right in sides]
    if coloured:
        drawing = [re.sub(r"(?<=\|) [RGP] (?=\|)", _coloured_ball, line) for line in drawing]
    return [f"{title}   {pours_text(len(card_round.moves))}   {clock_text(card_round.seconds)}", "", *drawing]


def pours_text(count: int) -> str:
    """Return a number of pours in words."""
    return "1 pour" if count == 1 else f"{count} pours"


def clock_text(seconds: float) -> str:
    """Return a time as minutes and whole seconds."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02}"


def _keys_below(names: str) -> str:
    """Return a line with the key of each tube under the middle of its name."""
    line = [" "] * len(names)
    for key, tube in TUBE_KEYS.items():
        line[names.index(tube) + len(tube) // 2] = key
    return "".join(line)


def _coloured_ball(ball: re.Match[str]) -> str:
    letter, ground = _COLOURS[ball.group().strip()]
    return f"\x1b[1;38;5;{letter};48;5;{ground}m{ball.group()}\x1b[0m"
