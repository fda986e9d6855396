"""Keys pressed at a terminal, one by one and without Enter, or written in the lines of a file or a pipe."""
from __future__ import annotations

import os
import select
import termios
import tty
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Optional, TextIO

from dr_eureka.game.state import TUBES

TUBE_KEYS = dict(zip("123", TUBES))
UNDO, RESTART, QUIT = "u", "r", "q"
#: Space, Enter and the like.
BLANK = " "
KEYS = {*TUBE_KEYS, UNDO, RESTART, QUIT}

_TICK = 1.0
_CTRL_D = "\x04"


def line_keys(lines: Iterable[str]) -> Iterator[str]:
    """Yield the keys in lines of text; a word that holds anything else is one unknown key."""
    for line in lines:
        for word in line.lower().split():
            yield from word if KEYS.issuperset(word) else (word,)


def terminal_keys(terminal: TextIO) -> Iterator[Optional[str]]:
    """Yield keys as they are pressed and None for each second without one, until Ctrl-D or the terminal is gone.

    The terminal must be `unbuffered`. A key that sends several characters, such as an arrow, is one unknown key.
    """
    number = terminal.fileno()
    while True:
        if not select.select([number], [], [], _TICK)[0]:
            yield None
            continue
        pressed = os.read(number, 1024).decode(errors="replace")
        if not pressed or _CTRL_D in pressed:
            return
        yield from line_keys([pressed]) if pressed.strip() else BLANK


@contextmanager
def unbuffered(terminal: TextIO) -> Iterator[None]:
    """Have a terminal hand over each key at once and unechoed; Ctrl-C still interrupts. As it was before at the end."""
    number = terminal.fileno()
    before = termios.tcgetattr(number)
    try:
        tty.setcbreak(number)
        yield
    finally:
        termios.tcsetattr(number, termios.TCSADRAIN, before)
