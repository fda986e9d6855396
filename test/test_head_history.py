"""Where the head was when an image was taken."""

import numpy as np
import pytest

from dr_eureka.behaviour.head_history import HeadHistory


def ramp(rate=0.1, start_s=10.0, count=126, period_s=0.008):
    history = HeadHistory(("head_y", "head_p"))
    for index in range(count):
        time_s = start_s + index * period_s
        history.add(time_s, {"head_p": rate * (time_s - start_s), "head_y": 0.2, "torso_y": 9.0})
    return history


def test_positions_between_two_joint_states_are_interpolated():
    np.testing.assert_allclose(ramp().at(10.5031), [0.2, 0.1 * 0.5031], atol=1e-12)


@pytest.mark.parametrize("time_s", [9.999, 11.001])
def test_positions_outside_the_history_are_unknown(time_s):
    assert ramp().at(time_s) is None


def test_a_head_that_moves_is_not_still_and_one_at_rest_is():
    assert not ramp(rate=0.1).still(10.9, window_s=0.25, tolerance_rad=0.003)
    assert ramp(rate=0.0).still(10.9, window_s=0.25, tolerance_rad=0.003)


def test_a_history_shorter_than_the_window_cannot_tell_that_the_head_is_still():
    assert not ramp(rate=0.0).still(10.2, window_s=0.25, tolerance_rad=0.003)


def test_a_joint_state_that_lacks_a_joint_or_is_not_finite_is_left_out():
    history = ramp()
    newest = history.newest()
    history.add(12.0, {"head_p": 0.0})
    history.add(12.0, {"head_p": float("nan"), "head_y": 0.0})
    assert history.newest() == newest and history.newest_s == pytest.approx(11.0)


def test_time_that_jumps_back_forgets_what_was_before():
    history = ramp()
    history.add(3.0, {"head_y": 0.0, "head_p": 0.4})
    assert history.at(10.5) is None
    np.testing.assert_array_equal(history.at(3.0), [0.0, 0.4])


def test_only_the_last_seconds_are_kept():
    history = ramp(count=1000)
    assert history.at(10.0) is None
    assert history.at(17.9) is not None
