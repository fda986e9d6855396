"""Images and calibrations between ROS messages and arrays, without a master."""

import numpy as np
import pytest

pytest.importorskip("rospy")

import rospy
from sensor_msgs.msg import CompressedImage, Image

from dr_eureka.bags.images import ImageError, camera_from_info, rgb_from_compressed, rgb_from_image
from dr_eureka.nodes.images import compressed_from_rgb, image_from_rgb, info_from_camera
from dr_eureka.vision.camera import CameraError, CameraModel

RGB = np.random.default_rng(1).integers(0, 256, (5, 7, 3), dtype=np.uint8)
STAMP = rospy.Time(12, 34)


def image(encoding, pixels, padding=0):
    """Return an image message with `padding` bytes behind every row."""
    rows = np.pad(pixels.reshape(pixels.shape[0], -1), ((0, 0), (0, padding)))
    return Image(encoding=encoding, height=rows.shape[0], width=pixels.shape[1], step=rows.shape[1], data=rows.tobytes())


def test_an_image_survives_the_way_there_and_back():
    message = image_from_rgb(RGB, STAMP, "cam_link")
    assert (message.header.stamp, message.header.frame_id, message.encoding) == (STAMP, "cam_link", "rgb8")
    np.testing.assert_array_equal(rgb_from_image(message), RGB)


@pytest.mark.parametrize("padding", [0, 3])
def test_colours_are_told_apart_in_every_encoding(padding):
    np.testing.assert_array_equal(rgb_from_image(image("rgb8", RGB, padding)), RGB)
    np.testing.assert_array_equal(rgb_from_image(image("bgr8", RGB[..., ::-1], padding)), RGB)
    grey = RGB[..., :1]
    np.testing.assert_array_equal(rgb_from_image(image("mono8", grey, padding)), np.repeat(grey, 3, axis=2))


@pytest.mark.parametrize(
    "message, words",
    [
        (image("bayer_rggb8", RGB[..., :1]), "'bayer_rggb8', expected one of rgb8, bgr8, mono8"),
        (Image(encoding="rgb8"), "size is 0x0"),
        (Image(encoding="rgb8", height=5, width=7, step=21, data=bytes(100)), "cut off: 100 bytes"),
        (Image(encoding="rgb8", height=5, width=7, step=7, data=bytes(35)), "cut off"),
        (Image(encoding="mono8", height=1, width=2**31, step=2**31, data=b"x"), "expected 1 to 8192"),
    ],
)
def test_an_image_that_cannot_be_read_is_refused_by_name(message, words):
    with pytest.raises(ImageError, match=words):
        rgb_from_image(message)


def test_a_jpeg_comes_back_with_its_colours():
    smooth = np.zeros((48, 64, 3), np.uint8)
    smooth[:, :32], smooth[:, 32:] = (200, 40, 30), (30, 60, 190)
    message = compressed_from_rgb(smooth, STAMP, "cam_link", quality=95)
    assert message.header.stamp == STAMP
    decoded = rgb_from_compressed(message).astype(int)
    assert np.abs(decoded - smooth)[:, [8, 56]].max() < 8


PACKED = compressed_from_rgb(RGB, STAMP, "cam_link", quality=95).data


@pytest.mark.parametrize(
    "data, words", [(b"", "no picture"), (b"no image at all", "no picture"), (PACKED[:-2], "cut off"), (PACKED[:100], "cut off")]
)
def test_a_compressed_image_that_is_none_or_cut_off_is_refused(data, words):
    with pytest.raises(ImageError, match=f"of format 'jpeg': .*{words}"):
        rgb_from_compressed(CompressedImage(format="jpeg", data=data))


def test_a_calibration_survives_the_way_there_and_back():
    camera = CameraModel.lab(distorted=True)
    info = info_from_camera(camera, STAMP, "cam_link")
    back = camera_from_info(info)
    np.testing.assert_array_equal(back.matrix, camera.matrix)
    np.testing.assert_array_equal(back.distortion, camera.distortion)
    assert (back.width, back.height, info.P[3]) == (640, 480, 0.0)


def test_an_uncalibrated_cameras_info_is_refused():
    info = info_from_camera(CameraModel.lab(), STAMP, "cam_link")
    info.K = [0.0] * 9
    with pytest.raises(CameraError, match="fx, fy > 0"):
        camera_from_info(info)
