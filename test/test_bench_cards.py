"""The benchmark `cards`, each part on a few cards: what it counts is counted right, and follows from the seed alone."""
import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from dr_eureka.bench import cards_plots, cards_speed
from dr_eureka.bench.cards_breakdown import breakdown, state_rows
from dr_eureka.bench.cards_map import (
    HeldOut, detect_held_out, far_rows, held_out_crop, map_rows,
)
from dr_eureka.bench.cards_refusals import KINDS, refusal_rows, refusal_scene
from dr_eureka.bench.cards_samples import draw_samples
from dr_eureka.bench.cards_states import SERIES, STATES, Trial, run_trials, scene_of
from dr_eureka.vision.card_detections import CropDetections, SeenBall
from dr_eureka.vision.card_metrics import (
    average_precision, box_overlap, match_balls, mean_average_precision, weighted_precision,
)

FEW = ("RR|GG|PP", "RRGG||PP", "|RGPP|RG")
TRIAL = Trial("RR|GG|PP", 0, "OK", "RR|GG|PP", 0.9, 0.25, 0.1, 0.2, 120.0, 1.0, 0.0, 0.5)
MISSED = replace(TRIAL, result="UNREADABLE", read=None, state="RRGG||PP")
WRONG = replace(TRIAL, read="RR|GG|P", side_px=300.0)


@pytest.fixture(scope="module")
def truth():
    """Return the balls of six held-out crops."""
    return [held_out_crop(1, index).balls for index in range(6)]


def guessed(truth, seed):
    """Return detections that are sometimes right, off, of another colour, doubled, or missing."""
    rng = np.random.default_rng(seed)
    seen = []
    for there in truth:
        balls = []
        for x, y, diameter, kind in np.repeat(there, 2, 0)[rng.random(12) < 0.7]:
            x, y = (x, y) + rng.normal(0, 0.2, 2) * diameter
            colour = "RGP"[int(kind)] if rng.random() < 0.9 else "R"
            balls.append(SeenBall(x, y, diameter * rng.uniform(0.8, 1.2), colour, float(rng.random())))
        seen.append(CropDetections(tuple(balls), ()))
    return seen


def perfect(truth):
    return [CropDetections(tuple(SeenBall(*b[:3], "RGP"[int(b[3])], 0.9) for b in there), ()) for there in truth]


def precision_ball_by_ball(seen, truth, colour):
    """Return the average precision with one list of all detections, in which each takes its ball in turn."""
    ranked = sorted(((ball, image) for image, found in enumerate(seen) for ball in found.balls if ball.colour == colour),
                    key=lambda pair: -pair[0].confidence)
    wanted = [there[there[:, 3] == "RGP".index(colour)] for there in truth]
    total, taken, curve = sum(map(len, wanted)), set(), []
    for rank, (ball, image) in enumerate(ranked, 1):
        overlaps = [box_overlap((ball.x, ball.y, ball.diameter), box[:3]) for box in wanted[image]]
        if overlaps and max(overlaps) >= 0.5:
            taken.add((image, overlaps.index(max(overlaps))))
        curve.append((len(taken) / total, len(taken) / rank))
    steps = [recall - before for (recall, _), (before, _) in zip(curve, [(0.0, 1.0), *curve])]
    return sum(step * max(precision for _, precision in curve[rank:]) for rank, step in enumerate(steps))


@pytest.mark.parametrize("colour", "RGP")
def test_average_precision_is_that_counted_ball_by_ball_when_every_crop_counts_once(truth, colour):
    for seed in range(5):
        seen = guessed(truth, seed)
        balls = [found.balls for found in seen]
        matches, total = match_balls(truth, balls, colour)
        expected = precision_ball_by_ball(seen, truth, colour)
        assert average_precision(balls, truth, colour) == pytest.approx(expected, abs=1e-12)
        assert weighted_precision(matches, total, np.ones(len(truth), int)) == pytest.approx(expected, abs=1e-12)


def test_a_crop_that_counts_twice_counts_as_if_it_were_there_twice(truth):
    seen, weights = guessed(truth, 3), np.array([2, 0, 1, 1, 3, 1])
    chosen = np.repeat(np.arange(6), weights)
    many, found = [truth[i] for i in chosen], [seen[i] for i in chosen]
    for colour in "RGP":
        expected = average_precision([f.balls for f in found], many, colour)
        assert weighted_precision(*match_balls(truth, [f.balls for f in seen], colour), weights) == pytest.approx(expected, abs=0.02)


