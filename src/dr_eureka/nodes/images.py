"""Camera images and calibrations as ROS messages; reading them is `bags.images`' work, live or recorded."""

from __future__ import annotations

import cv2
import numpy as np
import rospy
from cv_bridge import CvBridge
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from dr_eureka.vision.camera import CameraModel

_BRIDGE = CvBridge()


def image_from_rgb(rgb: np.ndarray, stamp: rospy.Time, frame_id: str) -> Image:
    """Return an rgb8 message from (height, width, 3) uint8."""
    message = _BRIDGE.cv2_to_imgmsg(np.ascontiguousarray(rgb, dtype=np.uint8), "rgb8")
    message.header.stamp = stamp
    message.header.frame_id = frame_id
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
