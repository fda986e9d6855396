"""Settings of Saika's simulated world, built from config/saika_world.yaml."""

from __future__ import annotations

from dataclasses import dataclass, field

from dr_eureka.resources import load_yaml
from dr_eureka.settings import build

CONFIG = "config/saika_world.yaml"
_POSITIVE = {"min": 1e-9}
_NOT_NEGATIVE = {"min": 0.0}
_SHARE = {"min": 0.0, "max": 1.0}


@dataclass(frozen=True)
class SaikaPhysicsSettings:
    """Step [s], masses [kg] and materials; see the comments in the yaml."""

    step_s: float = field(metadata={"min": 1e-4, "max": 5e-3})
    solver_iterations: int = field(metadata={"min": 10, "max": 500})
    ball_mass_kg: float = field(metadata=_POSITIVE)
    ball_restitution: float = field(metadata=_SHARE)
    basket_restitution: float = field(metadata=_SHARE)
    ball_friction: float = field(metadata=_NOT_NEGATIVE)
    basket_friction: float = field(metadata=_NOT_NEGATIVE)
    rolling_resistance_m: float = field(metadata=_NOT_NEGATIVE)
    drag_coefficient: float = field(metadata={"min": 0.0, "max": 2.0})
    servo_gain: float = field(metadata={"min": 0.01, "max": 1.0})


@dataclass(frozen=True)
class SensorSettings:
    """Renderer, noise of the pictures (of 255), the room's light, and the noise [px] of the analytic camera."""

    renderer: str = field(metadata={"choices": ("auto", "egl", "tiny")})
    brightness_noise: float = field(metadata={"min": 0.0, "max": 50.0})
    light: tuple[float, float] = field(metadata={"min": 0.1, "max": 1.2})
    centre_noise_px: float = field(metadata=_NOT_NEGATIVE)
    diameter_noise_px: float = field(metadata=_NOT_NEGATIVE)


@dataclass(frozen=True)
class CatchRefereeSettings:
    """When a ball counts as caught: speed [m/s] against the basket, and for how long [s]."""

    rest_speed_m_s: float = field(metadata=_POSITIVE)
    rest_s: float = field(metadata=_POSITIVE)


@dataclass(frozen=True)
class SaikaWorldSettings:
    """Everything the simulated world of Saika can be told."""

    physics: SaikaPhysicsSettings
    sensor: SensorSettings
    referee: CatchRefereeSettings

    @classmethod
    def load(cls, path: str = CONFIG) -> SaikaWorldSettings:
        """Build the settings in a yaml; raises ResourceError or SettingsError naming file and key."""
        return build(cls, load_yaml(path), path)
