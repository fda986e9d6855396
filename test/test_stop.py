"""A stop at any point of any motion: the very next goals are slower, and within a tenth of a second all joints hold."""

import numpy as np
import pytest
from test_engine import BALLS, CYCLE, PLACES, IdealRobot, make_engine

from dr_eureka.control.motion import Brake
from dr_eureka.game.actions import actions_for
from dr_eureka.game.state import Pour

LONGEST_S = 0.1  # as the README promises
EVERY = 9  # cycles between two points that are tried


def motions_of_a_pour(method):
    """Return the motions of picks, a pour and places, and the engine that planned them."""
    engine = make_engine()
    robot, planned = IdealRobot(engine), []
    hit = engine.body.hit
    engine.body.hit = lambda motion: planned.append(motion) or hit(motion)
    engine.start(actions_for([Pour("left", "right", 1)]), PLACES, BALLS, method, hands_at_once=True)
    robot.run()
    return planned, engine


def goals_of(motion, goals_at, times):
    rows = [goals_at(time) for time in times]
    return np.array([[row[name] for names, _ in motion.tracks for name in names] for row in rows])


@pytest.mark.parametrize("method", ["lock", "linear", "profiled"])
def test_from_any_point_the_next_cycle_brakes_and_a_tenth_of_a_second_later_all_joints_hold(method):
    motions, engine = motions_of_a_pour(method)
    stop, fastest = engine.settings.speeds.stop, engine.settings.speeds.hardware * CYCLE
    assert len(motions) > 10
    for motion in motions:
        low, high = np.array([engine.ranges[name] for names, _ in motion.tracks for name in names]).T
        for elapsed in np.arange(0.0, motion.duration, EVERY * CYCLE):
            brake = Brake(motion, elapsed, stop)
            assert brake.duration < LONGEST_S
            here = goals_of(motion, motion.goals, [elapsed])
            unbraked = np.abs(goals_of(motion, motion.goals, [elapsed + CYCLE]) - here).max()
            goals = np.vstack([here, goals_of(motion, brake.goals, CYCLE * np.arange(1, 16))])
            steps = np.abs(np.diff(goals, axis=0)).max(axis=1)
            assert steps[0] < unbraked or unbraked < 1e-6
            assert (steps <= fastest).all() and (goals >= low - 1e-9).all() and (goals <= high + 1e-9).all()
            assert (steps[int(np.ceil(LONGEST_S / CYCLE)) :] == 0.0).all()
