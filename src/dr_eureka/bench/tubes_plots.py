"""Plots of the benchmark `tubes`: errors, and what the eyes see (paper Figures 9 and 10; overlays of the contents)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from dr_eureka.bench.tubes_scenes import SERIES, Eyes, Shot, Trial, take_shot
from dr_eureka.game.state import TUBES
from dr_eureka.simulation.stage import Stage
from dr_eureka.vision.contents import TubeView, read_contents, upright
from dr_eureka.vision.rectified import SheetGrid, paper_brightness, rectify
from dr_eureka.vision.tubes import TubeResult, TubeScene, locate_tubes

_DPI = 110
_SAMPLES = 6
_BINS_MM = np.linspace(0.0, 1.5, 61)


def draw_plots(folder: Path, stage: Stage, seed: int, tables: Mapping[str, Sequence[Trial]]) -> None:
    """Write all plots as PNG into a folder that exists; scenes are drawn on a stage with a renderer."""
    plot_errors(tables, folder / "tubes_errors.png")
    eyes = Eyes.load()
    shots = [take_shot(stage, series, seed, index) for index, series in zip(range(_SAMPLES), SERIES * _SAMPLES)]
    scenes = [locate_tubes(shot.image, shot.camera, shot.base_from_camera, eyes.pieces, eyes.tubes) for shot in shots]
    plot_steps(eyes, shots[0], scenes[0], folder / "tubes_steps.png")
    plot_contents(eyes, shots, scenes, folder / "tubes_contents.png")


def plot_errors(tables: Mapping[str, Sequence[Trial]], file: Path) -> None:
    """Draw how large the errors are, and whether the stated standard deviations are."""
    figure, (histogram, scatter) = _figure((12, 4.5), 2)
    for name, trials in tables.items():
        errors = np.array([error for trial in trials for error in trial.errors_mm or ()])
        sigmas = np.array([sigma for trial in trials for sigma in trial.sigmas_mm])
        if len(errors) == 0:
            continue
        label = f"{name}: mean {errors.mean():.2f} mm, n = {len(errors)}"
        histogram.hist(np.minimum(errors, _BINS_MM[-1]), _BINS_MM, histtype="step", label=label)
        scatter.plot(sigmas, errors, ".", ms=3, alpha=0.5, label=name)
    histogram.set(xlabel="error of a tube's axis on the table [mm], last bin: and more", ylabel="tubes", title="Errors")
    ends = np.array([0.0, max(scatter.get_xlim()[1], 0.1)])
    scatter.plot(ends, 3 * ends, "k:", label="three standard deviations")
    scatter.set(xlabel="stated standard deviation along an axis [mm]", ylabel="error [mm]", title="Stated and true")
    for axes in (histogram, scatter):
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
    _save(figure, file)


def plot_steps(eyes: Eyes, shot: Shot, scene: TubeScene, file: Path) -> None:
    """Draw the steps of one localisation: picture, sheet from above, its brightness with the feet (Figures 9, 10)."""
    figure, axes = _figure((15, 4.2), 3)
    axes[0].imshow(shot.image)
    axes[0].set_title("picture of the head camera")
    if scene.base_from_sheet is not None:
        grid = SheetGrid(eyes.pieces, eyes.tubes.pixels_per_metre)
        straight, camera = shot.camera.undistort(shot.image), shot.camera.without_distortion()
        camera_from_sheet = np.linalg.inv(shot.base_from_camera) @ scene.base_from_sheet
        axes[1].imshow(rectify(straight, camera, camera_from_sheet, grid))
        axes[1].set_title("perspective removed")
        value = rectify(straight.max(axis=2), camera, camera_from_sheet, grid)
        brightness = paper_brightness(
            value, grid, scene.markers_seen, eyes.tubes.marker_margin_m, eyes.tubes.smallest_contrast
        )
        axes[2].imshow(np.ones_like(value) if brightness is None else brightness, cmap="gray", vmin=0, vmax=1)
        for name, place in scene.tubes.items():
            in_sheet = np.linalg.inv(scene.base_from_sheet) @ [*place.position, 1.0]
            centre = grid.pixels(in_sheet[:2])
            radius = eyes.pieces.foot_radius * grid.pixels_per_metre
            axes[2].add_patch(Circle(centre, radius, fill=False, color="tab:red", lw=1.5))
            axes[2].plot(*centre, "+", color="tab:red")
            axes[2].annotate(
                f"{name}\n{1000 * place.sigma_m:.1f} mm", centre, xytext=(0, 26), textcoords="offset points",
                color="tab:red", ha="center", fontsize=8,
            )
        axes[2].set_title("feet found, with standard deviation")
    for each in axes:
        each.set(xticks=[], yticks=[])
    _save(figure, file)


def plot_contents(eyes: Eyes, shots: Sequence[Shot], scenes: Sequence[TubeScene], file: Path) -> None:
    """Draw what was read in some scenes onto their pictures: outline of each tube, discs looked at, and letters."""
    figure, axes = _figure((15, 8.2), 3, rows=2)
    for each, shot, scene in zip(np.ravel(axes), shots, scenes):
        image, title = shot.image.copy(), scene.result
        if scene.result == TubeResult.OK:
            reading = read_contents(
                shot.image, shot.camera, shot.base_from_camera, scene.tubes, eyes.pieces, eyes.contents,
                scene.base_from_sheet,
            )
            title = f"{reading.state or reading.result}, confidence {reading.confidence:.2f}; true {shot.state}"
            for name in TUBES:
                view = TubeView(shot.camera, shot.base_from_camera, upright(scene.tubes[name].position), eyes.pieces)
                _draw_tube(image, view, reading.tubes[name].colours, eyes.contents.sample_share)
        each.imshow(image)
        each.set_title(title, fontsize=9)
        each.set(xticks=[], yticks=[])
    _save(figure, file)


def _draw_tube(image: np.ndarray, view: TubeView, colours: str, share: float) -> None:
    cv2.polylines(image, [view.outline], True, (0, 160, 255), 1, cv2.LINE_AA)
    for letter, centre, radius in zip(colours.ljust(len(view.radii)), view.centres, view.radii):
        column, row = np.rint(centre).astype(int).tolist()
        cv2.circle(image, (column, row), round(radius * share), (0, 0, 0), 1, cv2.LINE_AA)
        beside = column + round(radius) + 4, row + 4
        cv2.putText(image, letter.strip() or "-", beside, cv2.FONT_HERSHEY_SIMPLEX, 0.4, (0, 0, 160), 1, cv2.LINE_AA)


def _figure(size: tuple[float, float], columns: int, rows: int = 1) -> tuple[Figure, Sequence[Axes]]:
    figure = Figure(figsize=size, dpi=_DPI, layout="tight")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns)


def _save(figure: Figure, file: Path) -> None:
    figure.savefig(file)
