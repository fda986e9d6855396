"""The hybrid inverse kinematics: tube poses, straight paths, refused network steps, and named ends for what cannot be."""
import numpy as np
import pytest

from dr_eureka.kinematics.arms import SIDES, arm_chain, mirror
from dr_eureka.kinematics.hybrid import HybridSettings, HybridSolver, IkCode
from dr_eureka.kinematics.network import ArmNetwork
from dr_eureka.kinematics.transforms import rotation_about, rotation_vector, transform
from dr_eureka.resources import load_yaml
from dr_eureka.settings import build

HOME = np.array([0.569, 1.032, -0.115, 0.495, 1.041, -0.157, 0.085])  # left arm [rad]
PICK = np.array([-0.413, 1.032, 0.747, 0.424, 0.982, -0.351, -0.326])  # left arm [rad]


@pytest.fixture(scope="module")
def network():
    return ArmNetwork.load()


def of_side(joints, side):
    return joints if side == "left" else mirror(joints)


def tube_poses(side, count, seed):
    """Return end-link poses for a level grip of the tubes a hand takes, as placed in games, at the grip and above it."""
    rng = np.random.default_rng(seed)
    sign = 1.0 if side == "left" else -1.0
    poses = []
    for _ in range(count):
        x, y = 0.44 + rng.uniform(-0.02, 0.02), sign * rng.choice([0.0, 0.11]) + rng.uniform(-0.02, 0.02)
        grasp = [x, y, rng.uniform(0.81, 1.0)]
        yawed = transform(rotation_about([0, 0, 1], sign * np.radians(-30)), grasp)
        poses.append(yawed @ transform(translation=[-0.019, 0.0, 0.0]))
    return poses


def errors(chain, joints, target):
    pose = chain.forward(joints)
    return np.linalg.norm(pose[:3, 3] - target[:3, 3]), np.linalg.norm(rotation_vector(target[:3, :3] @ pose[:3, :3].T))


class FixedStep:
    """A network that always answers with the same joint step."""

    def __init__(self, step):
        self._step = np.asarray(step, dtype=float)

    def step(self, joints, delta, side):
        return self._step


@pytest.mark.parametrize("with_network", [True, False])
@pytest.mark.parametrize("side", SIDES)
def test_every_tube_is_reached_from_home_inside_the_limits(side, with_network, network):
    chain = arm_chain(side)
    solver = HybridSolver(chain, network if with_network else None)
    for target in tube_poses(side, 60, seed=1):
        result = solver.solve(of_side(HOME, side), target)
        assert result.code == IkCode.CONVERGED and result.restarts == 0
        shift, turn = errors(chain, result.joints, target)
        assert shift <= 2e-4 and turn <= 2e-3
        assert (result.position_error_m, result.orientation_error_rad) == pytest.approx((shift, turn), abs=1e-9)
        assert all(chain.within_limits(joints, 1e-12) for joints in result.path)
        np.testing.assert_array_equal(result.path[0], of_side(HOME, side))
        np.testing.assert_array_equal(result.path[-1], result.joints)
        assert np.abs(np.diff(result.path, axis=0)).max() <= 1.0 + 1e-9
        assert result.cycles == len(result.path) - 1 and (result.network_cycles > 0) == with_network


def test_the_arms_answer_in_the_mirror(network):
    left, right = (HybridSolver(arm_chain(side), network) for side in SIDES)
    for target in tube_poses("left", 10, seed=2):
        reflect = np.diag([1.0, -1.0, 1.0, 1.0])
        expected = left.solve(HOME, target)
        result = right.solve(mirror(HOME), reflect @ target @ reflect)
        np.testing.assert_allclose(mirror(result.joints), expected.joints, atol=1e-4)


def test_random_starts_reach_too(network):
    chain = arm_chain("left")
    solver, rng = HybridSolver(chain, network), np.random.default_rng(3)
    results = [solver.solve(rng.uniform(chain.lower, chain.upper), target) for target in tube_poses("left", 60, seed=3)]
    assert [result.code for result in results] == [IkCode.CONVERGED] * 60


