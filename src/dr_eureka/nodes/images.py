"""Camera images and calibrations between ROS messages and arrays."""

from __future__ import annotations

import cv2
import numpy as np
import rospy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from dr_eureka.errors import DrEurekaError
from dr_eureka.vision.camera import CameraModel

_CHANNELS = {"rgb8": 3, "bgr8": 3, "mono8": 1}
_LARGEST_SIDE_PX = 8192


class ImageError(DrEurekaError):
    """An image message that cannot be read; the text names its encoding or size and what was expected."""


def rgb_from_image(message: Image) -> np.ndarray:
    """Return (height, width, 3) uint8 rgb from a raw image of encoding rgb8, bgr8 or mono8."""
    channels = _CHANNELS.get(message.encoding)
    if channels is None:
        raise ImageError(f"image encoding is {message.encoding!r}, expected one of {', '.join(_CHANNELS)}")
    height, width, step = message.height, message.width, message.step
    if not 0 < height <= _LARGEST_SIDE_PX or not 0 < width <= _LARGEST_SIDE_PX:
        raise ImageError(f"image size is {width}x{height} px, expected 1 to {_LARGEST_SIDE_PX} each way")
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


def rgb_from_compressed(message: CompressedImage) -> np.ndarray:
    """Return (height, width, 3) uint8 rgb from a jpeg or png image."""
    data = np.frombuffer(message.data, np.uint8)
    bgr = cv2.imdecode(data, cv2.IMREAD_COLOR) if data.size else None
    if bgr is None:
        raise ImageError(f"compressed image of format {message.format!r} with {data.size} bytes cannot be decoded")
    return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)


def image_from_rgb(rgb: np.ndarray, stamp: rospy.Time, frame_id: str) -> Image:
    """Return an rgb8 message from (height, width, 3) uint8."""
    message = Image(encoding="rgb8", height=rgb.shape[0], width=rgb.shape[1], step=3 * rgb.shape[1])
    message.header.stamp = stamp
    message.header.frame_id = frame_id
    message.data = np.ascontiguousarray(rgb, dtype=np.uint8).tobytes()
    return message


def compressed_from_rgb(rgb: np.ndarray, stamp: rospy.Time, frame_id: str, quality: int) -> CompressedImage:
    """Return a jpeg message (quality 0..100) from (height, width, 3) uint8."""
    # The name of the format is image_transport's: how the pixels were, and how they are packed.
    message = CompressedImage(format="rgb8; jpeg compressed bgr8")
    message.header.stamp = stamp
    message.header.frame_id = frame_id
    _, data = cv2.imencode(".jpg", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, quality])
    message.data = data.tobytes()
    return message


def camera_from_info(info: CameraInfo) -> CameraModel:
    """Return the calibration in a CameraInfo; raises CameraError when it is none (all zero, NaN, too many coefficients)."""
    return CameraModel(info.width, info.height, np.array(info.K).reshape(3, 3), np.array(info.D))


def info_from_camera(camera: CameraModel, stamp: rospy.Time, frame_id: str) -> CameraInfo:
    """Return the CameraInfo of a calibration, unrectified (plumb_bob, R identity, P from K)."""
    info = CameraInfo(width=camera.width, height=camera.height, distortion_model="plumb_bob")
    info.header.stamp = stamp
    info.header.frame_id = frame_id
    info.K = camera.matrix.ravel().tolist()
    info.D = camera.distortion.ravel().tolist()
    info.R = np.eye(3).ravel().tolist()
    info.P = np.hstack([camera.matrix, np.zeros((3, 1))]).ravel().tolist()
    return info
