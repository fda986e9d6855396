"""A ROS 1 bag as a file: its topics and, one after another, its messages. No ROS master is needed (rosbags)."""
from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Union

from rosbags.rosbag1 import Reader
from rosbags.typesys import Stores, get_typestore

from dr_eureka.errors import DrEurekaError


class BagError(DrEurekaError):
    """A recording that cannot be read or lacks what was asked of it.

    Attributes:
        path: the file.
    """

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path}: {reason}")
        self.path = path


@dataclass(frozen=True)
class Topic:
    """A recorded topic: its absolute name, its type in ROS 1 spelling (`sensor_msgs/Image`), how many messages."""

    name: str
    type: str
    messages: int


class Stamped(NamedTuple):
    """A message and its time [s]: the header's stamp, or the time of recording where that is zero."""

    stamp_s: float
    message: Any


class Recording:
    """An open bag; use it in a `with` statement. Messages of ROS's own packages can be read, ours need not be known.

    Raises:
        BagError: when the file is missing, no bag, not indexed or damaged.
    """

    def __init__(self, path: Union[str, Path]) -> None:
        self.path = Path(path)
        if not self.path.is_file():
            raise BagError(self.path, "no such file")
        self._reader = Reader(self.path)
        try:
            self._reader.open()
            topics = sorted(self._reader.topics.items())
            self.topics = tuple(Topic(name, _ros1_spelling(info.msgtype), info.msgcount) for name, info in topics)
        except Exception as error:  # A file that is no bag or is damaged fails anywhere in the parser, in any way.
            self.close()
            raise BagError(self.path, f"not a readable ROS 1 bag: {_one_line(error)}") from error
        self._types = get_typestore(Stores.ROS1_NOETIC)

    def __enter__(self) -> Recording:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; closing twice is no error."""
        if self._reader.bio is not None:
            self._reader.close()

    def find(self, *wanted: tuple[str, str], near: str = "") -> Topic:
        """Return the topic that is the first of several wanted (name, type).

        A relative name fits every topic that ends in it, as topics recorded in a namespace do. Where several fit,
        the one is taken whose name shares the longest beginning with `near`.

        Raises:
            BagError: when none fits (it lists the topics there are), or several do and `near` is not given.
        """
        for name, type_name in wanted:
            found = [topic for topic in self.topics if topic.type == type_name and _fits(topic.name, name)]
            if len(found) > 1 and not near:
                names = ", ".join(topic.name for topic in found)
                raise BagError(self.path, f"several topics end in {name}, expected the full name of one: {names}")
            if found:
                return max(found, key=lambda topic: len(os.path.commonprefix([topic.name, near])))
        expected = " or ".join(f"{name} [{type_name}]" for name, type_name in wanted)
        there = ", ".join(f"{topic.name} [{topic.type}]" for topic in self.topics) or "none"
        raise BagError(self.path, f"no topic {expected}; topics in the bag: {there}")

    def messages(self, topic: Topic) -> Iterator[Stamped]:
        """Yield the messages of a topic, which must have a header, in the order of recording.

        Raises:
            BagError: when the recording is damaged at this place.
        """
        connections = [connection for connection in self._reader.connections if connection.topic == topic.name]
        if not connections:
            return
        raw_messages = self._reader.messages(connections)
        while True:
            try:
                connection, recorded_ns, data = next(raw_messages)
                message = self._types.deserialize_ros1(data, connection.msgtype)
            except StopIteration:
                return
            except Exception as error:  # As above: decompression and parsing of a damaged bag fail in many ways.
                raise BagError(self.path, f"damaged at a message of {topic.name}: {_one_line(error)}") from error
            stamp = message.header.stamp
            header_s = stamp.sec + stamp.nanosec * 1e-9
            yield Stamped(header_s or recorded_ns * 1e-9, message)


def _fits(topic_name: str, name: str) -> bool:
    return topic_name == name if name.startswith("/") else f"/{topic_name}".endswith(f"/{name}")


def _ros1_spelling(type_name: Union[str, None]) -> str:
    return type_name.replace("/msg/", "/") if type_name else "several types"


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