def test_the_network_saves_cycles_in_the_papers_settings(network):
    targets = tube_poses("left", 30, seed=4)
    hybrid, jacobian = (
        [HybridSolver(arm_chain("left"), learned, HybridSettings.paper()).solve(HOME, target) for target in targets]
        for learned in (network, None)
    )
    assert {result.code for result in hybrid + jacobian} == {IkCode.CONVERGED}
    assert sum(result.cycles for result in hybrid) < 0.5 * sum(result.cycles for result in jacobian)


@pytest.mark.parametrize(
    "step",
    [[1.1, 0, 0, 0, 0, 0, 0], [0, 0.6, 0, 0, 0, 0, 0], [0.3, 0, 0.3, 0, 0, 0, 0], [np.nan] * 7],
    ids=["jump", "limit", "away", "nan"],
)
def test_a_network_step_that_cannot_be_trusted_is_refused_and_the_jacobian_takes_over(step):
    target = tube_poses("left", 1, seed=5)[0]
    result = HybridSolver(arm_chain("left"), FixedStep(step)).solve(HOME, target)
    assert result.code == IkCode.CONVERGED and result.network_cycles == 0


@pytest.mark.parametrize("side", SIDES)
def test_a_straight_lift_is_continuous_and_comes_back_to_where_it_began(side, network):
    chain = arm_chain(side)
    solver = HybridSolver(chain, network)
    foot = solver.solve(of_side(HOME, side), tube_poses(side, 1, seed=6)[0], rest=of_side(PICK, side)).joints
    start = chain.forward(foot)
    heights = np.concatenate([np.linspace(0.0, 0.15, 16), np.linspace(0.15, 0.0, 16)])
    targets = [transform(start[:3, :3], start[:3, 3] + [0, 0, height]) for height in heights]
    results = solver.solve_path(foot, targets)
    assert [result.code for result in results] == [IkCode.CONVERGED] * len(targets)
    path = np.array([foot] + [result.joints for result in results])
    assert np.abs(np.diff(path, axis=0)).max() < np.radians(6)
    np.testing.assert_allclose(path[-1], foot, atol=0.01)
    for joints, target in zip(path[1:], targets):
        assert errors(chain, joints, target)[0] <= 2e-4


def test_a_path_ends_at_the_first_pose_that_fails(network):
    chain = arm_chain("left")
    start = chain.forward(HOME)
    targets = [transform(start[:3, :3], start[:3, 3] + [0.1 * number, 0, 0]) for number in range(8)]
    results = HybridSolver(chain, network).solve_path(HOME, targets)
    assert len(results) < 8 and results[-1].code != IkCode.CONVERGED
    assert all(result.code == IkCode.CONVERGED for result in results[:-1])


def test_spare_freedom_goes_to_the_rest_posture_wherever_the_arm_starts(network):
    chain = arm_chain("left")
    solver, rng = HybridSolver(chain, network), np.random.default_rng(7)
    target = chain.forward(PICK)
    for _ in range(10):
        result = solver.solve(chain.clip(PICK + rng.uniform(-0.4, 0.4, 7)), target, rest=PICK)
        np.testing.assert_allclose(result.joints, PICK, atol=0.05)


def pose_with(place, value):
    pose = np.eye(4)
    pose[place] = value
    return pose


NO_POSES = {
    "nan": np.full((4, 4), np.nan),
    "infinite": np.diag([1, 1, 1, np.inf]),
    "small": np.eye(3),
    "mirror": pose_with((0, 0), -1.0),
    "scaled": np.diag([2.0, 2.0, 2.0, 1.0]),
    "huge": np.diag([1e200, 1e200, 1e200, 1.0]),
    "last row": pose_with((3, 1), 0.5),
    "word": "left",
    "ragged": [[1, 2], [3]],
}


@pytest.mark.parametrize("target", NO_POSES.values(), ids=NO_POSES)
def test_a_target_that_is_no_pose_is_named_invalid(target, network):
    result = HybridSolver(arm_chain("left"), network).solve(HOME, target)
    assert result.code == IkCode.INVALID_TARGET and result.cycles == 0 and result.reason
    np.testing.assert_array_equal(result.joints, HOME)


