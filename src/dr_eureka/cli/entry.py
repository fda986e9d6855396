"""What every command shares: how it ends when nobody reads on, and on Ctrl-C."""
from __future__ import annotations

import os
import select
import signal
import sys
from collections.abc import Callable
from typing import NoReturn


def run(main: Callable[[], int]) -> NoReturn:
    """Run a command's `main` and exit with its code.

    Where the reader of stdout has gone, as `head` goes when it has enough, or on Ctrl-C, the command ends without a word,
    with the exit code that a shell gives to programs which the signal ended: 141 or 130.
    """
    try:
        try:
            code = main()
        finally:
            if sys.stdout is not None:
                sys.stdout.flush()
    except BrokenPipeError:
        if not _stdout_is_closed():
            raise
        # What is left unwritten is not to be tried again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 128 + signal.SIGPIPE
    except KeyboardInterrupt:
        code = 128 + signal.SIGINT
    sys.exit(code)


def _stdout_is_closed() -> bool:
    """Tell whether stdout is a pipe, or a socket, that nobody reads any more."""
    poll = select.poll()
    poll.register(sys.stdout.fileno(), 0)
    return any(events & (select.POLLERR | select.POLLHUP) for _, events in poll.poll(0))
