"""YOLO-Dr. Eureka: the paper's size and shape, decoding, folding, learning, resuming, scoring."""
from dataclasses import replace

import numpy as np
import pytest
import torch

from dr_eureka.checkpoint import CheckpointError
from dr_eureka.cli.train_card_detector import main
from dr_eureka.vision.card_architecture import (
    GRID, RAW_CHANNELS, build_network, parameter_count, to_arrays,
)
from dr_eureka.vision.card_detections import SeenBall, collect
from dr_eureka.vision.card_metrics import average_precision, box_overlap, mean_average_precision
from dr_eureka.vision.card_network import CardNetwork, decode
from dr_eureka.vision.card_stream import CardStream
from dr_eureka.vision.card_targets import detection_loss, encode
from dr_eureka.vision.card_training import CHECKPOINT, TrainingPlan, train
from dr_eureka.vision.card_weights import load_detector, save_detector


@pytest.fixture(autouse=True)
def one_thread():
    torch.set_num_threads(1)


def test_the_network_has_about_250_thousand_parameters():
    assert 225_000 <= parameter_count(build_network("eureka")) <= 275_000


def test_the_third_and_fourth_convolutions_have_stride_2_and_a_crop_gives_a_13_by_13_grid_of_four():
    network = build_network("eureka").eval()
    assert [block[0].stride for block in network.features] == [(1, 1)] * 2 + [(2, 2)] * 2 + [(1, 1)] * 3
    with torch.no_grad():
        assert decode(network(torch.zeros(1, 3, 416, 416))).balls.shape == (1, 13, 13, 4)


def test_the_baseline_has_about_eleven_million_parameters_and_the_same_grid():
    network = build_network("tiny").eval()
    assert 10_500_000 <= parameter_count(network) <= 11_500_000
    with torch.no_grad():
        assert network(torch.zeros(1, 3, 416, 416)).shape == (1, RAW_CHANNELS, GRID, GRID)


def test_the_baselines_weights_keep_seven_bits_and_their_places_on_disk(tmp_path):
    torch.manual_seed(2)
    arrays = to_arrays(build_network("tiny"))
    files = save_detector("tiny", arrays, tmp_path)
    assert all(file.stat().st_size < 4_000_000 for file in files)
    loaded = load_detector("tiny", tmp_path)
    assert loaded.keys() == arrays.keys()
    for name, array in arrays.items():
        largest = np.abs(array.reshape(len(array), -1)).max(1).reshape(-1, *(1,) * (array.ndim - 1))
        assert np.all(np.abs(loaded[name] - array) <= largest / 253), name


def test_folding_batch_norm_changes_no_output():
    torch.manual_seed(1)
    network = build_network("eureka")
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            torch.nn.init.uniform_(module.weight, 0.5, 1.5)
            torch.nn.init.normal_(module.bias)
            torch.nn.init.normal_(module.running_mean, std=0.1)
            torch.nn.init.uniform_(module.running_var, 0.5, 2.0)
    crop = np.random.default_rng(1).integers(0, 256, (416, 416, 3), np.uint8)
    with torch.no_grad():
        expected = decode(network.eval()(torch.from_numpy(crop / np.float32(255)).permute(2, 0, 1)[None]))
    found = CardNetwork(to_arrays(network)).detect(crop)
    assert torch.allclose(found.balls, expected.balls, atol=1e-3)
    assert torch.allclose(found.feet, expected.feet, atol=1e-3)


def test_weights_of_a_wrong_shape_are_refused_by_name():
    arrays = to_arrays(build_network("eureka"))
    arrays["kernel2"] = arrays["kernel2"][:, :3]
    with pytest.raises(ValueError, match="kernel2 has shape"):
        CardNetwork(arrays)


def test_shipped_weights_fit_the_network():
    CardNetwork(load_detector("eureka"))


def raw_from(ball_grid, foot_grid):
    """Return the raw output that says exactly what the grids to learn say."""
    raw = np.zeros((GRID, GRID, RAW_CHANNELS))
    inverse = lambda offset: np.log((offset + 0.2) / (1.2 - offset))
    raw[..., 0], raw[..., 7] = 20 * ball_grid[..., 0] - 10, 20 * foot_grid[..., 0] - 10
    raw[..., 1:3], raw[..., 3] = inverse(ball_grid[..., 1:3]), ball_grid[..., 3]
    raw[..., 4:7] = 10 * (ball_grid[..., 4, None] == np.arange(3))
    raw[..., 8:10] = inverse(foot_grid[..., 1:3])
    return torch.from_numpy(raw.transpose(2, 0, 1)[None]).float()


