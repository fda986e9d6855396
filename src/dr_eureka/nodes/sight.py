"""Camera images with the pose of the camera at the moment each was taken."""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import Optional

import rospy
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState

from dr_eureka.bags.images import ImageError, camera_from_info, rgb_from_compressed, rgb_from_image
from dr_eureka.behaviour.head_history import HeadHistory
from dr_eureka.behaviour.observation import Frame, Gaze, ImageHeader
from dr_eureka.kinematics.arms import head_chain
from dr_eureka.vision.camera import CameraError, CameraModel
from dr_eureka.vision.voting import RepeatedPictures

TRANSPORTS = ("raw", "compressed")
# An image this much older than the last one is not late: a recording has begun again.
_JUMP_BACK_S = 1.0
# Least robot time between two lines of the log about images that are dropped [s].
_COMPLAINT_S = 5.0


@dataclass(frozen=True)
class SightSettings:
    """Which images are used; see the comments in config/dr_eureka_main.yaml.

    `backlog` is how many images wait: 1 for a robot, to which only the newest matters; more for a recording, so that it
    leads to what the robot decided, however slow this machine is. `history` [s] is how long joint states are kept.
    """

    image_max_age: float
    pose_limit: float
    still_window: float
    still_tolerance: float
    backlog: int
    history: float


class Sight:
    """The images of `camera/image_raw`, each with calibration and pose.

    An image is usable when it decodes, is newer than the last and not the same picture, fits the calibration, which is
    that of `camera/camera_info` unless a `camera` is given, and when `robotis/present_joint_states` tell where the head was
    at its stamp and that it was at rest. Otherwise `problem` says what is wrong in one line; `frozen` tells that images
    come, but nothing new in them.
    """

    def __init__(self, settings: SightSettings, transport: str, camera: Optional[CameraModel] = None):
        self._settings = settings
        self._chain = head_chain()
        self._history = HeadHistory(tuple(self._chain.joint_names), settings.history)
        self._lock = threading.Lock()
        self._pending: deque[tuple[float, float, Image | CompressedImage]] = deque(maxlen=settings.backlog)
        self._camera = camera
        self._info: Optional[CameraInfo] = None
        self._last_stamp_s = 0.0
        self._repeated = RepeatedPictures()
        self._compressed = transport == "compressed"
        self._topic = "camera/image_raw/compressed" if self._compressed else "camera/image_raw"
        self._subscriber: Optional[rospy.Subscriber] = None
        self.seen = False
        self.frozen = False
        self.problem = f"no image on {rospy.resolve_name(self._topic)}"
        rospy.Subscriber("camera/camera_info", CameraInfo, self.hear_info, queue_size=1)
        rospy.Subscriber("robotis/present_joint_states", JointState, self.hear_joints, queue_size=10, tcp_nodelay=True)

    def open(self, wanted: bool) -> None:
        """Subscribe to the images or stop doing so; a camera that nobody watches costs nothing."""
        if wanted and self._subscriber is None:
            kind = CompressedImage if self._compressed else Image
            self._subscriber = rospy.Subscriber(self._topic, kind, self.hear_image, queue_size=self._settings.backlog)
        elif not wanted and self._subscriber is not None:
            self._subscriber.unregister()
            self._subscriber = None

    @property
    def head(self) -> Optional[Gaze]:
        """Where the head points now, None before the first joint state."""
        with self._lock:
            joints = self._history.newest()
        return Gaze(joints["head_y"], joints["head_p"]) if joints else None

    def take(self) -> Optional[Frame]:
        """Return the next waiting image if it is usable."""
        with self._lock:
            if not self._pending:
                return None
            info = self._info
            arrived_s, stamp_s, message = self._pending[0]
            joints = self._history.at(stamp_s)
            still = self._history.still(stamp_s, self._settings.still_window, self._settings.still_tolerance)
            if joints is None and self._waits_for_joints(stamp_s, arrived_s):
                return None
            self._pending.popleft()
        if self._camera is None and info is None:
            self._drop(f"no calibration on {rospy.resolve_name('camera/camera_info')}")
            return None
        try:
            camera = self._camera or camera_from_info(info)
            image = rgb_from_compressed(message) if self._compressed else rgb_from_image(message)
            camera.check_size(image)
        except (ImageError, CameraError) as error:
            self._drop(str(error))
            return None
        self.seen = True
        if self._repeated.add(image):
            self._drop(f"image of {stamp_s:.3f} s repeats the one before pixel by pixel", frozen=True)
            return None
        self.frozen = False
        if joints is None:
            self.problem = f"no joint state of the image's time {stamp_s:.3f} s"
            return None
        if not still:
            self.problem = "no image with the head at rest"
            return None
        self.problem = "no new image"
        header = ImageHeader(message.header.stamp.to_nsec(), message.header.frame_id)
        return Frame(header, image, camera, self._chain.forward(joints))

    def _drop(self, problem: str, frozen: bool = False) -> None:
        """Note why an image cannot be used, and say so in the log now and then."""
        self.problem = problem
        self.frozen = frozen
        rospy.logwarn_throttle(_COMPLAINT_S, "image dropped: %s", problem)

    def _waits_for_joints(self, stamp_s: float, arrived_s: float) -> bool:
        newest_s = self._history.newest_s
        coming = newest_s is None or newest_s < stamp_s
        return coming and time.monotonic() - arrived_s < self._settings.pose_limit

    def hear_info(self, info: CameraInfo) -> None:
        """Take a calibration; the last one counts."""
        with self._lock:
            self._info = info

    def hear_joints(self, state: JointState) -> None:
        """Take a joint state; one whose names and positions do not pair up is left out."""
        if len(state.name) == len(state.position):
            with self._lock:
                self._history.add(state.header.stamp.to_sec(), dict(zip(state.name, state.position)))

    def hear_image(self, message: Image | CompressedImage) -> None:
        """Keep an image for `take`, unless its stamp is missing, old, or of another time."""
        stamp_s, now_s = message.header.stamp.to_sec(), rospy.get_time()
        with self._lock:
            if stamp_s <= 0.0:
                self._drop("image without a time stamp")
            elif self._last_stamp_s - _JUMP_BACK_S < stamp_s <= self._last_stamp_s:
                self._drop(f"image of {stamp_s:.3f} s, not newer than the last of {self._last_stamp_s:.3f} s", frozen=True)
            elif now_s > 0.0 and abs(now_s - stamp_s) > self._settings.image_max_age:
                limit_s = self._settings.image_max_age
                self._drop(f"image of {stamp_s:.3f} s at {now_s:.3f} s: older or newer than {limit_s:g} s")
            else:
                self._last_stamp_s = stamp_s
                self._pending.append((time.monotonic(), stamp_s, message))
