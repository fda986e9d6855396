"""How cards may be drawn: like the publisher's, wider than that for training, and outside of training's for measuring.

Lengths are fractions of the card's side unless said otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

Bands = tuple[tuple[float, float], ...]  # a quantity is drawn evenly from one of these intervals


@dataclass(frozen=True)
class CardStyle:
    """How one card is drawn."""

    border: float  # width of the white border
    corner_radius: float  # of the outer corners
    ball_diameter: float
    tube_spacing: float  # between neighbouring tube axes
    group_offset: float  # of the centre tube from the card's middle, to the right
    foot_line: float  # y of the feet's centres, from the top
    tube_height: float  # in ball diameters
    tube_width: float  # in ball diameters
    foot_width: float  # in ball diameters
    ball_pitch: float  # between centres of touching balls, in ball diameters
    outline: float  # stroke of the tubes
    outline_level: float  # grey of that stroke, 0..255
    ground_level: float  # grey of the chalkboard, 0..255
    bench: bool
    streaks: int
    gloss: float  # 0 flat .. 1 the publisher's highlight
    shine_angle: float  # [rad] where the highlight sits on a ball, from x right towards y down
    colour_shift: tuple[int, int, int]  # added to every ball colour, RGB levels


@dataclass(frozen=True)
class _StyleRanges:
    """What styles are drawn from; names as in CardStyle."""

    border: Bands
    corner_radius: Bands
    ball_diameter: Bands
    tube_height: Bands
    tube_width: Bands
    foot_width: Bands
    ball_pitch: Bands
    outline: Bands
    outline_level: Bands
    ground_level: Bands
    streaks: Bands
    gloss: Bands
    shine_spread: float  # [rad] of the highlight about the upper left
    colour_shift: Bands  # size of the shift of each channel, either way
    closest_feet: float  # narrowest spacing, in foot widths


_RANGES = {
    "real": _StyleRanges(
        border=((0.055, 0.075),), corner_radius=((0.04, 0.055),), ball_diameter=((0.118, 0.14),),
        tube_height=((4.6, 4.8),), tube_width=((1.17, 1.23),), foot_width=((1.6, 1.75),), ball_pitch=((0.96, 1.0),),
        outline=((0.008, 0.011),), outline_level=((235, 245),), ground_level=((20, 25),), streaks=((8, 21),),
        gloss=((0.8, 1.0),), shine_spread=0.1, colour_shift=((0, 6),), closest_feet=1.02,
    ),
    "training": _StyleRanges(
        border=((0.04, 0.095),), corner_radius=((0.02, 0.07),), ball_diameter=((0.105, 0.15),),
        tube_height=((4.5, 4.9),), tube_width=((1.12, 1.3),), foot_width=((1.5, 1.85),), ball_pitch=((0.92, 1.03),),
        outline=((0.006, 0.014),), outline_level=((180, 255),), ground_level=((8, 50),), streaks=((0, 40),),
        gloss=((0.3, 1.0),), shine_spread=np.pi, colour_shift=((0, 22),), closest_feet=0.96,
    ),
    "far": _StyleRanges(
        border=((0.032, 0.04), (0.095, 0.105)), corner_radius=((0.01, 0.02), (0.07, 0.09)),
        ball_diameter=((0.098, 0.105), (0.15, 0.155)), tube_height=((4.3, 4.5), (4.9, 5.1)),
        tube_width=((1.08, 1.12), (1.3, 1.36)), foot_width=((1.42, 1.5), (1.85, 1.95)), ball_pitch=((1.03, 1.05),),
        outline=((0.004, 0.006), (0.014, 0.017)), outline_level=((150, 180),), ground_level=((50, 62),),
        streaks=((40, 60),), gloss=((0.0, 0.3),), shine_spread=np.pi, colour_shift=((22, 28),), closest_feet=0.96,
    ),
}
_FIGURES = ("border", "corner_radius", "ball_diameter", "tube_height", "tube_width", "foot_width", "ball_pitch", "outline",
            "outline_level", "ground_level", "streaks", "gloss", "colour_shift")


def sample_style(rng: np.random.Generator, look: str = "real") -> CardStyle:
    """Return a random style of a look.

    Looks: `real`; `training`, wider; outside of training's in two figures, `held_out`, or in all, `far`. What the
    geometry ties together, spacing and place of the tubes, follows from the other figures. Raises KeyError for any other
    look.
    """
    ranges = _RANGES["far" if look == "held_out" else look]
    if look == "held_out":
        chosen = rng.choice(_FIGURES, 2, replace=False)
        ranges = replace(_RANGES["training"], **{name: getattr(ranges, name) for name in chosen})
    border, diameter = draw(rng, ranges.border), draw(rng, ranges.ball_diameter)
    foot_width, tube_height = draw(rng, ranges.foot_width), draw(rng, ranges.tube_height)
    room = 0.5 - border - foot_width * diameter / 2 - 0.015
    spacing = rng.uniform(min(foot_width * diameter * ranges.closest_feet, room), room)
    slack = min(room - spacing, 0.12 * spacing)
    highest = border + 0.04 + tube_height * diameter
    lowest = 1.0 - border - 0.14 * foot_width * diameter - 0.025
    shift = [rng.choice((-1, 1)) * draw(rng, ranges.colour_shift) for _ in range(3)]
    return CardStyle(
        border=border,
        corner_radius=draw(rng, ranges.corner_radius),
        ball_diameter=diameter,
        tube_spacing=spacing,
        group_offset=rng.uniform(-slack, slack),
        foot_line=max(lowest - rng.uniform(0.0, 0.09), min(highest, lowest)),
        tube_height=tube_height,
        tube_width=draw(rng, ranges.tube_width),
        foot_width=foot_width,
        ball_pitch=draw(rng, ranges.ball_pitch),
        outline=draw(rng, ranges.outline),
        outline_level=draw(rng, ranges.outline_level),
        ground_level=draw(rng, ranges.ground_level),
        bench=bool(rng.random() < 0.3),
        streaks=round(draw(rng, ranges.streaks)),
        gloss=draw(rng, ranges.gloss),
        shine_angle=-0.75 * np.pi + rng.uniform(-ranges.shine_spread, ranges.shine_spread),
        colour_shift=tuple(round(s) for s in shift),
    )


def draw(rng: np.random.Generator, bands: Bands) -> float:
    """Return a number drawn evenly from one of the intervals, each as likely as the others."""
    return float(rng.uniform(*bands[rng.integers(len(bands))]))
