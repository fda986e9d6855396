"""The command `replay_bag` on bags whose images are drawn with a known answer."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from recorded_bags import camera_info, compressed_image, head_states, image, write_bag
from tube_scenes import Scene, draw

from dr_eureka.bags.frames import RecordedCamera
from dr_eureka.bags.recording import Recording
from dr_eureka.bags.replay import ReplaySettings, replay
from dr_eureka.cli import replay_bag
from dr_eureka.kinematics.arms import head_chain
from dr_eureka.pieces import load_pieces
from dr_eureka.vision.camera import CameraModel
from dr_eureka.vision.cards import CardReading, CardResult
from dr_eureka.vision.tubes import NAMES

PACKAGE = Path(__file__).resolve().parent.parent
CARD_PITCH, SHEET_PITCH = 0.5, 0.87
CAMERA = CameraModel.lab()
PLAIN = np.full((480, 640, 3), 128, np.uint8)


class RobotScene(Scene):
    """A scene seen by the camera that the robot description has."""

    @property
    def base_from_camera(self):
        return head_chain().forward(np.array([0.0, 0.0, self.head_pitch]))


class CardInTheCorner:
    """Reads a card that is nothing but a red upper left pixel, so that these tests need no trained weights."""

    def read(self, image_rgb):
        if image_rgb[0, 0, 0] > 200 and image_rgb[0, 0, 1] < 80:
            return CardReading(CardResult.OK, "RG|PG|RP", 0.97)
        return CardReading(CardResult.NO_CARD, reason="no outline of a card")


@pytest.fixture(scope="module")
def tubes_scene():
    tubes = np.array([[-0.03, 0.112], [-0.04, 0.003], [-0.033, -0.107]])
    return RobotScene(sheet=(0.478, -0.004, 0.05), tubes=tubes, noise=2.0)


@pytest.fixture(scope="module")
def tube_pictures(tubes_scene):
    pictures = []
    for seed in range(7):
        tubes_scene.seed = seed
        pictures.append(draw(tubes_scene, load_pieces(), CAMERA))
    return pictures


@pytest.fixture()
def no_weights(monkeypatch):
    monkeypatch.setattr(replay_bag.CardReader, "load", classmethod(lambda cls: CardInTheCorner()))


def card_picture():
    picture = PLAIN.copy()
    picture[:20, :20] = (255, 10, 10)
    return picture


def flickering(rgb, count):
    """Return pictures that differ in a corner, even as JPEG: no two of a living camera are alike."""
    pictures = np.repeat(rgb[None], count, axis=0)
    for number, picture in enumerate(pictures):
        picture[-16:, -16:] = 20 * number
    return list(pictures)


def game_topics(tube_pictures, namespace="", card=True, make_image=image, topic="camera/image_raw"):
    """A recorded beginning of a game at 10 Hz: two images of nothing, six of the card, then the sheet."""
    first = flickering(PLAIN, 2) + flickering(card_picture() if card else PLAIN, 6)
    images = [make_image(100.0 + 0.1 * step, rgb) for step, rgb in enumerate(first)]
    images += [make_image(102.0 + 0.1 * step, rgb) for step, rgb in enumerate(tube_pictures)]
    return {
        f"{namespace}/{topic}": images,
        f"{namespace}/camera/camera_info": [camera_info(100.0, CAMERA)],
        f"{namespace}/robotis/present_joint_states": head_states(99.0, 100.9, CARD_PITCH)
        + head_states(101.0, 103.0, SHEET_PITCH),
    }


def run(capsys, path, *arguments):
    assert replay_bag.main([str(path), "--json", *arguments]) == 0
    return json.loads(capsys.readouterr().out)


def largest_error_m(seen, scene):
    return np.linalg.norm([seen["tubes"][name] for name in NAMES] - scene.tubes_in_base, axis=1).max()


@pytest.mark.parametrize("namespace", ["", "/lab"])
def test_card_and_tubes_of_a_game_are_seen(tmp_path, capsys, no_weights, tube_pictures, tubes_scene, namespace):
    seen = run(capsys, write_bag(tmp_path / "a.bag", game_topics(tube_pictures, namespace), "lz4"))
    assert seen["images"] == 15 and seen["unreadable_images"] == 0
    assert seen["card"] == {"result": "OK", "state": "RG|PG|RP", "confidence": 0.97}
    assert seen["tubes_result"] == "OK"
    assert largest_error_m(seen, tubes_scene) < 0.003
    assert seen["topics"][f"{namespace}/camera/image_raw"] == {"type": "sensor_msgs/Image", "messages": 15}


def test_compressed_images_in_a_bz2_bag_are_seen_too(tmp_path, capsys, no_weights, tube_pictures, tubes_scene):
    topics = game_topics(tube_pictures, make_image=compressed_image, topic="camera/image_raw/compressed")
    seen = run(capsys, write_bag(tmp_path / "a.bag", topics, "bz2"))
    assert seen["card"]["state"] == "RG|PG|RP"
    assert largest_error_m(seen, tubes_scene) < 0.003


def test_a_recording_without_a_card_still_shows_the_tubes(tmp_path, capsys, no_weights, tube_pictures, tubes_scene):
    seen = run(capsys, write_bag(tmp_path / "a.bag", game_topics(tube_pictures, card=False)))
    assert seen["card"]["result"] == "NO_CARD" and seen["card"]["state"] is None
    assert "no outline of a card" in seen["card"]["reason"]
    assert largest_error_m(seen, tubes_scene) < 0.003


def test_tubes_seen_before_the_card_are_looked_for_again(tmp_path, no_weights, tube_pictures, tubes_scene):
    """A robot whose head hung down at first saw the tubes elsewhere; what counts is after the card."""
    moved = RobotScene(sheet=(0.47, 0.0, 0.0), noise=2.0)
    before = draw(moved, load_pieces(), CAMERA)
    topics = game_topics(tube_pictures)
    topics["/camera/image_raw"] = [
        image(90.0 + 0.1 * step, rgb) for step, rgb in enumerate(flickering(before, 6))
    ] + topics["/camera/image_raw"]
    topics["/robotis/present_joint_states"] = head_states(89.0, 91.0, SHEET_PITCH) + topics["/robotis/present_joint_states"]
    with Recording(write_bag(tmp_path / "a.bag", topics)) as recording:
        settings = ReplaySettings.load()
        camera = RecordedCamera(recording, settings.stillness)
        sighting = replay(camera, CardInTheCorner(), load_pieces(), settings)
    np.testing.assert_allclose(sighting.tubes.tubes["left"].position, tubes_scene.tubes_in_base[0], atol=0.003)


def test_a_recording_of_a_frozen_camera_shows_no_card(tmp_path, capsys, no_weights, tube_pictures):
    topics = game_topics(tube_pictures)
    topics["/camera/image_raw"] = [image(100.0 + 0.1 * step, card_picture()) for step in range(20)]
    seen = run(capsys, write_bag(tmp_path / "a.bag", topics))
    assert (seen["images"], seen["card"]["state"]) == (20, None)
    assert "1 RG|PG|RP, expected 5 alike" in seen["card"]["reason"]


def test_without_joint_states_the_card_is_read_and_the_reason_is_named(tmp_path, capsys, no_weights, tube_pictures):
    topics = game_topics(tube_pictures)
    del topics["/robotis/present_joint_states"]
    seen = run(capsys, write_bag(tmp_path / "a.bag", topics))
    assert seen["card"]["state"] == "RG|PG|RP"
    assert seen["tubes"] == {} and seen["tubes_result"] == "NO_CAMERA_POSE"
    assert "no topic robotis/present_joint_states" in seen["tubes_reason"]


def test_the_text_for_a_person_names_card_and_places(tmp_path, capsys, no_weights, tube_pictures):
    path = write_bag(tmp_path / "a.bag", game_topics(tube_pictures))
    assert replay_bag.main([str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"{path}: 15 images on /camera/image_raw"
    assert lines[1] == "card: RG|PG|RP (confidence 0.97)"
    assert [line.split(":")[0] for line in lines[2:]] == ["left tube", "center tube", "right tube"]


def test_a_damaged_image_is_counted(tmp_path, capsys, no_weights, tube_pictures):
    topics = game_topics(tube_pictures)
    topics["/camera/image_raw"][0].encoding = "nonsense"
    seen = run(capsys, write_bag(tmp_path / "a.bag", topics))
    assert seen["unreadable_images"] == 1 and seen["card"]["state"] == "RG|PG|RP"


def test_a_missing_bag_ends_with_one_line_and_code_2(tmp_path, capsys):
    assert replay_bag.main([str(tmp_path / "none.bag")]) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err == f"replay_bag: {tmp_path / 'none.bag'}: no such file\n"


def test_a_bag_without_a_camera_ends_with_one_line_that_lists_its_topics(tmp_path, capsys):
    path = write_bag(tmp_path / "a.bag", {"/robotis/present_joint_states": head_states(0.0, 1.0, 0.5)})
    assert replay_bag.main([str(path)]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert message.endswith("topics in the bag: /robotis/present_joint_states [sensor_msgs/JointState]\n")


def test_help_needs_no_master():
    environment = {key: value for key, value in os.environ.items() if not key.startswith("ROS_")}
    environment["PYTHONPATH"] = str(PACKAGE / "src")
    command = [sys.executable, str(PACKAGE / "scripts" / "replay_bag"), "--help"]
    finished = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
    assert finished.returncode == 0
    assert "--image TOPIC" in finished.stdout
