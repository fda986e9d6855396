"""The network of the arm: shape, accuracy, refusals, and both ways of learning."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from dr_eureka.catching.arm_network import OUT_OF_REACH, SHAPES, OutOfReachError, SaikaNetwork, SaikaNetworkError
from dr_eureka.catching.arm_training import SAMPLES, ArmSamples, draw_samples, learn, learn_by_back_propagation
from dr_eureka.catching.saika import SaikaArm
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.catching.working_area import WorkingArea
from dr_eureka.cli.train_saika_network import main
from dr_eureka.resources import load_weights

SETTINGS = SaikaSettings.load()
ARM = SaikaArm(SETTINGS)
AREA = WorkingArea(SETTINGS.working_area, ARM)
NETWORK = SaikaNetwork.load(SETTINGS)
PLACES = AREA.draw(1000, np.random.default_rng(1))


def error_mm(network, places=PLACES):
    return 1000.0 * np.linalg.norm(ARM.basket_centre(network.four_joints(places)) - places, axis=1)


@pytest.fixture(scope="module")
def samples():
    return draw_samples(ARM, AREA, np.random.default_rng(2))


def test_the_shipped_network_is_the_papers_and_puts_the_hand_within_two_millimetres():
    weights = load_weights("saika_network.npz")
    assert [weights[key].shape for key in ("hidden_weight", "output_weight")] == [(25, 3), (4, 25)]
    assert error_mm(NETWORK).mean() < 2.0
    assert error_mm(NETWORK).max() < 15.0


def test_its_joints_are_within_the_limits_and_hold_the_basket_up():
    for place in PLACES[:50]:
        joints = NETWORK.joints(place)
        assert np.all((joints >= ARM.lower) & (joints <= ARM.upper))
        assert ARM.forward(joints)[2, 2] > 0.7


def test_its_output_is_that_of_a_network_written_out():
    weights = load_weights("saika_network.npz")
    inputs = (PLACES[0] - AREA.lower) / (AREA.upper - AREA.lower) * 2.0 - 1.0
    layers = [(weights[f"{layer}_weight"], weights[f"{layer}_bias"]) for layer in ("hidden", "output")]
    values = inputs
    for matrix, biases in layers:
        values = [1.0 / (1.0 + np.exp(-(row @ values + bias))) for row, bias in zip(matrix, biases)]
    assert NETWORK.four_joints(PLACES[0]) == pytest.approx(weights["joint_offset"] + weights["joint_scale"] * values)


@pytest.mark.parametrize("place", [
    (0.3, 0.4, -0.2), (-0.2, 0.4, 0.2), (-0.46, 0.54, -0.34), (np.nan, 0.4, -0.2), (-0.2, np.inf, -0.2),
])
def test_a_place_outside_of_what_was_learnt_is_refused_by_name(place):
    with pytest.raises(OutOfReachError, match="OUT_OF_REACH: hand at .* expected x, y, z in") as refused:
        NETWORK.joints(np.array(place))
    assert refused.value.reason == OUT_OF_REACH


def test_weights_of_another_arm_are_refused():
    longer = dataclasses.replace(SETTINGS, body=dataclasses.replace(SETTINGS.body, forearm_m=0.25))
    with pytest.raises(SaikaNetworkError, match="trained for another arm or area"):
        SaikaNetwork.load(longer)


@pytest.mark.parametrize("key", SHAPES)
def test_weights_of_another_shape_are_refused(key):
    weights = dict(load_weights("saika_network.npz"))
    weights[key] = np.zeros(2)
    with pytest.raises(SaikaNetworkError, match=f"{key} has shape"):
        SaikaNetwork(weights, SETTINGS)


def test_there_are_162_samples_spread_over_the_area_and_true_to_the_arm(samples):
    assert samples.joints.shape == (SAMPLES, 4) and SAMPLES == 162
    assert AREA.contains(samples.positions).all()
    assert ARM.basket_centre(samples.joints) == pytest.approx(samples.positions, abs=1e-9)
    farthest = max(np.linalg.norm(samples.positions - place, axis=1).min() for place in PLACES)
    assert farthest < 0.07


def test_both_ways_of_learning_bring_the_error_down(samples):
    ours = learn(ARM, AREA, samples, np.random.default_rng(3), cycles=12)
    assert error_mm(SaikaNetwork(ours.weights, SETTINGS)).mean() < 15.0
    paper = learn_by_back_propagation(ARM, AREA, samples, np.random.default_rng(3), cycles=1500)
    assert error_mm(SaikaNetwork(paper.weights, SETTINGS)).mean() < 40.0
    for learnt in (ours, paper):
        assert learnt.total_error[-1] < 0.05 * learnt.total_error[0]
        assert len(learnt.cycles) == len(learnt.total_error)


def test_back_propagation_follows_the_gradient_that_differences_give(samples):
    from dr_eureka.catching.arm_training import _first_parameters, _Problem

    few = ArmSamples(samples.positions[:10], samples.joints[:10])
    problem, parameters = _Problem(ARM, AREA, few), _first_parameters(np.random.default_rng(4))
    _, gradient = problem.error_and_gradient(parameters)
    slopes = problem.slopes(parameters)
    for index in range(0, len(parameters), 7):
        step = np.zeros(len(parameters))
        step[index] = 1e-6
        after, before = problem.errors(parameters + step), problem.errors(parameters - step)
        assert slopes[:, :, index] == pytest.approx((after - before) / 2e-6, abs=1e-7)
        assert gradient[index] == pytest.approx((np.sum(after**2) - np.sum(before**2)) / 2e-6, abs=1e-6)


def test_the_command_says_what_is_wrong_with_its_folder_before_it_learns(tmp_path, capsys):
    file = tmp_path / "file"
    file.write_text("")
    assert main(["--out", str(file)]) == 2
    assert capsys.readouterr().err == f"train_saika_network: --out {file}: File exists; expected a folder for the weights\n"
