"""Breaking motions off: from any point of any motion the joints brake on the motion's own path, from the next cycle on."""

import numpy as np
import pytest

from dr_eureka.control.motion import Brake, Follow
from dr_eureka.control.trajectory import JointTrajectory, MotionLimits, SampledTrajectory

CYCLE = 0.008
LIMITS = MotionLimits(speed=1.6, acceleration=6.0, jerk=60.0)
STOP = 30.0


def random_motion(rng: np.random.Generator) -> Follow:
    left = np.cumsum(rng.uniform(-0.4, 0.4, (rng.integers(2, 8), 2)), axis=0)
    right = np.cumsum(rng.uniform(-0.4, 0.4, (rng.integers(2, 8), 2)), axis=0)
    tracks = [(("a", "b"), JointTrajectory.within(left, LIMITS)), (("c", "d"), JointTrajectory.within(right, LIMITS))]
    return Follow(tuple(tracks))


@pytest.mark.parametrize("seed", range(25))
def test_a_brake_slows_at_once_stays_on_the_path_and_keeps_the_limits(seed):
    rng = np.random.default_rng(seed)
    motion = random_motion(rng)
    elapsed = rng.uniform(0.0, motion.duration)
    brake = Brake(motion, elapsed, STOP)
    before = [motion.sampled(elapsed + offset) for offset in (-CYCLE, 0.0)]
    times = np.arange(1, 20) * CYCLE
    goals = np.array([[row[name] for name in "abcd"] for row in (*before, *map(brake.goals, times))], dtype=float)

    steps = np.diff(goals, axis=0)
    unbraked = np.array([motion.sampled(elapsed + CYCLE)[name] - before[1][name] for name in "abcd"])
    fastest = np.abs(unbraked).max()
    if fastest > 1e-4:
        assert np.abs(steps[1]).max() < fastest
    assert brake.duration <= LIMITS.speed / STOP
    at_rest = 1 + int(np.ceil(brake.duration / CYCLE))
    assert (steps[at_rest:] == 0.0).all() and brake.over(brake.duration, {})
    assert np.abs(np.diff(steps, axis=0)).max() / CYCLE**2 <= 1.01 * (STOP + LIMITS.acceleration)
    path = motion.sampled(elapsed + np.linspace(0.0, brake.duration, 2001))
    path = np.stack([path[name] for name in "abcd"], axis=1)
    for goal in goals[2:]:
        assert np.abs(path - goal).max(axis=1).min() < 1e-4


def test_a_motion_that_stands_still_needs_no_braking():
    still = Follow(((("a",), JointTrajectory.lasting(np.array([[0.4], [0.4]]), 1.0)),))
    brake = Brake(still, 0.5, STOP)
    assert brake.over(0.0, {}) and brake.goals(0.0) == {"a": pytest.approx(0.4)}


def test_a_motion_is_sampled_as_it_is_followed():
    profile = SampledTrajectory(np.array([0.0, 0.2]), np.array([[0.0], [1.0]]))
    motion = Follow(((("a",), profile), (("b", "c"), JointTrajectory.lasting(np.array([[0.0, 1.0], [1.0, 0.0]]), 0.5))))
    times = np.linspace(0.0, 0.6, 7)
    sampled = motion.sampled(times)
    assert motion.duration == 0.5
    for index, time in enumerate(times):
        assert motion.goals(time) == {name: pytest.approx(values[index]) for name, values in sampled.items()}
