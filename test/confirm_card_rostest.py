#!/usr/bin/env python3
"""A person corrects the first card to what the tubes hold, and confirms the second; until then no arm moves."""

import sys
import threading
import unittest

import numpy as np
import rospy
import rostest
from sensor_msgs.msg import Image, JointState

from dr_eureka.msg import CardDetection, GameStatus
from dr_eureka.srv import ConfirmCard, ConfirmCardResponse

START, CARD = "RR|GG|PP", "R|GG|PPR"
LIMIT_S = 60.0


class ConfirmCardTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("confirm_card_rostest")
        cls.changed = threading.Condition()
        cls.heard = {"status": [], "card": [], "card_readings": [], "card_image": [], "image": []}
        for name, topic, kind in (
            ("status", "dr_eureka_main/status", GameStatus),
            ("card", "dr_eureka_main/card", CardDetection),
            ("card_readings", "dr_eureka_main/card_readings", CardDetection),
            ("card_image", "dr_eureka_main/card_image", Image),
            ("image", "camera/image_raw", Image),
        ):
            rospy.Subscriber(topic, kind, cls.hear, callback_args=name, queue_size=100)
        rospy.wait_for_service("dr_eureka_main/confirm_card", LIMIT_S)
        cls.confirm = rospy.ServiceProxy("dr_eureka_main/confirm_card", ConfirmCard)

    @classmethod
    def hear(cls, message, name):
        with cls.changed:
            cls.heard[name].append(message)
            cls.changed.notify_all()

    def until(self, condition, what):
        with self.changed:
            self.assertTrue(self.changed.wait_for(condition, LIMIT_S), f"not {what}: {self.heard['status'][-1:]}")

    def phase(self, game, phase):
        statuses = self.heard["status"]
        return bool(statuses) and (statuses[-1].game, statuses[-1].phase) == (game, phase)

    def until_waiting(self, game):
        self.until(lambda: self.phase(game, GameStatus.WAITING_FOR_CONFIRMATION), "waiting for confirmation")
        return self.heard["status"][-1]

    def arms(self):
        state = rospy.wait_for_message("robotis/present_joint_states", JointState, LIMIT_S)
        return [position for name, position in zip(state.name, state.position) if "_arm_" in name]

    def test_1_nothing_can_be_confirmed_before_a_card_is_read(self):
        before = self.confirm("")
        self.assertEqual(before.result, ConfirmCardResponse.NOT_WAITING, before.message)

    def test_2_a_correction_that_is_no_state_is_refused_and_the_robot_still_waits(self):
        type(self).arms_before = self.arms()
        status = self.until_waiting(game=0)
        self.assertEqual((status.card, status.goal), (CARD, ""))
        refused = self.confirm("RRR|GG|PP")
        self.assertEqual(refused.result, ConfirmCardResponse.WRONG_STATE)
        self.assertIn("3 red balls", refused.message)
        seen = len(self.heard["status"])
        self.until(lambda: len(self.heard["status"]) > seen + 1, "told again")
        self.assertTrue(self.phase(0, GameStatus.WAITING_FOR_CONFIRMATION))

    def test_3_the_card_and_its_picture_carry_the_header_of_the_image_that_was_read(self):
        self.until(lambda: self.heard["card"] and self.heard["card_image"], "shown")
        card = self.heard["card"][-1]
        self.assertEqual((card.result, card.state, len(card.balls), len(card.corners)), (CardDetection.OK, CARD, 6, 8))
        for found in (card, self.heard["card_image"][-1]):
            self.until(lambda: found.header.stamp in {image.header.stamp for image in self.heard["image"]}, "seen by the camera")
            self.assertEqual(found.header.frame_id, self.heard["image"][-1].header.frame_id)
        self.assertIn(card.header.stamp, [reading.header.stamp for reading in self.heard["card_readings"]])
        ball = card.balls[0]
        self.assertIn(ball.colour, "RGP")
        corners = np.reshape(card.corners, (4, 2))
        self.assertTrue((corners.min(axis=0) < (ball.x, ball.y)).all() and (corners.max(axis=0) > (ball.x, ball.y)).all())

    def test_4_a_corrected_card_is_the_goal(self):
        answer = self.confirm(START)
        self.assertEqual((answer.result, answer.message), (ConfirmCardResponse.OK, f"the goal is {START}, corrected from {CARD}"))
        self.until(lambda: any(s.phase == GameStatus.FINISHED for s in self.heard["status"]), "finished")
        finished = next(s for s in self.heard["status"] if s.phase == GameStatus.FINISHED)
        self.assertEqual((finished.game, finished.code, finished.card, finished.goal), (0, GameStatus.SOLVED, CARD, START))

    def test_5_a_confirmed_card_is_played_and_no_arm_has_moved_before(self):
        card = self.until_waiting(game=1).card
        self.assertNotIn(card, (START, ""))
        np.testing.assert_allclose(self.arms(), self.arms_before, atol=0.005)
        answer = self.confirm("")
        self.assertEqual(answer.result, ConfirmCardResponse.OK, answer.message)
        self.until(lambda: self.phase(1, GameStatus.LOOKING_FOR_TUBES), "looking for the tubes")
        self.assertEqual(self.heard["status"][-1].goal, card)
        self.assertEqual(self.confirm("").result, ConfirmCardResponse.NOT_WAITING)


if __name__ == "__main__":
    rostest.rosrun("dr_eureka", "confirm_card", ConfirmCardTest, sys.argv)
