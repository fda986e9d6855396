"""Where and when the ball comes, predicted from ever more points: the paper's fit beside ours (paper 7, Figures 11, 12)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dr_eureka.bench.catch_flights import Step, draw_flight, follow
from dr_eureka.bench.report import BenchOptions, Row, progress
from dr_eureka.catching.ball_track import BALLISTIC, PAPER_THROWN
from dr_eureka.catching.catcher_settings import THROWN, CatcherSettings
from dr_eureka.catching.settings import SaikaSettings

FLIGHTS = 300
#: After so many points the rows tell the errors.
AFTER_POINTS = (5, 10, 15, 20, 25)
#: By name of the row: the method, and r of Equation 9.
METHODS = {
    "paper's fit, r 0.9": (PAPER_THROWN, 0.9), "paper's fit, r 1": (PAPER_THROWN, 1.0), "ours": (BALLISTIC, 0.9),
}
#: After fewer points than all, only these are told.
COMPARED = ("paper's fit, r 0.9", "ours")


def rows(options: BenchOptions) -> list[Row]:
    """Predict thrown balls from their views by the analytic cameras; `trials` is the number of flights, else 300."""
    saika, settings = SaikaSettings.load(), CatcherSettings.load()
    plane = settings.stances[THROWN].plane
    count = options.trials or FLIGHTS
    flights = [draw_flight(saika, settings, options.seed, index) for index in range(count)]
    tables = {name: [] for name in METHODS}
    for flight in progress(flights, count, "catch, predictions"):
        for name, (method, reliability) in METHODS.items():
            chosen = replace(settings.method, name=method, reliability=reliability)
            tables[name].append(follow(flight, chosen, saika, plane))
    found = [row for points in AFTER_POINTS for name in COMPARED for row in _rows_after(name, tables[name], points)]
    found += [row for name in METHODS for row in _last_rows(name, tables[name])]
    if options.out is not None:
        from dr_eureka.bench.catch_plots import plot_errors, plot_paths

        example = max(flights, key=lambda flight: len(flight.views))
        plot_paths(options.out / "catch_paths.png", example, saika, settings)
        plot_errors(options.out / "catch_predictions.png", tables)
    return found


def _rows_after(name: str, table: Sequence[Sequence[Step]], points: int) -> list[Row]:
    steps = [step for flight in table for step in flight if step.points == points]
    return _rows(f"prediction after {points} points, {name}", steps)


def _last_rows(name: str, table: Sequence[Sequence[Step]]) -> list[Row]:
    return _rows(f"last prediction, {name}", [flight[-1] for flight in table if flight])


def _rows(name: str, steps: Sequence[Step]) -> list[Row]:
    if not steps:
        return [Row(f"{name}: none", None, "mm", 0)]
    places, times = (np.array([getattr(step, kind) for step in steps]) for kind in ("place_m", "time_s"))
    return [
        Row(f"{name}: place, median error", 1000.0 * float(np.median(places)), "mm", len(steps)),
        Row(f"{name}: place, 90th percentile", 1000.0 * float(np.percentile(places, 90)), "mm", len(steps)),
        Row(f"{name}: time, median error", 1000.0 * float(np.median(times)), "ms", len(steps)),
    ]
