"""Camera images and calibrations out of ROS messages, whatever library made the message objects.

The functions read only the fields that ROS 1 defines, so they take rosbags' objects as well as rospy's.
"""
from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from dr_eureka.errors import DrEurekaError
from dr_eureka.vision.camera import CameraError, CameraModel
from dr_eureka.vision.pictures import PictureError, decode_picture

LARGEST_SIDE_PX = 8192
_CHANNELS = {"rgb8": 3, "bgr8": 3, "mono8": 1}
_DISTORTION_MODELS = ("", "plumb_bob")


class ImageError(DrEurekaError):
    """An image message that cannot be read; the text names its encoding or size and what was expected."""


def rgb_from_image(message: Any) -> np.ndarray:
    """Return (height, width, 3) uint8 rgb from a sensor_msgs/Image of encoding rgb8, bgr8 or mono8.

    Raises:
        ImageError: for another encoding, an impossible size, or fewer bytes than the size needs.
    """
    channels = _CHANNELS.get(message.encoding)
    if channels is None:
        raise ImageError(f"image encoding is {message.encoding!r}, expected one of {', '.join(_CHANNELS)}")
    height, width, step = message.height, message.width, message.step
    if not 0 < height <= LARGEST_SIDE_PX or not 0 < width <= LARGEST_SIDE_PX:
        raise ImageError(f"image size is {width}x{height} px, expected 1 to {LARGEST_SIDE_PX} each way")
    if step < width * channels or len(message.data) < step * height:
        raise ImageError(
            f"image is cut off: {len(message.data)} bytes in rows of {step}, expected {width * channels * height} "
            f"for {width}x{height} {message.encoding}"
        )
    rows = np.frombuffer(message.data, np.uint8, step * height).reshape(height, step)[:, : width * channels]
    pixels = rows.reshape(height, width, channels)
    if message.encoding == "rgb8":
        return np.ascontiguousarray(pixels)
    return cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB if channels == 3 else cv2.COLOR_GRAY2RGB)


def rgb_from_compressed(message: Any) -> np.ndarray:
    """Return (height, width, 3) uint8 rgb from a sensor_msgs/CompressedImage, jpeg or png.

    Raises:
        ImageError: when the bytes are no whole picture that can be decoded.
    """
    try:
        return decode_picture(bytes(message.data))
    except PictureError as error:
        raise ImageError(f"compressed image of format {message.format!r}: {error}") from error


def camera_from_info(message: Any) -> CameraModel:
    """Return the calibration in a sensor_msgs/CameraInfo.

    Raises:
        CameraError: when it is none (all zero, NaN, too many coefficients) or of another distortion model.
    """
    if message.distortion_model not in _DISTORTION_MODELS:
        raise CameraError(f"camera distortion model is {message.distortion_model!r}, expected 'plumb_bob'")
    return CameraModel(message.width, message.height, np.array(message.K).reshape(3, 3), np.array(message.D))
