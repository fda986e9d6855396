#!/usr/bin/env python3
"""What a person can get wrong: the launch ends by itself and one line names what was wrong and where."""

import sys
import unittest

import rosbag
import rospy
import rostest
from launching import Launch, path_in, scratch_folder
from sensor_msgs.msg import JointState

LIMIT_S = 60.0


class BadInputTest(unittest.TestCase):
    def complaint(self, node, file, **arguments):
        """Run a launch file until it ends; return the one line in which the node says why it did not start."""
        launch = Launch(file, arguments)
        self.addCleanup(launch.stop)
        output = launch.wait(LIMIT_S)
        lines = [line for line in output.splitlines() if line.startswith(f"/{node}: ")]
        self.assertEqual(len(lines), 1, output)
        self.assertIn("exit code 1", output)
        self.assertNotIn("Traceback", output)
        return lines[0]

    def test_a_goal_that_is_no_state_ends_the_launch(self):
        line = self.complaint("dr_eureka_main", "main.launch", goal="RRR|GG|PP")
        self.assertIn("/dr_eureka_main/goal: RRR|GG|PP", line)
        self.assertIn("3 red balls", line)

    def test_a_strategy_nobody_knows_ends_the_launch_with_the_valid_ones(self):
        line = self.complaint("dr_eureka_main", "main.launch", strategy="luckiest")
        self.assertIn("/dr_eureka_main/strategy: is 'luckiest'; expected one of fewest", line)

    def test_a_camera_calibration_that_is_not_there_ends_the_launch(self):
        line = self.complaint("dr_eureka_main", "main.launch", camera_calibration="/nowhere/camera.yaml")
        self.assertIn("/nowhere/camera.yaml", line)

    def test_a_start_that_is_no_state_ends_the_simulation(self):
        line = self.complaint("fake_robotis_manager", "robot_sim.launch", start="RRGGP|P")
        self.assertIn("/fake_robotis_manager/start: RRGGP|P", line)

    def test_a_timeout_that_makes_no_sense_ends_the_engine_before_any_motion(self):
        line = self.complaint("control_engine", "control.launch", joint_states_timeout=-1.0)
        self.assertIn("joint_states_timeout: is -1.0", line)

    def test_a_missing_recording_ends_the_replay(self):
        with scratch_folder() as name:
            line = self.complaint("dr_eureka_main", "replay.launch", bag=f"{name}/none.bag")
        self.assertIn("none.bag: no such file", line)

    def test_a_recording_without_a_camera_ends_the_replay(self):
        folder = scratch_folder()
        self.addCleanup(folder.cleanup)
        path = path_in(folder, "blind.bag")
        with rosbag.Bag(str(path), "w") as bag:
            bag.write("/robotis/present_joint_states", JointState(), rospy.Time(1))
        line = self.complaint("dr_eureka_main", "replay.launch", bag=path)
        self.assertIn("no message on /camera/image_raw/compressed", line)
        self.assertIn("it holds /robotis/present_joint_states", line)

    def test_a_recording_that_is_none_ends_the_replay(self):
        folder = scratch_folder()
        self.addCleanup(folder.cleanup)
        path = path_in(folder, "text.bag")
        path.write_text("this is no bag\n", encoding="ascii")
        self.assertIn("not a readable bag", self.complaint("dr_eureka_main", "replay.launch", bag=path))


if __name__ == "__main__":
    rostest.rosrun("dr_eureka", "bad_input", BadInputTest, sys.argv)
