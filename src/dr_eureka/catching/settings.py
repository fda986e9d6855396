"""Settings of Saika, built from config/saika.yaml."""

from __future__ import annotations

from dataclasses import dataclass, field

from dr_eureka.resources import load_yaml
from dr_eureka.settings import SettingsError, build

CONFIG = "config/saika.yaml"
NECK_JOINTS = ("neck_pan", "neck_tilt")
ARM_JOINTS = ("shoulder_pitch", "shoulder_roll", "upper_arm_yaw", "elbow", "forearm_roll")
_LENGTH = {"min": 1e-3, "max": 3.0}
_SHARE = {"min": 0.0, "max": 1.0}


@dataclass(frozen=True)
class BodySettings:
    """Lengths [m] and the basket's mounting angle [deg]; see the comments in the yaml."""

    floor_below_shoulders_m: float = field(metadata=_LENGTH)
    shoulder_half_width_m: float = field(metadata=_LENGTH)
    upper_arm_m: float = field(metadata=_LENGTH)
    forearm_m: float = field(metadata=_LENGTH)
    basket_beyond_wrist_m: float = field(metadata=_LENGTH)
    basket_depth_m: float = field(metadata=_LENGTH)
    basket_rim_level_at_deg: float = field(metadata={"min": -90.0, "max": 90.0})
    torso_half_width_m: float = field(metadata=_LENGTH)
    torso_half_depth_m: float = field(metadata=_LENGTH)
    arm_radius_m: float = field(metadata=_LENGTH)
    neck_pan_above_shoulders_m: float = field(metadata=_LENGTH)
    neck_tilt_above_shoulders_m: float = field(metadata=_LENGTH)
    eyes_above_neck_tilt_m: float = field(metadata=_LENGTH)
    eyes_before_neck_m: float = field(metadata=_LENGTH)


@dataclass(frozen=True)
class JointSettings:
    """Lower and upper limit [deg] and speed [rad/s] of one joint."""

    range_deg: tuple[float, float] = field(metadata={"min": -180.0, "max": 180.0})
    speed: float = field(metadata={"min": 0.1, "max": 50.0})


@dataclass(frozen=True)
class WorkingAreaSettings:
    """Where the left hand may go: [least, most] of each axis of base, and the largest distance from its shoulder [m]."""

    x_m: tuple[float, float] = field(metadata={"min": -1.0, "max": 1.0})
    y_m: tuple[float, float] = field(metadata={"min": -1.0, "max": 1.0})
    z_m: tuple[float, float] = field(metadata={"min": -1.0, "max": 1.0})
    most_reach_m: float = field(metadata=_LENGTH)


@dataclass(frozen=True)
class HeadCameraSettings:
    """Both head cameras, which are alike: intrinsics [px], mounting [m], timing [s], pan and tilt [deg].

    The principal point is the middle of the picture. `lag_s`: how long after the left camera the right one takes its
    picture. The sigmas [px] are what localisation expects of the ball finder.
    """

    focal_px: float = field(metadata={"min": 1.0})
    width: int = field(metadata={"min": 16, "max": 4096})
    height: int = field(metadata={"min": 16, "max": 4096})
    baseline_m: float = field(metadata=_LENGTH)
    period_s: float = field(metadata={"min": 0.001, "max": 1.0})
    lag_s: float = field(metadata={"min": 0.0, "max": 0.2})
    pan_limit_deg: float = field(metadata={"min": 0.0, "max": 90.0})
    tilt_limit_deg: float = field(metadata={"min": 0.0, "max": 90.0})
    centre_sigma_px: float = field(metadata={"min": 1e-3, "max": 20.0})
    diameter_sigma_px: float = field(metadata={"min": 1e-3, "max": 20.0})


@dataclass(frozen=True)
class BallFinderSettings:
    """What the ball looks like, and from when on a coloured spot is taken for it."""

    ball_rgb: tuple[int, int, int] = field(metadata={"min": 0, "max": 255})
    hue_tolerance_deg: float = field(metadata={"min": 1.0, "max": 90.0})
    least_saturation: float = field(metadata=_SHARE)
    least_brightness: float = field(metadata=_SHARE)
    least_diameter_px: float = field(metadata={"min": 3.0, "max": 1000.0})
    least_arc: float = field(metadata=_SHARE)


@dataclass(frozen=True)
class SaikaSettings:
    """Everything about Saika, its ball and its basket that the robot itself may know."""

    ball_diameter_m: float = field(metadata=_LENGTH)
    basket_diameter_m: float = field(metadata=_LENGTH)
    body: BodySettings
    joints: dict[str, JointSettings]
    working_area: WorkingAreaSettings
    cameras: HeadCameraSettings
    ball_finder: BallFinderSettings

    @classmethod
    def load(cls, path: str = CONFIG) -> SaikaSettings:
        """Build the settings in a yaml; raises ResourceError or SettingsError naming file and key."""
        settings = build(cls, load_yaml(path), path)
        expected = {*NECK_JOINTS, *ARM_JOINTS}
        if set(settings.joints) != expected:
            raise SettingsError(path, "joints", f"are {', '.join(settings.joints)}", ", ".join(sorted(expected)))
        return settings
