#!/usr/bin/env python3
"""Both arms pick a tube each at the same time; how fast they went is measured in the joint states that the robot sends."""

import sys
import threading
import unittest

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import Point
from sensor_msgs.msg import JointState

from dr_eureka.control.settings import ControlSettings
from dr_eureka.game.hands import HANDS
from dr_eureka.kinematics.arms import arm_joint_names
from dr_eureka.msg import Action, EngineStatus, Referee, TubePlace
from dr_eureka.resources import load_yaml
from dr_eureka.simulation.placement import draw_placement
from dr_eureka.simulation.settings import load_world_settings
from dr_eureka.srv import ExecuteStrategy

WHERE = "config/control_engine.yaml"
LIMIT_S = 120.0
CYCLE_S = 0.008
# What a servo adds while it follows its goals, as a share of the limits that the goals keep.
FOLLOWING = 0.02
MOVING = 1e-3  # [rad/s]


class BothHandsTest(unittest.TestCase):
    def setUp(self):
        rospy.init_node("both_hands_rostest")
        self.heard = threading.Condition()
        self.status, self.standing, self.states = None, None, []
        rospy.wait_for_service("control_engine/execute_strategy", LIMIT_S)
        self.execute = rospy.ServiceProxy("control_engine/execute_strategy", ExecuteStrategy)
        rospy.Subscriber("control_engine/status", EngineStatus, self.hear_status)
        rospy.Subscriber("referee", Referee, self.hear_referee)
        rospy.Subscriber("robotis/present_joint_states", JointState, self.hear_state, tcp_nodelay=True)
        rospy.wait_for_message("robotis/set_joint_states", JointState, LIMIT_S)

    def hear_status(self, status):
        with self.heard:
            self.status = status
            self.heard.notify_all()

    def hear_referee(self, ruling):
        with self.heard:
            self.standing = set(ruling.tubes_standing)
            self.heard.notify_all()

    def hear_state(self, state):
        with self.heard:
            self.states.append((state.header.stamp.to_sec(), dict(zip(state.name, state.position))))

    def until(self, condition, what):
        with self.heard:
            self.assertTrue(self.heard.wait_for(condition, LIMIT_S), f"not {what}: {self.status}")

    def pick_at_once(self):
        """Have the left and the right tube picked, and return the joint states meanwhile, name -> (k,) [rad]."""
        places = draw_placement(load_world_settings(), rospy.get_param("~seed"), np.array([0.0, 0.0, 1.2])).tubes
        tubes = [TubePlace(name, Point(*foot), 0.001) for name, foot in places.items()]
        picks = [Action(kind=Action.PICK, hand=hand, tube=hand) for hand in HANDS]
        answer = self.execute(picks, tubes, bytes([2] * len(tubes)), "lock", False, True)
        self.assertEqual(answer.result, EngineStatus.OK, answer.message)
        mine = lambda: self.status and self.status.strategy_id == answer.strategy_id
        self.until(lambda: mine() and self.status.at_once == 2, "two at once")
        self.until(lambda: self.status.state != EngineStatus.BUSY, "over")
        self.assertEqual((self.status.state, self.status.code), (EngineStatus.DONE, EngineStatus.OK), self.status.message)
        with self.heard:
            states = list(self.states)
        times = np.array([time for time, _ in states])
        np.testing.assert_allclose(np.diff(times), CYCLE_S, atol=1e-6, err_msg="joint states are missing")
        return {name: np.array([joints[name] for _, joints in states]) for name in states[0][1]}

    def assert_keeps(self, positions, limits, what):
        """Print the peaks of joints (k, n) [rad] and check them against their limits."""
        speeds = np.diff(positions, axis=0) / CYCLE_S
        speed, acceleration = np.abs(speeds).max(), np.abs(np.diff(speeds, axis=0)).max() / CYCLE_S
        print(
            f"{what}: peak speed {speed:.3f} rad/s (limit {limits.speed}), "
            f"peak acceleration {acceleration:.3f} rad/s^2 (limit {limits.acceleration})"
        )
        self.assertLessEqual(speed, limits.speed * (1.0 + FOLLOWING))
        self.assertLessEqual(acceleration, limits.acceleration * (1.0 + FOLLOWING))
        self.assertGreater(speed, 0.3 * limits.speed)

    def test_both_arms_pick_at_once_within_the_limits_of_speed_and_acceleration(self):
        settings = ControlSettings.from_mapping(load_yaml(WHERE), WHERE)
        joints = self.pick_at_once()
        arms = {hand: np.stack([joints[name] for name in arm_joint_names(hand)], axis=1) for hand in HANDS}
        fingers = np.minimum(joints["l_arm_grip"], joints["r_arm_grip"])
        grasped = int(np.argmax(fingers > settings.grip.on_tube[0]))
        self.assertGreater(grasped, 0)
        for hand, positions in arms.items():
            self.assert_keeps(positions[: grasped + 1], settings.speeds.move, f"{hand} arm, empty")
            self.assert_keeps(positions[grasped:], settings.speeds.carry, f"{hand} arm, carrying")
        moves = [np.abs(np.diff(positions, axis=0)).max(axis=1) / CYCLE_S > MOVING for positions in arms.values()]
        together = (moves[0] & moves[1]).sum() / max(moves[0].sum(), moves[1].sum())
        print(f"both arms move in {100.0 * together:.0f} % of the cycles in which one does")
        self.assertGreater(together, 0.8)
        self.until(lambda: self.standing == {"center"}, "lifted")


if __name__ == "__main__":
    rostest.rosrun("dr_eureka", "both_hands", BothHandsTest, sys.argv)
