"""Bags read without a master: encodings, compressions, namespaces, camera poses, and everything that can be wrong."""

import bz2
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from recorded_bags import camera_info, compressed_image, head_states, image, joint_state, write_bag
from rosbags.rosbag1 import Writer

from dr_eureka.bags.frames import RecordedCamera, Stillness
from dr_eureka.bags.recording import BagError, Recording, Topic
from dr_eureka.kinematics.arms import head_chain
from dr_eureka.vision.camera import CameraModel

AT_REST = Stillness(still_window=0.25, still_tolerance=0.003)
CAMERA = CameraModel(32, 24, np.array([[40.0, 0, 16], [0, 41.0, 12], [0, 0, 1]]))


def picture(seed=0):
    """A smooth picture, so that jpeg changes it little."""
    coarse = np.random.default_rng(seed).integers(30, 220, (3, 4, 3)).astype(np.uint8)
    return np.kron(coarse, np.ones((8, 8, 1), np.uint8))


def decoded(path, topic="camera/image_raw"):
    with Recording(path) as recording:
        return [frame.image for frame in RecordedCamera(recording, AT_REST, topic).frames()]


def recorded(path, head_p=0.87, namespace="", **topics):
    """A bag of ten images at 10 Hz with calibration and a head at rest."""
    stamps = [100.0 + 0.1 * step for step in range(10)]
    contents = {
        f"{namespace}/camera/image_raw": [image(stamp, picture()) for stamp in stamps],
        f"{namespace}/camera/camera_info": [camera_info(100.0, CAMERA)],
        f"{namespace}/robotis/present_joint_states": head_states(99.0, 102.0, head_p),
    }
    return write_bag(path, {**contents, **topics})


@pytest.mark.parametrize("compression", ["none", "lz4", "bz2"])
@pytest.mark.parametrize("encoding", ["rgb8", "bgr8"])
def test_colour_images_come_back_exactly(tmp_path, encoding, compression):
    pictures = [picture(seed) for seed in range(3)]
    messages = [image(100.0 + seed, rgb, encoding) for seed, rgb in enumerate(pictures)]
    path = write_bag(tmp_path / "a.bag", {"/camera/image_raw": messages}, compression)
    np.testing.assert_array_equal(decoded(path), pictures)


def test_grey_images_come_back_with_three_equal_channels(tmp_path):
    path = write_bag(tmp_path / "a.bag", {"/camera/image_raw": [image(100.0, picture(), "mono8")]})
    (rgb,) = decoded(path)
    expected = picture() @ [0.299, 0.587, 0.114]
    assert np.abs(rgb - expected[..., None]).max() <= 1.0


def test_padding_at_the_end_of_rows_is_left_out(tmp_path):
    path = write_bag(tmp_path / "a.bag", {"/camera/image_raw": [image(100.0, picture(), padding=5)]})
    np.testing.assert_array_equal(decoded(path), [picture()])


@pytest.mark.parametrize("suffix, tolerance", [("png", 0.0), ("jpeg", 6.0)])
@pytest.mark.parametrize("asked", ["camera/image_raw", "camera/image_raw/compressed", "/camera/image_raw"])
def test_compressed_images_come_back(tmp_path, suffix, tolerance, asked):
    messages = [compressed_image(100.0, picture(), suffix)]
    path = write_bag(tmp_path / "a.bag", {"/camera/image_raw/compressed": messages})
    (rgb,) = decoded(path, asked)
    assert np.abs(rgb.astype(int) - picture()).mean() <= tolerance


@pytest.mark.parametrize("compression", ["none", "lz4", "bz2"])
def test_bags_written_by_ros_itself_are_read(tmp_path, compression):
    rosbag = pytest.importorskip("rosbag")
    sensor_msgs = pytest.importorskip("sensor_msgs.msg")
    message = sensor_msgs.Image(height=24, width=32, step=96, encoding="rgb8", data=picture().tobytes())
    message.header.stamp.secs, message.header.stamp.nsecs = 100, 250_000_000
    with rosbag.Bag(str(tmp_path / "a.bag"), "w", compression=compression) as bag:
        bag.write("/camera/image_raw", message)
    with Recording(tmp_path / "a.bag") as recording:
        (frame,) = RecordedCamera(recording, AT_REST).frames()
    assert frame.stamp_s == pytest.approx(100.25, abs=1e-9)
    np.testing.assert_array_equal(frame.image, picture())


