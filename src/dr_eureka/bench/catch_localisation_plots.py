"""Plots of how the ball is localised: the paper's Figures 3, 4 and 5, measured in rendered pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from dr_eureka.bench.catch_places import Measured
from dr_eureka.catching.localisation import depth_resolution
from dr_eureka.catching.settings import SaikaSettings

_DPI = 110


def draw_plots(folder: Path, settings: SaikaSettings, parallax: Sequence[Measured], size: Sequence[Measured]) -> None:
    """Write catch_localisation.png into a folder that exists."""
    figure = Figure(figsize=(13, 8), dpi=_DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 2)
    cameras = settings.cameras
    _draw_relation(
        axes[0, 0], cameras.focal_px * cameras.baseline_m, [(place.depth_m, place.parallax_px) for place in parallax],
        "parallax [px]", "Figure 3: depth and parallax", f"b f / l, b = {1000 * cameras.baseline_m:.0f} mm",
    )
    _draw_relation(
        axes[0, 1], cameras.focal_px * settings.ball_diameter_m, [(place.depth_m, place.size_px) for place in size],
        "the ball's diameter [px]", "Figure 4: depth and size on the image",
        f"d f / l, d = {1000 * settings.ball_diameter_m:.0f} mm",
    )
    depths = np.linspace(0.3, 2.0, 200)
    axes[1, 0].plot(1000 * depths, 1000 * depth_resolution(depths, settings), label="one pixel of diameter (Equation 2)")
    by_one_px = depths**2 / (cameras.focal_px * cameras.baseline_m)
    axes[1, 0].plot(1000 * depths, 1000 * by_one_px, "--", label="one pixel of parallax")
    axes[1, 0].set(xlabel="depth [mm]", ylabel="resolution in depth [mm]", title="Figure 5: resolution in depth")
    _draw_errors(axes[1, 1], parallax, size)
    for one in axes.flat:
        one.grid(alpha=0.3)
        one.legend(fontsize=8)
    figure.savefig(folder / "catch_localisation.png")


def _draw_relation(
    axes: Axes, constant_px_m: float, measured: Sequence[tuple[float, float | None]], unit: str, title: str, formula: str
) -> None:
    seen = np.array([(depth, value) for depth, value in measured if value is not None]).reshape(-1, 2)
    depths = np.linspace(0.28, max(float(seen[:, 0].max(initial=0.8)), 0.8), 200)
    axes.plot(1000 * depths, constant_px_m / depths, "k-", lw=1, label=formula)
    axes.plot(1000 * seen[:, 0], seen[:, 1], ".", color="tab:red", label=f"found in pictures, n = {len(seen)}")
    axes.set(xlabel="depth [mm]", ylabel=unit, title=title)


def _draw_errors(axes: Axes, parallax: Sequence[Measured], size: Sequence[Measured]) -> None:
    series = (
        ("size, whole pixels", size, "whole_pixels_size_m", "x", "tab:orange"),
        ("parallax, whole pixels", parallax, "whole_pixels_parallax_m", "+", "tab:cyan"),
        ("size, between pixels", size, "depth_by_size_m", "o", "tab:red"),
        ("parallax, between pixels", parallax, "depth_by_parallax_m", "o", "tab:blue"),
    )
    for name, places, key, mark, colour in series:
        pairs = [(place.depth_m, getattr(place, key)) for place in places if getattr(place, key) is not None]
        if pairs:
            depths, found = np.array(pairs).T
            errors = 1000 * np.abs(found - depths)
            label = f"{name}: mean {errors.mean():.1f} mm"
            axes.semilogy(1000 * depths, np.maximum(errors, 1e-2), mark, ms=4, color=colour, label=label)
    # Below the points there is room for the legend.
    axes.set_ylim(bottom=1e-3)
    axes.set(
        xlabel="depth [mm]", ylabel="error in depth [mm], 0.01 and less at 0.01",
        title="Errors (the paper's means: parallax 10, size 13 mm)",
    )
