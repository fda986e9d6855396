"""Both hands at once: two skills side by side, motion by motion, as long as neither gets in the other's way."""

from __future__ import annotations

from itertools import chain
from typing import Iterator

from dr_eureka.control.body import Body
from dr_eureka.control.motion import Follow, Motion, Wait


def at_once(body: Body, first: Iterator[Motion], second: Iterator[Motion]) -> Iterator[Motion]:
    """Run two skills of different hands, each motion of one together with that of the other.

    Where both together would collide, or one has no motion left, they go on one after the other, first the one whose way is
    free.
    """
    skills = [first, second]
    motions = [next(skill, None) for skill in skills]
    while None not in motions:
        together = _together(*motions)
        if together is None or isinstance(together, Follow) and body.hit(together):
            break
        yield together
        motions = [next(skill, None) for skill in skills]
    left = [chain([motion], skill) if motion else skill for motion, skill in zip(motions, skills)]
    blocked = [isinstance(motion, Follow) and body.hit(motion) is not None for motion in motions]
    for skill in reversed(left) if blocked == [True, False] else left:
        yield from skill


def _together(first: Motion, second: Motion) -> Motion | None:
    """Return two motions as one, or None for a motion and a wait."""
    if isinstance(first, Follow) and isinstance(second, Follow):
        return Follow(first.tracks + second.tracks, first.may_touch | second.may_touch)
    if isinstance(first, Wait) and isinstance(second, Wait):
        # Each condition has a memory, so each must be asked every time.
        return Wait(lambda *now: all([first.until(*now), second.until(*now)]), max(first.limit, second.limit))
    return None
