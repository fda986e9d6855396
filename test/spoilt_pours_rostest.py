#!/usr/bin/env python3
"""Two pours spoilt on purpose: a pushed arm pours nothing, and the game plans anew; a ball knocked out ends the game."""

import json
import sys
import unittest

import rospy
import rostest
from launching import Launch, path_in, scratch_folder

from dr_eureka.srv import SpoilPour, SpoilPourRequest

START, GOAL = "RR|GG|PP", "R|G|PPRG"
AFTER_FIRST_POUR = "R|GG|PPR"
GAME_LIMIT_S = 240.0
SERVICE_LIMIT_S = 60.0
# The wrist lifts the mouth of the tube that is poured from by 5 cm and turns it back by 14 degrees: no ball leaves it.
JOG = SpoilPourRequest(fault=SpoilPourRequest.JOG, joints=["l_arm_wr_y"], offsets=[-0.3], seconds=3.0)
KNOCK_OUT = SpoilPourRequest(fault=SpoilPourRequest.KNOCK_OUT_BALL)


class SpoiltPoursTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("spoilt_pours_rostest")

    def play(self, fault):
        """Play for the goal with the first pour spoilt; return what game.json says."""
        folder = scratch_folder()
        self.addCleanup(folder.cleanup)
        game = Launch("game.launch", {"start": START, "goal": GOAL, "seed": 4, "out": path_in(folder)})
        self.addCleanup(game.stop)
        rospy.wait_for_service("fake_robotis_manager/spoil_pour", SERVICE_LIMIT_S)
        answer = rospy.ServiceProxy("fake_robotis_manager/spoil_pour", SpoilPour)(fault)
        self.assertTrue(answer.success, answer.message)
        self.output = game.wait(GAME_LIMIT_S)
        self.assertIn(f"spoilt a pour as asked: {fault.fault}", self.output)
        return json.loads(path_in(folder, "game.json").read_text(encoding="utf-8"))

    def test_a_pour_in_which_the_arm_was_pushed_is_seen_planned_anew_and_the_game_solved(self):
        result = self.play(JOG)
        self.assertEqual(
            {key: result[key] for key in ("verdict", "solved", "balls_lost", "true_state", "replans")},
            {"verdict": "SOLVED", "solved": True, "balls_lost": 0, "true_state": GOAL, "replans": 1},
            self.output,
        )
        # Seen in the hands after the first pour of two, so the second was not made then.
        self.assertEqual(result["pours"], 3)
        self.assertRegex(self.output, "tube in a hand seen to hold .*, expected .*: putting the tubes down to look again")
        self.assertIn(f"tubes: they hold {START}, expected {AFTER_FIRST_POUR}: planning anew", self.output)

    def test_a_ball_that_was_knocked_out_ends_the_game_with_its_own_code(self):
        result = self.play(KNOCK_OUT)
        self.assertEqual(
            {key: result[key] for key in ("verdict", "solved", "balls_lost", "replans")},
            {"verdict": "BALL_LOST", "solved": False, "balls_lost": 1, "replans": 0},
            self.output,
        )
        self.assertIn("red", result["message"])


if __name__ == "__main__":
    rostest.rosrun("dr_eureka", "spoilt_pours", SpoiltPoursTest, sys.argv)
