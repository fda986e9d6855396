"""What the game flow sees and asks for: images, the engine's status, and the robot it commands."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Mapping, Optional, Protocol, Sequence

import numpy as np

from dr_eureka.game.actions import Action

#: Code of an `Answer` that never came.
NO_ANSWER = "NO_ANSWER"


@dataclass(frozen=True)
class Gaze:
    """Where the head points [rad]: `head_y` positive to the left, `head_p` positive down."""

    head_y: float
    head_p: float


@dataclass(frozen=True)
class ImageHeader:
    """Which image it is: its robot time in whole nanoseconds, so that it compares equal, and the camera's frame."""

    stamp_ns: int
    frame_id: str


@dataclass(frozen=True, eq=False)
class Frame:
    """An image taken with the head at rest.

    `image` is (height, width, 3) uint8 rgb, `camera` a `vision.camera.CameraModel`, `base_from_camera` (4, 4).
    """

    header: ImageHeader
    image: np.ndarray
    camera: Any
    base_from_camera: np.ndarray

    @property
    def stamp_s(self) -> float:
        """Robot time of the image [s]."""
        return self.header.stamp_ns * 1e-9


@dataclass(frozen=True)
class EngineView:
    """The control engine's last status, and the wall time at which it was heard.

    `at_once`: how many actions, up to `action_index`, are under way at the same time. `held` has base_from_tube (4, 4) of each tube
    in a hand while the engine pauses for a look after a pour, else nothing.
    """

    state: str
    code: str
    strategy_id: int
    action_index: int
    message: str
    heard_wall_s: float
    held: Mapping[str, np.ndarray] = field(default_factory=dict)
    at_once: int = 1


@dataclass(frozen=True)
class Observation:
    """Everything the flow knows at one step.

    `frame` is a new image or None; `camera_seen` tells that images arrive at all, `camera_problem` why none is usable,
    `camera_frozen` that what arrives repeats the image before; `head` holds the present `head_y` and `head_p` [rad], or is
    None before the first joint state.
    """

    wall_s: float
    robot_s: float
    engine: Optional[EngineView] = None
    frame: Optional[Frame] = None
    camera_seen: bool = False
    camera_problem: str = ""
    camera_frozen: bool = False
    head: Optional[Gaze] = None


@dataclass(frozen=True)
class Answer:
    """The engine's answer to a request; `code` is one of `control.codes.EngineCode`, OK when accepted, or NO_ANSWER."""

    code: str
    message: str = ""
    strategy_id: int = 0


class Robot(Protocol):
    """The control engine as the flow commands it; every call is bounded in time and answers."""

    def look_at(self, gaze: Gaze, duration_s: float) -> Answer:
        """Begin to turn the head."""

    def execute(self, actions: Sequence[Action], tubes: Mapping[str, Any], balls: Mapping[str, int], pour: str) -> Answer:
        """Begin a strategy that pauses after each pour but the last.

        `tubes` are `vision.tubes.TubePlace` by name, `balls` how many each tube holds.
        """

    def go_on(self, put_down: bool) -> Answer:
        """End the engine's pause after a pour: carry the strategy on, or put down what is held and leave the rest."""

    def stop(self) -> Answer:
        """Stop whatever moves, and hold."""


class Look(Protocol):
    """A decision that ripens over several images, such as which card is shown."""

    def add(self, frame: Frame) -> Optional[Any]:
        """Take one more image; return what was found once enough images agree, else None."""

    def failure(self) -> tuple[str, str]:
        """Return the game code and the reason when time runs out undecided."""
