"""Settings of the catcher, built from config/ball_catcher.yaml."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from dr_eureka.catching.ball_track import MethodSettings
from dr_eureka.catching.prediction import HEIGHT, CatchingPlane
from dr_eureka.resources import load_yaml
from dr_eureka.settings import SettingsError, build

CONFIG = "config/ball_catcher.yaml"
THROWN, FALLING = "thrown", "falling"
BALLS = (THROWN, FALLING)
_SECONDS = {"min": 0.0, "max": 10.0}
_METRES = {"min": -2.0, "max": 2.0}
_DEGREES = {"min": -90.0, "max": 90.0}


@dataclass(frozen=True)
class GazeSettings:
    """Where to look: pan and tilt of the neck and tilt of both cameras in the head; left and up are positive [deg]."""

    neck_pan_deg: float = field(metadata=_DEGREES)
    neck_tilt_deg: float = field(metadata=_DEGREES)
    camera_tilt_deg: float = field(metadata=_DEGREES)


@dataclass(frozen=True)
class StanceSettings:
    """How a kind of ball is waited for: where to look, where the basket waits (3,), and how high it catches [m] in base."""

    gaze: GazeSettings
    ready_m: tuple[float, float, float] = field(metadata=_METRES)
    height_m: float = field(metadata=_METRES)

    @property
    def plane(self) -> CatchingPlane:
        """The height at which the middle of the basket's rim meets the ball's middle."""
        return CatchingPlane(HEIGHT, self.height_m)


@dataclass(frozen=True)
class JudgingSettings:
    """How the robot looks whether the ball is in its basket."""

    gaze: GazeSettings
    basket_m: tuple[float, float, float] = field(metadata=_METRES)
    rest_s: float = field(metadata=_SECONDS)
    after_s: float = field(metadata=_SECONDS)
    carry_share: float = field(metadata={"min": 0.01, "max": 1.0})
    views: int = field(metadata={"min": 1, "max": 100})
    within_m: float = field(metadata={"min": 0.0, "max": 1.0})
    limit_s: float = field(metadata=_SECONDS)


@dataclass(frozen=True)
class CatcherSettings:
    """Everything the catcher can be told; times [s], lengths [m]."""

    method: MethodSettings
    stances: dict[str, StanceSettings]
    judging: JudgingSettings
    acceleration: float = field(metadata={"min": 0.1, "max": 1e4})
    jerk: float = field(metadata={"min": 1.0, "max": 1e6})
    scatter_m: float = field(metadata={"min": 1e-3, "max": 10.0})
    still_rad: float = field(metadata={"min": 1e-4, "max": 0.5})
    largest_sigma_m: float = field(metadata={"min": 0.0, "max": 2.0})
    longest_flight_s: float = field(metadata=_SECONDS)
    lost_s: float = field(metadata=_SECONDS)
    blind_s: float = field(metadata=_SECONDS)

    def with_method(self, name: str) -> CatcherSettings:
        """Return the same settings with another method of finding the path."""
        return replace(self, method=replace(self.method, name=name))

    @classmethod
    def load(cls, path: str = CONFIG) -> CatcherSettings:
        """Build the `catcher:` block of a yaml; raises ResourceError or SettingsError naming file and key."""
        return checked(build(cls, load_yaml(path).get("catcher", {}), f"{path} catcher"), path)


def checked(settings: CatcherSettings, where: str) -> CatcherSettings:
    """Return the settings; raise SettingsError when a kind of ball has no stance."""
    if set(settings.stances) != set(BALLS):
        raise SettingsError(where, "stances", f"are {', '.join(settings.stances)}", ", ".join(BALLS))
    return settings
