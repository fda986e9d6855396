"""A look at the two tubes in the hands after a pour: did the balls go where they should?"""

from __future__ import annotations

from collections import deque
from typing import Callable, Mapping, Optional

import numpy as np

from dr_eureka.behaviour.flow_settings import FlowSettings
from dr_eureka.behaviour.observation import Frame, Observation
from dr_eureka.game.state import TUBE_CAPACITY, State
from dr_eureka.vision.contents import ContentsReading
from dr_eureka.vision.contents_levels import UNKNOWN

#: Reads the balls in an image, given base_from_tube (4, 4) of each held tube by name.
ReadHeld = Callable[[Frame, Mapping[str, np.ndarray]], ContentsReading]


class HeldLook:
    """Looks at what can be seen of the tubes in the hands, in images taken from `now` on.

    Fingers hide the lower balls, the upper ones are seen: what is hidden is taken for right, and so is everything when the
    images of the whole limit do not agree, since all tubes are looked at again when they are put down. `problem` tells in
    one line what was seen otherwise than expected, or that nothing was; it is empty when all is right.
    """

    def __init__(self, read: ReadHeld, expected: State, settings: FlowSettings, now: Observation):
        self._read = read
        self._expected = expected
        self._settings = settings
        self._began = now
        self._newest: deque[bool] = deque(maxlen=settings.held_images)
        self.problem = f"no image of the tubes in the hands within {settings.held_limit:g} s"

    def step(self, now: Observation) -> Optional[bool]:
        """Return whether the tubes hold what they should as far as is seen, None while it is not decided."""
        frame, held = now.frame, now.engine.held
        if frame is not None and frame.stamp_s >= self._began.robot_s:
            tubes = self._read(frame, held).tubes
            pairs = {name: (tubes[name].colours, self._expected.tube(name)) for name in held}
            odd = {name: pair for name, pair in pairs.items() if not _fits(*pair)}
            self._newest.append(not odd)
            self.problem = ", ".join(
                f"{name} tube in a hand seen to hold {seen or 'nothing'}, expected {expected or 'nothing'}"
                for name, (seen, expected) in odd.items()
            )
            if len(self._newest) == self._settings.held_images and len(set(self._newest)) == 1:
                return self._newest[0]
        limit_s = self._settings.held_limit
        late = min(now.robot_s - self._began.robot_s, now.wall_s - self._began.wall_s) > limit_s
        return True if late else None


def _fits(seen: str, expected: str) -> bool:
    """Tell whether the balls seen in a tube, bottom to top, may be those that are expected."""
    levels = zip(seen.ljust(TUBE_CAPACITY), expected.ljust(TUBE_CAPACITY))
    return all(level in (UNKNOWN, ball) for level, ball in levels)
