"""How balls are let go: drawn so that they come down at a place that is drawn, too."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dr_eureka.resources import load_yaml
from dr_eureka.settings import build
from dr_eureka.simulation.bodies import GRAVITY
from dr_eureka.simulation.settings import SimulationError

CONFIG = "config/fake_saika.yaml"
#: Where a ball is aimed: into the area of the stated reach, or beside it.
REACH, BEYOND = "reach", "beyond"
AIMS = (REACH, BEYOND)
_METRES = {"min": -5.0, "max": 5.0}


@dataclass(frozen=True)
class ThrowSettings:
    """From where to where one kind of ball goes: [least, most] in base [m], and for how long it flies [s].

    x_m, y_m, height_m: where it comes down when aimed into reach; beyond_m: how far beside that otherwise. from_x_m,
    from_y_m: where it is let go, flight_s: how long it flies; None for a ball that is dropped from from_z_m above height_m.
    """

    x_m: tuple[float, float] = field(metadata=_METRES)
    y_m: tuple[float, float] = field(metadata=_METRES)
    height_m: float = field(metadata=_METRES)
    beyond_m: tuple[float, float] = field(metadata=_METRES)
    from_z_m: tuple[float, float] = field(metadata=_METRES)
    from_x_m: tuple[float, float] | None = field(default=None, metadata=_METRES)
    from_y_m: tuple[float, float] | None = field(default=None, metadata=_METRES)
    flight_s: tuple[float, float] | None = field(default=None, metadata={"min": 0.05, "max": 3.0})


@dataclass(frozen=True, eq=False)
class Throw:
    """One ball: where it is let go (3,) [m] and how fast (3,) [m/s], and where it is to come down (3,) [m], in base."""

    position: np.ndarray
    velocity: np.ndarray
    aim: np.ndarray


def load_throws(path: str = CONFIG) -> dict[str, ThrowSettings]:
    """Return the kinds of balls in the `balls:` block of a yaml; raises ResourceError or SettingsError."""
    return build_throws(load_yaml(path).get("balls", {}), f"{path} balls")


def build_throws(mapping: dict, where: str) -> dict[str, ThrowSettings]:
    """Build the kinds of balls from a mapping of names; raises SettingsError, SimulationError when there is none."""
    if not isinstance(mapping, dict) or not mapping:
        raise SimulationError(f"{where}: is {mapping!r}; expected kinds of balls by name")
    return {name: build(ThrowSettings, values, f"{where} {name}") for name, values in mapping.items()}


def draw_throw(settings: ThrowSettings, aim: str, rng: np.random.Generator) -> Throw:
    """Draw a ball that comes down through the height at a place drawn evenly in the area, or beside it to the right."""
    place = np.array([rng.uniform(*settings.x_m), rng.uniform(*settings.y_m), settings.height_m])
    if aim == BEYOND:
        place[0] = settings.x_m[1] + rng.uniform(*settings.beyond_m)
    if settings.flight_s is None or settings.from_x_m is None or settings.from_y_m is None:
        return Throw(place + [0.0, 0.0, rng.uniform(*settings.from_z_m)], np.zeros(3), place)
    start = np.array([rng.uniform(*settings.from_x_m), rng.uniform(*settings.from_y_m), rng.uniform(*settings.from_z_m)])
    flight_s = rng.uniform(*settings.flight_s)
    fall = np.array([0.0, 0.0, 0.5 * GRAVITY * flight_s**2])
    return Throw(start, (place - start + fall) / flight_s, place)
