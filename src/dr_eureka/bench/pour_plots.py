"""Pictures of pours: how often they go right while more and more is off, and strips of frames of a pour."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from dr_eureka.bench.pour_rig import PourKind, PourRig
from dr_eureka.bench.pour_rounds import CONTROL, Trial
from dr_eureka.bench.pour_spread import NONE
from dr_eureka.bench.report import share_row
from dr_eureka.control.grasp import UP
from dr_eureka.control.pour_geometry import PourPlace
from dr_eureka.control.settings import ControlSettings
from dr_eureka.kinematics.transforms import transform
from dr_eureka.pieces import load_pieces
from dr_eureka.resources import load_yaml
from dr_eureka.simulation.settings import load_camera_settings, load_world_settings
from dr_eureka.simulation.stage import Stage

METHODS = ("lock", "profiled", "linear")
TILT_EDGES_DEG = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0)
# Since the pour began [s].
STRIPS = {
    "pour_lock": (PourKind("lock", "left", 4, 1, 1), (0.0, 0.4, 0.8, 1.3, 1.7, 2.0, 2.2)),
    "pour_profiled": (PourKind("profiled", "left", 4, 2, 0), (0.0, 0.1, 0.18, 0.26, 0.34, 0.42, 0.6)),
}
# [m] how far from the mouths the camera stands that looks from beside.
_AWAY_M = 0.35


def draw_plots(folder: Path, stated: Sequence[Trial], wide: Sequence[Trial]) -> None:
    """Write pour_spread.png: the share of right pours by how far the tube leans in the hand to how it is believed to."""
    figure, axes = plt.subplots(figsize=(7.5, 4.5))
    middles = [(low + high) / 2.0 for low, high in zip(TILT_EDGES_DEG, TILT_EDGES_DEG[1:])]
    for offset, method in zip((-0.04, 0.0, 0.04), METHODS):
        rows = []
        for low, high in zip(TILT_EDGES_DEG, TILT_EDGES_DEG[1:]):
            tried = [
                trial for trial in (*stated, *wide)
                if trial.kind.method == method and low <= np.degrees(trial.tilt) < high and trial.arrived is not None
                and (method == "lock" or trial.kind.held > trial.kind.count)
            ]
            rows.append(share_row("", sum(trial.right for trial in tried), len(tried)))
        told = [(middle + offset, row) for middle, row in zip(middles, rows) if row.n]
        if told:
            values = np.array([row.value for _, row in told])
            reach = np.abs(np.array([row.interval95 for _, row in told]).T - values)
            axes.errorbar([x for x, _ in told], values, yerr=reach, marker="o", capsize=3, label=method)
    axes.set_xticks(TILT_EDGES_DEG)
    axes.set_xlabel("how far the tube leans in the hand to how the robot believes [deg]")
    axes.set_ylabel("share of pours that moved just the balls meant")
    axes.set_ylim(0.0, 1.02)
    axes.grid(alpha=0.3)
    axes.legend(title="with 95 % interval", loc="lower left")
    axes.set_title("Pours at the stated spread (up to 1 deg about each axis) and the wide one (2 deg)", fontsize=10)
    figure.tight_layout()
    figure.savefig(folder / "pour_spread.png", dpi=130)
    plt.close(figure)


def draw_strips(folder: Path, seed: int) -> None:
    """Write a strip of frames of a lock-pour and of a profiled pour of two: above from the head, below from beside."""
    stage = Stage(load_camera_settings().renderer)
    camera = replace(load_camera_settings(), noise=0.0)
    control = ControlSettings.from_mapping(load_yaml(CONTROL), CONTROL)
    try:
        rig = PourRig(control, load_world_settings(), load_pieces(), NONE, seed, stage, camera)
        for name, (kind, times_s) in STRIPS.items():
            _draw_strip(folder / f"{name}.png", rig, kind, times_s, _beside(control.pour_place))
    finally:
        stage.close()


def _draw_strip(file: Path, rig: PourRig, kind: PourKind, times_s: Sequence[float], beside: np.ndarray) -> None:
    due, frames = list(times_s), []

    def watch(elapsed_s: float) -> None:
        if due and elapsed_s >= due[0] - 1e-6:
            frames.append((due.pop(0), rig.world.camera_image(), rig.world.picture_from(beside)))

    poured = rig.pour(kind, each_cycle=watch)
    figure, axes = plt.subplots(2, len(frames), figsize=(2.2 * len(frames), 4.6), squeeze=False)
    for column, (time_s, *pictures) in enumerate(frames):
        for row, picture in enumerate(pictures):
            height, width = picture.shape[:2]
            side = int(0.7 * height)
            top, left = (height - side) // 2, (width - side) // 2
            axes[row, column].imshow(picture[top : top + side, left : left + side])
            axes[row, column].axis("off")
        axes[0, column].set_title(f"{time_s:.2f} s", fontsize=9)
    what = f"{kind.method}: {kind.count} of {kind.held} balls into {kind.in_target}"
    figure.suptitle(f"{what}: {poured.arrived} arrived, {poured.lost} lost; from the head, and from beside", fontsize=10)
    figure.tight_layout()
    figure.savefig(file, dpi=130)
    plt.close(figure)


def _beside(place: PourPlace) -> np.ndarray:
    """Return base_from_camera (4, 4) of a level camera before the robot that looks square on the plane in which it pours."""
    right = np.array([-np.cos(place.plane_yaw), np.sin(place.plane_yaw), 0.0])
    forward = np.cross(UP, right)
    return transform(np.column_stack([right, -UP, forward]), np.array(place.target_mouth) - _AWAY_M * forward)
