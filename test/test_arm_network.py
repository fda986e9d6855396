"""The learned step: architecture, numpy against torch, the mirror, its error, and the samples it is trained on."""
import numpy as np
import pytest
from scipy.optimize import minimize

from dr_eureka.kinematics.arms import arm_chain, mirror, mirror_delta, mirror_transform
from dr_eureka.kinematics.network import ArmNetwork, ArmNetworkError
from dr_eureka.kinematics.samples import (
    SampleSettings, draw_paper_samples, draw_samples, least_norm_change, moved, pose_errors,
)
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
        index, dense = int(layer) // 3, int(layer) % 3 == 0
        state[key] = torch.tensor(weights[f"dense{index}_{part}" if dense else f"norm{index}_{names[part]}"])
    model.load_state_dict(state)
    model.eval()
    inputs = np.concatenate([samples.delta, network.normalise(samples.joints)], axis=1)
    expected = model(torch.tensor(inputs, dtype=torch.float32)).detach().numpy()
    np.testing.assert_allclose(network.step(samples.joints, samples.delta), expected, atol=2e-5)
    np.testing.assert_allclose(network.step(samples.joints[0], samples.delta[0]), expected[0], atol=2e-5)


def test_a_step_never_seen_in_training_misses_by_a_quarter_of_what_the_authors_network_does(network, samples):
    poses = arm_chain("left").forward(samples.joints + network.step(samples.joints, samples.delta))
    missed = pose_errors(poses, samples.target)
    assert np.linalg.norm(missed[:, :3], axis=1).mean() < 0.0045
    assert np.linalg.norm(missed[:, 3:], axis=1).mean() < 0.025


@pytest.mark.parametrize("size", [0.005, 0.05, 0.15, 0.30])
def test_the_network_misses_by_at_most_half_a_centimetre_whatever_the_size(network, size):
    rng = np.random.default_rng(8)
    missed = step_errors(arm_chain("left"), {"network": network.step}, size, "joint_change", 400, rng)["network"]
    assert missed.mean() <= 0.005


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

        def missed(change):
            return pose_errors(chain.forward((start + change)[None]), target[None])[0]

        answer = minimize(
            lambda change: change @ change,
            np.zeros(7),
            jac=lambda change: 2.0 * change,
            constraints={"type": "eq", "fun": missed},
            options={"ftol": 1e-12, "maxiter": 200},
        )
        assert answer.success
        np.testing.assert_allclose(samples.change[index], answer.x, atol=2e-3)


def test_a_step_out_of_reach_has_no_target():
    chain = arm_chain("left")
    joints = np.array([[0.0, 1.0, 0.0, 0.5, 1.0, 0.0, 0.0]])
    _, error = least_norm_change(chain, joints, moved(chain.forward(joints), np.array([[0.9, 0, 0, 0, 0, 0]])))
    assert error[0] > 0.1


def test_the_papers_samples_are_random_joint_changes_clipped_to_the_range():
    chain, settings = arm_chain("left"), SampleSettings.paper()
    samples = draw_paper_samples(chain, 5000, np.random.default_rng(6))
    ends = samples.joints + samples.change
    assert len(samples) == 5000
    np.testing.assert_allclose(chain.forward(ends), samples.target, atol=1e-12)
    assert np.all((ends >= np.array(settings.lower) - 1e-12) & (ends <= np.array(settings.upper) + 1e-12))
    at_the_end = np.isclose(ends, settings.lower) | np.isclose(ends, settings.upper)
    assert at_the_end.any(axis=1).mean() > 0.2  # clipped, not discarded
    assert np.abs(samples.change).max() <= settings.change and np.abs(samples.delta[:, 3:]).max() < settings.max_turn


def test_large_steps_are_not_rare_among_our_samples():
    chain = arm_chain("left")
    ours, papers = (
        np.linalg.norm(samples.delta[:, :3], axis=1)
        for samples in (
            draw_samples(chain, 4000, np.random.default_rng(7), SampleSettings(straight_share=0.0)),
            draw_paper_samples(chain, 4000, np.random.default_rng(7)),
        )
    )
    assert np.mean(ours > 0.25) > 1.5 * np.mean(papers > 0.25)


def test_our_range_of_joints_holds_the_papers_and_stays_inside_the_makers_urdf():
    ours, papers = SampleSettings(), SampleSettings.paper()
    assert np.all(np.array(ours.lower) <= papers.lower) and np.all(np.array(ours.upper) >= papers.upper)
    urdf = np.array([1.5708, 1.5708, 1.5708, 1.2566, 2.8274, 1.4137, 1.4137])
    assert np.all(np.array(ours.lower) >= -urdf) and np.all(np.array(ours.upper) <= urdf)
