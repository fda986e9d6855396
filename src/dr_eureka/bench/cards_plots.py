"""Plots of the benchmark `cards`: the training of both detectors (paper Figure 14), what the confidence is worth, and the
exact-state table as bars."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from dr_eureka.bench.cards_breakdown import LEAST_RIGHT, breakdown
from dr_eureka.bench.cards_map import PAPER_MAP, TITLES
from dr_eureka.bench.cards_states import Trial
from dr_eureka.bench.report import share_row
from dr_eureka.errors import DrEurekaError
from dr_eureka.vision.card_metrics import Match

_DPI = 110
_LOG_COLUMNS = ("epoch", "loss", "map50")
_COLOURS = {"eureka": "tab:blue", "tiny": "tab:orange"}


class TrainingLogError(DrEurekaError):
    """A training log that is missing or lacks a column."""


def read_training_log(file: Path) -> dict[str, np.ndarray]:
    """Return epoch, loss and map50 of each epoch from a log that train_card_detector wrote. Raises TrainingLogError."""
    try:
        with file.open(newline="") as lines:
            records = list(csv.DictReader(lines))
        columns = {name: np.array([float(record[name]) for record in records]) for name in _LOG_COLUMNS}
    except OSError as error:
        raise TrainingLogError(f"{file}: {error.strerror}; expected a training log") from error
    except (KeyError, TypeError, ValueError) as error:
        columns = ", ".join(_LOG_COLUMNS)
        raise TrainingLogError(f"{file}: expected the columns {columns} with a number on every line") from error
    if not records:
        raise TrainingLogError(f"{file}: expected a line for each epoch, found none")
    return columns


def plot_training(logs: Mapping[str, Mapping[str, np.ndarray]], file: Path) -> None:
    """Draw loss and validation mAP over the epochs of each network (paper Figure 14)."""
    figure, (losses, maps) = _figure((11, 4.2), 2)
    for model, log in logs.items():
        losses.plot(log["epoch"], log["loss"], "o-", ms=3, color=_COLOURS[model], label=TITLES[model])
        maps.plot(log["epoch"], log["map50"], "o-", ms=3, color=_COLOURS[model], label=TITLES[model])
    maps.axhline(PAPER_MAP, color="grey", ls=":", label=f"both in the paper, at the end: {PAPER_MAP}")
    losses.set(xlabel="epoch", ylabel="training loss", yscale="log", title="Loss")
    maps.set(xlabel="epoch", ylabel="mAP@0.5 [share]", ylim=(None, 1.005), title="Mean average precision, validation crops")
    for axes in (losses, maps):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.grid(alpha=0.3)
        axes.legend()
    _save(figure, file)


def plot_reliability(matches: Mapping[str, Sequence[Match]], file: Path) -> None:
    """Draw, for the balls that each network detects, how many are there against how sure it was."""
    figure, (shares, counts) = _figure((11, 4.2), 2)
    edges = np.linspace(0, 1, 11)
    for model, found in matches.items():
        sure, hit = np.array([m.confidence for m in found]), np.array([m.hit for m in found])
        place = np.clip(np.digitize(sure, edges) - 1, 0, len(edges) - 2)
        filled = [i for i in range(len(edges) - 1) if (place == i).any()]
        rows = [share_row("", int(hit[place == i].sum()), int((place == i).sum())) for i in filled]
        middle = [float(sure[place == i].mean()) for i in filled]
        look = {"color": _COLOURS[model], "label": TITLES[model]}
        shares.errorbar(middle, [r.value for r in rows], yerr=_whiskers(rows), fmt="o-", ms=4, capsize=2, **look)
        counts.stairs([(place == i).sum() for i in range(len(edges) - 1)], edges, **look)
    shares.plot((0, 1), (0, 1), color="grey", ls=":", label="as sure as right")
    shares.set(xlabel="confidence", ylabel="balls that are there [share]", title="Held-out crops; bars: 95 %", xlim=(0, 1),
               ylim=(0, 1.02))
    counts.set(xlabel="confidence", ylabel="detections", yscale="log", title="How sure the detections are", xlim=(0, 1))
    for axes in (shares, counts):
        axes.grid(alpha=0.3)
        axes.legend()
    _save(figure, file)


def plot_breakdown(tables: Mapping[str, Sequence[Trial]], file: Path) -> None:
    """Draw the share of trials that were not read, and of those read wrong, by each thing that varies; a colour a series."""
    figure, panels = _figure((15, 7.5), 8)
    width = 0.8 / len(tables)
    for number, (series, trials) in enumerate(tables.items()):
        for axes, (factor, bins) in zip(panels, breakdown(trials).items()):
            places = np.arange(len(bins)) + (number + 0.5) * width - 0.4
            filled = [i for i, part in enumerate(bins) if part.trials]
            rows = [share_row("", sum(not t.right for t in bins[i].trials), len(bins[i].trials)) for i in filled]
            axes.bar(places[filled], [100 * r.value for r in rows], width, yerr=100 * _whiskers(rows), ecolor="0.4",
                     error_kw={"lw": 0.8}, label=f"{series}: not read")
            wrong = [100 * np.mean([t.wrong for t in bins[i].trials]) for i in filled]
            axes.bar(places[filled], wrong, width, color="black", label="read wrong" if not number else None)
            axes.set_xticks(np.arange(len(bins)), [part.label.split(" ")[0] for part in bins], rotation=35, ha="right")
            unit = bins[0].label.partition(" ")[2]
            axes.set(title=factor, xlabel=f"{factor} [{unit}]" if unit else "", ylabel="trials [%]")
    for axes in panels:
        axes.axhline(100 * (1 - LEAST_RIGHT), color="tab:red", ls=":", label="goal: fewer")
        axes.grid(alpha=0.3, axis="y")
    panels[0].legend(fontsize="small")
    _save(figure, file)


def _figure(size: tuple[float, float], panels: int) -> tuple[Figure, list[Axes]]:
    figure = Figure(size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(1 if panels < 4 else 2, panels if panels < 4 else panels // 2).flat)


def _save(figure: Figure, file: Path) -> None:
    figure.savefig(file, dpi=_DPI)


def _whiskers(rows: Sequence) -> np.ndarray:
    """Return how far the intervals of rows reach down and up from their values, (2, n)."""
    return np.array([(r.value - r.interval95[0], r.interval95[1] - r.value) for r in rows]).T.clip(0)
