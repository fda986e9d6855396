"""Plots of the benchmark `kinematics`: the paper's Figures 12 and 18, and how fast and exactly poses are solved."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from dr_eureka.bench.kinematics_solvers import METHODS
from dr_eureka.bench.kinematics_solving import LARGEST_SHIFT, STARTS, Trials
from dr_eureka.bench.kinematics_steps import AUTHORS_CM, LARGEST_MEAN_CM, StepTable
from dr_eureka.kinematics.arms import ARM_JOINTS
from dr_eureka.kinematics.samples import Samples
from dr_eureka.kinematics.step_errors import STEP_SIZES, TESTS

_DPI = 110
_PLAIN = FuncFormatter(lambda value, _: f"{value:g}")
_COLUMNS = 7
_BINS = 60
_LEGEND_HEIGHT = 0.06  # share of the figure
_LEAST_ERROR_MM = 1e-5
_TEST_TITLES = {"joint_change": "Random joint change, as in the paper", "straight": "Straight step, orientation kept"}
_METHOD_NAMES = {"network": "network", "pseudo_inverse": "pseudo-inverse", "damped": "damped inverse"}


def draw_plots(
    folder: Path, samples: Mapping[str, Samples], steps: StepTable, solved: Mapping[tuple[str, str], Trials]
) -> None:
    """Write all plots as PNG into a folder that exists."""
    plot_samples(samples, folder / "kinematics_samples.png")
    plot_steps(steps, folder / "kinematics_steps.png")
    plot_solving(solved, folder / "kinematics_solving.png")


def plot_samples(recipes: Mapping[str, Samples], file: Path) -> None:
    """Draw how joints, hand steps and joint changes are distributed (Figure 12), for each recipe of samples."""
    figure, axes = _figure((17, 7.5), 3, _COLUMNS)
    delta_names = [f"hand's step, {axis} [m]" for axis in "xyz"] + [f"hand's turn about {axis} [rad]" for axis in "xyz"]
    rows = [
        ("joints", [f"{joint} [rad]" for joint in ARM_JOINTS]),
        ("delta", delta_names),
        ("change", [f"change of {joint} [rad]" for joint in ARM_JOINTS]),
    ]
    for line, (part, names) in zip(axes, rows):
        for column, name in enumerate(names):
            values = {recipe: getattr(samples, part)[:, column] for recipe, samples in recipes.items()}
            together = np.concatenate(list(values.values()))
            bins = np.linspace(together.min(), together.max(), _BINS + 1)
            for recipe, numbers in values.items():
                share = np.full(len(numbers), 100.0 / len(numbers))
                line[column].hist(numbers, bins, weights=share, histtype="step", label=recipe)
            line[column].set_xlabel(name)
        line[0].set_ylabel("samples [%]")
    axes[1][-1].axis("off")
    axes[1][-1].legend(*axes[0][0].get_legend_handles_labels(), title="recipe of samples", loc="center")
    _save(figure, file)


def plot_steps(steps: StepTable, file: Path) -> None:
    """Draw the mean error of single steps against their size (Figure 18), in both tests."""
    figure, panels = _figure((13, 5.2), 1, len(TESTS))
    sizes_cm = 100.0 * np.array(STEP_SIZES)
    for axes, test in zip(panels[0], TESTS):
        for method, name in _METHOD_NAMES.items():
            errors = [steps[test, size, method] for size in STEP_SIZES]
            means = [100.0 * missed.mean() for missed in errors]
            axes.plot(sizes_cm, means, "o-", label=f"{name}, mean of {len(errors[0])}")
        if test == "joint_change":
            for (method, means), mark in zip(AUTHORS_CM.items(), "x+"):
                axes.plot(sizes_cm, means, f"{mark}:", color="grey", label=f"{_METHOD_NAMES[method]}, the authors'")
            goal = f"goal for the network: {LARGEST_MEAN_CM} cm"
            axes.axhline(LARGEST_MEAN_CM, color="black", lw=0.8, ls="--", label=goal)
        axes.set(xlabel="size of the step [cm]", ylabel="mean position error after one step [cm]", title=_TEST_TITLES[test])
        axes.set(xscale="log", yscale="log", xticks=sizes_cm, xticklabels=[f"{size:g}" for size in sizes_cm])
        axes.minorticks_off()
        axes.yaxis.set_major_formatter(_PLAIN)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
    _save(figure, file)


def plot_solving(solved: Mapping[tuple[str, str], Trials], file: Path) -> None:
    """Draw what share of poses each method solves within a time, and how exactly."""
    figure, panels = _figure((13, 9), len(STARTS), 2)
    for (times, errors), start in zip(panels, STARTS):
        for method in METHODS:
            trials = solved[method, start]
            shares = 100.0 * np.arange(1, len(trials.seconds) + 1) / len(trials.seconds)
            order = np.sort(np.where(trials.solved, 1000.0 * trials.seconds, np.inf))
            times.plot(order[np.isfinite(order)], shares[np.isfinite(order)], label=method)
            errors.plot(np.sort(np.maximum(1000.0 * trials.shift, _LEAST_ERROR_MM)), shares, label=method)
        goal = "solved: within 1 mm, 1 degree, the limits"
        errors.axvline(1000.0 * LARGEST_SHIFT, color="black", lw=0.8, ls="--", label=goal)
        times.set(xlabel="processor time [ms]", title=f"Solved in time, from {start}")
        errors.set(xlabel="position error of the answer [mm]", title=f"Exactness, from {start}")
        for axes in (times, errors):
            axes.set(xscale="log", ylabel="poses [%]", ylim=(0.0, 102.0))
            axes.xaxis.set_major_formatter(_PLAIN)
            axes.grid(alpha=0.3)
    figure.get_layout_engine().set(rect=(0.0, _LEGEND_HEIGHT, 1.0, 1.0 - _LEGEND_HEIGHT))
    figure.legend(*panels[0][1].get_legend_handles_labels(), loc="lower center", ncol=4)
    _save(figure, file)


def _figure(size: tuple[float, float], rows: int, columns: int) -> tuple[Figure, np.ndarray]:
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False)


def _save(figure: Figure, file: Path) -> None:
    figure.savefig(file, dpi=_DPI)
