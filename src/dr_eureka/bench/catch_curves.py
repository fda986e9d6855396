"""Where catching breaks down: noise, the cameras' lag, the ball's speed, late pictures, drag, a slow arm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dr_eureka.bench.catch_plots import new_figure
from dr_eureka.bench.catch_series import Series, run_series
from dr_eureka.bench.report import BenchOptions, Row, share_row
from dr_eureka.catching.ball_track import PAPER_FALLING
from dr_eureka.catching.catcher_settings import FALLING, THROWN

BALLS = 30
_COLOURS = {"paper": "tab:red", "falling": "tab:green", "thrown": "tab:blue"}
_MOVING_AGAIN = {"thrown, feedback": Series(THROWN)}
_THROWN = {**_MOVING_AGAIN, "thrown, no feedback": Series(THROWN, feedback=False)}
_FALLING = {"falling, feedback": Series(FALLING), "falling, no feedback": Series(FALLING, feedback=False)}


@dataclass(frozen=True)
class Curve:
    """One condition: title and axis label, which field of `Series` it is and its values, and by name what it is tried on."""

    title: str
    label: str
    condition: str
    values: tuple[float, ...]
    balls: Mapping[str, Series]


CURVES = (
    Curve(
        "sensor noise", "noise of centre and diameter, times 0.10 and 0.15 px", "noise", (1.0, 3.0, 6.0, 12.0, 25.0),
        {**_THROWN, **_FALLING},
    ),
    Curve(
        "camera lag", "right camera after the left [s]", "lag_s", (0.0, 0.0083, 0.0167, 0.025, 0.0333),
        {**_THROWN, **_FALLING, "falling, paper's parallax": Series(FALLING, PAPER_FALLING)},
    ),
    Curve("speed of the throw", "time of flight from 2 m away [s]", "flight_s", (0.35, 0.4, 0.45, 0.5, 0.6, 0.75), _THROWN),
    Curve("speed of the fall", "let go above the catch by [m]", "drop_m", (0.5, 0.85, 1.5, 2.5, 4.0), _FALLING),
    Curve("late pictures", "from exposure to answer [s]", "latency_s", (0.0, 0.05, 0.1, 0.2, 0.3, 0.4), _MOVING_AGAIN),
    Curve("drag, unknown to the robot", "drag coefficient of the ball", "drag", (0.0, 0.25, 0.47, 1.0), _MOVING_AGAIN),
    Curve("speed of the arm", "share of its 4 rad/s", "arm_speed", (0.1, 0.2, 0.3, 0.5, 1.0), _MOVING_AGAIN),
)


def rows(options: BenchOptions) -> list[Row]:
    """Let balls go at each value of each condition; `trials` is how many, else 30. Draws catch_breakdown.png."""
    found = [(curve, _lines(curve, options)) for curve in CURVES]
    if options.out is not None:
        _draw(options.out / "catch_breakdown.png", found)
    return [row for _, lines in found for line in lines.values() for row in line]


def _lines(curve: Curve, options: BenchOptions) -> dict[str, Sequence[Row]]:
    """Return the shares caught, one a value, of each kind of ball."""
    return {
        name: [_share(curve, name, replace(series, **{curve.condition: value}), value, options) for value in curve.values]
        for name, series in curve.balls.items()
    }


def _share(curve: Curve, name: str, series: Series, value: float, options: BenchOptions) -> Row:
    count = options.trials or BALLS
    outcomes = run_series(series, options, count, f"catch, {curve.title} {value:g}, {name}")
    return share_row(f"{curve.title}, {value:g}: {name}: caught", sum(outcome.caught for outcome in outcomes), count)


def _draw(file: Path, curves: Sequence[tuple[Curve, Mapping[str, Sequence[Row]]]]) -> None:
    """Draw the share of balls caught against each condition with 95 % intervals; each curve with its lines of shares."""
    figure, axes = new_figure((20, 9), 4, rows=2)
    for unused in np.ravel(axes)[len(curves):]:
        unused.set_visible(False)
    for each, (curve, lines) in zip(np.ravel(axes), curves):
        for name, rows in lines.items():
            style = "o--" if "no feedback" in name else "o-"
            colour = next(colour for word, colour in _COLOURS.items() if word in name)
            shares = np.array([row.value for row in rows])
            low, high = np.array([row.interval95 for row in rows]).T
            # At a share of 1 rounding may put the interval's end below it.
            bars = np.maximum([shares - low, high - shares], 0.0)
            each.errorbar(curve.values, shares, bars, fmt=style, ms=4, capsize=3, color=colour, label=name)
        title = f"{curve.title}, {rows[0].n} balls each"
        each.set(xlabel=curve.label, ylabel="share caught", ylim=(-0.03, 1.05), title=title)
        if curve.condition == "noise":
            each.set_xscale("log")
            each.set_xticks(curve.values, [f"{value:g}" for value in curve.values], minor=False)
            each.set_xticks([], minor=True)
        each.grid(alpha=0.3)
        each.legend(fontsize=8)
    figure.savefig(file)
