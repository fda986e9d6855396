#!/usr/bin/env python3
"""Saika catches a thrown ball through ROS, and calls one out of reach."""

import json
import sys
import unittest

import rospy
import rostest
from launching import Launch, path_in, scratch_folder
from sensor_msgs.msg import JointState

from dr_eureka.msg import CatchReferee, CatchStatus

LIMIT_S = 300.0


class CatchTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("catch_rostest")
        cls.folder = scratch_folder()
        cls.addClassCleanup(cls.folder.cleanup)

    def session(self, **arguments):
        """Run catch.launch for one ball; return catch.json, all statuses, all joint goals, and what was printed."""
        out = path_in(self.folder, self.id())
        statuses, goals = [], []
        listeners = [
            rospy.Subscriber("ball_catcher/status", CatchStatus, statuses.append),
            rospy.Subscriber("saika/set_joint_states", JointState, goals.append),
        ]
        launch = Launch("catch.launch", {"throws": 1, "out": out, **arguments})
        self.addCleanup(launch.stop)
        output = launch.wait(LIMIT_S)
        for listener in listeners:
            listener.unregister()
        self.assertTrue((out / "catch.json").exists(), output)
        with open(out / "catch.json", encoding="utf-8") as file:
            return json.load(file), statuses, goals, output

    def test_a_thrown_ball_is_caught(self):
        rulings = []
        listener = rospy.Subscriber("catch_referee", CatchReferee, rulings.append)
        self.addCleanup(listener.unregister)
        result, statuses, _, output = self.session(seed=1)
        self.assertEqual((result["caught"], result["ok"]), (1, True), output)
        ball = result["balls"][0]
        self.assertEqual((ball["verdict"], ball["robot"]), ("CAUGHT", "CAUGHT"), output)
        self.assertGreater(ball["moves"], 3)
        phases = list(dict.fromkeys(status.phase for status in statuses))
        self.assertEqual(phases, [
            CatchStatus.GETTING_READY, CatchStatus.WATCHING, CatchStatus.FOLLOWING, CatchStatus.JUDGING,
        ])
        told = next(status for status in statuses if status.balls == 1)
        self.assertEqual((told.result, told.reason), (CatchStatus.CAUGHT, ""))
        for predicted, aimed in zip((told.place.x, told.place.y, told.place.z), ball["aim_m"]):
            self.assertAlmostEqual(predicted, aimed, delta=0.01)
        verdicts = [ruling.verdict for ruling in rulings]
        # A ball that rolls about while it is carried does not rest for a moment.
        self.assertEqual((verdicts[:3], verdicts[-1]), (["NO_BALL", "FLYING", "CAUGHT"], "CAUGHT"))
        self.assertNotIn("MISSED", verdicts)
        # Equal seeds end alike, however fast this machine is at the moment.
        again, _, _, output = self.session(seed=1)
        self.assertEqual(again, result, output)

    def test_a_ball_beyond_reach_is_called_so_and_the_arm_stays(self):
        result, statuses, goals, output = self.session(seed=2, aim="beyond")
        ball = result["balls"][0]
        said = (ball["robot"], ball["verdict"], ball["moves"], result["ok"])
        self.assertEqual(said, ("OUT_OF_REACH", "MISSED", 0, True), output)
        self.assertEqual(statuses[-1].result, CatchStatus.OUT_OF_REACH)
        released = [goal for goal in goals if goal.header.stamp.to_sec() >= ball["released_s"]]
        waiting = dict(zip(released[0].name, released[0].position))
        for goal in released:
            for name, angle in zip(goal.name, goal.position):
                self.assertAlmostEqual(angle, waiting[name], delta=1e-6)

    def test_a_method_nobody_knows_ends_the_launch_with_the_valid_ones(self):
        launch = Launch("catch.launch", {"method": "guess", "out": path_in(self.folder, self.id())})
        self.addCleanup(launch.stop)
        output = launch.wait(LIMIT_S)
        lines = [line for line in output.splitlines() if line.startswith("/ball_catcher: ")]
        self.assertEqual(lines, [
            "/ball_catcher: /ball_catcher/method: is 'guess'; expected one of ballistic, paper_thrown, paper_falling"
        ], output)
        self.assertNotIn("Traceback", output)


if __name__ == "__main__":
    rostest.rosrun("dr_eureka", "catch", CatchTest, sys.argv)
