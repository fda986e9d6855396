"""From what is seen at each level of three tubes to the state of the game, by gravity and by counting."""

from __future__ import annotations

from collections import Counter
from typing import Mapping, Sequence

from dr_eureka.game.state import COLOURS, TUBES, State, all_states
from dr_eureka.vision.contents_levels import EMPTY, UNKNOWN

BALLS_A_COLOUR = 2


def settle(labels: str) -> str:
    """Return a tube's labels, bottom to top, with what gravity adds.

    Above an empty place is nothing. Below a ball is another: what looks empty there is covered by something colourless.
    """
    height = len(labels.rstrip(EMPTY + UNKNOWN))
    ground = labels.find(EMPTY, height)
    known = labels if ground < 0 else labels[:ground].ljust(len(labels), EMPTY)
    return known[:height].replace(EMPTY, UNKNOWN) + known[height:]


def consistent_states(labels: Mapping[str, str]) -> list[State]:
    """Return the states that three tubes may be in, given their settled labels.

    The topmost ball of each tube must have been seen: that one is missing elsewhere does not put it where nobody can look.
    Of a ball below another, which must be there, the colour may be the only one left.
    """
    return [state for state in all_states() if all(_fits(state.tube(name), labels[name]) for name in TUBES)]


def _fits(balls: str, labels: str) -> bool:
    if balls and labels[len(balls) - 1] == UNKNOWN:
        return False
    return all(label in (ball, UNKNOWN) for ball, label in zip(balls.ljust(len(labels), EMPTY), labels))


def surplus(labels: Sequence[str]) -> str:
    """Say which colours are seen more often than there are balls; empty if none is."""
    counts = Counter("".join(labels))
    return ", ".join(f"{counts[c]} {c} balls, expected {BALLS_A_COLOUR}" for c in COLOURS if counts[c] > BALLS_A_COLOUR)


def missing(labels: Sequence[str]) -> str:
    """Return the letters of the balls that are not seen in any tube."""
    counts = Counter("".join(labels))
    return "".join(colour * (BALLS_A_COLOUR - counts[colour]) for colour in COLOURS)