def test_mean_average_precision_has_a_row_a_colour_an_interval_and_a_comparison(truth):
    found = HeldOut(truth, {"eureka": guessed(truth, 1), "tiny": perfect(truth)})
    rows = {row.name: row for row in map_rows(found, 1)}
    ours = rows["mAP@0.5, YOLO-Dr. Eureka"]
    assert ours.value == pytest.approx(mean_average_precision([crop.balls for crop in found.seen["eureka"]], truth))
    assert ours.interval95[0] < ours.value < ours.interval95[1] and ours.ok is False
    assert rows["mAP@0.5, YOLOv2-tiny"].value == 1.0 and rows["mAP@0.5, YOLOv2-tiny"].ok is True
    assert rows["mAP@0.5, ours less YOLOv2-tiny"].value == pytest.approx(ours.value - 1.0)
    assert sum(name.startswith("AP@0.5 ") for name in rows) == 6
    assert map_rows(found, 1) == list(rows.values())


def test_far_crops_are_told_but_not_judged(truth):
    rows = far_rows(HeldOut(truth, {"eureka": guessed(truth, 1), "tiny": perfect(truth)}), 1)
    assert [row.name.removesuffix(", far outside training") for row in rows] == [
        "mAP@0.5, YOLO-Dr. Eureka", "mAP@0.5, YOLOv2-tiny", "mAP@0.5, ours less YOLOv2-tiny"]
    assert all((row.goal, row.ok, row.paper) == (None, None, None) for row in rows)


def test_held_out_crops_follow_from_seed_and_number():
    crop, again = held_out_crop(1, 0), held_out_crop(1, 0)
    assert np.array_equal(crop.image, again.image) and np.array_equal(crop.balls, again.balls)
    assert not np.array_equal(crop.image, held_out_crop(2, 0).image)
    assert not np.array_equal(crop.image, held_out_crop(1, 1).image)
    assert crop.image.shape == (416, 416, 3) and crop.balls.shape == (6, 4)


def test_every_network_sees_the_same_crops(truth):
    from dr_eureka.vision.card_network import CardNetwork
    from dr_eureka.vision.card_weights import load_detector

    network = CardNetwork(load_detector("eureka"))
    found = detect_held_out({"eureka": network, "tiny": network}, 1, 2)
    assert found.seen["eureka"] == found.seen["tiny"] and len(found.seen["tiny"]) == 2
    assert all(np.array_equal(balls, there) for balls, there in zip(found.truth, truth))


def test_a_scene_can_be_drawn_again_and_no_two_trials_share_one():
    scene = scene_of(SERIES[0], 1, FEW[0], 0)
    assert scene.image.shape == (480, 640, 3)
    assert np.array_equal(scene.image, scene_of(SERIES[0], 1, FEW[0], 0).image)
    others = [(SERIES[1], 1, FEW[0], 0), (SERIES[0], 2, FEW[0], 0), (SERIES[0], 1, FEW[1], 0), (SERIES[0], 1, FEW[0], 1)]
    assert not any(np.array_equal(scene.image, scene_of(*other).image) for other in others)


def test_cards_of_the_second_series_are_upside_down_and_of_all_series_of_every_state():
    turns = [scene_of(SERIES[1], 1, state, 0).view.turn for state in FEW]
    assert all(math.radians(160) <= turn <= math.radians(200) for turn in turns)
    assert len(set(STATES)) == 1710


def test_trials_do_not_depend_on_how_many_processes_share_them():
    alone = run_trials(SERIES[0], 1, 2, 1, FEW)
    assert [(trial.state, trial.view) for trial in alone] == [(state, view) for state in FEW for view in range(2)]
    assert run_trials(SERIES[0], 1, 2, 2, FEW) == alone
    assert sum(trial.right for trial in alone) >= 5 and not any(trial.wrong for trial in alone)


def test_the_exact_state_table_counts_right_wrong_and_refused():
    table = state_rows(SERIES[0], [TRIAL] * 7 + [MISSED, MISSED, WRONG])
    rows = {row.name.removeprefix("exact state, any turn"): row for row in table}
    right, wrong, refused = rows[": OK and right"], rows[": OK and wrong"], rows[": UNREADABLE"]
    assert (right.value, wrong.value, refused.value, right.n) == (0.7, 0.1, 0.2, 10)
    assert (right.ok, wrong.ok, refused.ok) == (False, False, None)
    assert rows[", empty tube none: OK and right"].value == 7 / 8
    assert rows[", empty tube centre: OK and right"].value == 0.0
    assert rows[", size 243..320 px: OK and wrong"].value == 1.0
    assert ", size 80..106 px: OK and wrong" not in rows


def test_a_series_that_is_not_judged_has_totals_only():
    rows = state_rows(SERIES[2], [TRIAL, MISSED])
    assert len(rows) == 5 and all(row.goal is None and row.ok is None for row in rows)


def test_every_trial_is_in_one_bin_of_each_thing_that_varies():
    trials = [replace(TRIAL, side_px=side, tilt=tilt, turn=turn, view=index) for index, (side, tilt, turn) in enumerate(
        [(80.0, 0.0, -math.pi), (320.0, math.pi / 4, math.pi), (106.0, 0.3, -0.01), (200.0, 0.7, 0.0)])]
    parts = breakdown(trials)
    assert list(parts) == ["empty tube", "spacing", "turn", "tilt", "size", "light", "motion blur", "defocus"]
    for bins in parts.values():
        assert sorted(trial.view for part in bins for trial in part.trials) == [0, 1, 2, 3]
    assert [len(part.trials) for part in parts["turn"]] == [1, 0, 0, 0, 2, 0, 0, 1]


