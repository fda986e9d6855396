"""What the planner knows of the robot: which hand takes which tube, how long things take, how pours end."""
from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from math import fsum
from typing import Any

from dr_eureka.errors import DrEurekaError
from dr_eureka.game.hands import HANDS
from dr_eureka.game.state import TUBE_CAPACITY, TUBES
from dr_eureka.resources import load_yaml
from dr_eureka.settings import SettingsError, build, expect_keys

PLANNER_FILE = "config/planner.yaml"
_SHARE = {"min": 0.0, "max": 1.0}


class PlannerError(DrEurekaError):
    """A strategy or a way to pour that the planner does not know."""


@dataclass(frozen=True)
class Measured:
    """A mean duration [s] and how many times it was measured; 0 for an estimate.

    `failed`: how many picks or places besides were ended by a fault. Plans do not count on that: the robot looks and tries again.
    """

    seconds: float = field(metadata={"min": 0.0, "max": 600.0})
    trials: int = field(default=0, metadata={"min": 0})
    failed: int = field(default=0, metadata={"min": 0})


@dataclass(frozen=True)
class PickDurations:
    """Picks by hand and tube: by a hand that comes from home, and by one that has just placed another tube."""

    from_home: dict[str, dict[str, Measured]]
    after_place: dict[str, dict[str, Measured]]


@dataclass(frozen=True)
class Durations:
    """Everything a plan is made of.

    `ready` brings two tubes together for pours out of the one named, `upright` back to where they can be placed, `home`
    both hands back after the last place. `ready`, `upright` and `pour` are by way to pour, `pour` then by balls.
    """

    pick: PickDurations
    place: dict[str, dict[str, Measured]]
    ready: dict[str, dict[str, Measured]]
    upright: dict[str, Measured]
    home: Measured
    pour: dict[str, dict[int, Measured]]


@dataclass(frozen=True)
class Outcome:
    """Shares of pours that move as many balls as intended, one fewer, one more, or lose a ball; they add up to 1."""

    intended: float = field(metadata=_SHARE)
    fewer: float = field(default=0.0, metadata=_SHARE)
    more: float = field(default=0.0, metadata=_SHARE)
    lost: float = field(default=0.0, metadata=_SHARE)
    trials: int = field(default=0, metadata={"min": 0})


@dataclass(frozen=True)
class PlannerSettings:
    """The content of config/planner.yaml, which explains it; `durations.pour` and `outcomes` by way to pour."""

    reach: dict[str, tuple[str, ...]] = field(metadata={"choices": TUBES})
    hands_at_once: bool
    durations: Durations
    outcomes: dict[str, dict[int, dict[int, Outcome]]]

    @property
    def methods(self) -> tuple[str, ...]:
        """Ways to pour that are known."""
        return tuple(self.durations.pour)


@lru_cache(maxsize=4)
def load_planner_settings(path: str = PLANNER_FILE) -> PlannerSettings:
    """Load and check the planner's settings; raises ResourceError or SettingsError naming the file and the key."""
    return planner_settings(load_yaml(path), path)


def planner_settings(content: Any, path: str) -> PlannerSettings:
    """Check the content of the yaml at `path`; raises SettingsError naming that and the key."""
    settings = build(PlannerSettings, content, path)
    expect_keys(path, "reach", settings.reach, HANDS)
    durations = settings.durations
    for key, table in (
        ("durations.pick.from_home", durations.pick.from_home),
        ("durations.pick.after_place", durations.pick.after_place),
        ("durations.place", durations.place),
    ):
        expect_keys(path, key, table, HANDS)
        for hand, tubes in settings.reach.items():
            expect_keys(path, f"{key}.{hand}", table[hand], tubes, TUBES)
    counts = range(1, TUBE_CAPACITY + 1)
    for key, table in (
        ("durations.ready", durations.ready),
        ("durations.upright", durations.upright),
        ("outcomes", settings.outcomes),
    ):
        expect_keys(path, key, table, settings.methods)
    for method, by_count in durations.pour.items():
        expect_keys(path, f"durations.pour.{method}", by_count, counts)
        expect_keys(path, f"durations.ready.{method}", durations.ready[method], TUBES)
        for count, pour in by_count.items():
            if pour.seconds == 0.0:
                key = f"durations.pour.{method}.{count}.seconds"
                raise SettingsError(path, key, "is 0", "more, or plans never end", 0.0)
        expect_keys(path, f"outcomes.{method}", settings.outcomes[method], counts)
        for held, by_poured in settings.outcomes[method].items():
            expect_keys(path, f"outcomes.{method}.{held}", by_poured, range(1, held + 1))
            for poured, outcome in by_poured.items():
                _check_outcome(path, f"outcomes.{method}.{held}.{poured}", held, poured, outcome)
    return settings


def _check_outcome(path: str, key: str, held: int, poured: int, outcome: Outcome) -> None:
    total = fsum((outcome.intended, outcome.fewer, outcome.more, outcome.lost))
    if abs(total - 1.0) > 1e-6:
        raise SettingsError(path, key, f"shares add up to {total:g}", "1", total)
    if outcome.intended == 0.0:
        raise SettingsError(path, f"{key}.intended", "is 0", "a pour that can go as intended", 0.0)
    if poured == held and outcome.more > 0.0:
        raise SettingsError(path, f"{key}.more", f"is {outcome.more:g}", f"0, for the tube holds {held} balls", outcome.more)
