"""Where the head was at the moment an image was taken, from the joint states around it."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from typing import Mapping, Optional

import numpy as np


class HeadHistory:
    """The last seconds of a few joints' positions, to be asked at any time in between."""

    def __init__(self, joint_names: tuple[str, ...], keep_s: float = 5.0):
        self._names = joint_names
        self._keep_s = keep_s
        self._times: deque[float] = deque()
        self._positions: deque[np.ndarray] = deque()

    def add(self, time_s: float, joints: Mapping[str, float]) -> None:
        """Take the joint state of `time_s` [s]; one that lacks a joint or is not finite is left out.

        Time that jumps back (a bag played again) forgets everything before.
        """
        if any(name not in joints for name in self._names):
            return
        positions = np.array([joints[name] for name in self._names], dtype=float)
        if not np.isfinite(positions).all():
            return
        if self._times and time_s < self._times[-1]:
            self._times.clear()
            self._positions.clear()
        self._times.append(time_s)
        self._positions.append(positions)
        while self._times[0] < time_s - self._keep_s:
            self._times.popleft()
            self._positions.popleft()

    @property
    def newest_s(self) -> Optional[float]:
        """Time of the newest joint state [s], or None."""
        return self._times[-1] if self._times else None

    def newest(self) -> Optional[dict[str, float]]:
        """Return the newest positions [rad] by name, or None."""
        return dict(zip(self._names, self._positions[-1])) if self._times else None

    def at(self, time_s: float) -> Optional[np.ndarray]:
        """Return the positions [rad] at `time_s`, interpolated; None outside the history."""
        if not self._times or not self._times[0] <= time_s <= self._times[-1]:
            return None
        times = list(self._times)
        after = bisect_left(times, time_s)
        if times[after] == time_s:
            return self._positions[after].copy()
        share = (time_s - times[after - 1]) / (times[after] - times[after - 1])
        return (1.0 - share) * self._positions[after - 1] + share * self._positions[after]

    def still(self, time_s: float, window_s: float, tolerance_rad: float) -> bool:
        """Tell whether every joint stayed within `tolerance_rad` during the `window_s` that end at `time_s`.

        A history that does not reach back over the whole window cannot tell, and answers False.
        """
        if not self._times or self._times[0] > time_s - window_s or self._times[-1] < time_s:
            return False
        inside = [
            positions
            for at_s, positions in zip(self._times, self._positions)
            if time_s - window_s <= at_s <= time_s
        ]
        return bool(inside) and bool((np.ptp(np.array(inside), axis=0) <= tolerance_rad).all())