@pytest.mark.parametrize("compression", ["none", "lz4", "bz2"])
def test_ros_reads_the_bags_these_tests_write(tmp_path, compression):
    rosbag = pytest.importorskip("rosbag")
    write_bag(tmp_path / "a.bag", {"/camera/image_raw": [image(100.0, picture())]}, compression)
    with rosbag.Bag(str(tmp_path / "a.bag")) as bag:
        ((_, message, _),) = bag.read_messages()
    assert message.data == picture().tobytes()


def test_topics_are_listed_with_type_and_number(tmp_path):
    with Recording(recorded(tmp_path / "a.bag")) as recording:
        assert recording.topics == (
            Topic("/camera/camera_info", "sensor_msgs/CameraInfo", 1),
            Topic("/camera/image_raw", "sensor_msgs/Image", 10),
            Topic("/robotis/present_joint_states", "sensor_msgs/JointState", 151),
        )


def test_topics_in_a_namespace_are_found(tmp_path):
    with Recording(recorded(tmp_path / "a.bag", namespace="/lab/robot1")) as recording:
        camera = RecordedCamera(recording, AT_REST)
        assert camera.topic.name == "/lab/robot1/camera/image_raw"
        assert camera.unplaced == ""
        assert len(list(camera.frames())) == 10


def test_a_topic_whose_name_merely_ends_alike_is_not_taken(tmp_path):
    path = write_bag(tmp_path / "a.bag", {"/webcamera/image_raw": [image(100.0, picture())]})
    with Recording(path) as recording, pytest.raises(BagError):
        RecordedCamera(recording, AT_REST)


def test_two_robots_must_be_told_apart_by_the_full_name(tmp_path):
    path = write_bag(
        tmp_path / "a.bag",
        {
            "/one/camera/image_raw": [image(100.0, picture())],
            "/two/camera/image_raw": [image(100.0, picture())],
            "/one/robotis/present_joint_states": head_states(99.0, 101.0, 0.1),
            "/two/robotis/present_joint_states": head_states(99.0, 101.0, 0.2),
            "/two/camera/camera_info": [camera_info(100.0, CAMERA)],
        },
    )
    with Recording(path) as recording:
        with pytest.raises(BagError, match="expected the full name of one: /one/camera/image_raw, /two/camera/image_raw"):
            RecordedCamera(recording, AT_REST)
        (frame,) = RecordedCamera(recording, AT_REST, "/two/camera/image_raw").frames()
    np.testing.assert_allclose(frame.base_from_camera, head_chain().forward(np.array([0.0, 0.0, 0.2])), atol=1e-12)


def test_the_calibration_is_the_one_beside_the_images(tmp_path):
    other = CameraModel(32, 24, np.array([[80.0, 0, 16], [0, 80.0, 12], [0, 0, 1]]))
    path = recorded(tmp_path / "a.bag", **{"/hand/camera/camera_info": [camera_info(100.0, other)]})
    with Recording(path) as recording:
        np.testing.assert_array_equal(RecordedCamera(recording, AT_REST).model.matrix, CAMERA.matrix)


def test_each_image_gets_the_pose_of_its_own_stamp(tmp_path):
    """The head turns by 0.1 rad/s; without stillness asked for, poses are those in between the joint states."""
    states = [
        joint_state(99.0 + 0.03 * step, {"head_p": 0.5 + 0.003 * step, "torso_y": 0.1, "head_y": -0.2, "r_arm_grip": 9.0})
        for step in range(101)
    ]
    path = recorded(tmp_path / "a.bag", **{"/robotis/present_joint_states": states})
    with Recording(path) as recording:
        frames = list(RecordedCamera(recording, Stillness(still_window=0.25, still_tolerance=0.5)).frames())
    assert [frame.stamp_s for frame in frames] == pytest.approx([100.0 + 0.1 * step for step in range(10)], abs=1e-9)
    for frame in frames:
        joints = np.array([0.1, -0.2, 0.5 + 0.1 * (frame.stamp_s - 99.0)])
        np.testing.assert_allclose(frame.base_from_camera, head_chain().forward(joints), atol=1e-9)


