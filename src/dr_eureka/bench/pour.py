"""The benchmark `pour`: paper 4.4 and Table 2, with the robot's own arms in simulated contact physics."""
from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence

import numpy as np

from dr_eureka.bench.pour_rounds import Trial, every_kind, fewer_kinds, lock_kinds, run_rounds
from dr_eureka.bench.pour_spread import STATED, WIDE
from dr_eureka.bench.pour_trials import PourTrial
from dr_eureka.bench.report import BenchOptions, Row, mean_row, share_row
from dr_eureka.control.codes import EngineCode

ROUNDS = 100
# Share of right pours by balls before and balls to pour, of 10 each (Table 2).
TABLE_2 = {(4, 1): 0.9, (4, 2): 0.9, (4, 3): 0.8, (3, 1): 0.9, (3, 2): 0.9, (2, 1): 1.0}
LEAST_PROFILED = 0.99
LONGEST_PROFILED_S = 0.8


def run(options: BenchOptions) -> list[Row]:
    """Return the rows at the stated and at the wide spread; with `out`, plots and the trials for `measure_pours` too."""
    rounds = options.trials or ROUNDS
    began = time.perf_counter()
    stated = run_rounds(STATED, options.seed, rounds, every_kind, options.processes, "pours")
    wide = run_rounds(WIDE, options.seed, rounds, fewer_kinds, options.processes, "pours, wide spread")
    minutes = (time.perf_counter() - began) / 60.0
    rows = rows_of(stated) + wide_rows(wide)
    tried = len(stated) + len(wide)
    rows.append(Row("pours tried a minute, wall time", tried / minutes, "1/min", tried))
    if options.out is not None:
        from dr_eureka.bench.pour_plots import draw_plots, draw_strips

        (options.out / "pours.jsonl").write_text("".join(line.as_line() for line in as_pour_trials(stated)))
        draw_plots(options.out, stated, wide)
        draw_strips(options.out, options.seed)
    return rows


def rows_of(trials: Sequence[Trial]) -> list[Row]:
    """Return the rows on pours at the stated spread."""
    rows = []
    for method in ("profiled", "linear"):
        for held, count in [*TABLE_2, *((held, held) for held in (4, 3, 2, 1))]:
            rows.append(_direct_row(method, held, count, _chosen(trials, method, held, count)))
    for kind in lock_kinds():
        tried = [trial for trial in trials if trial.kind == kind]
        name = f"lock from the {kind.hand}: 1 of {kind.held} into {kind.in_target}"
        rows.append(_share(name, tried, 1.0, paper=1.0))
    for method in ("profiled", "linear", "lock"):
        told = [trial for trial in trials if trial.kind.method == method and trial.arrived is not None]
        if method != "lock":
            told = [trial for trial in told if (trial.kind.held, trial.kind.count) in TABLE_2]
        rows.append(_seconds_row(method, [trial.seconds for trial in told]))
    lost = sum(trial.lost for trial in trials)
    rows.append(Row("balls lost", lost, "balls", len(trials), goal="0", ok=lost == 0))
    return rows + refusal_rows("", trials)


def wide_rows(trials: Sequence[Trial]) -> list[Row]:
    """Return the rows on pours at the wide spread; nothing is asked of them."""
    rows = []
    for method in ("profiled", "linear"):
        for held, count in TABLE_2:
            tried = _chosen(trials, method, held, count)
            right = sum(trial.right for trial in tried)
            rows.append(share_row(f"wide spread: {method}: {count} of {held}", right, len(tried)))
    locked = [trial for trial in trials if trial.kind.method == "lock"]
    rows.append(share_row("wide spread: lock, all kinds", sum(trial.right for trial in locked), len(locked)))
    rows.append(Row("wide spread: balls lost", sum(trial.lost for trial in trials), "balls", len(trials)))
    return rows + refusal_rows("wide spread: ", trials)


def refusal_rows(prefix: str, trials: Sequence[Trial]) -> list[Row]:
    """Return how many pours the engine refused, or broke off, by its code."""
    codes = Counter(trial.code for trial in trials if trial.code != EngineCode.OK)
    return [share_row(f"{prefix}refused or broken off: {code}", count, len(trials)) for code, count in sorted(codes.items())]


def as_pour_trials(trials: Sequence[Trial]) -> list[PourTrial]:
    """Return what `measure_pours` reads: the pours that began. A ball that sprang out of the receiving tube is lost."""
    told = []
    for trial in trials:
        if trial.arrived is not None:
            kind, poured = trial.kind, max(trial.arrived, 0)
            told.append(PourTrial(kind.method, kind.held, kind.count, poured, min(trial.lost, kind.held - poured)))
    return told


def _chosen(trials: Sequence[Trial], method: str, held: int, count: int) -> list[Trial]:
    return [t for t in trials if (t.kind.method, t.kind.held, t.kind.count) == (method, held, count)]


def _direct_row(method: str, held: int, count: int, tried: Sequence[Trial]) -> Row:
    paper = TABLE_2.get((held, count))
    least = LEAST_PROFILED if method == "profiled" else paper
    words = "all" if count == held else f"{count}"
    return _share(f"{method}: {words} of {held}", tried, least, paper)


def _share(name: str, tried: Sequence[Trial], least: float | None, paper: float | None) -> Row:
    right = sum(trial.right for trial in tried)
    if least is None:
        return share_row(name, right, len(tried), paper=paper)
    return share_row(name, right, len(tried), goal=f">= {least:g}", ok=right >= least * len(tried), paper=paper)


def _seconds_row(method: str, seconds: Sequence[float]) -> Row:
    name = f"{method}: ready to ready, simulated time"
    if method != "profiled":
        return mean_row(name, seconds, "s")
    ok = bool(seconds) and float(np.mean(seconds)) <= LONGEST_PROFILED_S
    return mean_row(name, seconds, "s", goal=f"<= {LONGEST_PROFILED_S} s", ok=ok)
