#!/usr/bin/env python3
"""A game without a camera ends with a name, and the robot has not moved."""

import sys
import threading
import unittest

import numpy as np
import rospy
import rostest
from sensor_msgs.msg import JointState

from dr_eureka.msg import EngineStatus, GameStatus

LIMIT_S = 60.0


class NoCameraTest(unittest.TestCase):
    def test_no_image_within_the_limit_ends_the_game_and_nothing_moves(self):
        rospy.init_node("no_camera_rostest")
        before = rospy.wait_for_message("robotis/present_joint_states", JointState, LIMIT_S)
        failed = threading.Event()
        statuses = []

        def hear(status):
            statuses.append(status)
            if status.phase == GameStatus.FAILED:
                failed.set()

        rospy.Subscriber("dr_eureka_main/status", GameStatus, hear)
        self.assertTrue(failed.wait(LIMIT_S), statuses[-1:])
        self.assertEqual(statuses[-1].code, GameStatus.NO_CAMERA)
        self.assertEqual(statuses[-1].message, "no image on /nowhere/image_raw within 3 s")
        after = rospy.wait_for_message("robotis/present_joint_states", JointState, LIMIT_S)
        np.testing.assert_allclose(after.position, before.position, atol=0.002)
        engine = rospy.wait_for_message("control_engine/status", EngineStatus, LIMIT_S)
        self.assertEqual((engine.state, engine.strategy_id), (EngineStatus.IDLE, 0))


if __name__ == "__main__":
    rostest.rosrun("dr_eureka", "no_camera", NoCameraTest, sys.argv)
