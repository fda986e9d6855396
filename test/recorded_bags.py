"""Small bags for tests, written by rosbags."""

from __future__ import annotations

import functools
from pathlib import Path

import cv2
import lz4.frame
import numpy as np
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

TYPES = get_typestore(Stores.ROS1_NOETIC)
HEAD_JOINTS = ("torso_y", "head_y", "head_p")


def header(stamp_s: float):
    seconds = int(stamp_s)
    stamp = TYPES.types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=round((stamp_s - seconds) * 1e9))
    return TYPES.types["std_msgs/msg/Header"](seq=0, stamp=stamp, frame_id="cam_link")


def image(stamp_s: float, rgb: np.ndarray, encoding: str = "rgb8", padding: int = 0):
    """A sensor_msgs/Image of (height, width, 3) uint8 rgb, each row followed by `padding` bytes of rubbish."""
    pixels = {
        "rgb8": lambda: rgb,
        "bgr8": lambda: rgb[..., ::-1],
        "mono8": lambda: cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY),
    }[encoding]()
    rows = np.full((rgb.shape[0], pixels[0].size + padding), 99, np.uint8)
    rows[:, : pixels[0].size] = pixels.reshape(rgb.shape[0], -1)
    return TYPES.types["sensor_msgs/msg/Image"](
        header=header(stamp_s), height=rgb.shape[0], width=rgb.shape[1], encoding=encoding, is_bigendian=0,
        step=rows.shape[1], data=rows.ravel(),
    )


def compressed_image(stamp_s: float, rgb: np.ndarray, suffix: str = "jpeg"):
    """A sensor_msgs/CompressedImage of (height, width, 3) uint8 rgb."""
    _, data = cv2.imencode(f".{suffix}", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR))
    return TYPES.types["sensor_msgs/msg/CompressedImage"](
        header=header(stamp_s), format=f"rgb8; {suffix} compressed bgr8", data=np.frombuffer(data.tobytes(), np.uint8)
    )


def camera_info(stamp_s: float, camera, model: str = "plumb_bob"):
    """A sensor_msgs/CameraInfo of a CameraModel."""
    region = TYPES.types["sensor_msgs/msg/RegionOfInterest"](x_offset=0, y_offset=0, height=0, width=0, do_rectify=False)
    return TYPES.types["sensor_msgs/msg/CameraInfo"](
        header=header(stamp_s), height=camera.height, width=camera.width, distortion_model=model,
        D=np.array(camera.distortion, dtype=float), K=np.array(camera.matrix, dtype=float).ravel(),
        R=np.eye(3).ravel(), P=np.zeros(12), binning_x=0, binning_y=0, roi=region,
    )


def joint_state(stamp_s: float, joints: dict[str, float]):
    """A sensor_msgs/JointState of joint positions [rad] by name."""
    nothing = np.zeros(0)
    return TYPES.types["sensor_msgs/msg/JointState"](
        header=header(stamp_s), name=list(joints), position=np.array(list(joints.values()), dtype=float),
        velocity=nothing, effort=nothing,
    )


def head_states(begin_s: float, end_s: float, head_p: float, rate_hz: float = 50.0):
    """Joint states of a head at rest, looking down by `head_p` [rad]."""
    times = np.arange(begin_s, end_s + 1e-9, 1 / rate_hz)
    return [joint_state(float(time_s), {"torso_y": 0.0, "head_y": 0.0, "head_p": head_p}) for time_s in times]


def write_bag(path: Path, topics: dict[str, list], compression: str = "none", recorded_later_s: float = 0.01) -> Path:
    """Write messages by topic, each recorded a little after its header's stamp, in the order of recording."""
    writer = Writer(path)
    if compression != "none":
        writer.set_compression(Writer.CompressionFormat[compression.upper()])
    if compression == "lz4":
        # ROS's own lz4 reader takes only independent blocks with a checksum.
        writer.compressor = functools.partial(
            lz4.frame.compress, block_linked=False, content_checksum=True, store_size=False
        )
    with writer:
        pending = []
        for topic, messages in topics.items():
            kind = messages[0].__msgtype__
            connection = writer.add_connection(topic, kind, typestore=TYPES)
            for message in messages:
                stamp = message.header.stamp
                recorded_ns = stamp.sec * 10**9 + stamp.nanosec + round(recorded_later_s * 1e9)
                pending.append((recorded_ns, len(pending), connection, kind, message))
        for recorded_ns, _, connection, kind, message in sorted(pending, key=lambda item: item[:2]):
            writer.write(connection, recorded_ns, TYPES.serialize_ros1(message, kind))
    return path
