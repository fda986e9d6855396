"""Plots of predictions and catches (paper Figures 11 and 12, and where it breaks down)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from dr_eureka.bench.catch_flights import Flight, Step
from dr_eureka.bench.report import Row
from dr_eureka.catching.ball_track import BALLISTIC, PAPER_THROWN, BallTrack, View
from dr_eureka.catching.catcher_settings import THROWN, CatcherSettings
from dr_eureka.catching.prediction import LEAST_POINTS, PredictionRefused
from dr_eureka.catching.settings import SaikaSettings

_DPI = 110
_COLOURS = {PAPER_THROWN: "tab:orange", BALLISTIC: "tab:blue"}
_NAMES = {PAPER_THROWN: "paper's fit", BALLISTIC: "ours"}


def plot_paths(file: Path, flight: Flight, saika: SaikaSettings, settings: CatcherSettings) -> None:
    """Draw one flight as Figures 11 and 12 do: observed points, fits after five points and after all, and the truth."""
    figure, axes = _figure((13, 8.5), 2, rows=2)
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
                each.plot(fitted[:, 1], fitted[:, axis], color=colour, lw=1.5, label=label)
                each.plot(end[1], end[axis], "o", color=colour, mfc="none")
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
    _save(figure, file)


def plot_errors(file: Path, tables: Mapping[str, Sequence[Sequence[Step]]]) -> None:
    """Draw median and 90th percentile of the errors of place and time against the number of points."""
    figure, (place, when) = _figure((13, 4.8), 2)
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
    _save(figure, file)


def plot_curves(file: Path, curves: Mapping[str, tuple[str, Sequence[float], Sequence[Row]]]) -> None:
    """Draw the share of balls caught against each condition, with 95 % intervals; curves: axis label, values, shares."""
    figure, axes = _figure((18, 8), 4, rows=2)
    for unused in np.ravel(axes)[len(curves):]:
        unused.set_visible(False)
    for each, (name, (label, values, rows)) in zip(np.ravel(axes), curves.items()):
        shares = np.array([row.value for row in rows])
        low, high = np.array([row.interval95 for row in rows]).T
        # At a share of 1 rounding may put the interval's end below it.
        bars = np.maximum([shares - low, high - shares], 0.0)
        each.errorbar(values, shares, bars, fmt="o-", capsize=3, color="tab:blue")
        each.set(xlabel=label, ylabel="share caught", ylim=(-0.03, 1.05), title=f"{name}, {rows[0].n} balls each")
        if name == "noise":
            each.set_xscale("log")
        each.grid(alpha=0.3)
    _save(figure, file)


def save_strip(file: Path, frames: Sequence[tuple[float, np.ndarray, np.ndarray]], title: str) -> None:
    """Draw pictures from beside above those of the robot's left camera; frames: seconds since the release, both pictures."""
    figure, axes = _figure((2.6 * len(frames), 4.6), len(frames), rows=2)
    for (elapsed_s, beside, seen), upper, lower in zip(frames, *np.atleast_2d(axes)):
        upper.imshow(beside)
        upper.set_title(f"{elapsed_s:.2f} s", fontsize=9)
        lower.imshow(seen)
        for each in (upper, lower):
            each.set(xticks=[], yticks=[])
    axes[0][0].set_ylabel("from beside")
    axes[1][0].set_ylabel("left camera")
    figure.suptitle(title, fontsize=10)
    _save(figure, file)


def _add(track: BallTrack, view: View) -> None:
    try:
        track.add(view)
    except PredictionRefused:
        pass


def _figure(size: tuple[float, float], columns: int, rows: int = 1) -> tuple[Figure, Sequence[Axes]]:
    figure = Figure(figsize=size, dpi=_DPI, layout="tight")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns)


def _save(figure: Figure, file: Path) -> None:
    figure.savefig(file)
