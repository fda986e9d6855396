"""What a camera may send while the robot looks, from the message to the named end of the look; no master."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

pytest.importorskip("rospy")

import rospy
from sensor_msgs.msg import JointState

from dr_eureka.behaviour.failure import Failure
from dr_eureka.behaviour.flow_settings import FlowSettings
from dr_eureka.behaviour.guided_look import GuidedLook
from dr_eureka.behaviour.looks import CardLook, TubeLook
from dr_eureka.behaviour.observation import EngineView, Gaze, Observation
from dr_eureka.behaviour.report import GameCode
from dr_eureka.control.codes import EngineCode, EngineState
from dr_eureka.nodes import sight
from dr_eureka.nodes.images import image_from_rgb, info_from_camera
from dr_eureka.pieces import load_pieces
from dr_eureka.resources import load_yaml
from dr_eureka.settings import build
from dr_eureka.vision.camera import CameraModel
from dr_eureka.vision.card_renderer import render_card
from dr_eureka.vision.cards import CardReader
from dr_eureka.vision.tubes import TubeSettings, locate_tubes
from dr_eureka.vision.voting import CardVote, CardVoteSettings, LossVote, TubeVote, TubeVoteSettings

SETTINGS = replace(
    build(FlowSettings, load_yaml("config/dr_eureka_main.yaml")["flow"], "flow"), camera_limit=1.5, frozen_limit=1.0
)
GAZE, STATE, PERIOD_S, LOOK_S = Gaze(0.0, 0.5), "RG|PRGP|", 0.2, 2.0


@pytest.fixture(scope="module")
def reader():
    return CardReader.load()


@pytest.fixture
def look_at(reader, monkeypatch):
    """Return a function that looks at pictures made one after another, for a card unless told, until the look has ended."""
    now = {"s": 10.0}
    log = []
    monkeypatch.setattr(sight.rospy, "get_time", lambda: now["s"])
    monkeypatch.setattr(sight.rospy, "Subscriber", lambda *args, **kwargs: None)
    monkeypatch.setattr(sight.rospy, "logwarn_throttle", lambda period, line, *values: log.append(line % values))

    def card_look():
        return CardLook(reader.read, CardVote(CardVoteSettings(window=8, agree=5)), lambda frame, reading: None)

    def look_at_pictures(make, size=(480, 640), spoil=lambda message: None, look=card_look):
        settings = sight.SightSettings(
            image_max_age=2.0, pose_limit=0.0, still_window=0.25, still_tolerance=0.003, backlog=1, history=5.0
        )
        eye = sight.Sight(settings, "raw")
        height, width = size
        camera = CameraModel(width, height, [[width, 0, width / 2], [0, width, height / 2], [0, 0, 1]], np.zeros(5))
        eye.hear_info(info_from_camera(camera, rospy.Time(1), "cam_link"))
        guided = None
        for _ in range(100):
            now["s"] += PERIOD_S
            for share in np.linspace(-1.0, 0.0, 5):
                joints = JointState(name=["torso_y", "head_y", "head_p"], position=[0.0, GAZE.head_y, GAZE.head_p])
                joints.header.stamp = rospy.Time.from_sec(now["s"] + share * PERIOD_S)
                eye.hear_joints(joints)
            message = image_from_rgb(make(), rospy.Time.from_sec(now["s"] - 0.01), "cam_link")
            spoil(message)
            eye.hear_image(message)
            seen = Observation(
                wall_s=now["s"], robot_s=now["s"], engine=EngineView(EngineState.IDLE, EngineCode.OK, 0, -1, "", now["s"]),
                frame=eye.take(), camera_seen=eye.seen, camera_problem=eye.problem, camera_frozen=eye.frozen, head=GAZE,
            )
            if guided is None:
                guided = GuidedLook(look(), GAZE, LOOK_S, SETTINGS, seen)
            outcome = guided.step(seen)
            if outcome is not None:
                return outcome, log
        raise AssertionError("the look never ended")

    return look_at_pictures


def card_scene(height, width):
    side = height // 3
    scene = np.full((height, width, 3), 110, np.uint8)
    scene[side : 2 * side, side : 2 * side] = cv2.resize(render_card(STATE, 4, 280), (side, side), interpolation=cv2.INTER_AREA)
    return scene


def with_noise(picture, seed=1):
    """Return a maker of pictures that differ by the noise of a sensor."""
    rng = np.random.default_rng(seed)
    noise = rng.integers(-2, 3, (picture.shape[0] + 64, picture.shape[1] + 64, 1))

    def make():
        row, column = rng.integers(0, 64, 2)
        grain = noise[row : row + picture.shape[0], column : column + picture.shape[1]]
        return np.clip(picture.astype(np.int16) + grain, 0, 255).astype(np.uint8)

    return make


def refused(outcome, code, words):
    assert isinstance(outcome, Failure)
    assert outcome.code == code and words in outcome.message and "\n" not in outcome.message


def test_a_living_camera_shows_the_card(look_at):
    found, log = look_at(with_noise(card_scene(480, 640)))
    assert (str(found.state), found.images, log) == (STATE, 5, [])


def test_a_card_in_a_frozen_picture_is_no_goal(look_at):
    picture = card_scene(480, 640)
    outcome, log = look_at(lambda: picture)
    refused(outcome, GameCode.CAMERA_FROZEN, "nothing new from the camera for 1 s: image of ")
    assert "repeats the one before pixel by pixel" in log[0]


def test_a_card_in_a_picture_whose_stamp_stands_still_is_no_goal(look_at):
    first = []

    def stop_the_clock(message):
        first.append(message.header.stamp)
        message.header.stamp = first[0]

    outcome, log = look_at(with_noise(card_scene(480, 640)), spoil=stop_the_clock)
    refused(outcome, GameCode.CAMERA_FROZEN, "not newer than the last")
    assert log


@pytest.mark.parametrize("level", [0, 255, 128])
def test_an_empty_picture_has_no_card_and_repeated_to_the_pixel_it_is_a_frozen_cameras(look_at, level):
    blank = np.full((480, 640, 3), level, np.uint8)
    refused(look_at(with_noise(blank))[0], GameCode.NO_CARD, "no outline of a card")
    refused(look_at(lambda: blank)[0], GameCode.CAMERA_FROZEN, "repeats the one before")


def test_a_camera_of_one_pixel_shows_no_card(look_at):
    rng = np.random.default_rng(1)
    refused(look_at(lambda: rng.integers(0, 256, (1, 1, 3), dtype=np.uint8), size=(1, 1))[0], GameCode.NO_CARD, "too small")


@pytest.mark.parametrize("size", [(480, 640), (1, 1)])
def test_pictures_without_a_sheet_show_no_tubes(look_at, size):
    pieces, settings, rng = load_pieces(), TubeSettings.load(), np.random.default_rng(1)

    def locate(frame):
        return locate_tubes(frame.image, frame.camera, frame.base_from_camera, pieces, settings)

    def tube_look():
        votes = CardVoteSettings(window=8, agree=5)
        places = TubeVote(TubeVoteSettings(window=8, agree=5, tolerance_m=0.004))
        return TubeLook(locate, None, places, CardVote(votes), LossVote(votes))

    outcome, _ = look_at(lambda: rng.integers(250, 256, (*size, 3), dtype=np.uint8), size=size, look=tube_look)
    refused(outcome, GameCode.NO_TUBES, "NO_SHEET")


def test_a_card_is_read_in_a_picture_of_12_megapixels(look_at):
    picture = card_scene(3000, 4000)

    def make():
        # One pixel that flickers is enough for a living camera.
        picture[0, 0] += 1
        return picture

    found, _ = look_at(make, size=(3000, 4000))
    assert str(found.state) == STATE
    np.testing.assert_allclose(found.reading.corners.mean(axis=0), (1500, 1500), atol=10)


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"data": bytes(480 * 1920 - 1)}, "cut off: 921599 bytes in rows of 1920, expected 921600"),
        ({"step": 640}, "cut off"),
        ({"encoding": "bayer_rggb8"}, "image encoding is 'bayer_rggb8', expected one of rgb8, bgr8, mono8"),
        ({"encoding": "16UC1"}, "image encoding is '16UC1'"),
        ({"width": 0}, "image size is 0x480 px"),
        ({"width": 639}, "expected 480 rows x 640 columns"),
    ],
)
def test_images_that_cannot_be_read_end_as_no_camera_with_one_line_that_says_why(look_at, changes, words):
    def spoil(message):
        for name, value in changes.items():
            setattr(message, name, value)

    outcome, log = look_at(with_noise(card_scene(480, 640)), spoil=spoil)
    refused(outcome, GameCode.NO_CAMERA, words)
    assert words in log[0] and "\n" not in log[0]
