"""Which camera images the game node uses, and what it says of the others; no master."""

import numpy as np
import pytest

pytest.importorskip("rospy")

import rospy
from sensor_msgs.msg import JointState

from dr_eureka.behaviour.observation import ImageHeader
from dr_eureka.kinematics.arms import base_from_camera
from dr_eureka.nodes import sight
from dr_eureka.nodes.images import image_from_rgb, info_from_camera
from dr_eureka.vision.camera import CameraModel

RGB = np.full((480, 640, 3), 90, np.uint8)
LOG = []
HEAD = {"torso_y": 0.0, "head_y": 0.1, "head_p": 0.5}


@pytest.fixture
def clock(monkeypatch):
    """Stand in for the ROS clock: a list with the present time [s]."""
    now = [10.0]
    monkeypatch.setattr(sight.rospy, "get_time", lambda: now[0])
    monkeypatch.setattr(sight.rospy, "Subscriber", lambda *args, **kwargs: None)
    monkeypatch.setattr(sight.rospy, "logwarn_throttle", lambda period, line, *values: LOG.append(line % values))
    LOG.clear()
    return now


def make(clock, info=True, joints=True, backlog=1, pose_limit=0.0, camera=None):
    settings = sight.SightSettings(
        image_max_age=2.0, pose_limit=pose_limit, still_window=0.25, still_tolerance=0.003, backlog=backlog, history=5.0
    )
    eye = sight.Sight(settings, "raw", camera)
    if info:
        eye.hear_info(info_from_camera(CameraModel.lab(), rospy.Time(1), "cam_link"))
    if joints:
        move_head(eye, 9.0, 10.2)
    return eye


def move_head(eye, start_s, end_s, rate=0.0):
    for time_s in np.arange(start_s, end_s, 0.008):
        state = JointState(name=list(HEAD), position=[HEAD["torso_y"], HEAD["head_y"], HEAD["head_p"] + rate * (time_s - start_s)])
        state.header.stamp = rospy.Time.from_sec(time_s)
        eye.hear_joints(state)


def image(stamp_s, rgb=RGB, **changes):
    message = image_from_rgb(rgb, rospy.Time.from_sec(stamp_s), "cam_link")
    for name, value in changes.items():
        setattr(message, name, value)
    return message


def test_an_image_comes_with_calibration_and_the_cameras_pose_at_its_stamp(clock):
    eye = make(clock)
    eye.hear_image(image(10.0))
    frame = eye.take()
    assert (frame.header, frame.camera.width, eye.seen) == (ImageHeader(10_000_000_000, "cam_link"), 640, True)
    assert frame.stamp_s == 10.0
    np.testing.assert_array_equal(frame.image, RGB)
    np.testing.assert_allclose(frame.base_from_camera, base_from_camera(HEAD), atol=1e-9)
    assert eye.take() is None


@pytest.mark.parametrize("info", [True, False])
def test_a_calibration_of_ones_own_counts_instead_of_the_cameras(clock, info):
    own = CameraModel.lab(distorted=True)
    eye = make(clock, info=info, camera=own)
    eye.hear_image(image(10.0))
    assert eye.take().camera is own


def test_before_the_first_image_the_topic_is_named(clock):
    assert make(clock).problem == "no image on /camera/image_raw"


@pytest.mark.parametrize(
    "message, words",
    [
        (image(0.0), "without a time stamp"),
        (image(7.5), "older or newer than 2 s"),
        (image(12.5), "older or newer than 2 s"),
        (image(10.0, encoding="yuv422"), "'yuv422', expected one of rgb8, bgr8, mono8"),
        (image(10.0, data=b"cut off"), "cut off: 7 bytes"),
        (image(10.0, data=RGB.tobytes()[:-1]), "cut off: 921599 bytes in rows of 1920, expected 921600"),
        (image(10.0, rgb=np.zeros((1, 1, 3), np.uint8)), "expected 480 rows x 640 columns"),
        (image(10.0, rgb=np.zeros((3000, 4000, 3), np.uint8)), "expected 480 rows x 640 columns"),
        (image(10.0, width=320, height=960, step=960), "expected 480 rows x 640 columns"),
        (image(10.4), "no joint state of the image's time"),
    ],
)
def test_an_unusable_image_is_dropped_and_the_reason_told_and_the_next_one_is_used(clock, message, words):
    eye = make(clock)
    eye.hear_image(message)
    assert eye.take() is None
    assert words in eye.problem and not eye.frozen
    move_head(eye, 10.2, 10.7)
    eye.hear_image(image(10.5, rgb=RGB + 1))
    assert eye.take().stamp_s == 10.5


def test_what_is_wrong_with_an_image_is_logged_in_one_line(clock):
    eye = make(clock)
    eye.hear_image(image(10.0, encoding="yuv422"))
    eye.take()
    assert LOG == ["image dropped: image encoding is 'yuv422', expected one of rgb8, bgr8, mono8"]


def test_a_frozen_camera_is_noticed_whether_its_stamps_go_on_or_not(clock):
    for stamp_s, words in ((10.0, "not newer than the last"), (10.1, "repeats the one before pixel by pixel")):
        eye = make(clock)
        eye.hear_image(image(10.0))
        assert eye.take() is not None and not eye.frozen
        eye.hear_image(image(stamp_s))
        assert eye.take() is None
        assert eye.frozen and words in eye.problem
        eye.hear_image(image(10.15, rgb=RGB + 1))
        assert eye.take().stamp_s == 10.15 and not eye.frozen


def test_an_image_without_or_with_a_meaningless_calibration_is_not_used(clock):
    eye = make(clock, info=False)
    eye.hear_image(image(10.0))
    assert eye.take() is None and not eye.seen
    assert eye.problem == "no calibration on /camera/camera_info"
    zero = info_from_camera(CameraModel.lab(), rospy.Time(1), "cam_link")
    zero.K = [0.0] * 9
    eye.hear_info(zero)
    eye.hear_image(image(10.1))
    assert eye.take() is None and not eye.seen
    assert "fx, fy > 0" in eye.problem


def test_an_image_taken_while_the_head_moved_is_not_used(clock):
    eye = make(clock, joints=False)
    move_head(eye, 9.0, 10.2, rate=0.1)
    eye.hear_image(image(10.0))
    assert eye.take() is None
    assert eye.problem == "no image with the head at rest"


def test_an_image_waits_for_the_joint_state_of_its_time(clock):
    eye = make(clock, pose_limit=60.0)
    eye.hear_image(image(10.4))
    assert eye.take() is None
    move_head(eye, 10.2, 10.6)
    assert eye.take().stamp_s == 10.4


def test_a_robot_looks_at_the_newest_image_and_a_replay_at_every_one(clock):
    for backlog, stamps in ((1, [10.1]), (10, [9.7, 9.9, 10.1])):
        eye = make(clock, backlog=backlog)
        for number, stamp_s in enumerate((9.7, 9.9, 10.1)):
            eye.hear_image(image(stamp_s, rgb=RGB + number))
        taken = []
        while (frame := eye.take()) is not None:
            taken.append(round(frame.stamp_s, 3))
        assert taken == stamps


def test_a_recording_that_begins_again_is_looked_at_again(clock):
    eye = make(clock)
    eye.hear_image(image(10.0))
    eye.take()
    clock[0] = 2.0
    move_head(eye, 1.5, 2.2)
    eye.hear_image(image(2.0, rgb=RGB + 1))
    assert eye.take().stamp_s == 2.0
