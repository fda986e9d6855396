"""Settings of the control engine, read once from config/control_engine.yaml."""

from __future__ import annotations

from dataclasses import dataclass, field

from dr_eureka.control.pour_geometry import LipPlace, PourPlace
from dr_eureka.control.trajectory import MotionLimits
from dr_eureka.kinematics.hybrid import HybridSettings
from dr_eureka.settings import build

_POSITIVE = {"min": 1e-6}


@dataclass(frozen=True)
class SpeedSettings:
    """How fast the arms go: joint speeds [rad/s], accelerations [rad/s^2], hand speed on straight lines [m/s].

    `longest_step` [s]: after a gap in the joint states, motions go on where they were, and one command moves no farther than this long.
    """

    hardware: float = field(metadata={"min": 0.1, "max": 3.5})
    longest_step: float = field(metadata={"min": 0.008, "max": 0.1})
    move: MotionLimits
    carry: MotionLimits
    line: float = field(metadata={"min": 0.01, "max": 1.0})


@dataclass(frozen=True)
class GripSettings:
    """Finger angles [rad] and times [s] of the grippers."""

    open: float
    closed: float
    on_tube: tuple[float, float]
    travel_seconds: float = field(metadata=_POSITIVE)
    settle_seconds: float = field(metadata=_POSITIVE)


@dataclass(frozen=True)
class PickSettings:
    """How a tube is picked up and put down: lengths [m], angles [rad] (left hand; the right hand is its mirror image)."""

    centre_beyond_end: float
    grip_height: float = field(metadata=_POSITIVE)
    lift: float = field(metadata=_POSITIVE)
    place_clearance: float = field(metadata={"min": 0.0, "max": 0.01})
    approach_yaw: float
    way_point_spacing: float = field(metadata=_POSITIVE)


@dataclass(frozen=True)
class PostureSettings:
    """Joint postures [rad] of the left arm (right = negated), order sh_p1 sh_r sh_p2 el_y wr_r wr_y wr_p."""

    home: tuple[float, ...]
    pick: tuple[float, ...]
    pour_source: tuple[float, ...]
    pour_target: tuple[float, ...]


@dataclass(frozen=True)
class Keyframe:
    """One pose of a keyframed pour: reached after `seconds`, source at `elevation` [rad], lip `withdrawn` [m]."""

    name: str
    seconds: float = field(metadata=_POSITIVE)
    elevation: float
    withdrawn: float


@dataclass(frozen=True)
class LockPourSettings:
    """The lock-pour: where the lip is held and the keyframes after the ready pose."""

    lip: LipPlace
    ready_elevation: float
    ready_withdrawn: float
    keyframes: tuple[Keyframe, ...]


@dataclass(frozen=True)
class DirectPourSettings:
    """The direct pour: a dip of the tube, timed by how many balls stay behind.

    `dip_seconds[k]` [s]: how long the tube is sent down when k balls are to stay; angles in rad, rates in rad/s and rad/s^2.
    """

    lip: LipPlace
    ready_elevation: float
    ready_withdrawn: float
    dip_elevation: float
    return_elevation: float
    rate: float = field(metadata=_POSITIVE)
    acceleration: float = field(metadata=_POSITIVE)
    dip_seconds: tuple[float, ...]
    hold_seconds: float = field(metadata=_POSITIVE)


@dataclass(frozen=True)
class GuardSettings:
    """When the engine gives up: largest tracking error [rad] and for how long [s] it may last; torso's largest turn [rad];
    longest pause after a pour [s]."""

    tracking_error: float = field(metadata=_POSITIVE)
    tracking_seconds: float = field(metadata=_POSITIVE)
    torso: float = field(metadata=_POSITIVE)
    pause_seconds: float = field(metadata=_POSITIVE)


@dataclass(frozen=True)
class ControlSettings:
    """Everything the control engine can be told; see the comments in config/control_engine.yaml."""

    kinematics: HybridSettings
    speeds: SpeedSettings
    grip: GripSettings
    pick: PickSettings
    postures: PostureSettings
    pour_place: PourPlace
    lock_pour: LockPourSettings
    direct_pour: DirectPourSettings
    guards: GuardSettings

    @classmethod
    def from_mapping(cls, mapping: dict, where: str) -> ControlSettings:
        """Validate the yaml's content (its `node:` block is the ROS node's own); raises SettingsError."""
        return build(cls, {key: value for key, value in mapping.items() if key != "node"}, where)
