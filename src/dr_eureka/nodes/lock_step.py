"""Waiting for the controller's answer to a joint state or a picture, so that results do not depend on the machine's load."""

from __future__ import annotations

import threading
import time
from typing import Callable, Generic, TypeVar

# A message with a header.
Stamped = TypeVar("Stamped")
_RECENT_NS = 200_000_000


class LockStep(Generic[Stamped]):
    """Collects joint commands, and holds the simulation back until the present state is answered.

    A controller answers a state by a command with that state's stamp. It is waited for only while it is connected and
    has answered lately; when it fails to answer within the limit, the simulation goes on without it until it answers
    again. Commands with other stamps are taken as they come. A state may as well be a picture, and a command what was found
    in it.
    """

    def __init__(self, limit_s: float, connected: Callable[[], bool]):
        self._limit_s = limit_s
        self._connected = connected
        self._arrived = threading.Condition()
        self._commands: list[Stamped] = []
        self._answering = False
        self._expected_ns = 0
        self._answered = False

    @property
    def answering(self) -> bool:
        """Tell whether a controller keeps step."""
        return self._answering

    def rely_on_answers(self) -> None:
        """Wait for the very first answer, too: the controller is known to be there."""
        with self._arrived:
            self._answering = True

    def expect(self, stamp_ns: int) -> None:
        """Name the state that is about to be published."""
        with self._arrived:
            self._expected_ns = stamp_ns
            self._answered = False

    def on_command(self, command: Stamped) -> None:
        """Take a command from the subscriber's thread."""
        with self._arrived:
            self._commands.append(command)
            behind_ns = self._expected_ns - command.header.stamp.to_nsec()
            # A little late is a controller on its way to catching up: from now on it is waited for.
            self._answering = self._answering or 0 <= behind_ns <= _RECENT_NS
            if behind_ns == 0:
                self._answered = True
                self._arrived.notify()

    def take(self) -> list[Stamped]:
        """Return the commands of this cycle in the order in which they came."""
        give_up_s = time.monotonic() + self._limit_s
        with self._arrived:
            while self._answering and not self._answered:
                left_s = give_up_s - time.monotonic()
                if left_s <= 0.0 or not self._connected():
                    self._answering = False
                else:
                    # A connection that breaks does not notify, so look for that now and then.
                    self._arrived.wait(min(left_s, 0.1))
            commands, self._commands = self._commands, []
            return commands
