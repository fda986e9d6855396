"""Where a run puts its files."""

from __future__ import annotations

import os
from pathlib import Path

import rospy

from dr_eureka.nodes.parameters import ParameterError


def output_folder(text: str) -> Path:
    """Return the folder named by an `out` argument, made when missing; raises ParameterError when it cannot be made."""
    folder = resolve(text)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ParameterError(f"{rospy.get_name()}/out: {folder}: {error.strerror}; expected a folder that can be made") from error
    return folder


def resolve(text: str) -> Path:
    """Return a path as the person at the shell meant it: roslaunch starts nodes in ROS_HOME, but leaves PWD alone."""
    return Path(os.environ.get("PWD", os.curdir)) / Path(text).expanduser()