@pytest.mark.parametrize("kind", KINDS)
def test_what_may_be_read_in_a_scene_is_what_it_shows(kind):
    for index in range(12):
        image, shown = refusal_scene(kind, 1, index)
        again, _ = refusal_scene(kind, 1, index)
        assert image.shape == (480, 640, 3) and np.array_equal(image, again)
        assert len(shown) == {"impossible card": 0, "two cards": 2}.get(kind, 1)
        assert set(shown) <= set(STATES)


def test_every_kind_is_counted_and_all_wrong_readings_are_judged_together():
    rows = refusal_rows(1, 2)
    assert [row.name for row in rows[:-1]] == [f"{kind}: {what}" for kind in KINDS for what in ("refused", "OK and wrong")]
    assert (rows[-1].n, rows[-1].value, rows[-1].ok) == (8, 0.0, True)


def test_parameters_are_those_of_the_layers():
    def layers(*channels):
        """Return the parameters of 3x3 convolutions with batch norm, and of the 1x1 output layer of 10 channels."""
        return sum(9 * a * b + 2 * b for a, b in zip(channels, channels[1:])) + 10 * channels[-1] + 10

    ours, tiny, ratio = cards_speed.parameter_rows()
    assert ours.value == layers(3, 8, 16, 32, 64, 64, 128, 96) and ours.ok is True
    assert tiny.value == layers(3, 16, 32, 64, 128, 256, 512, 1024, 512)
    assert ratio.value == tiny.value / ours.value


def test_opencv_computes_from_the_exported_network_what_torch_does(tmp_path):
    import torch

    from dr_eureka.vision.card_architecture import from_arrays
    from dr_eureka.vision.card_weights import load_detector

    crop = held_out_crop(1, 0).image
    raw = cards_speed.onnx_engines(tmp_path)["YOLO-Dr. Eureka, OpenCV dnn"](crop)
    image = torch.from_numpy(crop).permute(2, 0, 1)[None] / 255.0
    with torch.no_grad():
        expected = from_arrays(load_detector("eureka"), "eureka")(image).numpy()
    np.testing.assert_allclose(raw, expected, atol=1e-3)


def test_speeds_are_measured_in_turns_and_compared():
    rows = {row.name: row for row in cards_speed.network_speed_rows(1, 2) + cards_speed.reading_speed_rows(1, 2)}
    ours, tiny = (rows[f"time a crop, median, {name}, torch"].value for name in ("YOLO-Dr. Eureka", "YOLOv2-tiny"))
    assert 0 < ours < tiny
    assert rows["speed, ours over YOLOv2-tiny"].value > 1
    assert rows["time a crop, YOLO-Dr. Eureka, OpenCV dnn over torch"].value > 0
    assert rows["image to state, one core"].value == pytest.approx(1000 / rows["image to state, median"].value)


def test_a_training_log_is_read_and_a_broken_one_is_told(tmp_path):
    file = tmp_path / "log.csv"
    file.write_text("epoch,samples,loss,map50,exact,seconds\n1,2496,1.5,0.9,0.5,300\n2,4992,0.5,0.99,0.9,310\n")
    log = cards_plots.read_training_log(file)
    assert (list(log["epoch"]), list(log["loss"]), list(log["map50"])) == ([1, 2], [1.5, 0.5], [0.9, 0.99])
    for text in ("epoch,loss\n1,2\n", "epoch,loss,map50\n1,2,much\n", "epoch,loss,map50\n", "epoch,loss,map50\n1\n"):
        file.write_text(text)
        with pytest.raises(cards_plots.TrainingLogError, match="log.csv: expected"):
            cards_plots.read_training_log(file)
    with pytest.raises(cards_plots.TrainingLogError, match="expected a training log"):
        cards_plots.read_training_log(tmp_path / "none.csv")


def test_plots_are_pictures(truth, tmp_path):
    log = {"epoch": np.array([1, 2]), "loss": np.array([1.0, 0.5]), "map50": np.array([0.5, 0.9])}
    cards_plots.plot_training({"eureka": log, "tiny": log}, tmp_path / "training.png")
    cards_plots.plot_reliability({"eureka": match_balls(truth, [found.balls for found in guessed(truth, 1)], "R")[0]}, tmp_path / "confidence.png")
    cards_plots.plot_breakdown({"any turn": [TRIAL, MISSED], "upside down": [WRONG]}, tmp_path / "states.png")
    draw_samples(SERIES[0], [TRIAL, MISSED], 1, perfect(truth), tmp_path / "samples.png")
    for name in ("training", "confidence", "states", "samples"):
        assert cv2.imread(str(tmp_path / f"{name}.png")).std() > 10
