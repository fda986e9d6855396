"""The benchmark `catch`: localisation, the arm's network, predictions and catches (the second paper, and beyond)."""

from __future__ import annotations

from dr_eureka.bench import (
    catch_curves,
    catch_localisation,
    catch_network,
    catch_prediction,
    catch_rates,
    catch_reach,
    catch_strip,
)
from dr_eureka.bench.report import BenchOptions, Row

_PARTS = (catch_localisation, catch_network, catch_prediction, catch_rates, catch_reach, catch_curves)


def run(options: BenchOptions) -> list[Row]:
    """Measure; `trials` is the number of balls, places or flights of each series instead of each one's own."""
    rows = [row for part in _PARTS for row in part.rows(options)]
    if options.out is not None:
        catch_strip.draw(options)
    return rows
