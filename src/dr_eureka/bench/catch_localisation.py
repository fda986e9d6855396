"""Where the ball is, measured: paper 4, Figures 3, 4 and 5, and both mean errors."""

from __future__ import annotations

import numpy as np

from dr_eureka.bench.catch_localisation_plots import draw_plots
from dr_eureka.bench.catch_places import Measured, draw_place, in_camera, measure
from dr_eureka.bench.report import BenchOptions, Row, mean_row, share_row
from dr_eureka.catching.localisation import LocalisationError, locate_by_parallax, locate_by_size, rig_at
from dr_eureka.catching.saika import SaikaHead
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.simulation.saika_cameras import AnalyticCamera
from dr_eureka.simulation.saika_settings import SaikaWorldSettings

PLACES = 100
PARALLAX_RANGE_M, SIZE_RANGE_M = (0.3, 0.8), (0.3, 1.2)  # of depth from the cameras, as in the paper
PAPER_PARALLAX_MM, PAPER_SIZE_MM = 10.0, 13.0
# Balls in flight, for what a lag between both cameras does: steps of the ball's way seen at once.
_FLIGHTS = 400
_LAGS_S = (0.0, 0.0167, 0.0333)
_FALLING_M_S, _THROWN_M_S = (1.0, 3.5), (2.0, 4.0)


def rows(options: BenchOptions) -> list[Row]:
    """Measure localisation in rendered pictures; `trials` is the number of places of each method, else 100."""
    settings, world = SaikaSettings.load(), SaikaWorldSettings.load()
    count = options.trials or PLACES
    parallax = measure(settings, world, PARALLAX_RANGE_M, count, options.seed, both=True)
    size = measure(settings, world, SIZE_RANGE_M, count, options.seed + 1, both=False)
    if options.out is not None:
        draw_plots(options.out, settings, parallax, size)
    return (
        _error_rows("parallax, 300-800 mm", parallax, "parallax", PAPER_PARALLAX_MM)
        + _error_rows("size, 300-1200 mm", size, "size", PAPER_SIZE_MM)
        + _finder_rows(parallax + size, world)
        + _lag_rows(settings, world, options.seed)
    )


def _error_rows(name: str, places: list[Measured], method: str, paper_mm: float) -> list[Row]:
    ours, whole = (_errors_mm(places, key) for key in (f"depth_by_{method}_m", f"whole_pixels_{method}_m"))
    ok = bool(ours) and float(np.mean(ours)) <= paper_mm
    return [
        share_row(f"{name}: ball found", len(ours), len(places)),
        mean_row(f"{name}: error in depth", ours, "mm", paper=paper_mm, goal=f"<= {paper_mm:g} mm", ok=ok),
        mean_row(f"{name}: error in depth from whole pixels, as the paper's tracker gives", whole, "mm", paper=paper_mm),
        Row(f"{name}: error in depth, largest", max(ours, default=None), "mm", len(ours)),
    ]


def _errors_mm(places: list[Measured], key: str) -> list[float]:
    """Return how far off a measured depth is, where there is one."""
    found = [(getattr(place, key), place.depth_m) for place in places]
    return [1000.0 * abs(depth - true) for depth, true in found if depth is not None]


def _finder_rows(places: list[Measured], world: SaikaWorldSettings) -> list[Row]:
    """Compare the finder's errors in rendered pictures with what the analytic camera of the large benchmarks adds."""
    centre = np.array([error for place in places for error in place.centre_errors_px]).ravel()
    size = np.array([place.size_px - place.true_size_px for place in places if place.size_px is not None])
    figures = [("centre", centre, world.sensor.centre_noise_px), ("diameter", size, world.sensor.diameter_noise_px)]
    compared = []
    for what, errors, noise in figures:
        value = float(np.sqrt(np.mean(errors**2))) if len(errors) else None
        compared.append(
            Row(
                f"ball finder in rendered pictures: error of the {what}, root mean square", value, "px", len(errors),
                goal=f"<= {noise:g} px, the analytic camera's noise", ok=value is not None and value <= noise,
            )
        )
    extra = sum(place.extra for place in places)
    find_ms = float(np.median([place.find_ms for place in places]))
    return compared + [
        Row("ball finder: things taken for a ball that are none", extra, "things", len(places), goal="0", ok=extra == 0),
        Row("ball finder: processor time a picture, median", find_ms, "ms", len(places)),
    ]


def _lag_rows(settings: SaikaSettings, world: SaikaWorldSettings, seed: int) -> list[Row]:
    """Measure what the cameras' lag does to stereo, for falling and for thrown balls, by the analytic camera (paper 4)."""
    found = []
    for lag in _LAGS_S:
        rng = np.random.default_rng([seed, 3])
        falling = _flight_errors(settings, world, (0.4, 0.8), _FALLING_M_S, 2, lag, rng)
        found.append(mean_row(f"falling ball, parallax, lag {1000 * lag:.0f} ms: error in depth", falling["parallax"], "mm"))
        thrown = _flight_errors(settings, world, (0.6, 1.6), _THROWN_M_S, 1, lag, rng)
        found.append(mean_row(f"thrown ball, parallax, lag {1000 * lag:.0f} ms: error in depth", thrown["parallax"], "mm"))
        if lag == _LAGS_S[-1]:
            found.append(mean_row("thrown ball, size, any lag: error in depth", thrown["size"], "mm"))
    return found


def _flight_errors(
    settings: SaikaSettings,
    world: SaikaWorldSettings,
    depths_m: tuple[float, float],
    speeds_m_s: tuple[float, float],
    axis: int,
    lag_s: float,
    rng: np.random.Generator,
) -> dict[str, list[float]]:
    """Return errors in depth [mm] of balls that move against `axis` of base while the right camera looks `lag_s` later."""
    rig = rig_at(settings, SaikaHead(settings))
    camera = AnalyticCamera(settings, world.sensor, rng)
    errors: dict[str, list[float]] = {"parallax": [], "size": []}
    while len(errors["size"]) < _FLIGHTS:
        place = draw_place(settings, rig, depths_m, True, rng)
        later = place.copy()
        later[axis] -= rng.uniform(*speeds_m_s) * lag_s
        left, right = camera.balls(rig.left.base_from_camera, [place]), camera.balls(rig.right.base_from_camera, [later])
        if not (left and right):
            continue
        # Of both moments, the middle is what two pictures together are compared with.
        middle = in_camera(rig.left, 0.5 * (place + later))[2]
        try:
            by_parallax = locate_by_parallax(left[0].centre_px, right[0].centre_px, rig)[0]
        except LocalisationError:
            continue
        errors["parallax"].append(1000.0 * abs(in_camera(rig.left, by_parallax)[2] - middle))
        by_size = locate_by_size(left[0].centre_px, left[0].diameter_px, rig.left)[0]
        errors["size"].append(1000.0 * abs(in_camera(rig.left, by_size)[2] - in_camera(rig.left, place)[2]))
    return errors
