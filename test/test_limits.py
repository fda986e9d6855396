"""The last step of the write path: no command leaves range or speed, none is NaN."""

import math

import numpy as np
import pytest
from test_engine import IdealRobot, make_engine

from dr_eureka.control.codes import ControlError, EngineCode
from dr_eureka.control.limits import CommandLimiter, JointLimit, joint_ranges
from dr_eureka.control.port import CONTROLLED_JOINTS


def limiter() -> CommandLimiter:
    made = CommandLimiter({"a": JointLimit(-1.0, 1.0, 3.4), "b": JointLimit(0.0, 0.5, 3.4)}, longest_step=0.016)
    made.reset(0.0, {"a": 0.0, "b": 0.2})
    return made


def test_a_far_goal_is_approached_at_the_joint_speed():
    assert limiter().apply(0.008, {"a": 1.0})["a"] == pytest.approx(3.4 * 0.008)


def test_random_goals_never_break_range_or_speed():
    rng = np.random.default_rng(0)
    made, last = limiter(), {"a": 0.0, "b": 0.2}
    for cycle in range(1, 500):
        out = made.apply(0.008 * cycle, {"a": rng.normal(0, 3), "b": rng.normal(0, 3)})
        assert -1.0 <= out["a"] <= 1.0 and 0.0 <= out["b"] <= 0.5
        assert all(abs(out[name] - last[name]) <= 3.4 * 0.008 + 1e-12 for name in out)
        last = out


def test_a_gap_in_the_cycles_allows_no_jump():
    assert limiter().apply(5.0, {"a": 1.0})["a"] == pytest.approx(3.4 * 0.016)


@pytest.mark.parametrize("goal", [math.nan, math.inf, -math.inf])
def test_a_goal_that_is_not_finite_is_refused_and_nothing_is_written(goal):
    made = limiter()
    with pytest.raises(ControlError) as caught:
        made.apply(0.008, {"a": goal})
    assert caught.value.code == EngineCode.INVALID_VALUE
    assert made.apply(0.016, {"a": 0.0})["a"] == 0.0


def test_an_unknown_joint_is_refused_by_name():
    with pytest.raises(ControlError, match="l_arm_grip_1") as caught:
        limiter().apply(0.008, {"l_arm_grip_1": 0.1})
    assert caught.value.code == EngineCode.UNKNOWN_JOINT


def test_a_clock_that_goes_back_allows_no_movement():
    made = limiter()
    here = made.apply(1.0, {"a": 0.5})["a"]
    assert made.apply(0.5, {"a": -0.5})["a"] == here


def test_every_controlled_joint_has_the_range_of_the_robots_description():
    ranges = joint_ranges()
    assert set(ranges) == set(CONTROLLED_JOINTS)
    assert ranges["head_p"] == pytest.approx(np.radians([-60.0, 87.0])) and ranges["l_arm_grip"] == (0.0, 1.15)
    assert ranges["l_arm_el_y"] == pytest.approx(np.radians([-45.0, 72.0]), abs=1e-4)
    assert ranges["r_arm_el_y"] == pytest.approx(np.radians([-72.0, 45.0]), abs=1e-4)


def test_a_limit_that_is_given_with_four_decimals_is_taken_for_the_limit():
    engine = make_engine()
    robot = IdealRobot(engine)
    engine.move_joints({"head_y": 1.5708}, 0.0)
    robot.run()
    assert robot.joints["head_y"] == engine.ranges["head_y"][1] < 1.5708
    with pytest.raises(ControlError, match="head_y to 1.572 rad, expected -1.571 to 1.571"):
        engine.move_joints({"head_y": 1.572}, 0.0)
