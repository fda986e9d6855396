"""How many balls are caught, with and without feedback, and what breaks it: noise, lag, latency and speed."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from dr_eureka.bench.catch_trials import CatchRun, Conditions, Trial
from dr_eureka.bench.report import BenchOptions, Row, progress, share_row
from dr_eureka.catching.arm_network import SaikaNetwork
from dr_eureka.catching.ball_track import BALLISTIC, PAPER_FALLING, PAPER_THROWN
from dr_eureka.catching.catch_report import CatchResult
from dr_eureka.catching.catcher_settings import FALLING, THROWN, CatcherSettings
from dr_eureka.simulation.saika import CAUGHT
from dr_eureka.simulation.throws import BEYOND, REACH, ThrowSettings, draw_throw, load_throws

BALLS, CURVE_BALLS, RENDERED_BALLS = 300, 40, 20
LEAST_FALLING, LEAST_THROWN = 0.99, 0.95
NOISE_FACTORS = (1.0, 3.0, 6.0, 12.0, 25.0)
LAGS_S = (0.0, 0.0083, 0.0167, 0.025, 0.0333)
LATENCIES_S = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4)
FLIGHTS_S = (0.35, 0.4, 0.45, 0.5, 0.6, 0.75)
ARM_SPEEDS = (0.1, 0.2, 0.3, 0.5, 1.0)
DRAGS = (0.0, 0.25, 0.47, 1.0)
# What the paper says of falling balls; of thrown ones it tells no rate.
PAPER = "successful though the area was restricted"


@dataclass(frozen=True)
class Series:
    """Balls under equal conditions; `noise` and `arm_speed` are factors, `flight_s` is how long each ball
    flies, `drag` its drag coefficient, which the robot takes to be 0.
    """

    ball: str
    method: str = BALLISTIC
    feedback: bool = True
    aim: str = REACH
    rendered: bool = False
    to_the_end: bool = False
    noise: float = 1.0
    lag_s: float | None = None
    latency_s: float | None = None
    flight_s: float | None = None
    arm_speed: float = 1.0
    drag: float = 0.0


@dataclass(frozen=True)
class Outcome:
    """One ball: whether it was caught, what the robot said, how often it moved, and the arm's largest speed [rad/s]."""

    caught: bool
    said: str
    moves: int
    joint_speed: float


def rows(options: BenchOptions) -> list[Row]:
    """Let balls go; `trials` is how many in each series, else 300, 40 a point of a curve, 20 with rendered pictures."""
    found = [*_area_rows()]
    for ball, least in ((FALLING, LEAST_FALLING), (THROWN, LEAST_THROWN)):
        found += _main_rows(ball, least, options)
    found += _beyond_rows(options)
    curves = {
        name: (label, values, _curve(name, values, series, options)) for name, (label, values, series) in _curves().items()
    }
    found += [row for _, _, shares in curves.values() for row in shares]
    if options.out is not None:
        from dr_eureka.bench.catch_plots import plot_curves

        plot_curves(options.out / "catch_breakdown.png", curves)
    return found


def run_series(series: Series, seed: int, count: int, processes: int | None, label: str) -> list[Outcome]:
    """Let so many balls go, in order; `processes`: how many work, by default one a core."""
    workers = min(processes or len(os.sched_getaffinity(0)), count)
    one = partial(run_one, series, seed)
    if workers == 1:
        return [one(index) for index in progress(range(count), count, label)]
    # A fork would share the renderer's state; a new interpreter starts clean.
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        return list(progress(pool.imap(one, range(count), chunksize=2), count, label))


def run_one(series: Series, seed: int, index: int) -> Outcome:
    """Let one ball go, drawn from the seed and its index."""
    trial = run_trial(series, seed, index)
    report = trial.report
    said, moves = (report.result, report.moves) if report else ("", 0)
    return Outcome(trial.verdict == CAUGHT, said, moves, trial.joint_speed)


def run_trial(series: Series, seed: int, index: int) -> Trial:
    """Let one ball go and return all that is known of it."""
    conditions = conditions_of(series)
    throw = draw_throw(throws_of(series), series.aim, np.random.default_rng([seed, 4, index]))
    return CatchRun(conditions, *_mind(series), seed * 100_003 + index).run(throw)


@lru_cache(maxsize=None)
def _mind(series: Series) -> tuple[CatcherSettings, SaikaNetwork]:
    return CatcherSettings.load(), SaikaNetwork.load(conditions_of(series).saika)


@lru_cache(maxsize=None)
def conditions_of(series: Series) -> Conditions:
    """Return a series' conditions; the robot does not know that its cameras are noisier than it was told."""
    plain = Conditions(series.ball, series.method, series.feedback, to_the_end=series.to_the_end, rendered=series.rendered)
    cameras, sensor, noise = plain.saika.cameras, plain.world.sensor, series.noise
    cameras = replace(cameras, lag_s=cameras.lag_s if series.lag_s is None else series.lag_s)
    sensor = replace(
        sensor, centre_noise_px=sensor.centre_noise_px * noise, diameter_noise_px=sensor.diameter_noise_px * noise
    )
    joints = {name: replace(joint, speed=joint.speed * series.arm_speed) for name, joint in plain.saika.joints.items()}
    return replace(
        plain, latency_s=plain.latency_s if series.latency_s is None else series.latency_s,
        saika=replace(plain.saika, cameras=cameras, joints=joints),
        world=replace(plain.world, sensor=sensor, physics=replace(plain.world.physics, drag_coefficient=series.drag)),
    )


