"""Settings of the control engine, read once from config/control_engine.yaml."""

from __future__ import annotations

from dataclasses import dataclass, field

from dr_eureka.control.pour_geometry import LipPlace, PourPlace
from dr_eureka.control.trajectory import MotionLimits
from dr_eureka.game.state import TUBE_CAPACITY
from dr_eureka.kinematics.hybrid import HybridSettings
from dr_eureka.settings import SettingsError, build, expect_keys

_POSITIVE = {"min": 1e-6}


@dataclass(frozen=True)
class SpeedSettings:
    """How fast the arms go: joint speeds [rad/s], accelerations [rad/s^2], jerks [rad/s^3], a hand on straight lines [m/s].

    `stop`: how hard joints slow down when a motion is broken off [rad/s^2].
    `longest_step` [s]: after a gap in the joint states, motions go on where they were, and one command moves no farther than this long.
    """

    hardware: float = field(metadata={"min": 0.1, "max": 3.5})
    longest_step: float = field(metadata={"min": 0.008, "max": 0.1})
    move: MotionLimits
    carry: MotionLimits
    line: float = field(metadata={"min": 0.01, "max": 1.0})
    stop: float = field(metadata={"min": 1.0, "max": 500.0})


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

    def yaw_of(self, hand: str) -> float:
        """Return a hand's approach direction about z of base [rad]."""
        return self.approach_yaw if hand == "left" else -self.approach_yaw


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
    """The lock-pour: where the lip is held and the keyframes after the ready pose; angles in rad, lengths in m."""

    lip: LipPlace
    undocked: float = field(metadata={"min": 0.0, "max": 0.05})
    ready_elevation: float
    ready_withdrawn: float
    keyframes: tuple[Keyframe, ...]


@dataclass(frozen=True)
class TiltLimits:
    """How fast the pouring tube may tilt: rate [rad/s] and acceleration [rad/s^2]."""

    rate: float = field(metadata=_POSITIVE)
    acceleration: float = field(metadata=_POSITIVE)


@dataclass(frozen=True)
class LinearPourSettings:
    """The paper's direct pour: evenly from a ready to a pouring pose, cut at a step and back at once.

    `return_steps[n][k]`: the step at which it turns back when k of n balls are to be poured; beyond `poses`, it waits at the
    pouring pose. `hold_seconds`: how long it then stays at the return elevation; `back_seconds`: from there to ready. Angles in
    rad, lengths in m, `step_seconds` between two poses.
    """

    lip: LipPlace
    undocked: float = field(metadata={"min": 0.0, "max": 0.05})
    ready_elevation: float
    ready_withdrawn: float
    pouring_elevation: float
    return_elevation: float
    poses: int = field(metadata={"min": 1, "max": 10000})
    step_seconds: float = field(metadata=_POSITIVE)
    limits: TiltLimits
    return_steps: dict[int, dict[int, int]] = field(metadata={"min": 1})
    hold_seconds: float = field(metadata=_POSITIVE)
    back_seconds: float = field(metadata=_POSITIVE)


@dataclass(frozen=True)
class ProfiledPourSettings:
    """The direct pour that dips and returns as quickly as the wrist may, timed by how many balls stay behind.

    `dip_seconds[k]` [s]: how long the tube is sent down when k balls are to stay. `hold_seconds`: how long it then stays at the
    return elevation; `back_seconds`: from there to ready. Angles in rad, lengths in m.
    """

    lip: LipPlace
    undocked: float = field(metadata={"min": 0.0, "max": 0.05})
    ready_elevation: float
    ready_withdrawn: float
    dip_elevation: float
    return_elevation: float
    limits: TiltLimits
    dip_seconds: dict[int, float] = field(metadata=_POSITIVE)
    hold_seconds: float = field(metadata=_POSITIVE)
    back_seconds: float = field(metadata=_POSITIVE)


@dataclass(frozen=True)
class Furniture:
    """A box that stands in front of the robot, edges parallel to base: centre and size (x, y, z) [m]."""

    centre: tuple[float, float, float]
    size: tuple[float, float, float] = field(metadata=_POSITIVE)


@dataclass(frozen=True)
class CollisionSettings:
    """How near to one another things may come in a motion: lengths [m].

    `margin`: the least distance; `horizon`: bodies farther apart than this are not looked at, so it also is how far the
    robot may move between two looks where nothing is near.
    """

    margin: float = field(metadata={"min": 0.001, "max": 0.02})
    horizon: float = field(metadata={"min": 0.02, "max": 0.5})
    furniture: dict[str, Furniture]


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
    linear_pour: LinearPourSettings
    profiled_pour: ProfiledPourSettings
    guards: GuardSettings
    collision: CollisionSettings

    @classmethod
    def from_mapping(cls, mapping: dict, where: str) -> ControlSettings:
        """Validate the yaml's content (its `node:` block is the ROS node's own); raises SettingsError."""
        settings = build(cls, {key: value for key, value in mapping.items() if key != "node"}, where)
        dips, turns = settings.profiled_pour.dip_seconds, settings.linear_pour.return_steps
        expect_keys(where, "profiled_pour.dip_seconds", dips, range(TUBE_CAPACITY))
        expect_keys(where, "linear_pour.return_steps", turns, range(1, TUBE_CAPACITY + 1))
        for held, steps in turns.items():
            expect_keys(where, f"linear_pour.return_steps.{held}", steps, range(1, held + 1))
        # From the return elevation a tube comes down to ready: nothing that stays may roll out meanwhile.
        for name, pour in {"linear_pour": settings.linear_pour, "profiled_pour": settings.profiled_pour}.items():
            if pour.return_elevation < pour.ready_elevation:
                problem, expected = f"is {pour.return_elevation:g}", f"ready_elevation, {pour.ready_elevation:g}, or more"
                raise SettingsError(where, f"{name}.return_elevation", problem, expected, pour.return_elevation)
        return settings
