"""Steps of the damped Jacobian: against numpy's own pseudo-inverse, beside the joint limits, and many at once."""

import numpy as np
import pytest

from dr_eureka.kinematics.arms import arm_chain
from dr_eureka.kinematics.hybrid_settings import HybridSettings
from dr_eureka.kinematics.jacobian_step import JacobianStep, damped_steps

CHAIN = arm_chain("left")
NO_PULL = np.zeros(7)


def postures(count, seed=0):
    return np.random.default_rng(seed).uniform(0.7 * CHAIN.lower, 0.7 * CHAIN.upper, (count, 7))


@pytest.mark.parametrize("damping", [0.0, 0.05])
def test_many_steps_at_once_are_those_of_numpys_least_squares_one_by_one(damping):
    jacobians = CHAIN.jacobian(postures(50))
    twists = np.random.default_rng(1).normal(0.0, 0.1, (50, 6))
    steps = damped_steps(jacobians, twists, damping**2)
    for jacobian, twist, step in zip(jacobians, twists, steps):
        # J^T (J J^T + d^2 I)^-1 t is the least-norm solution of [J, d I] [q, r] = t.
        wide = np.hstack([jacobian, damping * np.eye(6)])
        np.testing.assert_allclose(step, np.linalg.lstsq(wide, twist, rcond=None)[0][:7], rtol=1e-6, atol=1e-9)


def test_each_of_many_steps_may_have_its_own_damping():
    jacobians, twists, dampings = CHAIN.jacobian(postures(4)), np.full((4, 6), 0.05), np.array([0.0, 1e-4, 1e-2, 1.0])
    together = damped_steps(jacobians, twists, dampings)
    apart = [damped_steps(jacobians[n : n + 1], twists[n : n + 1], damping)[0] for n, damping in enumerate(dampings)]
    np.testing.assert_allclose(together, apart, rtol=1e-12)


def test_of_three_rows_only_the_place_is_kept():
    jacobians = CHAIN.jacobian(postures(5))[:, :3]
    steps = damped_steps(jacobians, np.full((5, 3), 0.01), 0.0)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", jacobians, steps), 0.01, atol=1e-12)


def test_a_joint_at_its_limit_stays_there_and_the_others_make_the_step():
    settings = HybridSettings(damping=0.0)
    step_of = JacobianStep(CHAIN, settings).step
    held = 0
    for joints in postures(40, seed=2):
        jacobian = CHAIN.jacobian(joints)
        shift, turn = np.random.default_rng(3).normal(0.0, 0.004, (2, 3))
        free = step_of(joints, jacobian, shift, turn, NO_PULL, limited=False)
        joint = int(np.argmax(np.abs(free)))
        joints[joint] = CHAIN.upper[joint] if free[joint] > 0.0 else CHAIN.lower[joint]
        # The same Jacobian: what is asked is what the step makes of it, not whether it is the arm's there.
        step = step_of(joints, jacobian, shift, turn, NO_PULL)
        assert CHAIN.within_limits(joints + step, 1e-12)
        if np.abs(step).max() < settings.jacobian_joint_step:
            held += 1
            assert step[joint] == 0.0
            np.testing.assert_allclose(jacobian @ step, np.concatenate([shift, turn]), atol=1e-5)
    assert held > 20


def test_a_long_step_is_shortened_to_its_largest_length_turn_and_joint_angle():
    settings = HybridSettings(damping=0.0)
    step_of = JacobianStep(CHAIN, settings).step
    for joints in postures(20, seed=4):
        jacobian = CHAIN.jacobian(joints)
        step = step_of(joints, jacobian, np.array([0.4, 0.0, 0.0]), np.array([0.0, 0.0, 2.0]), NO_PULL, limited=False)
        moved = jacobian @ step
        assert np.linalg.norm(moved[:3]) <= settings.jacobian_step + 1e-5
        assert np.linalg.norm(moved[3:]) <= settings.jacobian_rotation + 1e-5
        assert np.abs(step).max() <= settings.jacobian_joint_step + 1e-12
