"""Whether a recording has what a replay needs."""

from __future__ import annotations

from pathlib import Path

import rosbag
import rospy
from rosbag import ROSBagException

from dr_eureka.bags.recording import BagError


def check_bag(path: Path, transport: str) -> None:
    """Raise BagError unless the bag can be read and holds images, calibration and joint states for this namespace."""
    if not path.is_file():
        raise BagError(path, "no such file; expected a bag recorded with record:=true")
    try:
        with rosbag.Bag(str(path)) as bag:
            topics = bag.get_type_and_topic_info().topics
            found = {topic for topic, info in topics.items() if info.message_count > 0}
    except (ROSBagException, OSError, ValueError) as error:
        raise BagError(path, f"not a readable bag: {error}; `rosbag reindex` may repair it") from error
    image = "camera/image_raw" if transport == "raw" else "camera/image_raw/compressed"
    for name in (image, "camera/camera_info", "robotis/present_joint_states"):
        topic = rospy.resolve_name(name)
        if topic not in found:
            raise BagError(path, f"no message on {topic}; it holds {', '.join(sorted(found)) or 'nothing'}")