def test_images_taken_while_the_head_moves_are_left_out(tmp_path):
    states = head_states(99.0, 100.4, 0.5) + head_states(100.42, 102.0, 0.87)
    path = recorded(tmp_path / "a.bag", **{"/robotis/present_joint_states": states})
    with Recording(path) as recording:
        stamps = [frame.stamp_s for frame in RecordedCamera(recording, AT_REST).frames()]
    assert stamps == pytest.approx([100.0, 100.1, 100.2, 100.3, 100.4, 100.7, 100.8, 100.9], abs=1e-9)


def test_images_without_joint_states_are_read_but_have_no_pose(tmp_path):
    path = write_bag(
        tmp_path / "a.bag",
        {"/camera/image_raw": [image(100.0, picture())], "/camera/camera_info": [camera_info(100.0, CAMERA)]},
    )
    with Recording(path) as recording:
        camera = RecordedCamera(recording, AT_REST)
        (frame,) = camera.frames()
    assert frame.base_from_camera is None
    assert "no topic robotis/present_joint_states [sensor_msgs/JointState]" in camera.unplaced


def test_joint_states_without_a_head_are_named(tmp_path):
    states = [joint_state(100.0, {"l_arm_el_y": 0.0})]
    with Recording(recorded(tmp_path / "a.bag", **{"/robotis/present_joint_states": states})) as recording:
        assert "has the head's joints torso_y, head_y, head_p" in RecordedCamera(recording, AT_REST).unplaced


def test_a_calibration_of_zeros_is_named(tmp_path):
    info = camera_info(100.0, CAMERA)
    info.K[:] = 0.0
    with Recording(recorded(tmp_path / "a.bag", **{"/camera/camera_info": [info]})) as recording:
        camera = RecordedCamera(recording, AT_REST)
        assert camera.unplaced.startswith("camera matrix is [0.0,")
        assert len(list(camera.frames())) == 10


def test_a_fisheye_calibration_is_refused(tmp_path):
    info = camera_info(100.0, CAMERA, model="equidistant")
    with Recording(recorded(tmp_path / "a.bag", **{"/camera/camera_info": [info]})) as recording:
        assert RecordedCamera(recording, AT_REST).unplaced == "camera distortion model is 'equidistant', expected 'plumb_bob'"


def test_a_damaged_image_is_counted_and_left_out(tmp_path):
    broken = compressed_image(100.1, picture())
    broken.data = broken.data[:7]
    messages = [compressed_image(100.0, picture()), broken, compressed_image(100.2, picture())]
    path = write_bag(tmp_path / "a.bag", {"/camera/image_raw/compressed": messages})
    with Recording(path) as recording:
        camera = RecordedCamera(recording, AT_REST)
        assert len(list(camera.frames())) == 2
        assert camera.unreadable == 1


@pytest.mark.parametrize(
    "spoil, message",
    [
        (dict(encoding="32FC1"), "image encoding is '32FC1', expected one of rgb8, bgr8, mono8"),
        (dict(height=25), "image is cut off: 2304 bytes in rows of 96, expected 2400 for 32x25 rgb8"),
        (dict(width=0), "image size is 0x24 px, expected 1 to 8192 each way"),
        (dict(step=32), "image is cut off: 2304 bytes in rows of 32, expected 2304 for 32x24 rgb8"),
    ],
)
def test_a_bag_without_one_readable_image_is_refused(tmp_path, spoil, message):
    spoilt = image(100.0, picture())
    for name, value in spoil.items():
        setattr(spoilt, name, value)
    path = write_bag(tmp_path / "a.bag", {"/camera/image_raw": [spoilt]})
    with pytest.raises(BagError) as caught:
        decoded(path)
    assert str(caught.value) == f"{path}: no image of /camera/image_raw can be decoded: {message}"


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(BagError, match=re.escape(f"{tmp_path / 'none.bag'}: no such file")):
        Recording(tmp_path / "none.bag")


