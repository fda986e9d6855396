"""The benchmark `kinematics`: paper 3.4 and 4.3, Figures 12 and 18, and inverse kinematics beside other libraries'."""

from __future__ import annotations

import numpy as np

from dr_eureka.bench.kinematics_chain import chain_rows
from dr_eureka.bench.kinematics_robustness import robustness_rows
from dr_eureka.bench.kinematics_solving import SETTINGS, measure_solving, solving_rows
from dr_eureka.bench.kinematics_steps import measure_steps, sample_rows, step_rows
from dr_eureka.bench.report import BenchOptions, Row
from dr_eureka.kinematics.hybrid import HybridSettings
from dr_eureka.kinematics.samples import SampleSettings
from dr_eureka.resources import load_yaml
from dr_eureka.settings import build


def run(options: BenchOptions) -> list[Row]:
    """Measure chain, samples, single steps, whole solves and robustness.

    `trials`: steps of each size (3000), poses of each arm (10,000) and hard questions (10,000).
    """
    rows = chain_rows(np.random.default_rng([options.seed, 0]))
    samples_found, samples = sample_rows(np.random.default_rng([options.seed, 1]))
    steps = measure_steps(options.seed, options.trials)
    paper_steps = measure_steps(options.seed, options.trials, SampleSettings.paper())
    rows += samples_found + step_rows(steps) + step_rows(paper_steps, where=" in the authors' range of joints")
    solved, reachable = measure_solving(options)
    rows += solving_rows(solved, reachable)
    rows += robustness_rows(options.seed, options.trials, build(HybridSettings, load_yaml(SETTINGS)["kinematics"], SETTINGS))
    if options.out is not None:
        from dr_eureka.bench.kinematics_plots import draw_plots

        draw_plots(options.out, samples, steps, solved)
    return rows
