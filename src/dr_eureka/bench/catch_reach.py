"""The area in which balls are caught: balls that come down all about the stated reach, and what became of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from dr_eureka.bench.catch_plots import new_figure
from dr_eureka.bench.catch_series import WIDE_X_M, WIDE_Y_M, Outcome, Series, run_series
from dr_eureka.bench.report import BenchOptions, Row, share_row
from dr_eureka.catching.catch_report import CatchResult
from dr_eureka.catching.catcher_settings import FALLING, THROWN
from dr_eureka.catching.saika import SaikaArm
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.catching.working_area import WorkingArea
from dr_eureka.simulation.throws import ThrowSettings, load_throws

BALLS = 150
AREA_M2 = (WIDE_X_M[1] - WIDE_X_M[0]) * (WIDE_Y_M[1] - WIDE_Y_M[0])
# Colours and marks of what became of a ball.
_CAUGHT, _OUT = "caught", "not caught: robot said OUT_OF_REACH"
_MISSED, _UNKNOWN = "not caught: it tried", "not caught: not seen, or not predicted"
_MARKS = {_CAUGHT: ("o", "tab:blue"), _OUT: (".", "grey"), _MISSED: ("x", "tab:red"), _UNKNOWN: ("+", "tab:orange")}


def rows(options: BenchOptions) -> list[Row]:
    """Let balls come down evenly over a wide area; `trials` is how many of each kind, else 150. Draws catch_reach.png."""
    count = options.trials or BALLS
    outcomes = {
        ball: run_series(Series(ball, wide=True, to_the_end=True), options, count, f"catch, {ball}, about the reach")
        for ball in (FALLING, THROWN)
    }
    if options.out is not None:
        _draw(options.out / "catch_reach.png", outcomes)
    return [row for ball, found in outcomes.items() for row in rows_of(ball, found, load_throws()[ball])]


def rows_of(ball: str, outcomes: Sequence[Outcome], throws: ThrowSettings) -> list[Row]:
    """Return the area in which one kind of ball was caught, and what the robot said of the others."""
    name = f"{ball}, all about the reach, {AREA_M2:.3f} m^2"
    share = share_row(name, sum(outcome.caught for outcome in outcomes), len(outcomes))
    interval = tuple(AREA_M2 * end for end in share.interval95)
    inside = [outcome for outcome in outcomes if _within(outcome.place, throws)]
    lost = [outcome for outcome in outcomes if not outcome.caught]
    warned = sum(outcome.said == CatchResult.OUT_OF_REACH for outcome in lost)
    return [
        Row(f"{name}: area in which balls are caught", AREA_M2 * share.value, "m^2", share.n, interval),
        share_row(f"{name}: caught of those that come down in the stated reach", sum(o.caught for o in inside), len(inside)),
        share_row(f"{name}: robot says OUT_OF_REACH of those that it does not catch", warned, len(lost)),
    ]


def _within(place: tuple[float, float], throws: ThrowSettings) -> bool:
    return all(low <= value <= high for value, (low, high) in zip(place, (throws.x_m, throws.y_m)))


def _draw(file: Path, outcomes: Mapping[str, Sequence[Outcome]]) -> None:
    """Draw what became of balls by where they were to come down, seen from above; outcomes by kind of ball."""
    saika, throws = SaikaSettings.load(), load_throws()
    area = WorkingArea(saika.working_area, SaikaArm(saika))
    figure, axes = new_figure((14, 5.0), len(outcomes))
    for each, (ball, found) in zip(np.ravel(axes), outcomes.items()):
        for name, (mark, colour) in _MARKS.items():
            places = np.array([outcome.place for outcome in found if _end(outcome) == name]).reshape(-1, 2)
            each.plot(*(1000.0 * places.T), mark, color=colour, ms=5, label=f"{name}, {len(places)}")
        _draw_areas(each, area, throws[ball])
        each.set(
            xlabel="x, to the right [mm]", ylabel="y, forward [mm]", aspect="equal",
            title=f"{ball} balls, coming down at z = {1000.0 * throws[ball].height_m:.0f} mm, n = {len(found)}",
        )
        each.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2)
    figure.savefig(file)


def _end(outcome: Outcome) -> str:
    if outcome.caught:
        return _CAUGHT
    if outcome.said == CatchResult.OUT_OF_REACH:
        return _OUT
    return _MISSED if outcome.said == CatchResult.MISSED else _UNKNOWN


def _draw_areas(axes: Axes, area: WorkingArea, throws: ThrowSettings) -> None:
    """Draw the stated reach, and the part of the arm's working area at the height of the catch."""
    (left, right), (near, far) = (1000.0 * np.array(limits) for limits in (throws.x_m, throws.y_m))
    stated = f"stated reach, {right - left:.0f} by {far - near:.0f} mm"
    axes.add_patch(Rectangle((left, near), right - left, far - near, fill=False, color="black", lw=1.5, label=stated))
    x, y = np.meshgrid(np.linspace(*WIDE_X_M, 400), np.linspace(*WIDE_Y_M, 250))
    inside = area.contains(np.stack([x, y, np.full_like(x, throws.height_m)], axis=-1))
    axes.contour(1000.0 * x, 1000.0 * y, inside, levels=[0.5], colors="tab:green", linewidths=1.0)
    axes.plot([], [], color="tab:green", lw=1.0, label="the arm's working area at this height")