def test_what_is_encoded_for_training_decodes_to_the_same_balls_and_feet_once_each():
    rng = np.random.default_rng(2)
    stream = CardStream(rng, 4)
    for _ in range(12):
        _, balls, feet = stream.sample()
        grid = decode(raw_from(*encode(balls, feet)))
        arrays = (a[0].numpy() for a in (grid.balls, grid.diameters, grid.class_scores, grid.feet))
        seen = collect(*arrays, threshold=0.5)
        assert len(seen.balls) == len(balls) and len(seen.feet) == len(feet)
        for x, y, diameter, kind in balls:
            nearest = min(seen.balls, key=lambda b: np.hypot(b.x - x, b.y - y))
            assert (nearest.x, nearest.y, nearest.diameter) == pytest.approx((x, y, diameter), abs=1e-4)
            assert nearest.colour == "RGP"[int(kind)]


def test_the_loss_of_a_perfect_output_is_nearly_nothing_and_of_a_shifted_one_is_not():
    balls, feet = np.array([[0.31, 0.42, 0.13, 1.0], [0.52, 0.42, 0.13, 2.0]]), np.array([[0.31, 0.6]])
    ball_grid, foot_grid = encode(balls, feet)
    targets = [torch.from_numpy(grid[None]) for grid in (ball_grid, foot_grid)]
    assert detection_loss(raw_from(ball_grid, foot_grid), *targets) < 0.02
    other = encode(balls + (0.02, 0, 0, 0), feet)
    assert detection_loss(raw_from(*other), *targets) > 0.1


def test_the_learning_rate_warms_up_and_falls_to_nearly_nothing():
    plan = TrainingPlan(epochs=4, peak_rate=2e-3)
    assert plan.rate(0.0) == 0.0 and plan.rate(0.12) == pytest.approx(2e-3, rel=0.01)
    assert plan.rate(2.06) == pytest.approx(1e-3, rel=0.01) and plan.rate(3.999) < 1e-5


def test_a_run_that_is_broken_off_and_resumed_ends_with_the_same_weights(tmp_path, monkeypatch):
    plan = TrainingPlan(epochs=2, peak_rate=3e-3, samples_per_epoch=2, batch=2, pool=2, validation_samples=1, seed=3)
    whole = to_arrays(train(plan, tmp_path / "whole"))

    class Broken(Exception):
        pass

    calls = []

    def break_in_second_epoch(*arguments):
        calls.append(arguments)
        if len(calls) == 2:
            raise Broken

    monkeypatch.setattr("dr_eureka.vision.card_training._show_progress", break_in_second_epoch)
    with pytest.raises(Broken):
        train(plan, tmp_path / "parts")
    assert (tmp_path / "parts" / CHECKPOINT).exists()
    resumed = to_arrays(train(plan, tmp_path / "parts"))
    for name, array in whole.items():
        assert np.allclose(array, resumed[name], atol=1e-5), name
    log = (tmp_path / "parts" / "card_detector.csv").read_text().splitlines()
    assert [line.split(",")[0] for line in log] == ["epoch", "1", "2"]
    with pytest.raises(CheckpointError, match="begun with epochs 2, model eureka, now asked for epochs 3, model tiny"):
        train(replace(plan, epochs=3, model="tiny"), tmp_path / "parts")


@pytest.mark.parametrize("words, expected", [
    (["--epochs", "0"], "at least 1"),
    (["--samples", "4", "--batch", "8"], "at least a batch"),
    (["--seed", "-1"], "seed at least 0"),
])
def test_an_impossible_plan_is_refused_in_one_line(tmp_path, capsys, words, expected):
    with pytest.raises(SystemExit) as stop:
        main(["--out", str(tmp_path), *words])
    assert stop.value.code == 2 and expected in capsys.readouterr().err


def test_overlap_of_square_boxes_is_intersection_over_union():
    assert box_overlap((0.5, 0.5, 0.2), (0.5, 0.5, 0.2)) == pytest.approx(1.0)
    assert box_overlap((0.5, 0.5, 0.2), (0.6, 0.5, 0.2)) == pytest.approx(0.1 * 0.2 / (2 * 0.04 - 0.02))
    assert box_overlap((0.1, 0.1, 0.1), (0.5, 0.5, 0.1)) == 0.0


def test_average_precision_of_a_worked_example():
    truth = [np.array([[0.2, 0.2, 0.1, 0], [0.8, 0.8, 0.1, 0]]), np.array([[0.5, 0.5, 0.1, 0]])]
    seen = [
        [SeenBall(0.2, 0.2, 0.1, "R", 0.9), SeenBall(0.5, 0.2, 0.1, "R", 0.8)],
        [SeenBall(0.5, 0.5, 0.1, "R", 0.7), SeenBall(0.5, 0.5, 0.1, "R", 0.6)],
    ]
    # In order of confidence: hit, miss, hit, repeat. Precision 1 up to recall 1/3, then 2/3 up to recall 2/3.
    assert average_precision(seen, truth, "R") == pytest.approx(1 / 3 + (1 / 3) * (2 / 3))


def test_mean_average_precision_leaves_out_colours_that_never_occur():
    truth = [np.array([[0.2, 0.2, 0.1, 0]])]
    assert mean_average_precision([[SeenBall(0.2, 0.2, 0.1, "R", 0.9)]], truth) == 1.0
    assert mean_average_precision([[]], truth) == 0.0
