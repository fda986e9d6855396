"""How many balls are caught inside the stated reach, by the paper's fit and by ours, with and without feedback."""

from __future__ import annotations

from dr_eureka.bench.catch_series import Series, run_series
from dr_eureka.bench.report import BenchOptions, Row, share_row
from dr_eureka.catching.ball_track import PAPER_FALLING, PAPER_THROWN
from dr_eureka.catching.catch_report import CatchResult
from dr_eureka.catching.catcher_settings import FALLING, THROWN
from dr_eureka.simulation.throws import BEYOND, load_throws

BALLS, PAPER_BALLS, BEYOND_BALLS, RENDERED_BALLS = 300, 100, 40, 30
LEAST_FALLING, LEAST_THROWN = 0.99, 0.95
# What the paper says of falling balls; of thrown ones it tells no rate.
PAPER = "successful though the area was restricted"


def rows(options: BenchOptions) -> list[Row]:
    """Let balls go; `trials` is how many in each series, else 300, by the paper's fit 100, beyond 40, by pictures 30."""
    found = [*_area_rows()]
    for ball, least in ((FALLING, LEAST_FALLING), (THROWN, LEAST_THROWN)):
        found += _main_rows(ball, least, options)
    return found + _beyond_rows(options)


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
    ours = run_series(Series(ball, to_the_end=True), options, count, f"catch, {ball}")
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
        count = options.trials or (PAPER_BALLS if series.method == paper_method else BALLS)
        outcomes = run_series(series, options, count, f"catch, {ball}, {name}")
        found.append(share_row(f"{ball}, {name}: caught", sum(outcome.caught for outcome in outcomes), count))
    count = options.trials or RENDERED_BALLS
    seen = run_series(Series(ball, rendered=True), options, count, f"catch, {ball}, rendered")
    found.append(share_row(f"{ball}, ours, feedback, rendered pictures: caught", sum(o.caught for o in seen), count))
    return found


def _beyond_rows(options: BenchOptions) -> list[Row]:
    count = options.trials or BEYOND_BALLS
    outcomes = run_series(Series(THROWN, aim=BEYOND, to_the_end=True), options, count, "catch, beyond reach")
    told = sum(outcome.said == CatchResult.OUT_OF_REACH for outcome in outcomes)
    return [share_row("thrown beyond the reach: robot says OUT_OF_REACH", told, count, goal="all", ok=told == count)]
