"""Training of the arm network: its loss, its stream of samples, and runs that are broken off."""
import csv
from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from dr_eureka.checkpoint import CheckpointError
from dr_eureka.cli import train_arm_network
from dr_eureka.kinematics import samples, training
from dr_eureka.kinematics.arms import arm_chain
from dr_eureka.kinematics.network import ArmNetwork
from dr_eureka.kinematics.sample_stream import DELTA, JOINTS, WANTED, SampleStream, as_rows
from dr_eureka.kinematics.samples import SampleSettings, draw_samples
from dr_eureka.kinematics.torch_network import TorchChain
from dr_eureka.kinematics.training import TrainingPlan, hand_loss, train
from dr_eureka.resources import load_weights

PLAN = TrainingPlan(rounds=4, block=400, blocks_kept=2, round_samples=640, batch=64, warm_up=0.5, held_from=0.5)


@pytest.fixture(scope="module", autouse=True)
def few_samples():
    """Draw no more samples at once than these small runs take."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(samples, "_CHUNK", 256)
        patch.setattr(training, "_VALIDATION", 200)
        yield


@pytest.fixture(scope="module")
def trained(few_samples, tmp_path_factory):
    folder = tmp_path_factory.mktemp("unbroken")
    train(PLAN, folder)
    return folder


def test_training_lowers_the_loss_and_logs_every_round(trained):
    with (trained / training.LOG).open() as file:
        rows = list(csv.DictReader(file))
    assert [int(row["round"]) for row in rows] == [1, 2, 3, 4]
    assert [int(row["samples_drawn"]) for row in rows] == [400, 800, 1200, 1600]
    assert [int(row["samples_seen"]) for row in rows] == [640, 1280, 1920, 2560]
    assert float(rows[-1]["loss"]) < float(rows[0]["loss"])
    ArmNetwork(load_weights("arm_network.npz", trained))


def test_a_run_broken_off_ends_with_the_weights_of_one_that_was_not(trained, tmp_path, monkeypatch):
    save = training.save_checkpoint

    def save_and_break_off(path, modules, optimiser, done, plan):
        save(path, modules, optimiser, done, plan)
        if done == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(training, "save_checkpoint", save_and_break_off)
    with pytest.raises(KeyboardInterrupt):
        train(PLAN, tmp_path)
    monkeypatch.undo()
    train(PLAN, tmp_path)
    unbroken, resumed = (load_weights("arm_network.npz", folder) for folder in (trained, tmp_path))
    for key in unbroken:
        np.testing.assert_array_equal(resumed[key], unbroken[key])


def test_the_batch_norm_keeps_its_statistics_in_the_later_rounds(tmp_path, monkeypatch):
    means = []
    save = training.save_checkpoint

    def watch(path, modules, optimiser, done, plan):
        means.append(modules["model"][1].running_mean.clone())
        save(path, modules, optimiser, done, plan)

    monkeypatch.setattr(training, "save_checkpoint", watch)
    train(PLAN, tmp_path)
    assert not torch.equal(means[0], means[1])
    assert torch.equal(means[1], means[2]) and torch.equal(means[2], means[3])


def test_a_checkpoint_that_is_none_is_named(tmp_path):
    (tmp_path / training.CHECKPOINT).write_text("nonsense")
    with pytest.raises(CheckpointError, match="checkpoint.npz: not a checkpoint"):
        train(PLAN, tmp_path)


def test_a_run_does_not_go_on_by_another_plan(trained):
    with pytest.raises(CheckpointError, match="begun with batch 64, seed 1, now asked for batch 32, seed 2; go on as begun"):
        train(replace(PLAN, batch=32, seed=2), trained)
    with pytest.raises(CheckpointError, match="begun with straight_share 0.3, now asked for straight_share 0.0"):
        train(PLAN, trained, SampleSettings(straight_share=0.0))


def test_a_perfect_step_costs_nothing_and_each_error_its_weight():
    chain = arm_chain("left")
    rows = torch.from_numpy(as_rows(draw_samples(chain, 50, np.random.default_rng(1))))
    joints, wanted = rows[:, JOINTS], rows[:, WANTED]
    kinematics, plan = TorchChain(chain), TrainingPlan()
    assert float(hand_loss(kinematics, plan, joints, wanted[:, :7], wanted)) == pytest.approx(0.0, abs=1e-4)
    moved = wanted.clone()
    moved[:, 16] += 0.01  # the target one centimetre farther in x
    loss = float(hand_loss(kinematics, plan, joints, wanted[:, :7], moved))
    assert loss == pytest.approx(plan.position_weight * 1e-4, rel=0.05)


def test_the_torch_chain_agrees_with_the_numpy_chain():
    chain = arm_chain("left")
    joints = np.random.default_rng(2).uniform(chain.lower, chain.upper, (20, 7))
    rotations, positions = TorchChain(chain)(torch.tensor(joints, dtype=torch.float32))
    poses = chain.forward(joints)
    np.testing.assert_allclose(rotations.numpy(), poses[:, :3, :3], atol=2e-6)
    np.testing.assert_allclose(positions.numpy(), poses[:, :3, 3], atol=2e-6)


def test_a_stream_that_joins_late_holds_what_one_from_the_start_holds():
    chain = arm_chain("left")
    early, late = (SampleStream(chain, SampleSettings(), seed=3, block=50, blocks_kept=2) for _ in range(2))
    for number in range(4):
        expected = list(early.batches(number, 8, 3))
    for batch, same in zip(late.batches(3, 8, 3), expected, strict=True):
        assert torch.equal(batch, same)
    assert expected[0].shape == (8, 32)


def test_rows_hold_joints_step_and_target():
    drawn = draw_samples(arm_chain("left"), 5, np.random.default_rng(4))
    rows = as_rows(drawn)
    np.testing.assert_allclose(rows[:, JOINTS], drawn.joints, atol=1e-6)
    np.testing.assert_allclose(rows[:, DELTA], drawn.delta, atol=1e-6)
    np.testing.assert_allclose(rows[:, WANTED][:, 7:16].reshape(-1, 3, 3), drawn.target[:, :3, :3], atol=1e-6)


def test_the_learning_rate_warms_up_and_falls_to_zero():
    plan = TrainingPlan()
    assert plan.rate(0.0) < 0.05 * plan.peak_rate
    assert plan.rate(plan.rounds / 2) == pytest.approx(plan.peak_rate / 2)
    assert plan.rate(plan.rounds) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("words", [["--rounds", "0"], ["--batch", "-1"], ["--seed", "-3"], ["--rounds", "many"]])
def test_the_command_refuses_impossible_numbers(words, capsys):
    with pytest.raises(SystemExit) as ended:
        train_arm_network.main(words)
    assert ended.value.code == 2
    assert "error" in capsys.readouterr().err


def test_the_command_names_a_folder_it_cannot_write(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert train_arm_network.main(["--out", str(tmp_path / "file"), "--rounds", "1"]) == 1
    assert capsys.readouterr().err.startswith("train_arm_network: ")
