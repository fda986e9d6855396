"""The benchmark `kinematics`: its rows against figures worked out by hand, its poses, and each solver for real."""

from itertools import product

import numpy as np
import pytest

from dr_eureka.bench import kinematics_chain, kinematics_robustness, kinematics_steps
from dr_eureka.bench.kinematics_chain import chain_rows, finite_differences
from dr_eureka.bench.kinematics_engines import BulletArm, KdlArm
from dr_eureka.bench.kinematics_plots import plot_samples, plot_solving, plot_steps
from dr_eureka.bench.kinematics_poses import least_singular_values, singular_postures, tube_poses, witnesses
from dr_eureka.bench.kinematics_robustness import Question, is_right, robustness_rows
from dr_eureka.bench.kinematics_solvers import HYBRID, JACOBIAN, METHODS, PAPER_HYBRID, PAPER_JACOBIAN, solvers
from dr_eureka.bench.kinematics_solving import STARTS, Trials, commanded_seconds, measure_solving, solving_rows
from dr_eureka.bench.kinematics_steps import STEP_SIZES, TESTS, measure_steps, sample_rows, step_rows
from dr_eureka.bench.report import BenchOptions
from dr_eureka.kinematics.arms import SIDES, arm_chain
from dr_eureka.kinematics.hybrid import HybridSettings, HybridSolver, IkCode, IkResult
from dr_eureka.kinematics.samples import pose_errors


def by_name(rows):
    return {row.name: row for row in rows}


def trials(solved, cycles=5.0, commanded=0.5):
    """Return four trials, so many of them solved; the others miss by a centimetre."""
    shift = np.where(np.arange(4) < solved, 1e-4, 0.01)
    seconds, figures = np.array([0.001, 0.002, 0.003, 0.004]), (np.full(4, figure) for figure in (cycles, commanded, 1.0))
    return Trials(seconds, shift, np.zeros(4), np.ones(4), *figures)


def test_every_row_on_the_chain_meets_its_goal(monkeypatch):
    monkeypatch.setattr(kinematics_chain, "_POSTURES", 20)
    monkeypatch.setattr(kinematics_chain, "_BATCH", 500)
    rows = chain_rows(np.random.default_rng(1))
    assert [row.name for row in rows if row.short] == []
    assert sum(row.ok is True for row in rows) == 7


def test_finite_differences_of_a_circle_are_its_tangent():
    class Circle:
        def __len__(self):
            return 1

        def forward(self, joints):
            poses = np.tile(np.eye(4), (len(joints), 1, 1))
            cosines, sines = np.cos(joints[:, 0]), np.sin(joints[:, 0])
            poses[:, :2, :2] = np.array([[cosines, -sines], [sines, cosines]]).transpose(2, 0, 1)
            poses[:, 0, 3], poses[:, 1, 3] = 2.0 * cosines, 2.0 * sines
            return poses

    found = finite_differences(Circle(), np.array([[0.3]]))[0, :, 0]
    np.testing.assert_allclose(found, [-2.0 * np.sin(0.3), 2.0 * np.cos(0.3), 0, 0, 0, 1], atol=1e-9)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("engine", [BulletArm, KdlArm])
def test_the_other_libraries_solve_for_the_same_arm(side, engine):
    chain, arm = arm_chain(side), engine(side)
    rng = np.random.default_rng(2)
    middle = 0.5 * (chain.lower + chain.upper)
    for joints in middle + rng.uniform(-0.2, 0.2, (5, 7)):
        np.testing.assert_allclose(arm.forward(joints), chain.forward(joints), atol=1e-6)
        error = pose_errors(chain.forward(arm.solve(middle, chain.forward(joints)))[None], chain.forward(joints)[None])[0]
        assert np.abs(error).max() < 1e-3


def test_tube_poses_are_level_and_have_a_witness_inside_the_limits():
    for side in SIDES:
        chain, rng = arm_chain(side), np.random.default_rng(3)
        poses, share = tube_poses(side, 40, rng)
        assert poses.shape == (40, 4, 4) and 0.5 < share <= 1.0
        np.testing.assert_allclose(poses[:, 2, 2], 1.0)
        joints = witnesses(chain, poses, rng)
        found = np.isfinite(joints).all(axis=1)
        assert found.mean() > 0.8  # it starts anywhere, and finds another one or none
        assert np.all((joints[found] >= chain.lower) & (joints[found] <= chain.upper))
        assert np.abs(pose_errors(chain.forward(joints[found]), poses[found])).max() < 1e-4
        solver = HybridSolver(chain, None)
        assert all(solver.solve(0.5 * (chain.lower + chain.upper), pose).code == IkCode.CONVERGED for pose in poses)


def test_what_is_out_of_reach_has_no_witness():
    pose = np.eye(4)
    pose[0, 3] = 2.0
    assert np.isnan(witnesses(arm_chain("left"), pose[None], np.random.default_rng(4))).all()


def test_singular_postures_are_inside_the_limits_and_far_more_singular_than_any():
    chain, rng = arm_chain("left"), np.random.default_rng(5)
    postures = singular_postures(chain, 20, rng)
    assert np.all((postures >= chain.lower) & (postures <= chain.upper))
    usual = least_singular_values(chain, rng.uniform(chain.lower, chain.upper, (200, 7)))
    assert np.median(least_singular_values(chain, postures)) < 0.3 * np.median(usual)


def test_each_step_of_a_path_takes_its_time_but_at_least_a_cycle():
    path = np.zeros((4, 7))
    path[1:, 2] = 0.4
    path[3, 5] = -0.8
    assert commanded_seconds(path, 1.6) == pytest.approx(0.25 + 0.008 + 0.5)


