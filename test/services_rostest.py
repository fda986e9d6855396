#!/usr/bin/env python3
"""The control engine's services, with the simulated robot behind them."""

import sys
import unittest

import rospy
import rostest
from geometry_msgs.msg import Point
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from dr_eureka.msg import Action, EngineStatus, TubePlace
from dr_eureka.srv import ExecuteStrategy, GetJoint, SetJoints

LIMIT_S = 30.0


class ServicesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("services_rostest")
        kinds = {"get_joint": GetJoint, "set_joints": SetJoints, "execute_strategy": ExecuteStrategy, "stop": Trigger}
        cls.services = {name: rospy.ServiceProxy(f"control_engine/{name}", kind) for name, kind in kinds.items()}
        for name in kinds:
            rospy.wait_for_service(f"control_engine/{name}", LIMIT_S)
        cls.status = None
        rospy.Subscriber("control_engine/status", EngineStatus, cls.on_status)
        rospy.wait_for_message("robotis/set_joint_states", JointState, LIMIT_S)

    @classmethod
    def on_status(cls, status):
        cls.status = status

    def setUp(self):
        self.services["stop"]()
        self.until(lambda: self.status and self.status.code == EngineStatus.STOPPED, "stopped")

    def until(self, condition, what, limit_s=15.0):
        """Wait, in robot time, until a condition holds; looked at with every joint state."""
        end = rospy.get_time() + limit_s
        while not condition():
            if rospy.get_time() > end:
                self.fail(f"not {what} within {limit_s} s: {self.status}")
            rospy.wait_for_message("robotis/present_joint_states", JointState, LIMIT_S)

    def joint(self, name):
        answer = self.services["get_joint"](name)
        self.assertEqual(answer.result, EngineStatus.OK, answer.message)
        return answer.position

    def test_get_joint_gives_the_present_position(self):
        state = rospy.wait_for_message("robotis/present_joint_states", JointState, LIMIT_S)
        present = dict(zip(state.name, state.position))
        self.assertEqual(len(state.name), 31)
        self.assertEqual(list(state.name), sorted(state.name))
        self.assertEqual((len(state.velocity), len(state.effort)), (31, 31))
        for name in ("l_arm_sh_p1", "r_arm_wr_p", "l_leg_kn_p"):
            self.assertAlmostEqual(self.joint(name), present[name], places=3)

    def test_get_joint_names_an_unknown_joint(self):
        answer = self.services["get_joint"]("l_arm_tentacle")
        self.assertEqual((answer.result, answer.position), (EngineStatus.UNKNOWN_JOINT, 0.0))
        self.assertIn("l_arm_tentacle", answer.message)
        self.assertIn("l_arm_el_y", answer.message)

    def test_set_joints_moves_the_head_and_reports_the_end(self):
        answer = self.services["set_joints"](["head_p", "head_y"], [0.4, -0.3], 0.5)
        self.assertEqual(answer.result, EngineStatus.OK, answer.message)
        self.until(lambda: self.status.state == EngineStatus.DONE, "done")
        self.until(lambda: abs(self.joint("head_p") - 0.4) < 0.005 and abs(self.joint("head_y") + 0.3) < 0.005, "there")

    def test_set_joints_refuses_what_it_cannot_do_and_holds_still(self):
        before = self.joint("head_p")
        for names, positions, result in (
            (["head_p", "third_eye"], [0.1, 0.1], EngineStatus.UNKNOWN_JOINT),
            (["head_p"], [float("nan")], EngineStatus.INVALID_VALUE),
            (["head_p"], [float("inf")], EngineStatus.INVALID_VALUE),
            (["head_p", "head_y"], [0.1], EngineStatus.INVALID_VALUE),
            (["head_p"], [3.0], EngineStatus.OUT_OF_LIMITS),
        ):
            answer = self.services["set_joints"](names, positions, 0.2)
            self.assertEqual(answer.result, result, answer.message)
            self.assertTrue(answer.message)
        self.assertEqual(self.services["set_joints"](["head_p"], [0.1], float("nan")).result, EngineStatus.INVALID_VALUE)
        start = rospy.get_time()
        self.until(lambda: rospy.get_time() > start + 0.5, "half a second later")
        self.assertAlmostEqual(self.joint("head_p"), before, places=3)

    def test_a_motion_into_the_table_is_not_begun_and_says_what_would_touch(self):
        before = self.joint("l_arm_sh_p1")
        answer = self.services["set_joints"](["l_arm_sh_p1", "l_arm_sh_r"], [1.2, 0.0], 2.0)
        self.assertEqual(answer.result, EngineStatus.OK, answer.message)
        self.until(lambda: self.status.state == EngineStatus.FAULT, "refused")
        self.assertEqual(self.status.code, EngineStatus.COLLISION)
        self.assertRegex(self.status.message, "l_arm_.*(table|board|pelvis)")
        self.assertAlmostEqual(self.joint("l_arm_sh_p1"), before, places=3)

    def test_a_second_request_is_refused_while_the_first_is_carried_out(self):
        self.services["set_joints"](["head_y"], [0.5], 3.0)
        self.until(lambda: self.status.state == EngineStatus.BUSY, "busy")
        answer = self.services["set_joints"](["head_p"], [0.0], 0.5)
        self.assertEqual(answer.result, EngineStatus.ENGINE_BUSY, answer.message)

    def test_stop_ends_a_motion_at_once_and_holds(self):
        self.services["set_joints"](["head_y"], [-0.8], 3.0)
        self.until(lambda: self.joint("head_y") < -0.1, "moving")
        self.assertTrue(self.services["stop"]().success)
        self.until(lambda: self.status.code == EngineStatus.STOPPED, "stopped")
        start, held = rospy.get_time(), self.joint("head_y")
        self.until(lambda: rospy.get_time() > start + 0.5, "half a second later")
        self.assertAlmostEqual(self.joint("head_y"), held, delta=0.02)
        self.assertGreater(held, -0.75)

    def strategy(self, x):
        tubes = [TubePlace(name, Point(x, y, 0.775), 0.001) for name, y in (("left", 0.11), ("center", 0.0), ("right", -0.11))]
        actions = [Action(kind=Action.PICK, hand="left", tube="left")]
        return self.services["execute_strategy"](actions, tubes, bytes([2, 2, 2]), "lock", False, False)

    def test_an_unreachable_tube_has_its_own_code_and_a_strategy_number(self):
        answer = self.strategy(x=1.6)
        self.assertEqual(answer.result, EngineStatus.OK, answer.message)
        self.until(lambda: self.status.strategy_id == answer.strategy_id and self.status.state != EngineStatus.BUSY, "over")
        self.assertEqual((self.status.state, self.status.code), (EngineStatus.FAULT, EngineStatus.UNREACHABLE_TUBE))
        self.assertIn("left", self.status.message)

    def test_a_tube_nowhere_is_refused_before_any_motion(self):
        answer = self.strategy(x=float("nan"))
        self.assertEqual(answer.result, EngineStatus.INVALID_VALUE, answer.message)
        self.assertNotEqual(self.status.state, EngineStatus.BUSY)


if __name__ == "__main__":
    rostest.rosrun("dr_eureka", "services", ServicesTest, sys.argv)
