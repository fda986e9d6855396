"""Figures 12 and 18 of the paper: the samples that the network learns from, and how far one single step misses."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

import numpy as np

from dr_eureka.bench.report import Row, mean_row, progress
from dr_eureka.kinematics.arms import arm_chain
from dr_eureka.kinematics.network import ArmNetwork
from dr_eureka.kinematics.samples import Samples, SampleSettings, draw_paper_samples, draw_samples
from dr_eureka.kinematics.step_errors import STEP_SIZES, TESTS, step_errors, step_methods

TRIALS = 3000
LARGEST_MEAN_CM = 0.5
BETTER_FROM = 0.05  # [m] from this size of straight steps up the network shall miss by less than the pseudo-inverse
#: Mean errors [cm] of the authors' weights on random joint changes, and of the pseudo-inverse as they computed it.
AUTHORS_CM = {
    "network": (1.82, 1.81, 1.85, 1.77, 1.80, 1.76, 1.90, 2.20),
    "pseudo_inverse": (2.29, 2.28, 2.39, 2.81, 4.03, 6.34, 9.59, 21.79),
}
_TITLES = {"joint_change": "random joint change", "straight": "straight step"}
_PAPER_SAMPLES = 10_000_000
_TIMED_SAMPLES = 60_000

#: Position errors (n,) [m] after one step, by test, size [m] and method.
StepTable = Mapping[tuple[str, float, str], np.ndarray]


def sample_rows(rng: np.random.Generator) -> tuple[list[Row], dict[str, Samples]]:
    """Time both recipes of samples; return rows and samples of each, for Figure 12."""
    chain = arm_chain("left")
    recipes: dict[str, Callable[[int], Samples]] = {
        "the paper's": lambda count: draw_paper_samples(chain, count, rng),
        "ours": lambda count: draw_samples(chain, count, rng),
    }
    rows, drawn = [], {}
    for name, draw in recipes.items():
        began = time.process_time()
        drawn[name] = draw(_TIMED_SAMPLES)
        rate = _TIMED_SAMPLES / (time.process_time() - began)
        rows.append(Row(f"samples, {name}: drawn a second by one core", rate, "1/s", _TIMED_SAMPLES))
        rows.append(Row(f"samples, {name}: ten million would take", _PAPER_SAMPLES / rate / 60.0, "min", _TIMED_SAMPLES))
    return rows, drawn


def measure_steps(seed: int, trials: int | None, settings: SampleSettings = SampleSettings()) -> StepTable:
    """Take `trials` steps (3000) of each size in both tests by each method."""
    chain, network = arm_chain("left"), ArmNetwork.load()
    methods, errors = step_methods(chain, network), {}
    pairs = [(test, size) for test in TESTS for size in STEP_SIZES]
    for number, (test, size) in enumerate(progress(pairs, len(pairs), "kinematics, single steps")):
        found = step_errors(chain, methods, size, test, trials or TRIALS, np.random.default_rng([seed, number]), settings)
        errors.update({(test, size, method): missed for method, missed in found.items()})
    return errors


def step_rows(table: StepTable, where: str = "") -> list[Row]:
    """Return a row for each test, size and method; `where` goes into the names."""
    rows = []
    for (test, size, method), errors in table.items():
        mean, goal, ok = 100.0 * float(errors.mean()), None, None
        if method == "network" and test == "joint_change":
            goal, ok = f"<= {LARGEST_MEAN_CM} cm", mean <= LARGEST_MEAN_CM
        elif method == "network" and size >= BETTER_FROM:
            other = 100.0 * float(table[test, size, "pseudo_inverse"].mean())
            goal, ok = "< pseudo_inverse", mean < other
        paper = None
        if test == "joint_change" and method in AUTHORS_CM:
            paper = AUTHORS_CM[method][STEP_SIZES.index(size)]
        name = f"{_TITLES[test]}{where} of {100.0 * size:g} cm, {method}: misses by"
        rows.append(mean_row(name, 100.0 * errors, "cm", goal=goal, ok=ok, paper=paper))
    return rows
