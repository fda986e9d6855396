"""The pour as one tube's mouth relative to the other's (paper 3.5), in a vertical plane.

Everything here is for a pour from the left hand into the right; the other direction is its mirror image in the robot's
sagittal plane. `u` is the horizontal direction the source mouth points to, `elevation` the angle of the source's axis above
the horizontal (pi/2 upright, 0 lying, negative = mouth below foot) while the target stands still. Either tube may do a part
of the tilt: turning both about the target's mouth leaves them as they are to one another.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dr_eureka.control.grasp import UP, frame_along
from dr_eureka.kinematics.transforms import rotation_about, transform
from dr_eureka.pieces import Pieces


@dataclass(frozen=True)
class PourPlace:
    """Where in front of the robot a pour happens and which arm does how much of it, angles in rad, lengths in m.

    `source_share`: of the tilt away from the ready pose, what the pouring arm does; the receiving arm does the rest, the
    other way round. `target_elevation`: of the target at the ready pose.
    """

    target_mouth: tuple[float, float, float]
    target_elevation: float = field(metadata={"min": 0.5, "max": 1.5708})
    plane_yaw: float = field(metadata={"min": 0.0, "max": 3.1416})
    source_roll: float = field(metadata={"min": -1.5708, "max": 1.5708})
    target_roll: float = field(metadata={"min": -1.5708, "max": 1.5708})
    source_share: float = field(default=1.0, metadata={"min": 0.0, "max": 1.0})


@dataclass(frozen=True)
class LipPlace:
    """Where the source's lower lip is held at the target's mouth.

    `lock`: `distance` [m] from the target's far inner lip on a chord `angle` [rad] above the mouth plane, nearer than a
    ball's diameter, so that a ball is caught on both lips. `direct`: `gap` [m] in front of the mouth plane, `inset` [m]
    inside of the near inner lip.
    """

    kind: str = field(metadata={"choices": ("lock", "direct")})
    distance: float = 0.0
    angle: float = 0.0
    gap: float = 0.0
    inset: float = 0.0


class PourGeometry:
    """Poses of both tubes along a pour, source in the left hand.

    `turn` [rad]: how far both are turned about the middle of the target's mouth, the source's mouth up, the target's foot
    away from the source.
    """

    def __init__(self, place: PourPlace, lip: LipPlace, pieces: Pieces):
        self._pieces = pieces
        self._place = place
        self._u = np.array([np.cos(place.plane_yaw), -np.sin(place.plane_yaw), 0.0])
        f = place.target_elevation
        self._target_axis = -np.cos(f) * self._u + np.sin(f) * UP
        across = np.sin(f) * self._u + np.cos(f) * UP
        mouth = np.array(place.target_mouth)
        radius = pieces.tube_bore / 2.0
        if lip.kind == "lock":
            far_lip = mouth + across * radius
            self._lip = far_lip + lip.distance * (-np.cos(lip.angle) * across + np.sin(lip.angle) * self._target_axis)
        else:
            near_lip = mouth - across * radius
            self._lip = near_lip + lip.inset * across + lip.gap * self._target_axis
        # Out of the mouth: mostly back along the source's axis, a little up, so that the lips never rub.
        away = -self._u + 0.35 * UP
        self._away = away / np.linalg.norm(away)

    def target(self, turn: float = 0.0) -> np.ndarray:
        """Return base_from_tube (4, 4) of the receiving tube."""
        foot = np.array(self._place.target_mouth) - self._pieces.tube_height * self._target_axis
        level = np.cross(UP, self._u)
        roll = self._place.target_roll
        approach = np.cos(roll) * level + np.sin(roll) * np.cross(level, self._target_axis)
        return self._turned(frame_along(self._target_axis, approach, foot), turn)

    def source(self, elevation: float, withdrawn: float = 0.0, turn: float = 0.0) -> np.ndarray:
        """Return base_from_tube (4, 4) of the pouring tube at an elevation [rad], its lip `withdrawn` [m] from the mouth."""
        axis = np.cos(elevation) * self._u + np.sin(elevation) * UP
        normal = -np.sin(elevation) * self._u + np.cos(elevation) * UP
        lip = self._lip + withdrawn * self._away
        foot = lip + normal * self._pieces.tube_bore / 2.0 - self._pieces.tube_height * axis
        roll = self._place.source_roll
        approach = np.cos(roll) * np.cross(normal, axis) + np.sin(roll) * normal
        return self._turned(frame_along(axis, approach, foot), turn)

    def _turned(self, base_from_tube: np.ndarray, turn: float) -> np.ndarray:
        rotation, mouth = rotation_about(np.cross(self._u, UP), turn), np.array(self._place.target_mouth)
        return transform(rotation, mouth - rotation @ mouth) @ base_from_tube
