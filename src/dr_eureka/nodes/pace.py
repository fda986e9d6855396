"""Holding a simulation back to a wanted pace."""

from __future__ import annotations

import time
from typing import Optional

# A simulation that fell this far behind the wanted pace does not race to catch up.
_LARGEST_LAG_S = 0.2


class Pace:
    """Robot seconds per second; 0: as fast as the machine allows."""

    def __init__(self, factor: float):
        self._factor = factor
        self._began: Optional[tuple[float, float]] = None

    def keep(self, now_s: float) -> None:
        """Wait until it is time for the robot time `now_s` [s]."""
        if self._factor <= 0.0:
            return
        wall_s = time.monotonic()
        began_wall_s, began_s = self._began or (wall_s, now_s)
        ahead_s = began_wall_s + (now_s - began_s) / self._factor - wall_s
        if ahead_s > 0.0:
            time.sleep(ahead_s)
        self._began = (began_wall_s, began_s) if ahead_s > -_LARGEST_LAG_S else None
