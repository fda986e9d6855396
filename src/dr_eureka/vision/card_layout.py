"""From balls seen on a card to a state of the game (paper section 3.1, end).

As in the paper, K-means on the balls' x gives the tubes, in two cases: no tube empty, or one. Where the paper compares
pixels, everything here is measured in ball diameters or in the card's own tube spacing, so it holds at every spacing. The
feet of the tubes tell which way is up and where an empty tube stands. Whatever does not fit together is refused: a card
is shown again at no cost, a wrong goal costs the round. Lengths are fractions of the crop, x right, y down.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import Sequence

import numpy as np

from dr_eureka.errors import DrEurekaError
from dr_eureka.game.state import State, StateError
from dr_eureka.vision.card_detections import CropDetections, SeenBall, SeenFoot

_BALLS = 6
_SAME_TUBE = 0.7  # [ball diameters] cluster centres nearer than this are one tube; tubes are 1.1 wide or more
_COLUMN_SPREAD = 0.45  # [ball diameters] of a tube's balls about its axis
_FLOOR_SPREAD = 0.45  # [ball diameters] between the lowest balls of two tubes
_PITCH = (0.7, 1.35)  # [ball diameters] between neighbouring balls of a tube
_FOOT_BELOW = 0.56  # [ball diameters] from the lowest ball's centre down to the foot's centre
_FOOT_TOLERANCE = 0.45  # [ball diameters] in height
_FOOT_ASIDE = 0.3  # [tube spacings] of a foot from its tube's axis
_NARROWEST_SPACING = 1.1  # [ball diameters]
_UNEQUAL_SPACING = 1.5  # most that the wider of two gaps between tubes may exceed the narrower


class LayoutError(DrEurekaError):
    """Detections that are no readable card; the message says what does not fit."""


@dataclass(frozen=True)
class CardLayout:
    """A card understood: its state, and the clockwise quarter turns (0..3) that bring the crop upright."""

    state: State
    turn: int


def read_layout(seen: CropDetections) -> CardLayout:
    """Return the state that six balls and the feet show, whichever of the four sides is down.

    Raises LayoutError when they are no state of the game, fit no way up, or fit more than one.
    """
    if len(seen.balls) != _BALLS:
        raise LayoutError(f"{len(seen.balls)} balls seen, expected {_BALLS}")
    fits: list[CardLayout] = []
    reasons = []
    for turn in range(4):
        balls = [turned(ball, turn) for ball in seen.balls]
        feet = [turned(foot, turn) for foot in seen.feet]
        try:
            tubes = upright_tubes(balls, feet)
        except LayoutError as error:
            reasons.append(str(error))
            continue
        try:
            fits.append(CardLayout(State.parse("|".join(tubes)), turn))
        except StateError as error:
            raise LayoutError(str(error)) from error
    if not fits:
        raise LayoutError(f"no way up makes sense of the balls; as seen: {reasons[0]}")
    if len(fits) > 1:
        raise LayoutError("which way is up cannot be told: the balls fit " + " and ".join(str(fit.state) for fit in fits))
    return fits[0]


def turned(thing: SeenBall | SeenFoot, turn: int) -> SeenBall | SeenFoot:
    """Return a ball or foot as it stands after the crop is turned clockwise by quarter turns."""
    x, y = thing.x, thing.y
    for _ in range(turn % 4):
        x, y = 1.0 - y, x
    return replace(thing, x=x, y=y)


def upright_tubes(balls: Sequence[SeenBall], feet: Sequence[SeenFoot]) -> tuple[str, str, str]:
    """Return the colours of each tube, left to right and bottom to top, taking the crop to be upright.

    Raises LayoutError when the balls do not stand in columns on one floor or the feet are not where tubes end.
    """
    diameter = float(np.median([ball.diameter for ball in balls]))
    groups = columns([ball.x for ball in balls], diameter)
    stacks = [sorted((balls[i] for i in members), key=lambda ball: -ball.y) for members in groups]
    axes = [float(np.mean([ball.x for ball in stack])) for stack in stacks]
    _check_stacks(stacks, axes, diameter)
    floor = float(np.mean([stack[0].y for stack in stacks]))
    for foot in feet:
        if abs(foot.y - floor - _FOOT_BELOW * diameter) > _FOOT_TOLERANCE * diameter:
            raise LayoutError("a foot is not under the balls")
    if len(stacks) == 3:
        _check_spacing(axes, feet, diameter)
        return tuple("".join(ball.colour for ball in stack) for stack in stacks)
    empty = _empty_tube(axes, feet, diameter)
    contents = ["".join(ball.colour for ball in stack) for stack in stacks]
    contents.insert(empty, "")
    return tuple(contents)


def columns(positions: Sequence[float], ball_diameter: float) -> list[list[int]]:
    """Gather indices of balls into tubes, left to right, by K-means (k = 3) on x.

    In one dimension clusters are intervals, so the best of all splits is found outright, with no start to choose.
    Clusters nearer than a share of a ball are then one tube's (paper: a very low threshold).
    """
    order = sorted(range(len(positions)), key=lambda i: positions[i])
    splits = ((order[:i], order[i:j], order[j:]) for i, j in combinations(range(1, len(order)), 2))
    clusters = min(splits, key=lambda parts: sum(_scatter([positions[i] for i in part]) for part in parts))
    merged = [clusters[0]]
    for cluster in clusters[1:]:
        apart = np.mean([positions[i] for i in cluster]) - np.mean([positions[i] for i in merged[-1]])
        if apart < _SAME_TUBE * ball_diameter:
            merged[-1] = merged[-1] + cluster
        else:
            merged.append(cluster)
    return merged


def _scatter(values: Sequence[float]) -> float:
    """Return the sum of squared distances from the mean."""
    mean = sum(values) / len(values)
    return sum((value - mean) ** 2 for value in values)


def _check_stacks(stacks: list[list[SeenBall]], axes: list[float], diameter: float) -> None:
    """Raise LayoutError unless every stack is straight, without gaps, and on the common floor."""
    if len(stacks) < 2:
        raise LayoutError("all balls are in one column")
    floors = [stack[0].y for stack in stacks]
    if max(floors) - min(floors) > _FLOOR_SPREAD * diameter:
        raise LayoutError("the lowest balls do not stand on one floor")
    for stack, axis in zip(stacks, axes):
        if max(abs(ball.x - axis) for ball in stack) > _COLUMN_SPREAD * diameter:
            raise LayoutError("a column of balls is not straight")
        for below, above in zip(stack, stack[1:]):
            if not _PITCH[0] * diameter <= below.y - above.y <= _PITCH[1] * diameter:
                raise LayoutError("a column of balls has a gap")


def _check_spacing(axes: list[float], feet: Sequence[SeenFoot], diameter: float) -> None:
    """Raise LayoutError unless three tubes are evenly spaced and every foot belongs to one of them."""
    gaps = np.diff(axes)
    if gaps.min() < _NARROWEST_SPACING * diameter or gaps.max() > _UNEQUAL_SPACING * gaps.min():
        raise LayoutError("the three columns of balls are not evenly spaced")
    if not _feet_fit(axes, feet):
        raise LayoutError("a foot stands beside the columns of balls")


def _feet_fit(axes: Sequence[float], feet: Sequence[SeenFoot]) -> bool:
    """Tell whether each foot stands under its own tube."""
    spacing = (axes[-1] - axes[0]) / 2
    taken = [int(np.argmin([abs(foot.x - axis) for axis in axes])) for foot in feet]
    aside = [abs(foot.x - axes[tube]) for foot, tube in zip(feet, taken)]
    return len(set(taken)) == len(taken) and all(a <= _FOOT_ASIDE * spacing for a in aside)


def _empty_tube(axes: Sequence[float], feet: Sequence[SeenFoot], diameter: float) -> int:
    """Return which tube, 0 to 2, is empty when the balls stand in the two others.

    Each of the three cases says where all tubes stand; the foot of the empty one decides. Without it nothing does: a card
    of which a tube is cut off or covered would be read as another. Raises LayoutError when no case fits, or several.
    """
    first, second = axes
    apart = second - first
    cases = {
        0: (first - apart, first, second),
        1: (first, (first + second) / 2, second),
        2: (first, second, second + apart),
    }
    spacing = {0: apart, 1: apart / 2, 2: apart}
    seen = [
        empty for empty, tubes in cases.items()
        if spacing[empty] >= _NARROWEST_SPACING * diameter
        and 0.0 < tubes[0] - diameter / 2 and tubes[2] + diameter / 2 < 1.0
        and _feet_fit(tubes, feet)
        and any(abs(foot.x - tubes[empty]) <= _FOOT_ASIDE * spacing[empty] for foot in feet)
    ]
    if len(seen) != 1:
        raise LayoutError("which tube is empty cannot be told")
    return seen[0]
