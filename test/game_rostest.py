#!/usr/bin/env python3
"""A whole game in simulation, recorded, and its replay: card, plan, tubes, pour, verdict."""

import json
import sys
import unittest

import numpy as np
import rosbag
import rospy
import rostest
from launching import Launch, path_in, scratch_folder

from dr_eureka.msg import CardDetection, GameStatus, Plan, TubeScene

START, GOAL = "RR|GG|PP", "R|GG|PPR"
GAME_LIMIT_S = 150.0
REPLAY_LIMIT_S = 60.0


class GameTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("game_rostest")
        cls.namespace = rospy.get_param("~namespace", "/")
        cls.folder = scratch_folder()
        cls.addClassCleanup(cls.folder.cleanup)
        arguments = {"start": START, "card": GOAL, "seed": 4, "out": path_in(cls.folder, "out"), "record": "true"}
        game = Launch("game.launch", arguments, cls.namespace)
        cls.addClassCleanup(game.stop)
        cls.output = game.wait(GAME_LIMIT_S)
        with open(path_in(cls.folder, "out", "game.json"), encoding="utf-8") as file:
            cls.result = json.load(file)
        with rosbag.Bag(str(path_in(cls.folder, "out", "game.bag"))) as bag:
            cls.recorded = {}
            for topic, message, _ in bag.read_messages():
                cls.recorded.setdefault(topic, []).append(message)

    def topic(self, name):
        return self.recorded[f"{self.namespace.rstrip('/')}/{name}"]

    def test_the_referee_calls_the_game_solved_with_no_ball_lost(self):
        self.assertEqual(
            {key: self.result[key] for key in ("seed", "start", "card", "goal", "verdict", "solved", "balls_lost")},
            {"seed": 4, "start": START, "card": GOAL, "goal": GOAL, "verdict": "SOLVED", "solved": True, "balls_lost": 0},
            self.output,
        )
        last = self.topic("referee")[-1]
        self.assertEqual((last.state, last.balls_lost, sorted(last.tubes_standing)), (GOAL, 0, ["center", "left", "right"]))

    def test_both_hands_pick_and_place_at_once_and_actions_follow_one_another_in_robot_time(self):
        actions = self.result["actions"]
        # More follow only if a pour went wrong and a new plan was made.
        self.assertEqual([action["kind"] for action in actions[:5]], ["pick", "pick", "pour", "place", "place"])
        first_pick, second_pick, pour, first_place, second_place = (
            (action["start"], action["end"]) for action in actions[:5]
        )
        self.assertEqual((first_pick, first_place), (second_pick, second_place))
        self.assertEqual((pour[0], first_place[0]), (first_pick[1], pour[1]))
        ends = [action["end"] for action in actions]
        self.assertEqual(ends, sorted(ends))
        self.assertLessEqual(ends[-1], self.result["simulated_seconds"])

    def test_the_status_went_through_every_phase(self):
        phases = [status.phase for status in self.topic("dr_eureka_main/status")]
        expected = [
            GameStatus.LOOKING_FOR_CARD,
            GameStatus.LOOKING_FOR_TUBES,
            GameStatus.PLANNING,
            GameStatus.PLAYING,
            GameStatus.CHECKING,
            GameStatus.FINISHED,
        ]
        self.assertEqual([phase for phase in dict.fromkeys(phases) if phase in expected], expected)

    def test_joint_states_were_recorded_at_125_hz(self):
        stamps = [state.header.stamp.to_sec() for state in self.topic("robotis/present_joint_states")]
        np.testing.assert_allclose(np.median(np.diff(stamps)), 0.008, atol=1e-9)

    def test_the_replay_finds_the_recorded_goal_plan_and_tubes(self):
        found = {}
        listeners = self.listen(found)
        arguments = {"bag": path_in(self.folder, "out", "game.bag"), "namespace": self.namespace, "rate": 2.0}
        replay = Launch("replay.launch", arguments, self.namespace)
        self.addCleanup(replay.stop)
        output = replay.wait(REPLAY_LIMIT_S)
        for listener in listeners:
            listener.unregister()
        self.assertIn("REPLAYED", output)
        self.assertEqual(found["card"].state, GOAL)
        self.assertEqual(pours(found["plan"]), pours(self.topic("dr_eureka_main/plan")[-1]))
        before, after = self.topic("dr_eureka_main/tubes")[0], self.topic("dr_eureka_main/tubes")[-1]
        self.assertEqual((before.state, after.state, found["tubes"].state), (START, GOAL, START))
        np.testing.assert_allclose(places(found["tubes"]), places(before), atol=0.002)

    def listen(self, found):
        """Keep the newest card, plan and tubes of the replay in `found`; recorded messages have classes of their own."""
        return [
            rospy.Subscriber(
                f"{self.namespace.rstrip('/')}/dr_eureka_main/{name}",
                kind,
                lambda message, name=name: found.update({name: message}),
            )
            for name, kind in (("card", CardDetection), ("plan", Plan), ("tubes", TubeScene))
        ]


def pours(plan):
    """Return the pours of a plan as plain tuples."""
    return [(pour.source, pour.target, pour.count) for pour in plan.pours]


def places(scene):
    """Return the tubes' places (3, 3) in base [m], in the order left, center, right."""
    by_name = {tube.name: tube.position for tube in scene.tubes}
    return np.array([[by_name[name].x, by_name[name].y, by_name[name].z] for name in ("left", "center", "right")])


if __name__ == "__main__":
    rostest.rosrun("dr_eureka", "game", GameTest, sys.argv)