def test_a_folder_is_no_bag(tmp_path):
    with pytest.raises(BagError, match="no such file"):
        Recording(tmp_path)


@pytest.mark.parametrize("content", [b"", b"no bag at all\n", b"#ROSBAG V1.2\n", b"\xff\xfe\x00\n" * 9, bz2.compress(b"x")])
def test_a_file_that_is_no_bag_is_refused_in_one_line(tmp_path, content):
    path = tmp_path / "a.bag"
    path.write_bytes(content)
    with pytest.raises(BagError) as caught:
        Recording(path)
    assert str(caught.value).startswith(f"{path}: not a readable ROS 1 bag: ")
    assert "\n" not in str(caught.value)


def test_a_bag_whose_recorder_was_killed_is_refused(tmp_path):
    path = recorded(tmp_path / "a.bag")
    data = path.read_bytes()
    path.write_bytes(re.sub(rb"index_pos=.{8}", b"index_pos=" + bytes(8), data, count=1, flags=re.DOTALL))
    with pytest.raises(BagError, match="not indexed, reindex before reading"):
        Recording(path)


def test_a_bag_cut_short_anywhere_is_refused_or_read(tmp_path):
    whole = recorded(tmp_path / "a.bag").read_bytes()
    for size in np.linspace(1, len(whole) - 1, 60).astype(int):
        path = tmp_path / "cut.bag"
        path.write_bytes(whole[:size])
        with pytest.raises(BagError), Recording(path) as recording:
            list(RecordedCamera(recording, AT_REST).frames())


def test_damage_inside_a_compressed_bag_is_named(tmp_path):
    stamps = [100.0 + 0.1 * step for step in range(10)]
    path = write_bag(tmp_path / "a.bag", {"/camera/image_raw": [image(stamp, picture(3)) for stamp in stamps]}, "bz2")
    data = bytearray(path.read_bytes())
    at = data.index(b"BZh9") + 40
    data[at : at + 20] = bytes(20)
    path.write_bytes(data)
    with pytest.raises(BagError, match="damaged at a message of /camera/image_raw"):
        decoded(path)


def test_a_bag_without_a_camera_lists_what_it_has(tmp_path):
    path = write_bag(tmp_path / "a.bag", {"/robotis/present_joint_states": head_states(99.0, 100.0, 0.5)})
    with Recording(path) as recording, pytest.raises(BagError) as caught:
        RecordedCamera(recording, AT_REST)
    assert str(caught.value) == (
        f"{path}: no topic camera/image_raw [sensor_msgs/Image] or camera/image_raw/compressed "
        "[sensor_msgs/CompressedImage] or camera/image_raw [sensor_msgs/CompressedImage]; "
        "topics in the bag: /robotis/present_joint_states [sensor_msgs/JointState]"
    )


def test_an_empty_bag_has_no_topics(tmp_path):
    with Writer(tmp_path / "a.bag"):
        pass
    with Recording(tmp_path / "a.bag") as recording:
        with pytest.raises(BagError, match="topics in the bag: none$"):
            RecordedCamera(recording, AT_REST)


def test_closing_twice_is_no_error(tmp_path):
    recording = Recording(recorded(tmp_path / "a.bag"))
    recording.close()
    recording.close()


def test_bags_are_read_without_rospy():
    source = Path(__file__).resolve().parent.parent / "src"
    program = (
        "import sys; sys.modules['rospy'] = sys.modules['cv_bridge'] = sys.modules['rosbag'] = None; "
        "import dr_eureka.bags.replay"
    )
    subprocess.run([sys.executable, "-c", program], env={"PYTHONPATH": str(source)}, check=True, timeout=60)