def test_solving_rows_judge_the_hybrid_against_the_jacobian():
    measured = {(method, start): trials(4) for method in METHODS for start in STARTS}
    measured[JACOBIAN, STARTS[0]] = trials(4, cycles=7.0, commanded=0.4)
    measured[HYBRID, STARTS[1]] = trials(3)
    rows = by_name(solving_rows(measured, 0.9))
    first, second = (f"from {start}, {HYBRID}" for start in STARTS)
    assert rows[f"{first}: within 1 mm, 1 degree and the limits"].ok
    assert rows[f"{first}: cycles"].ok and not rows[f"{first}: commanded time"].ok
    solved = rows[f"{second}: within 1 mm, 1 degree and the limits"]
    assert (solved.value, solved.n, solved.ok) == (0.75, 4, False)
    assert rows[f"{second}: position error, largest"].value == pytest.approx(10.0)
    assert rows[f"{first}: time"].value == pytest.approx(2.5)
    assert rows[f"from {STARTS[0]}, {PAPER_HYBRID}: cycles"].ok is None


def test_an_answer_outside_the_limits_is_not_solved():
    answers = trials(4)
    answers.inside[1] = 0.0
    assert answers.solved.tolist() == [True, False, True, True]


def test_every_solver_answers_and_ours_reach_their_targets(tmp_path):
    measured, reachable = measure_solving(BenchOptions(seed=1, trials=3, processes=1))
    assert set(measured) == {(method, start) for method in METHODS for start in STARTS} and 0.5 < reachable <= 1.0
    for start in STARTS:
        assert measured[HYBRID, start].solved.all() and measured[JACOBIAN, start].solved.all()
        assert np.isfinite(measured[PAPER_JACOBIAN, start].cycles).all()
    plot_solving(measured, tmp_path / "solving.png")
    assert (tmp_path / "solving.png").stat().st_size > 10_000


def test_the_network_alone_comes_near_and_stays_inside_the_limits():
    chain, settings = arm_chain("right"), HybridSettings()
    poses, _ = tube_poses("right", 3, np.random.default_rng(6))
    for pose in poses:
        answer = solvers("right", settings)["network only"](0.5 * (chain.lower + chain.upper), pose)
        assert np.linalg.norm(pose_errors(chain.forward(answer.joints)[None], pose[None])[0, :3]) < 0.03
        assert all(chain.within_limits(joints) for joints in answer.path)


def test_steps_are_measured_and_judged_by_size_and_test(tmp_path):
    methods = ("network", "pseudo_inverse", "damped")
    table = {key: np.full(3, 0.004) for key in product(TESTS, STEP_SIZES, methods)}
    table["joint_change", 0.30, "network"] = np.full(3, 0.006)
    table["straight", 0.05, "pseudo_inverse"] = np.full(3, 0.005)
    rows = by_name(step_rows(table))
    assert rows["random joint change of 0.5 cm, network: misses by"].ok
    assert rows["random joint change of 0.5 cm, network: misses by"].paper == 1.82
    assert not rows["random joint change of 30 cm, network: misses by"].ok
    assert rows["straight step of 5 cm, network: misses by"].ok
    assert not rows["straight step of 10 cm, network: misses by"].ok
    assert rows["straight step of 2 cm, network: misses by"].ok is None
    assert rows["straight step of 2 cm, damped: misses by"].value == pytest.approx(0.4)
    plot_steps(table, tmp_path / "steps.png")
    assert (tmp_path / "steps.png").stat().st_size > 10_000


def test_single_steps_come_out_the_same_each_time(monkeypatch):
    monkeypatch.setattr(kinematics_steps, "STEP_SIZES", (0.05,))
    first, again = (measure_steps(seed=1, trials=20) for _ in range(2))
    assert set(first) == {(test, 0.05, method) for test in TESTS for method in ("network", "pseudo_inverse", "damped")}
    for key, errors in first.items():
        np.testing.assert_array_equal(errors, again[key])


def test_both_recipes_of_samples_are_timed_and_drawn(monkeypatch, tmp_path):
    monkeypatch.setattr(kinematics_steps, "_TIMED_SAMPLES", 500)
    rows, samples = sample_rows(np.random.default_rng(1))
    assert len(rows) == 4 and all(row.value > 0.0 for row in rows)
    assert [len(drawn) for drawn in samples.values()] == [500, 500]
    plot_samples(samples, tmp_path / "samples.png")
    assert (tmp_path / "samples.png").stat().st_size > 10_000


def test_hard_questions_get_right_codes_and_break_no_limit():
    rows = by_name(robustness_rows(seed=1, tries=24, settings=HybridSettings()))
    assert [row.name for row in rows.values() if row.short] == []
    assert rows["target beyond reach: right code"].n == 4
    assert rows["tube pose, from a corner of the limits: solved"].value == 1.0


@pytest.mark.parametrize("code, near, right", [
    (IkCode.CONVERGED, True, True), (IkCode.CONVERGED, False, False), (IkCode.NO_CONVERGENCE, False, True),
    (IkCode.NO_CONVERGENCE, True, False), (IkCode.UNREACHABLE, True, False),
])
def test_a_code_is_right_if_it_may_be_and_the_joints_bear_it_out(code, near, right):
    chain, joints = arm_chain("left"), np.zeros(7)
    target = chain.forward(joints)
    target[0, 3] += 0.0 if near else 0.01
    question = Question(joints, target, (IkCode.CONVERGED, IkCode.NO_CONVERGENCE))
    result = IkResult(code, joints, 0.0, 0.0, path=[joints])
    assert is_right(chain, question, result, HybridSettings()) == right
    assert kinematics_robustness.TRIES == 10_000
