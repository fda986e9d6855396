"""Trajectories: ends, smoothness and limits, against finite differences."""

import numpy as np
import pytest

from dr_eureka.control.trajectory import JointTrajectory, MotionLimits, SampledTrajectory, minimum_jerk

LIMITS = MotionLimits(speed=1.5, acceleration=5.0)


def test_minimum_jerk_starts_and_ends_at_rest_and_is_symmetric():
    s = np.linspace(0.0, 1.0, 1001)
    x = minimum_jerk(s)
    speed = np.gradient(x, s)
    assert x[0] == 0.0 and x[-1] == 1.0
    assert abs(speed[0]) < 1e-4 and abs(speed[-1]) < 1e-4
    assert speed.max() == pytest.approx(1.875, abs=1e-4)
    assert np.allclose(x + x[::-1], 1.0)


def test_a_move_within_limits_keeps_them_and_is_not_slower_than_needed():
    trajectory = JointTrajectory.within(np.array([[0.0, 0.2], [1.2, -0.4]]), LIMITS)
    times = np.linspace(0.0, trajectory.duration, 4001)
    positions = np.array([trajectory.at(t) for t in times])
    speed = np.gradient(positions, times, axis=0)
    acceleration = np.gradient(speed, times, axis=0)
    assert np.abs(speed).max() <= LIMITS.speed * 1.001
    assert np.abs(acceleration).max() <= LIMITS.acceleration * 1.01
    assert max(np.abs(speed).max() / LIMITS.speed, np.abs(acceleration).max() / LIMITS.acceleration) > 0.98


def test_a_path_passes_its_way_points_and_keeps_the_limits():
    points = np.array([[0.0], [0.3], [0.35], [0.9]])
    trajectory = JointTrajectory.within(points, LIMITS)
    speed, acceleration = trajectory.peaks()
    assert speed <= LIMITS.speed * 1.02 and acceleration <= LIMITS.acceleration * 1.05
    dense = np.array([trajectory.at(t) for t in np.linspace(0.0, trajectory.duration, 5001)])
    for point in points:
        assert np.abs(dense - point).min() < 1e-3


def test_a_trajectory_holds_its_end_and_its_start():
    trajectory = JointTrajectory(np.array([[0.0], [1.0]]), 2.0)
    assert trajectory.at(-1.0) == 0.0
    assert trajectory.at(5.0) == 1.0


def test_a_sampled_trajectory_is_linear_between_samples():
    trajectory = SampledTrajectory(np.array([0.0, 1.0, 3.0]), np.array([[0.0], [2.0], [0.0]]))
    assert trajectory.at(0.5) == pytest.approx(1.0)
    assert trajectory.at(2.0) == pytest.approx(1.0)
    assert trajectory.at(9.0) == pytest.approx(0.0)


@pytest.mark.parametrize("points, duration", [([[0.0]], 1.0), ([[0.0], [np.nan]], 1.0), ([[0.0], [1.0]], 0.0)])
def test_a_trajectory_without_sense_is_refused(points, duration):
    with pytest.raises(ValueError):
        JointTrajectory(np.array(points), duration)
