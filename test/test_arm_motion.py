"""Moving to a goal that changes: limits by finite differences, arrival, and slowing down to a share of the speed."""

import numpy as np
import pytest

from dr_eureka.catching.arm_motion import ArmMotion

SPEED, ACCELERATION, JERK, CYCLE_S = np.full(5, 4.0), 80.0, 4000.0, 0.008


@pytest.fixture
def motion():
    arm = ArmMotion(SPEED, ACCELERATION, JERK)
    arm.start(np.zeros(5))
    return arm


def test_limits_hold_while_the_goal_jumps_about(motion):
    rng, goal, places = np.random.default_rng(0), np.zeros(5), [np.zeros(5)]
    for cycle in range(600):
        if cycle % 7 == 0:
            goal = rng.uniform(-1.0, 1.0, 5)
        places.append(motion.step(goal, CYCLE_S, share=0.3 if cycle > 400 else 1.0))
    speeds = np.diff(places, axis=0) / CYCLE_S
    accelerations = np.diff(speeds, axis=0) / CYCLE_S
    assert 3.0 < np.abs(speeds).max() < SPEED[0] + 1e-3
    assert np.abs(speeds[430:]).max() < 0.3 * SPEED[0] + 1e-3
    assert np.abs(accelerations).max() < 1.01 * ACCELERATION
    assert np.abs(np.diff(accelerations, axis=0)).max() / CYCLE_S < 1.01 * JERK


def test_each_joint_comes_to_rest_at_the_goal_as_soon_as_it_can(motion):
    goal = np.array([0.5, -0.2, 0.1, 0.0, 0.4])
    places = np.array([motion.step(goal, CYCLE_S) for _ in range(60)])
    np.testing.assert_allclose(places[-1], goal, atol=1e-9)
    # At full speed but for the ends: distance / speed + speed / acceleration + acceleration / jerk, in cycles.
    expected = (0.5 / 4.0 + 4.0 / 80.0 + 80.0 / 4000.0) / CYCLE_S
    assert np.flatnonzero(np.abs(places[:, 0] - 0.5) > 1e-6).max() == pytest.approx(expected, abs=2)


def test_a_goal_that_is_none_changes_nothing_and_no_time_moves_nothing(motion):
    other = ArmMotion(SPEED, ACCELERATION, JERK)
    other.start(np.zeros(5))
    goal = np.full(5, 0.3)
    there = [arm.step(goal, CYCLE_S) for arm in (motion, other)]
    np.testing.assert_array_equal(motion.step(goal, 0.0), there[0])
    np.testing.assert_array_equal(motion.step(np.full(5, np.nan), CYCLE_S), other.step(goal, CYCLE_S))
