"""Trajectories: ends, smoothness and limits, against finite differences."""

import numpy as np
import pytest

from dr_eureka.control.trajectory import (
    JointTrajectory, MinimumJerk, MotionLimits, Quickest, SampledTrajectory, TrajectorySequence,
)

LIMITS = MotionLimits(speed=1.5, acceleration=5.0, jerk=50.0)


def peaks(trajectory, step=1e-4):
    """Return the largest speed, acceleration and jerk of any joint by differences, ends included."""
    times = np.arange(-10 * step, trajectory.duration + 10 * step, step)
    positions = trajectory.at(times)
    return [np.abs(np.diff(positions, n, axis=0)).max() / step**n for n in (1, 2, 3)]


def test_minimum_jerk_starts_and_ends_at_rest_and_is_symmetric():
    s = np.linspace(0.0, 1.0, 1001)
    x = MinimumJerk(1.0).at(s)
    speed = np.gradient(x, s)
    assert x[0] == 0.0 and x[-1] == 1.0
    assert abs(speed[0]) < 1e-4 and abs(speed[-1]) < 1e-4
    assert speed.max() == pytest.approx(1.875, abs=1e-4)
    assert np.allclose(x + x[::-1], 1.0)


def test_the_quickest_profile_takes_as_long_as_theory_says():
    # Jerk, acceleration and speed all reach their limits: path / speed + speed / acceleration + acceleration / jerk.
    assert Quickest(0.8, 2.0, 20.0).duration == pytest.approx(1.0 / 0.8 + 0.8 / 2.0 + 2.0 / 20.0)
    assert Quickest(0.8, 2.0, 20.0, at_least=3.0).duration == pytest.approx(3.0)


def test_a_move_within_limits_keeps_them_and_is_not_slower_than_needed():
    trajectory = JointTrajectory.within(np.array([[0.0, 0.2], [1.2, -0.4]]), LIMITS)
    speed, acceleration, _ = peaks(trajectory)
    _, _, jerk = peaks(trajectory, 1e-3)
    assert speed <= LIMITS.speed * 1.0001 and acceleration <= LIMITS.acceleration * 1.001 and jerk <= LIMITS.jerk * 1.001
    assert speed > 0.99 * LIMITS.speed and acceleration > 0.99 * LIMITS.acceleration
    np.testing.assert_allclose(trajectory.at([0.0, trajectory.duration]), [[0.0, 0.2], [1.2, -0.4]], atol=1e-9)


@pytest.mark.parametrize("seed", range(12))
def test_a_random_path_passes_its_way_points_and_keeps_the_limits(seed):
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.uniform(-0.3, 0.3, (rng.integers(3, 9), 7)), axis=0)
    trajectory = JointTrajectory.within(points, LIMITS)
    speed, acceleration, _ = peaks(trajectory)
    assert speed <= LIMITS.speed * 1.01 and acceleration <= LIMITS.acceleration * 1.02
    dense = trajectory.at(np.linspace(0.0, trajectory.duration, 20001))
    for point in points:
        assert np.abs(dense - point).max(axis=1).min() < 1e-3


def test_a_path_is_travelled_no_faster_than_asked():
    points = np.array([[0.0], [0.1], [0.2]])
    slow = JointTrajectory.within(points, LIMITS, share_speed=0.5)
    assert peaks(slow)[0] == pytest.approx(0.5 * 0.2, rel=0.01)


def test_a_trajectory_holds_its_end_and_its_start():
    trajectory = JointTrajectory.lasting(np.array([[0.0], [1.0]]), 2.0)
    assert trajectory.at(-1.0) == pytest.approx(0.0)
    assert trajectory.at(5.0) == pytest.approx(1.0)
    assert trajectory.duration == 2.0


def test_a_trajectory_that_goes_nowhere_stays_there():
    trajectory = JointTrajectory.within(np.array([[0.3, -0.2], [0.3, -0.2]]), LIMITS)
    np.testing.assert_allclose(trajectory.at(np.linspace(0.0, 1.0, 11)), [[0.3, -0.2]] * 11)


def test_a_sampled_trajectory_is_linear_between_samples():
    trajectory = SampledTrajectory(np.array([0.0, 1.0, 3.0]), np.array([[0.0], [2.0], [0.0]]))
    assert trajectory.at(0.5) == pytest.approx(1.0)
    np.testing.assert_allclose(trajectory.at([2.0, 9.0]), [[1.0], [0.0]])


def test_a_sequence_is_its_parts_one_after_the_other():
    first = JointTrajectory.lasting(np.array([[0.0, 1.0], [1.0, 2.0]]), 0.5)
    second = SampledTrajectory(np.array([0.0, 1.0]), np.array([[1.0, 2.0], [3.0, 0.0]]))
    sequence = TrajectorySequence([first, second])
    assert sequence.duration == pytest.approx(1.5)
    times = np.array([-1.0, 0.2, 0.5, 0.75, 1.5, 9.0])
    expected = [*first.at(times[:3]), *second.at(times[3:] - 0.5)]
    np.testing.assert_allclose(sequence.at(times), expected)
    np.testing.assert_allclose([sequence.at(time) for time in times], expected)


@pytest.mark.parametrize("points, duration", [([[0.0]], 1.0), ([[0.0], [np.nan]], 1.0), ([[0.0], [1.0]], 0.0)])
def test_a_trajectory_without_sense_is_refused(points, duration):
    with pytest.raises(ValueError):
        JointTrajectory.lasting(np.array(points), duration)
