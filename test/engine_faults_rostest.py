#!/usr/bin/env python3
"""The control engine when the robot's joint states are wrong or stop: it holds, and says why."""

import math
import sys
import threading
import time
import unittest

import rospy
import rostest
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from dr_eureka.msg import EngineStatus
from dr_eureka.simulation.joints import ALL_JOINTS
from dr_eureka.srv import GetJoint, SetJoints

LIMIT_S = 20.0


class EngineFaultsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("engine_faults_rostest")
        cls.heard = threading.Condition()
        cls.status, cls.commands, cls.modules = None, [], []
        cls.states = rospy.Publisher("robotis/present_joint_states", JointState, queue_size=10)
        rospy.Subscriber("control_engine/status", EngineStatus, lambda status: cls.hear("status", status))
        rospy.Subscriber("robotis/set_joint_states", JointState, lambda command: cls.hear("commands", command))
        rospy.Subscriber("robotis/enable_ctrl_module", String, lambda module: cls.hear("modules", module.data))
        for name in ("get_joint", "set_joints"):
            rospy.wait_for_service(f"control_engine/{name}", LIMIT_S)
        cls.get_joint = rospy.ServiceProxy("control_engine/get_joint", GetJoint)
        cls.set_joints = rospy.ServiceProxy("control_engine/set_joints", SetJoints)

    @classmethod
    def hear(cls, what, value):
        with cls.heard:
            if what == "status":
                cls.status = value
            else:
                getattr(cls, what).append(value)
            cls.heard.notify_all()

    def until(self, condition, what):
        with self.heard:
            self.assertTrue(self.heard.wait_for(condition, LIMIT_S), f"not {what}: {self.status}")

    def send(self, **changed):
        """Send one joint state, all joints at 0.1 rad but for those named."""
        positions = {**dict.fromkeys(ALL_JOINTS, 0.1), **changed}
        state = JointState(name=list(positions), position=list(positions.values()))
        state.header.stamp = rospy.Time.now()
        self.states.publish(state)
        return state.header.stamp

    def answered(self, stamp):
        return any(command.header.stamp == stamp for command in self.commands)

    def test_1_nothing_is_commanded_before_the_first_joint_state(self):
        self.until(lambda: self.status is not None, "heard from")
        self.assertEqual(self.get_joint("head_p").result, EngineStatus.NO_JOINT_STATES)
        self.assertEqual(self.commands, [])
        self.until(lambda: self.modules == ["none"], "asked for module none")

    def test_2_the_first_command_holds_where_the_robot_is_and_carries_its_stamp(self):
        while self.states.get_num_connections() == 0:
            time.sleep(0.01)
        stamp = self.send(head_p=0.3)
        self.until(lambda: self.answered(stamp), "answered")
        command = self.commands[-1]
        goals = dict(zip(command.name, command.position))
        self.assertEqual(goals["head_p"], 0.3)
        self.assertEqual(goals["l_arm_el_y"], 0.1)
        self.assertTrue(len(command.name) == len(command.position) == len(command.velocity) == len(command.effort))

    def test_3_joint_states_that_stop_are_a_fault_and_nothing_more_is_commanded(self):
        stamp = self.send()
        began_s = time.monotonic()
        self.until(lambda: self.answered(stamp), "answered")
        self.until(lambda: self.status.code == EngineStatus.JOINT_STATES_LOST, "lost")
        self.assertLess(time.monotonic() - began_s, 2.0)
        self.assertEqual(self.status.state, EngineStatus.FAULT)
        self.assertIn("robotis/present_joint_states", self.status.message)
        self.assertTrue(self.commands[-1].header.stamp == stamp)

    def test_4_no_joint_state_makes_the_engine_command_nan(self):
        for bad in (math.nan, math.inf, -math.inf):
            stamp = self.send(l_arm_sh_r=bad)
            self.until(lambda: self.answered(stamp), "answered")
        self.until(lambda: self.status.code == EngineStatus.INVALID_VALUE, "refused")
        self.assertIn("l_arm_sh_r", self.status.message)
        for command in self.commands:
            self.assertTrue(all(math.isfinite(position) for position in command.position))

    def test_5_a_joint_state_of_unequal_lengths_is_ignored(self):
        count = len(self.commands)
        broken = JointState(name=list(ALL_JOINTS), position=[0.0] * 5)
        broken.header.stamp = rospy.Time.now()
        self.states.publish(broken)
        stamp = self.send()
        self.until(lambda: self.answered(stamp), "answered")
        self.assertEqual(len(self.commands), count + 1)


if __name__ == "__main__":
    rostest.rosrun("dr_eureka", "engine_faults", EngineFaultsTest, sys.argv)
