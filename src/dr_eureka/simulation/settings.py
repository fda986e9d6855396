"""Settings of the simulated world, built from config/fake_robotis_manager.yaml."""
from __future__ import annotations

from dataclasses import dataclass, field

from dr_eureka.errors import DrEurekaError
from dr_eureka.resources import load_yaml
from dr_eureka.settings import build
from dr_eureka.simulation.arm_errors import ArmErrorSettings

CONFIG = "config/fake_robotis_manager.yaml"
_POSITIVE = {"min": 1e-9}
_NOT_NEGATIVE = {"min": 0.0}


class SimulationError(DrEurekaError):
    """Something asked of the simulated world that it cannot do, in one line: what, and what was expected."""


@dataclass(frozen=True)
class PhysicsSettings:
    """The solver and the materials (lengths m, masses kg; restitution and friction are products of two bodies' values)."""

    steps_per_cycle: int = field(metadata={"min": 1, "max": 20})
    solver_iterations: int = field(metadata={"min": 10, "max": 500})
    restitution_velocity_threshold: float = field(metadata=_NOT_NEGATIVE)
    contact_breaking_threshold: float = field(metadata=_POSITIVE)
    ball_mass: float = field(metadata=_POSITIVE)
    tube_mass: float = field(metadata=_POSITIVE)
    wall_boxes: int = field(metadata={"min": 8, "max": 32})
    piece_friction: float = field(metadata={"min": 0.0, "max": 2.0})
    pad_friction: float = field(metadata={"min": 0.0, "max": 2.0})
    table_friction: float = field(metadata={"min": 0.0, "max": 2.0})
    piece_restitution: float = field(metadata={"min": 0.0, "max": 1.0})
    table_restitution: float = field(metadata={"min": 0.0, "max": 1.0})
    rolling_resistance: float = field(metadata={"min": 0.0, "max": 0.1})


@dataclass(frozen=True)
class ServoSettings:
    """How the joints' position control behaves (speeds rad/s, angles rad, forces N, lengths m, inertia kg m^2)."""

    speed_limit: float = field(metadata={"min": 0.1, "max": 10.0})
    position_gain: float = field(metadata={"min": 0.01, "max": 1.0})
    grip_speed_limit: float = field(metadata={"min": 0.05, "max": 10.0})
    grip_position_gain: float = field(metadata={"min": 0.01, "max": 1.0})
    grip_pad_force: float = field(metadata={"min": 1.0, "max": 170.0})
    grip_pad_radius: float = field(metadata=_POSITIVE)
    grip_rotor_inertia: float = field(metadata=_POSITIVE)
    grip_lead: float = field(metadata={"min": 0.01, "max": 1.2})


@dataclass(frozen=True)
class LayoutSettings:
    """Where things stand, in `base` [m] unless a name says sheet; boxes are centre and size."""

    table_centre: tuple[float, float, float]
    table_size: tuple[float, float, float]
    board_centre: tuple[float, float, float]
    board_size: tuple[float, float, float]
    sheet_centre: tuple[float, float, float]
    tubes_in_sheet: dict[str, tuple[float, float]]
    card_x: tuple[float, float]
    card_y: tuple[float, float]
    card_z: tuple[float, float]
    start_joints: dict[str, float]


@dataclass(frozen=True)
class ScatterSettings:
    """How far each world's seed moves things: lengths m, angles rad, `materials` and `light` as fractions."""

    sheet: float = field(metadata=_NOT_NEGATIVE)
    sheet_yaw: float = field(metadata=_NOT_NEGATIVE)
    tubes: float = field(metadata=_NOT_NEGATIVE)
    card_tilt: float = field(metadata=_NOT_NEGATIVE)
    card_turn: float = field(metadata=_NOT_NEGATIVE)
    materials: float = field(metadata={"min": 0.0, "max": 0.9})
    light: float = field(metadata={"min": 0.0, "max": 0.9})


@dataclass(frozen=True)
class CameraSettings:
    """The head camera: size and intrinsics in px, plumb-bob distortion k1 k2 p1 p2 k3, rendering choices.

    With `hand_markers`, the markers that calibrate_arm looks for are on the hands.
    """

    width: int = field(metadata={"min": 16, "max": 4096})
    height: int = field(metadata={"min": 16, "max": 4096})
    fx: float = field(metadata=_POSITIVE)
    fy: float = field(metadata=_POSITIVE)
    cx: float
    cy: float
    distortion: tuple[float, ...]
    near: float = field(metadata=_POSITIVE)
    far: float = field(metadata=_POSITIVE)
    renderer: str = field(metadata={"choices": ("auto", "egl", "tiny")})
    wall_tint: float = field(metadata={"min": 0.0, "max": 1.0})
    noise: float = field(metadata={"min": 0.0, "max": 50.0})
    hand_markers: bool


@dataclass(frozen=True)
class RefereeSettings:
    """When the referee calls a tube standing: tilt [rad] and height of its foot above the sheet [m]."""

    standing_tilt: float = field(metadata=_POSITIVE)
    standing_height: float = field(metadata=_POSITIVE)


@dataclass(frozen=True)
class WorldSettings:
    """Everything the simulated world can be told; see the comments in config/fake_robotis_manager.yaml."""

    cycle: float = field(metadata={"min": 0.001, "max": 0.1})
    physics: PhysicsSettings
    servos: ServoSettings
    layout: LayoutSettings
    scatter: ScatterSettings
    referee: RefereeSettings
    arm_errors: ArmErrorSettings


def load_world_settings(path: str = CONFIG) -> WorldSettings:
    """Build the `world:` block of the simulator's yaml; raises ResourceError or SettingsError naming file and key."""
    return build(WorldSettings, load_yaml(path).get("world", {}), f"{path} world")


def load_camera_settings(path: str = CONFIG) -> CameraSettings:
    """Build the `camera:` block of the simulator's yaml; raises ResourceError or SettingsError naming file and key."""
    return build(CameraSettings, load_yaml(path).get("camera", {}), f"{path} camera")
