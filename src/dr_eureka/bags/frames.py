"""Recorded images with the calibration and the pose of the camera that took them."""
from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Optional

import numpy as np

from dr_eureka.bags.images import ImageError, camera_from_info, rgb_from_compressed, rgb_from_image
from dr_eureka.bags.recording import BagError, Recording, Topic
from dr_eureka.behaviour.head_history import HeadHistory
from dr_eureka.kinematics.arms import head_chain
from dr_eureka.vision.camera import CameraError, CameraModel

IMAGE_TOPIC = "camera/image_raw"
JOINT_STATES_TOPIC = "robotis/present_joint_states"
_DECODERS = {"sensor_msgs/Image": rgb_from_image, "sensor_msgs/CompressedImage": rgb_from_compressed}


@dataclass(frozen=True)
class Stillness:
    """When the head is at rest: no joint moved more than `still_tolerance` [rad] in the last `still_window` [s]."""

    still_window: float = field(metadata={"min": 0.0, "max": 10.0})
    still_tolerance: float = field(metadata={"min": 0.0, "max": 0.5})


@dataclass(frozen=True, eq=False)
class RecordedFrame:
    """An image (height, width, 3) uint8 rgb and the pose (4, 4) of its camera, None where that is not recorded."""

    stamp_s: float
    image: np.ndarray
    base_from_camera: Optional[np.ndarray]


class RecordedCamera:
    """The camera of a recording, with the joint states that tell where it was.

    Attributes:
        topic: the topic of the images.
        model: the camera's calibration, None where there is none.
        unplaced: why images have no pose or calibration, in one line; empty when they have.
        unreadable: how many images could not be decoded so far.

    Raises:
        BagError: when the recording has no such camera; the text lists its topics.
    """

    def __init__(self, recording: Recording, stillness: Stillness, image_topic: str = IMAGE_TOPIC) -> None:
        self._recording = recording
        self._stillness = stillness
        self._history: Optional[HeadHistory] = None
        self.model: Optional[CameraModel] = None
        self.unplaced = ""
        self.unreadable = 0
        self.topic = recording.find(
            (image_topic, "sensor_msgs/Image"),
            (f"{image_topic}/compressed", "sensor_msgs/CompressedImage"),
            (image_topic, "sensor_msgs/CompressedImage"),
        )
        try:
            self._history = _head_history(recording, self.topic)
            self.model = _camera_model(recording, self.topic)
        except (BagError, CameraError) as error:
            self.unplaced = str(error)

    def frames(self) -> Iterator[RecordedFrame]:
        """Yield the images in order, leaving out those that cannot be decoded or were taken while the head moved.

        Raises:
            BagError: when the recording is damaged, or not one image could be decoded.
        """
        decode = _DECODERS[self.topic.type]
        decoded = 0
        for stamp_s, message in self._recording.messages(self.topic):
            try:
                image = decode(message)
            except ImageError as error:
                self.unreadable += 1
                problem = error
                continue
            decoded += 1
            if self._history is None:
                yield RecordedFrame(stamp_s, image, None)
            elif self._history.still(stamp_s, self._stillness.still_window, self._stillness.still_tolerance):
                yield RecordedFrame(stamp_s, image, head_chain().forward(self._history.at(stamp_s)))
        if self.unreadable and not decoded:
            raise BagError(self._recording.path, f"no image of {self.topic.name} can be decoded: {problem}")


def _head_history(recording: Recording, image_topic: Topic) -> HeadHistory:
    topic = recording.find((JOINT_STATES_TOPIC, "sensor_msgs/JointState"), near=image_topic.name)
    history = HeadHistory(head_chain().joint_names, keep_s=math.inf)
    for stamp_s, message in recording.messages(topic):
        history.add(stamp_s, dict(zip(message.name, message.position)))
    if history.newest_s is None:
        names = ", ".join(head_chain().joint_names)
        raise BagError(recording.path, f"no message of {topic.name} has the head's joints {names}")
    return history


def _camera_model(recording: Recording, image_topic: Topic) -> CameraModel:
    """Return the calibration published beside the images, as `camera_info` in the namespace of `image_raw`."""
    image_name = image_topic.name
    if image_topic.type == "sensor_msgs/CompressedImage":
        image_name = image_name.rpartition("/compressed")[0] or image_name
    name = f"{image_name.rpartition('/')[0]}/camera_info"
    topic = recording.find((name, "sensor_msgs/CameraInfo"))
    for _, message in recording.messages(topic):
        return camera_from_info(message)
    raise BagError(recording.path, f"no message on {topic.name}")
