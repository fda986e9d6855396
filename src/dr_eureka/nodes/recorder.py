"""Starts `rosbag record` with a fixed list of topics into a folder that is made first."""

from __future__ import annotations

import os
import sys

import rosgraph.names
import roslib.packages
import rospy

from dr_eureka.errors import DrEurekaError
from dr_eureka.nodes.folders import output_folder

NAME = "record_game"


def main() -> int:
    """Become `rosbag record`: `record_game FOLDER BAG TOPIC...`; return an exit code only on bad input."""
    words = rospy.myargv()[1:]
    if len(words) < 3 or words[0] in ("-h", "--help"):
        print(f"usage: {NAME} FOLDER BAG TOPIC...")
        return 0 if words[:1] in (["-h"], ["--help"]) else 2
    folder, bag, *topics = words
    found = roslib.packages.find_node("rosbag", "record")
    try:
        file = output_folder(folder) / bag
        if not found:
            raise DrEurekaError("rosbag record: not found; expected Debian's python3-rosbag")
    except DrEurekaError as error:
        print(f"{NAME}: {error}", file=sys.stderr)
        return 1
    # The recorder must be the node itself: it closes the bag when roslaunch interrupts it.
    remappings = [word for word in sys.argv[1:] if word not in words]
    os.execv(found[0], [found[0], "--lz4", f"--output-name={file}", *map(_absolute, topics), *remappings])


def _absolute(topic: str) -> str:
    """Return a topic's full name: rosbag records topics under the very words it is given."""
    return rosgraph.names.script_resolve_name(NAME, topic)
