"""A strip of pictures of one catch: from beside, and as the robot's left camera sees it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dr_eureka.bench.catch_plots import new_figure
from dr_eureka.bench.catch_series import Series, conditions_of, draw_ball
from dr_eureka.bench.catch_trials import CatchRun, Trial
from dr_eureka.bench.report import BenchOptions
from dr_eureka.catching.arm_network import SaikaNetwork
from dr_eureka.catching.catcher_settings import THROWN, CatcherSettings
from dr_eureka.kinematics.transforms import transform
from dr_eureka.simulation.saika import SaikaWorld

# Since the release [s]; the last ones show the look into the basket.
_TIMES_S = (0.05, 0.2, 0.35, 0.5, 0.65, 0.9, 1.7)
# Beside the path, so far off that it is seen from the thrower's hand to the basket.
_WATCHER_M, _WATCHED_M = np.array([-2.9, 0.95, 0.25]), np.array([-0.1, 0.95, 0.05])


def draw(options: BenchOptions) -> Trial:
    """Catch the seed's first thrown ball with rendered pictures, and write catch_strip.png."""
    series = Series(THROWN, rendered=True, to_the_end=True)
    conditions = conditions_of(series)
    throw = draw_ball(series, options.seed, 0)
    run = CatchRun(conditions, CatcherSettings.load(), SaikaNetwork.load(conditions.saika), options.seed * 100_003)
    due, frames = list(_TIMES_S), []

    def watch(world: SaikaWorld, elapsed_s: float) -> None:
        if due and elapsed_s >= due[0]:
            due.pop(0)
            from_beside = world.picture_from(_looking(_WATCHER_M, _WATCHED_M))
            frames.append((elapsed_s, from_beside, world.capture("left")[1]))

    trial = run.run(throw, watch)
    said = trial.report.result if trial.report else "nothing"
    _save(options.out / "catch_strip.png", frames, f"one catch: referee {trial.verdict}, robot {said}")
    return trial


def _save(file: Path, frames: Sequence[tuple[float, np.ndarray, np.ndarray]], title: str) -> None:
    """Draw pictures from beside above those of the left camera; frames: seconds since the release, both pictures."""
    figure, axes = new_figure((2.6 * len(frames), 4.6), len(frames), rows=2)
    for (elapsed_s, beside, seen), upper, lower in zip(frames, *axes):
        upper.imshow(beside)
        upper.set_title(f"{elapsed_s:.2f} s", fontsize=9)
        lower.imshow(seen)
        for each in (upper, lower):
            each.set(xticks=[], yticks=[])
    axes[0][0].set_ylabel("from beside")
    axes[1][0].set_ylabel("left camera")
    figure.suptitle(title, fontsize=10)
    figure.savefig(file)


def _looking(place: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return base_from_camera (4, 4) of a level camera at `place` (3,) that looks at `at` (3,) [m]."""
    forward = (at - place) / np.linalg.norm(at - place)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return transform(np.column_stack([right, np.cross(forward, right), forward]), place)
