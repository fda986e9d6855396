"""What the node ball_catcher does with joint states and pictures that cannot be used; needs the built messages, no master."""

import numpy as np
import pytest

pytest.importorskip("dr_eureka.msg", reason="the package's messages are not built")

import rospy
from ball_pictures import ball_picture
from catch_stand_in import CAMERA, HEAD, NETWORK, SAIKA, SETTINGS
from sensor_msgs.msg import JointState

from dr_eureka.catching.catch_report import CatchPhase
from dr_eureka.catching.catcher import Catcher
from dr_eureka.nodes import ball_catcher
from dr_eureka.nodes.ball_catcher import BallCatcher, BallCatcherNodeSettings
from dr_eureka.nodes.images import image_from_rgb

CYCLE_NS = 8_000_000


class Robot:
    """The node with its topics written down: what it published by topic, and its posture as it was commanded."""

    def __init__(self, monkeypatch):
        self.said = {}
        published = self.said

        class Publisher:
            def __init__(self, topic, *_, **__):
                self.publish = published.setdefault(topic, []).append

        monkeypatch.setattr(rospy, "Publisher", Publisher)
        monkeypatch.setattr(rospy, "Subscriber", lambda *_, **__: None)
        for level in ("logwarn_throttle", "loginfo"):
            monkeypatch.setattr(rospy, level, lambda *_: None)
        self.catcher = Catcher(SETTINGS, SAIKA, NETWORK, "thrown")
        self.node = BallCatcher(self.catcher, SAIKA, BallCatcherNodeSettings(0.5, 2.0, 10.0))
        self.angles, self.cycle = self.catcher.waiting.by_name(), 0

    def live(self, cycles=1, **angles):
        """Have the node answer joint states, in which some angles may be wrong; return how many goals it sent."""
        known = len(self.goals)
        for _ in range(cycles):
            self.cycle += 1
            told = {**self.angles, **angles}
            state = JointState(name=list(told), position=list(told.values()))
            state.header.stamp = rospy.Time(0, self.cycle * CYCLE_NS)
            self.node._on_joints(state)
        return len(self.goals) - known

    def show(self, rgb=None, stamp=None, **changes):
        """Show the left camera a picture, of now unless stamped; return what the node says it saw."""
        picture = ball_picture(SAIKA, []) if rgb is None else rgb
        message = image_from_rgb(picture, rospy.Time(0, self.cycle * CYCLE_NS) if stamp is None else stamp, "left_camera")
        for name, value in changes.items():
            setattr(message, name, value)
        self.node._on_picture("left", message)
        return self.said["~balls"][-1]

    @property
    def goals(self):
        return self.said["saika/set_joint_states"]

    @property
    def problem(self):
        """What the last status complains of."""
        self.node._told = None
        self.node._tell()
        return self.said["~status"][-1].message


@pytest.fixture
def robot(monkeypatch):
    made = Robot(monkeypatch)
    made.live(3)
    assert made.catcher.phase == CatchPhase.WATCHING
    return made


def test_each_joint_state_is_answered_with_its_own_stamp_and_all_joints(robot):
    assert robot.live(2) == 2
    assert [goal.header.stamp.to_nsec() for goal in robot.goals] == [CYCLE_NS * number for number in range(1, 6)]
    assert set(robot.goals[-1].name) == set(robot.angles)


@pytest.mark.parametrize("angle", [float("nan"), float("inf")])
def test_a_joint_state_that_is_not_finite_is_answered_by_nothing_and_named(robot, angle):
    assert robot.live(left_elbow=angle) == 0
    assert robot.problem == "joint state without a finite angle of left_elbow: ignored"
    assert robot.live() == 1 and robot.problem == ""


def test_a_joint_state_that_lacks_a_joint_is_answered_by_nothing_and_named(robot):
    del robot.angles["neck_pan"]
    assert robot.live() == 0
    assert "neck_pan" in robot.problem


def test_a_ball_in_a_picture_is_told_and_followed(robot):
    eye = HEAD.base_from_camera("left", neck=np.radians([6.0, 5.0]))
    seen = robot.show(ball_picture(SAIKA, [(np.linalg.inv(eye) @ [0.1, 1.8, 0.2, 1.0])[:3]]))
    assert (len(seen.balls), seen.problem) == (1, "")
    assert robot.catcher.phase == CatchPhase.FOLLOWING


@pytest.mark.parametrize("changes, problem", [
    ({"encoding": "32FC1"}, "encoding is '32FC1'"),
    ({"data": b"\0" * 100}, "image is cut off"),
    ({"width": 320, "step": 960}, "expected 480 rows x 640 columns"),
], ids=["encoding", "cut off", "another size"])
def test_a_picture_that_cannot_be_used_is_named_and_changes_nothing(robot, changes, problem):
    seen = robot.show(**changes)
    assert problem in seen.problem and list(seen.balls) == []
    assert problem in robot.problem and robot.catcher.phase == CatchPhase.WATCHING
    robot.show()
    assert robot.problem == ""


@pytest.mark.parametrize("stamp", [rospy.Time(), rospy.Time(5000)], ids=["no stamp", "from the future"])
def test_a_picture_of_a_time_without_joint_states_is_named_and_not_followed(robot, stamp):
    middle = ball_picture(SAIKA, [1.5 * CAMERA.rays(np.array([320.0, 240.0]))])
    assert "no joint state of the picture's time" in robot.show(middle, stamp).problem
    assert robot.catcher.phase == CatchPhase.WATCHING


def test_silence_of_the_joints_is_named(robot, monkeypatch):
    monkeypatch.setattr(rospy, "resolve_name", lambda name: f"/{name}")
    later = ball_catcher.time.monotonic() + 60.0
    monkeypatch.setattr(ball_catcher.time, "monotonic", lambda: later)
    assert robot.problem == "no message on /saika/present_joint_states for 60 s"