def test_a_start_that_is_not_finite_or_far_outside_the_limits_is_named(network):
    chain = arm_chain("left")
    solver, target = HybridSolver(chain, network), tube_poses("left", 1, seed=8)[0]
    assert solver.solve(np.full(7, np.nan), target).code == IkCode.INVALID_TARGET
    assert solver.solve(HOME[:6], target).code == IkCode.INVALID_TARGET
    outside = solver.solve(HOME + [0, 0, 0, 2.0, 0, 0, 0], target)
    assert outside.code == IkCode.OUT_OF_LIMITS and "l_arm_el_y" in outside.reason
    slightly_outside = np.where(np.arange(7) == 1, chain.upper + 0.01, HOME)
    assert solver.solve(slightly_outside, target).code == IkCode.CONVERGED


def test_what_is_too_far_away_is_unreachable_at_once(network):
    result = HybridSolver(arm_chain("left"), network).solve(HOME, transform(translation=[1.5, 0.2, 1.0]))
    assert result.code == IkCode.UNREACHABLE and result.cycles == 0
    # from the shoulder at (0, 0.152, 1.0535)
    assert result.position_error_m == pytest.approx(np.linalg.norm([1.5, 0.048, -0.0535]) - 0.70, abs=1e-3)


def test_no_pose_of_the_arm_is_beyond_the_reach_setting():
    for side in SIDES:
        chain = arm_chain(side)
        joints = np.random.default_rng(9).uniform(chain.lower, chain.upper, (200_000, 7))
        distances = np.linalg.norm(chain.forward(joints)[:, :3, 3] - chain.first_joint_origin, axis=1)
        assert 0.6 < distances.max() < HybridSettings().reach


def test_a_pose_that_only_broken_limits_would_reach_is_out_of_limits(network):
    chain = arm_chain("left")
    beyond = np.where(np.arange(7) == 6, chain.upper + 0.5, HOME)
    result = HybridSolver(chain, network, HybridSettings(restarts=0)).solve(HOME, chain.forward(beyond), rest=HOME)
    assert result.code == IkCode.OUT_OF_LIMITS and "l_arm_wr_p" in result.reason
    assert chain.within_limits(result.joints, 1e-12)


def test_too_few_cycles_end_with_the_last_error(network):
    target = tube_poses("left", 1, seed=10)[0]
    result = HybridSolver(arm_chain("left"), network, HybridSettings(max_cycles=2, restarts=0)).solve(HOME, target)
    assert result.code == IkCode.NO_CONVERGENCE and result.cycles == 2
    assert result.position_error_m == pytest.approx(errors(arm_chain("left"), result.joints, target)[0], abs=1e-12)


def test_when_time_runs_out_the_answer_is_what_was_reached_by_then(network):
    chain, target = arm_chain("left"), tube_poses("left", 1, seed=10)[0]
    result = HybridSolver(chain, network, HybridSettings(max_seconds=1e-9, restarts=1000)).solve(HOME, target)
    assert result.code == IkCode.NO_CONVERGENCE and result.cycles <= 2 and result.restarts == 0
    assert result.position_error_m == pytest.approx(errors(chain, result.joints, target)[0], abs=1e-12)


def test_random_targets_always_end_with_a_code_and_never_break_a_limit(network):
    rng = np.random.default_rng(11)
    for side in SIDES:
        chain = arm_chain(side)
        solver = HybridSolver(chain, network, HybridSettings(restarts=1))
        for _ in range(40):
            start = np.where(rng.random(7) < 0.5, chain.lower, chain.upper)
            turn = rotation_about(rng.normal(size=3), rng.uniform(0, np.pi))
            result = solver.solve(start, transform(turn, chain.first_joint_origin + rng.normal(size=3) * 0.35))
            assert result.code in (IkCode.CONVERGED, IkCode.NO_CONVERGENCE, IkCode.OUT_OF_LIMITS, IkCode.UNREACHABLE)
            assert all(chain.within_limits(joints, 1e-12) for joints in result.path)
            reached = result.position_error_m <= 2e-4 and result.orientation_error_rad <= 2e-3
            assert (result.code == IkCode.CONVERGED) == reached


def test_the_shipped_yaml_is_complete_and_holds_the_defaults():
    shipped = load_yaml("config/control_engine.yaml")["kinematics"]
    assert build(HybridSettings, shipped) == HybridSettings()
    paper = HybridSettings.paper()
    assert (paper.network_distance, paper.network_step, paper.jacobian_step) == (0.12, 0.10, 0.005)
