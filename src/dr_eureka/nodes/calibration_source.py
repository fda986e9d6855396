"""The pictures of a live image topic, for the calibration of its camera."""

from __future__ import annotations

import queue
import time
from collections.abc import Iterator
from contextlib import suppress

import numpy as np
import rosgraph
import rospy
from sensor_msgs.msg import CompressedImage, Image

from dr_eureka.bags.images import ImageError, rgb_from_compressed, rgb_from_image
from dr_eureka.errors import DrEurekaError

PATIENCE_S = 10.0
_POLL_S = 0.5


class TopicError(DrEurekaError):
    """A topic that gives no pictures."""


def live_pictures(topic: str) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the newest picture of a topic again and again, with its time as a name, until ROS shuts down.

    It also ends when no further picture comes for ten seconds, so that what was seen before is not lost. Pictures are
    (height, width, 3) uint8 rgb. A topic that ends in `/compressed` carries CompressedImage, another Image.

    Raises:
        TopicError: there is no ROS master, or in the first ten seconds no picture came that can be decoded.
    """
    if not rosgraph.is_master_online():
        raise TopicError(f"no ROS master at {rosgraph.get_master_uri()}; start roscore and the camera first")
    # Ctrl-C must reach the caller, who calibrates with what there is.
    rospy.init_node("calibrate_camera", anonymous=True, disable_signals=True)
    kind, decode = (CompressedImage, rgb_from_compressed) if topic.endswith("/compressed") else (Image, rgb_from_image)
    waiting: queue.Queue = queue.Queue(maxsize=1)
    rospy.Subscriber(topic, kind, lambda message: _keep_newest(waiting, message), queue_size=1, buff_size=2**24)
    seen, problem, good_s = False, "no picture", time.monotonic()
    try:
        while not rospy.is_shutdown():
            try:
                message = waiting.get(timeout=_POLL_S)
                image = decode(message)
            except queue.Empty:
                pass
            except ImageError as error:
                problem = str(error)
            else:
                yield f"{message.header.stamp.to_sec():.3f} s", image
                seen, good_s = True, time.monotonic()
            if time.monotonic() - good_s > PATIENCE_S:
                if seen:
                    return
                raise TopicError(f"{rospy.resolve_name(topic)}: for {PATIENCE_S:g} s {problem}")
    finally:
        rospy.signal_shutdown("calibrated")


def _keep_newest(waiting: queue.Queue, message: object) -> None:
    """Put a message into the queue of one, in place of an older one."""
    with suppress(queue.Empty):
        waiting.get_nowait()
    # Each publisher has a thread of its own here: another may just have put a message, and that is as new.
    with suppress(queue.Full):
        waiting.put_nowait(message)
