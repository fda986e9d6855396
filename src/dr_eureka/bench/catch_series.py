"""Balls let go under equal conditions, each drawn from the seed and its number: what the benchmark `catch` counts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from dr_eureka.bench.catch_trials import CatchRun, Conditions, Trial
from dr_eureka.bench.report import BenchOptions
from dr_eureka.bench.workers import shared_out
from dr_eureka.catching.arm_network import SaikaNetwork
from dr_eureka.catching.ball_track import BALLISTIC
from dr_eureka.catching.catcher_settings import CatcherSettings
from dr_eureka.simulation.saika import CAUGHT
from dr_eureka.simulation.throws import REACH, Throw, ThrowSettings, draw_throw, load_throws

# Chosen so that the stated reach lies well inside: where balls come down that are drawn all about it [m].
WIDE_X_M, WIDE_Y_M = (-0.62, 0.16), (0.20, 0.64)


@dataclass(frozen=True)
class Series:
    """Balls under equal conditions; `noise` and `arm_speed` are factors, `flight_s` is how long each thrown ball flies,
    `drop_m` from how far above the catch each falling one does, `drag` its drag coefficient, which the robot takes to be 0.
    `wide`: balls come down all about the stated reach.
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
    drop_m: float | None = None
    arm_speed: float = 1.0
    drag: float = 0.0
    wide: bool = False


@dataclass(frozen=True)
class Outcome:
    """One ball: whether it was caught, what the robot said, how often it moved, the arm's largest speed [rad/s].

    `place`: the x and y [m] in base at which it was to come down.
    """

    caught: bool
    said: str
    moves: int
    joint_speed: float
    place: tuple[float, float] = (0.0, 0.0)


def run_series(series: Series, options: BenchOptions, count: int, label: str) -> list[Outcome]:
    """Let so many balls go, in order; `options.processes`: how many work, by default one a core."""
    return shared_out(partial(run_one, series, options.seed), range(count), options.processes, label, at_a_time=2)


def run_one(series: Series, seed: int, index: int) -> Outcome:
    """Let one ball go, drawn from the seed and its index."""
    throw = draw_ball(series, seed, index)
    trial = run_trial(series, seed, index, throw)
    report = trial.report
    said, moves = (report.result, report.moves) if report else ("", 0)
    return Outcome(trial.verdict == CAUGHT, said, moves, trial.joint_speed, (float(throw.aim[0]), float(throw.aim[1])))


def draw_ball(series: Series, seed: int, index: int) -> Throw:
    """Draw a ball; equal series but for their conditions draw equal balls."""
    return draw_throw(throws_of(series), series.aim, np.random.default_rng([seed, 4, index]))


def run_trial(series: Series, seed: int, index: int, throw: Throw) -> Trial:
    """Let one ball go and return all that is known of it."""
    return CatchRun(conditions_of(series), *_mind(series), seed * 100_003 + index).run(throw)


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
    if series.flight_s is not None:
        settings = replace(settings, flight_s=(series.flight_s, series.flight_s))
    if series.drop_m is not None:
        settings = replace(settings, from_z_m=(series.drop_m, series.drop_m))
    return replace(settings, x_m=WIDE_X_M, y_m=WIDE_Y_M) if series.wide else settings
