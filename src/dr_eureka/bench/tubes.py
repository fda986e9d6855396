"""The benchmark `tubes`: paper 3.2, Figures 9 and 10, and what its authors never had: eyes on the balls."""

from __future__ import annotations

import atexit
import os
from collections import Counter
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from dr_eureka.bench.calibration import photograph_rows
from dr_eureka.bench.hand_eye import run_rows
from dr_eureka.bench.report import BenchOptions, Row, mean_row, share_row
from dr_eureka.bench.tubes_scenes import SERIES, Eyes, Series, Trial, judge, take_shot
from dr_eureka.bench.workers import shared_out
from dr_eureka.simulation.settings import load_camera_settings
from dr_eureka.simulation.stage import Stage
from dr_eureka.vision.tubes import TubeResult

SCENES = 500
# Where the photographs of OpenCV's ArUco tests are; without it, what needs them is left out.
IMAGES_VARIABLE = "DR_EUREKA_IMAGES"
LARGEST_MEAN_MM, LARGEST_P99_MM = 1.5, 4.0
LEAST_RIGHT, MOST_WRONG = 0.99, 0.002


def run(options: BenchOptions) -> list[Row]:
    """Measure localisation, contents and both calibrations; `trials` is the number of scenes of each series, else 500."""
    rows, tables = [], {}
    for series in SERIES:
        tables[series.name] = run_trials(series, options.seed, options.trials or SCENES, options.processes)
        rows += place_rows(series.name, tables[series.name]) + contents_rows(
            series.name, tables[series.name], judged=series.judged
        )
    rows += run_rows(options)
    folder = os.environ.get(IMAGES_VARIABLE)
    if folder:
        rows += photograph_rows(Path(folder))
    if options.out is not None:
        from dr_eureka.bench.tubes_plots import draw_plots

        stage = Stage(load_camera_settings().renderer)
        try:
            draw_plots(options.out, stage, options.seed, tables)
        finally:
            stage.close()
    return rows


def run_trials(series: Series, seed: int, scenes: int, processes: int | None = None) -> list[Trial]:
    """Judge so many scenes, in order; `processes`: how many work, by default one a core."""
    return shared_out(partial(_trial, series, seed), range(scenes), processes, f"tubes, {series.name}", _prepare, at_a_time=4)


def place_rows(name: str, trials: Sequence[Trial]) -> list[Row]:
    """Return the rows on where the tubes were found."""
    located = [trial for trial in trials if trial.errors_mm is not None]
    # Tubes of one scene share its sheet's errors; scenes are independent.
    means = [float(np.mean(trial.errors_mm)) for trial in located]
    errors = np.array([error for trial in located for error in trial.errors_mm])
    sigmas = np.array([sigma for trial in located for sigma in trial.sigmas_mm])
    rows = [share_row(f"{name}: three tubes located", len(located), len(trials))]
    rows += [
        share_row(f"{name}: result {result}", count, len(trials))
        for result, count in sorted(Counter(trial.result for trial in trials if trial.result != TubeResult.OK).items())
    ]
    goal = f"<= {LARGEST_MEAN_MM} mm"
    ok = bool(means) and float(np.mean(means)) <= LARGEST_MEAN_MM
    rows.append(mean_row(f"{name}: error of a tube's axis", means, "mm", goal=goal, ok=ok))
    if len(errors):
        p99 = float(np.percentile(errors, 99))
        rows += [
            Row(
                f"{name}: error, 99th percentile", p99, "mm", len(errors),
                goal=f"<= {LARGEST_P99_MM} mm", ok=p99 <= LARGEST_P99_MM,
            ),
            Row(f"{name}: error, largest", float(errors.max()), "mm", len(errors)),
            mean_row(f"{name}: stated standard deviation", sigmas.reshape(-1, 3).mean(axis=1), "mm"),
        ]
    rows.append(_time_row(f"{name}: processor time to locate", [trial.locate_ms for trial in trials]))
    rows.append(_time_row(f"{name}: processor time of a frame", [trial.locate_ms + trial.read_ms for trial in trials]))
    return rows


def contents_rows(name: str, trials: Sequence[Trial], judged: bool = True) -> list[Row]:
    """Return the rows on what the tubes were read to hold, of all scenes, those without located tubes among them.

    Unless the series is `judged`, that enough states were read is no goal: a sheet that was not located hides them, too.
    """
    right, wrong = (sum(getattr(trial, kind) for trial in trials) for kind in ("right", "wrong"))
    count = len(trials)
    rows = [
        share_row(
            f"{name}: exact state of three tubes", right, count,
            goal=f">= {LEAST_RIGHT}" if judged else None, ok=right >= LEAST_RIGHT * count if judged else None,
        ),
        share_row(
            f"{name}: another state than the true one", wrong, count, goal=f"<= {MOST_WRONG}", ok=wrong <= MOST_WRONG * count
        ),
    ]
    refused = Counter(trial.contents for trial in trials if trial.contents and trial.read is None)
    rows += [share_row(f"{name}: contents {result}", number, count) for result, number in sorted(refused.items())]
    return rows


def _time_row(name: str, times_ms: Sequence[float]) -> Row:
    return Row(f"{name}, median", float(np.median(times_ms)), "ms", len(times_ms))


_eyes: Eyes | None = None
_stage: Stage | None = None


def _prepare() -> None:
    """Load this process's settings and open its renderer, once; each process keeps to one core."""
    global _eyes, _stage
    cv2.setNumThreads(1)
    if _eyes is None:
        _eyes, _stage = Eyes.load(), Stage(load_camera_settings().renderer)
        # Left to the interpreter's end, Bullet would write to standard output.
        atexit.register(_stage.close)


def _trial(series: Series, seed: int, index: int) -> Trial:
    return judge(_eyes, take_shot(_stage, series, seed, index), index)
