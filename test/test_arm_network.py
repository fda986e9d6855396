"""The learned step: architecture, numpy against torch, the mirror, its error, and how it is trained."""
import numpy as np
import pytest
from scipy.optimize import minimize

from dr_eureka.kinematics.arms import arm_chain, mirror, mirror_delta, mirror_transform
from dr_eureka.kinematics.network import ArmNetwork, ArmNetworkError
from dr_eureka.kinematics.samples import SampleSettings, draw_samples, least_norm_change, moved, pose_errors
from dr_eureka.kinematics.step_errors import step_errors, step_methods
from dr_eureka.resources import load_weights


@pytest.fixture(scope="module")
def network():
    return ArmNetwork.load()


@pytest.fixture(scope="module")
def samples():
    return draw_samples(arm_chain("left"), 1000, np.random.default_rng(12345))


def test_the_weights_are_the_papers_273415_numbers():
    weights = load_weights("arm_network.npz")
    assert sum(array.size for key, array in weights.items() if not key.startswith("joint_")) == 273_415
    assert [weights[f"dense{index}_weight"].shape[::-1] for index in range(8)] == [
        (13, 256), (256, 256), (256, 256), (256, 256), (256, 128), (128, 128), (128, 128), (128, 7),
    ]
    assert all(array.dtype == np.float32 for array in weights.values())


def test_numpy_inference_agrees_with_torch(network, samples):
    torch = pytest.importorskip("torch")
    from dr_eureka.kinematics.torch_network import build_model, parameter_count

    weights = load_weights("arm_network.npz")
    model = build_model()
    assert parameter_count(model) == 273_415
    names = {"weight": "gamma", "bias": "beta", "running_mean": "mean", "running_var": "variance"}
    state = model.state_dict()
    for key in state:
        layer, part = key.split(".")
        if key.endswith("num_batches_tracked"):
            continue
        dense = int(layer) % 3 == 0
        state[key] = torch.tensor(weights[f"dense{int(layer) // 3}_{part}" if dense else f"norm{int(layer) // 3}_{names[part]}"])
    model.load_state_dict(state)
    model.eval()
    inputs = np.concatenate([samples.delta, network.normalise(samples.joints)], axis=1)
    expected = model(torch.tensor(inputs, dtype=torch.float32)).detach().numpy()
    np.testing.assert_allclose(network.step(samples.joints, samples.delta), expected, atol=2e-5)
    np.testing.assert_allclose(network.step(samples.joints[0], samples.delta[0]), expected[0], atol=2e-5)


def test_a_step_never_seen_in_training_misses_by_a_third_of_what_the_authors_network_does(network, samples):
    poses = arm_chain("left").forward(samples.joints + network.step(samples.joints, samples.delta))
    missed = pose_errors(poses, samples.target)
    assert np.linalg.norm(missed[:, :3], axis=1).mean() < 0.0065
    assert np.linalg.norm(missed[:, 3:], axis=1).mean() < 0.025


def test_long_steps_are_better_than_the_pseudo_inverses(network):
    methods = step_methods(arm_chain("left"), network)
    for test in ("joint_change", "straight"):
        missed = step_errors(arm_chain("left"), methods, 0.10, test, 500, np.random.default_rng(4))
        assert missed["network"].mean() < 0.5 * missed["pseudo_inverse"].mean()
        assert missed["network"].mean() < 0.5 * missed["damped"].mean()


def test_the_right_arm_steps_in_the_mirror(network, samples):
    step = network.step(mirror(samples.joints), mirror_delta(samples.delta), side="right")
    np.testing.assert_allclose(step, mirror(network.step(samples.joints, samples.delta)), atol=1e-12)
    right = arm_chain("right")
    wanted = moved(right.forward(mirror(samples.joints)), mirror_delta(samples.delta))
    np.testing.assert_allclose(wanted, mirror_transform(samples.target), atol=2e-4)
    missed = pose_errors(right.forward(mirror(samples.joints) + step), wanted)
    left_missed = pose_errors(arm_chain("left").forward(samples.joints + mirror(step)), samples.target)
    np.testing.assert_allclose(missed, mirror_delta(left_missed), atol=5e-4)


def test_weights_with_a_hole_or_of_another_shape_are_refused():
    weights = load_weights("arm_network.npz")
    with pytest.raises(ArmNetworkError, match="no 'norm3_mean'"):
        ArmNetwork({key: array for key, array in weights.items() if key != "norm3_mean"})
    with pytest.raises(ArmNetworkError, match=r"'dense7_bias' has shape \(6,\), expected \(7,\)"):
        ArmNetwork({**weights, "dense7_bias": np.zeros(6)})


def test_samples_make_the_step_they_name_inside_the_limits(samples):
    chain = arm_chain("left")
    ends = samples.joints + samples.change
    assert np.all((ends >= chain.lower) & (ends <= chain.upper))
    np.testing.assert_allclose(chain.forward(ends), samples.target, atol=3e-4)
    np.testing.assert_allclose(moved(chain.forward(samples.joints), samples.delta), samples.target, atol=1e-9)
    assert np.abs(samples.delta[:, 3:]).max() < 0.5 and np.linalg.norm(samples.delta[:, :3], axis=1).max() <= 0.5


def test_equal_seeds_draw_equal_samples(samples):
    again = draw_samples(arm_chain("left"), 1000, np.random.default_rng(12345))
    np.testing.assert_array_equal(again.delta, samples.delta)
    assert not np.array_equal(draw_samples(arm_chain("left"), 1000, np.random.default_rng(1)).delta, samples.delta)


def test_targets_are_the_smallest_joint_steps_by_an_independent_optimiser(samples):
    chain = arm_chain("left")
    for index in range(8):
        start, target = samples.joints[index], samples.target[index]
        answer = minimize(
            lambda change: change @ change,
            np.zeros(7),
            jac=lambda change: 2.0 * change,
            constraints={"type": "eq", "fun": lambda change: pose_errors(chain.forward((start + change)[None]), target[None])[0]},
            options={"ftol": 1e-12, "maxiter": 200},
        )
        assert answer.success
        np.testing.assert_allclose(samples.change[index], answer.x, atol=2e-3)


def test_a_step_out_of_reach_has_no_target():
    chain = arm_chain("left")
    joints = np.array([[0.0, 1.0, 0.0, 0.5, 1.0, 0.0, 0.0]])
    _, error = least_norm_change(chain, joints, moved(chain.forward(joints), np.array([[0.9, 0, 0, 0, 0, 0]])))
    assert error[0] > 0.1


def test_training_lowers_the_loss_and_resumes_where_it_stopped(tmp_path, caplog):
    pytest.importorskip("torch")
    from dr_eureka.kinematics.training import TrainingSettings, train

    def run(steps):
        settings = TrainingSettings(steps=steps, batch=64, pool=2000, first_pool=2000, refresh=200, round_steps=20, warm_up=5)
        with caplog.at_level("INFO"):
            train(tmp_path / "arm_network.npz", tmp_path / "state", settings, SampleSettings())

    run(40)
    run(60)
    assert [record.message.split()[1] for record in caplog.records if record.message.startswith("step")] == ["20/40", "40/40", "60/60"]
    assert any("resuming" in record.message and "at step 40" in record.message for record in caplog.records)
    losses = [float(record.message.split()[3]) for record in caplog.records if record.message.startswith("step")]
    assert losses[-1] < losses[0]
    ArmNetwork(load_weights("arm_network.npz", tmp_path))
