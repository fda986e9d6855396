"""What a benchmark is told and what it answers: options in, rows out, one figure a row, each with its uncertainty."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from scipy import stats

from dr_eureka.errors import DrEurekaError

CONFIDENCE = 0.95
_BAR = 30
_T = TypeVar("_T")


class BenchError(DrEurekaError):
    """A benchmark that cannot be run as asked."""


@dataclass(frozen=True)
class BenchOptions:
    """How to run: the seed of all that is drawn; trials and processes, None for each benchmark's own; a folder for plots."""

    seed: int = 1
    trials: int | None = None
    out: Path | None = None
    processes: int | None = None


@dataclass(frozen=True)
class Row:
    """One figure: value None when it could not be had (the name says why).

    ok None: there is no goal to judge by, or nothing to judge.
    """

    name: str
    value: float | None
    unit: str
    n: int | None = None
    interval95: tuple[float, float] | None = None
    paper: float | str | None = None
    goal: str | None = None
    ok: bool | None = None

    @property
    def short(self) -> bool:
        """Tell whether a goal was missed, or could not be judged for want of a value."""
        return self.goal is not None and self.value is None if self.ok is None else not self.ok

    def as_mapping(self) -> dict[str, Any]:
        """Return the row for JSON, which knows neither NaN nor infinity."""
        mapping = asdict(self)
        if self.value is not None:
            mapping["value"] = float(self.value) if math.isfinite(self.value) else None
        if self.interval95 is not None:
            ends = [float(end) for end in self.interval95]
            mapping["interval95"] = ends if all(map(math.isfinite, ends)) else None
        mapping["ok"] = None if self.ok is None else bool(self.ok)
        return mapping


def share_row(
    name: str, hits: int, n: int, *, goal: str | None = None, ok: bool | None = None, paper: float | str | None = None
) -> Row:
    """Return the share of `hits` in `n` trials with its Wilson 95 % interval (scipy.stats); no value when n is 0."""
    if n == 0:
        return Row(name, None, "share", 0, None, paper, goal, ok)
    with np.errstate(divide="ignore"):  # of the p-value, which nobody asked for
        interval = stats.binomtest(int(hits), int(n)).proportion_ci(CONFIDENCE, method="wilson")
    return Row(name, hits / n, "share", int(n), (float(interval.low), float(interval.high)), paper, goal, ok)


def mean_row(
    name: str,
    values: Sequence[float],
    unit: str,
    *,
    goal: str | None = None,
    ok: bool | None = None,
    paper: float | str | None = None,
) -> Row:
    """Return the mean of independent values with Student's 95 % interval; no interval for fewer than two values."""
    data = np.asarray(values, float)
    if data.size == 0:
        return Row(name, None, unit, 0, None, paper, goal, ok)
    mean, interval = float(data.mean()), None
    if data.size > 1:
        reach = float(stats.sem(data) * stats.t.ppf((1 + CONFIDENCE) / 2, data.size - 1))
        interval = (mean - reach, mean + reach)
    return Row(name, mean, unit, int(data.size), interval, paper, goal, ok)


def progress(iterable: Iterable[_T], total: int, label: str) -> Iterator[_T]:
    """Yield the items, drawing on stderr how many of the total are done; nothing is drawn where stderr is no terminal."""
    shown = sys.stderr.isatty()
    for done, item in enumerate(iterable, 1):
        yield item
        if shown:
            bar = "#" * (_BAR * done // max(total, 1))
            sys.stderr.write(f"\r{label} [{bar:<{_BAR}}] {done}/{total} ")
            sys.stderr.flush()
    if shown:
        sys.stderr.write("\r\x1b[K")
        sys.stderr.flush()


def table_lines(rows: Sequence[Row]) -> list[str]:
    """Return rows as the lines of an aligned table, with headings."""
    heads = ("figure", "value", "unit", "n", "95 % interval", "paper", "goal", "")
    cells = [heads, *(_cells(row) for row in rows)]
    widths = [max(len(line[column]) for line in cells) for column in range(len(heads))]
    # Numbers stand right, words left.
    numeric = {1, 3}

    def aligned(line: tuple[str, ...]) -> str:
        words = (word.rjust(w) if i in numeric else word.ljust(w) for i, (word, w) in enumerate(zip(line, widths)))
        return "  ".join(words).rstrip()

    return [aligned(line) for line in cells]


def _cells(row: Row) -> tuple[str, ...]:
    interval = "" if row.interval95 is None else f"{number(row.interval95[0])} .. {number(row.interval95[1])}"
    paper = row.paper if isinstance(row.paper, str) else number(row.paper)
    verdict = "SHORT" if row.short else "ok" if row.ok else ""
    count = "" if row.n is None else str(row.n)
    return (row.name, number(row.value) or "-", row.unit, count, interval, paper, row.goal or "", verdict)


def number(value: float | None) -> str:
    """Return a figure with five significant digits, whole numbers in full; empty for None."""
    if value is None:
        return ""
    if not math.isfinite(value):
        return str(value)
    return str(round(value)) if value == round(value) or abs(value) >= 1e5 else f"{value:.5g}"
