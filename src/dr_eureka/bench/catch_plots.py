"""Plots of predictions (paper Figures 11 and 12)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from dr_eureka.bench.catch_flights import Flight, Step
from dr_eureka.catching.ball_track import BALLISTIC, PAPER_THROWN, BallTrack, View
from dr_eureka.catching.catcher_settings import THROWN, CatcherSettings
from dr_eureka.catching.prediction import LEAST_POINTS, PredictionRefused
from dr_eureka.catching.settings import SaikaSettings

_DPI = 110
_COLOURS = {PAPER_THROWN: "tab:orange", BALLISTIC: "tab:blue"}
_NAMES = {PAPER_THROWN: "paper's fit", BALLISTIC: "ours"}


def plot_paths(file: Path, flight: Flight, saika: SaikaSettings, settings: CatcherSettings) -> None:
    """Draw one flight as Figures 11 and 12 do: observed points, fits after five points and after all, and the truth."""
    figure, axes = new_figure((13, 8.5), 2, rows=2)
    plane = settings.stances[THROWN].plane
    times = np.linspace(0.0, flight.time_s, 120)
    truth = flight.at(times)
    for column, points in enumerate((LEAST_POINTS, len(flight.views))):
        for method, colour in _COLOURS.items():
            track = BallTrack(replace(settings.method, name=method), saika)
            for view in flight.views:
                if len(track.observed) < points:
                    _add(track, view)
            observed = np.array([point.position for point in track.observed])
            try:
                fitted, end = track.positions(times), track.predict(plane).position
            except PredictionRefused:
                continue
            for row, axis in enumerate((0, 2)):
                each = axes[row][column]
                label = f"{_NAMES[method]} after {len(observed)} points"
                # Where both agree, the paper's shows beside ours.
                width = 3.5 if method == PAPER_THROWN else 1.5
                each.plot(fitted[:, 1], fitted[:, axis], color=colour, lw=width, label=label)
                each.plot(end[1], end[axis], "o", color=colour, mfc="none", label="  comes down there by this fit")
        for row, axis in enumerate((0, 2)):
            each = axes[row][column]
            each.plot(observed[:, 1], observed[:, axis], "k.", ms=5, label="observed")
            each.plot(truth[:, 1], truth[:, axis], "k--", lw=1, label="truth")
            each.plot(flight.place[1], flight.place[axis], "kx", ms=8, label="where it comes down")
            each.set(
                xlabel="depth y [m]   (the paper's z)",
                ylabel=("right x [m]   (the paper's x)", "height z [m]   (the paper's y)")[row],
                title=("horizontal plane: a line", "sagittal plane: a parabola")[row] + f", {len(observed)} points",
            )
            each.invert_xaxis()
            span = np.ptp(truth[:, axis])
            each.set_ylim(truth[:, axis].min() - 0.4 * span - 0.05, truth[:, axis].max() + 0.4 * span + 0.05)
            each.grid(alpha=0.3)
            each.legend(fontsize=8)
    figure.savefig(file)


def plot_errors(file: Path, tables: Mapping[str, Sequence[Sequence[Step]]]) -> None:
    """Draw median and 90th percentile of the errors of place and time against the number of points."""
    figure, (place, when) = new_figure((13, 4.8), 2)
    for colour, (name, table) in zip(("tab:orange", "tab:red", "tab:blue"), tables.items()):
        by_points: dict[int, list[Step]] = {}
        for step in (step for flight in table for step in flight):
            by_points.setdefault(step.points, []).append(step)
        # The last few numbers of points are reached by a few long flights only.
        enough = max(map(len, by_points.values()), default=0) / 4
        points = sorted(count for count, steps in by_points.items() if len(steps) >= enough)
        for axes, kind in ((place, "place_m"), (when, "time_s")):
            values = [1000.0 * np.array([getattr(step, kind) for step in by_points[count]]) for count in points]
            axes.plot(points, [np.median(each) for each in values], color=colour, label=f"{name}: median")
            axes.plot(points, [np.percentile(each, 90) for each in values], ":", color=colour, label="90th percentile")
    place.axhline(25.0, color="grey", lw=0.8, ls="--", label="gap between ball and rim")
    place.set(ylabel="error of the place at the catching height [mm]", title="Where")
    when.set(ylabel="error of the time of arrival [ms]", title="When")
    for axes in (place, when):
        axes.set(xlabel="points", yscale="log")
        axes.grid(alpha=0.3, which="both")
        axes.legend(fontsize=8)
    figure.savefig(file)


def _add(track: BallTrack, view: View) -> None:
    try:
        track.add(view)
    except PredictionRefused:
        pass


def new_figure(size: tuple[float, float], columns: int, rows: int = 1) -> tuple[Figure, Sequence[Axes]]:
    """Return a figure of so many inches and its axes."""
    figure = Figure(figsize=size, dpi=_DPI, layout="tight")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns)
