"""The benchmark `cards`: paper 3.1 and 4.1, Figures 14 and 15, and how surely any card is read in any view."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from dr_eureka.bench.cards_breakdown import state_rows
from dr_eureka.bench.cards_map import (
    CROPS, FAR_CROPS, TITLES, HeldOut, detect_held_out, far_rows, map_rows,
)
from dr_eureka.bench.cards_refusals import REFUSALS, refusal_rows
from dr_eureka.bench.cards_speed import network_speed_rows, parameter_rows, reading_speed_rows
from dr_eureka.bench.cards_states import SERIES, Trial, run_trials
from dr_eureka.bench.report import BenchOptions, Row
from dr_eureka.game.state import COLOURS
from dr_eureka.resources import WEIGHTS_FOLDER, resource_path
from dr_eureka.vision.card_metrics import match_balls
from dr_eureka.vision.card_weights import load_detector, log_name

_ROUNDS = 200


def run(options: BenchOptions) -> list[Row]:
    """Measure both detectors and the card reader; trials: views of each state in every series, instead of the series' own.

    Raises WeightsError when a detector's weights cannot be loaded.
    """
    # torch takes seconds to import
    from dr_eureka.vision.card_network import CardNetwork

    networks = {model: CardNetwork(load_detector(model), 1, model) for model in TITLES}
    found = detect_held_out(networks, options.seed, CROPS)
    rows = map_rows(found, options.seed)
    rows += far_rows(detect_held_out(networks, options.seed, FAR_CROPS, far=True), options.seed)
    rows += parameter_rows()
    rows += network_speed_rows(options.seed, _ROUNDS)
    rows += reading_speed_rows(options.seed, _ROUNDS)
    tables: dict[str, list[Trial]] = {}
    for series in SERIES:
        views = options.trials or series.views_a_state
        tables[series.name] = run_trials(series, options.seed, views, options.processes)
        rows += state_rows(series, tables[series.name])
    rows += refusal_rows(options.seed, REFUSALS)
    if options.out is not None:
        rows += _draw(options.out, options.seed, found, tables)
    return rows


def _draw(out: Path, seed: int, found: HeldOut, tables: Mapping[str, Sequence[Trial]]) -> list[Row]:
    """Write the plots into a folder; return a row about each network's training log, without a value if there is none."""
    # matplotlib takes a second to import
    from dr_eureka.bench import cards_plots, cards_samples

    logs, rows = {}, []
    for model, title in TITLES.items():
        file = resource_path(WEIGHTS_FOLDER) / log_name(model)
        try:
            logs[model] = cards_plots.read_training_log(file)
        except cards_plots.TrainingLogError:
            rows.append(Row(f"Figure 14, {title}: no training log {file.name}", None, "epochs"))
        else:
            rows.append(Row(f"Figure 14, {title}: trained for", len(logs[model]["epoch"]), "epochs"))
    if logs:
        cards_plots.plot_training(logs, out / "cards_training.png")
    matches = {
        model: [match for colour in COLOURS for match in match_balls(found.truth, [crop.balls for crop in seen], colour)[0]]
        for model, seen in found.seen.items()
    }
    cards_plots.plot_reliability(matches, out / "cards_confidence.png")
    judged = {series.name: tables[series.name] for series in SERIES if series.judged}
    cards_plots.plot_breakdown(judged, out / "cards_states.png")
    first = SERIES[0]
    cards_samples.draw_samples(first, tables[first.name], seed, found.seen["eureka"], out / "cards_samples.png")
    return rows