@lru_cache(maxsize=None)
def throws_of(series: Series) -> ThrowSettings:
    """Return how a series' balls are let go."""
    settings = load_throws()[series.ball]
    return settings if series.flight_s is None else replace(settings, flight_s=(series.flight_s, series.flight_s))


def _area_rows() -> list[Row]:
    found = []
    for ball, throws in load_throws().items():
        width, depth = (high - low for low, high in (throws.x_m, throws.y_m))
        x, y = (f"{low:g}..{high:g}" for low, high in (throws.x_m, throws.y_m))
        name = f"{ball}: stated reach, x {x}, y {y}, z {throws.height_m:g} m"
        found.append(Row(name, width * depth, "m^2", paper="area restricted" if ball == FALLING else None))
    return found


def _main_rows(ball: str, least: float, options: BenchOptions) -> list[Row]:
    count = options.trials or BALLS
    paper_method = PAPER_FALLING if ball == FALLING else PAPER_THROWN
    ours = run_series(Series(ball, to_the_end=True), options.seed, count, options.processes, f"catch, {ball}")
    caught = sum(outcome.caught for outcome in ours)
    agreed = sum((outcome.said == CatchResult.CAUGHT) == outcome.caught for outcome in ours)
    found = [
        share_row(
            f"{ball}, ours, feedback: caught", caught, count, goal=f">= {least}", ok=caught >= least * count,
            paper=PAPER if ball == FALLING else None,
        ),
        share_row(f"{ball}, ours, feedback: robot and referee agree", agreed, count),
        Row(f"{ball}, ours, feedback: largest joint speed", max(outcome.joint_speed for outcome in ours), "rad/s", count),
    ]
    others = {
        "ours, no feedback": Series(ball, feedback=False), "paper's fit, feedback": Series(ball, paper_method),
        "paper's fit, no feedback": Series(ball, paper_method, feedback=False),
    }
    for name, series in others.items():
        outcomes = run_series(series, options.seed, count, options.processes, f"catch, {ball}, {name}")
        found.append(share_row(f"{ball}, {name}: caught", sum(outcome.caught for outcome in outcomes), count))
    count = options.trials or RENDERED_BALLS
    seen = run_series(Series(ball, rendered=True), options.seed, count, options.processes, f"catch, {ball}, rendered")
    found.append(share_row(f"{ball}, ours, feedback, rendered pictures: caught", sum(o.caught for o in seen), count))
    return found


def _beyond_rows(options: BenchOptions) -> list[Row]:
    count = options.trials or CURVE_BALLS
    series = Series(THROWN, aim=BEYOND, to_the_end=True)
    outcomes = run_series(series, options.seed, count, options.processes, "catch, beyond reach")
    told = sum(outcome.said == CatchResult.OUT_OF_REACH for outcome in outcomes)
    return [share_row("thrown beyond the reach: robot says OUT_OF_REACH", told, count, goal="all", ok=told == count)]


def _curves() -> dict[str, tuple[str, tuple[float, ...], list[Series]]]:
    """Return by name: axis label, values, one series a value."""
    return {
        "noise": ("sensor noise, times the ball finder's", NOISE_FACTORS, [Series(THROWN, noise=f) for f in NOISE_FACTORS]),
        "lag": ("right camera after the left [s]", LAGS_S, [Series(THROWN, lag_s=lag) for lag in LAGS_S]),
        "lag, falling, paper's parallax": (
            "right camera after the left [s]", LAGS_S, [Series(FALLING, PAPER_FALLING, lag_s=lag) for lag in LAGS_S]
        ),
        "latency": ("pictures late by [s]", LATENCIES_S, [Series(THROWN, latency_s=late) for late in LATENCIES_S]),
        "flight": ("time of flight [s]", FLIGHTS_S, [Series(THROWN, flight_s=t) for t in FLIGHTS_S]),
        "drag": ("drag coefficient of the ball", DRAGS, [Series(THROWN, drag=drag) for drag in DRAGS]),
        "arm": ("arm's speed, share of 4 rad/s", ARM_SPEEDS, [Series(THROWN, arm_speed=share) for share in ARM_SPEEDS]),
    }


def _curve(name: str, values: Sequence[float], series: Sequence[Series], options: BenchOptions) -> list[Row]:
    count = options.trials or CURVE_BALLS
    found = []
    for value, each in zip(values, series):
        outcomes = run_series(each, options.seed, count, options.processes, f"catch, {name} {value:g}")
        found.append(share_row(f"curve {name}, {value:g}: caught", sum(outcome.caught for outcome in outcomes), count))
    return found
