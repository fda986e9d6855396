"""Hidden mechanical errors of the simulated arms: joints whose zero is off, links that are not as long as drawn."""
from __future__ import annotations

from dataclasses import dataclass, field
from xml.etree import ElementTree

import numpy as np

from dr_eureka.kinematics.arms import SIDES, arm_joint_names


@dataclass(frozen=True)
class ArmErrorSettings:
    """Which robot it is and how far its arms may be off; see config/fake_robotis_manager.yaml.

    `robot` 0 is as drawn; every other number is one robot, the same in every game, whatever the world's seed. `joint` [rad]
    and `link` [m] bound what is drawn for each joint and for the link before it.
    """

    robot: int = field(metadata={"min": 0})
    joint: float = field(metadata={"min": 0.0, "max": 0.1})
    link: float = field(metadata={"min": 0.0, "max": 0.01})


@dataclass(frozen=True)
class ArmErrors:
    """One robot's errors by joint name.

    `offsets` [rad]: a joint that reports q stands at q + offset. `stretches` [m]: how much farther a joint sits from the one
    before it, in the same direction. Both are empty for a robot that is as drawn.
    """

    offsets: dict[str, float]
    stretches: dict[str, float]


def draw_arm_errors(settings: ArmErrorSettings) -> ArmErrors:
    """Draw the errors of both arms evenly within their bounds; equal robots have equal errors."""
    if settings.robot == 0:
        return ArmErrors({}, {})
    rng = np.random.default_rng((settings.robot, 2))
    names = [name for side in SIDES for name in arm_joint_names(side)]
    offsets = rng.uniform(-settings.joint, settings.joint, len(names))
    stretches = rng.uniform(-settings.link, settings.link, len(names))
    return ArmErrors(dict(zip(names, offsets.tolist())), dict(zip(names, stretches.tolist())))


def stretch_links(urdf: str, stretches: dict[str, float]) -> str:
    """Return a URDF's text with the named joints farther from their parents by so much [m]."""
    robot = ElementTree.fromstring(urdf)
    for joint in robot.findall("joint"):
        stretch = stretches.get(joint.get("name"), 0.0)
        if stretch:
            origin = joint.find("origin")
            place = np.array(origin.get("xyz").split(), dtype=float)
            origin.set("xyz", " ".join(f"{value:.9g}" for value in place * (1.0 + stretch / np.linalg.norm(place))))
    return ElementTree.tostring(robot, encoding="unicode")
