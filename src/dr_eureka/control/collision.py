"""Would a motion bring the robot into touch with itself or with what stands around it? Distances are Bullet's (GJK).

PyBullet serves as a library of closest points between shapes, nothing is simulated. The robot is its own description, the
furniture what a ruler measured, the tubes what the camera saw.
"""

from __future__ import annotations

import tempfile
import weakref
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from typing import Iterable, Iterator, Mapping, Sequence

import numpy as np
import pybullet

from dr_eureka.control.arm import Arm
from dr_eureka.control.port import CONTROLLED_JOINTS
from dr_eureka.control.settings import CollisionSettings
from dr_eureka.game.hands import HANDS
from dr_eureka.game.state import TUBES
from dr_eureka.kinematics.arms import URDF
from dr_eureka.kinematics.transforms import matrix_to_quaternion
from dr_eureka.pieces import Pieces
from dr_eureka.resources import resource_path

# The links that a held tube moves with; its contact with them is the grasp.
_HAND_LINKS = ("arm_wr_p_link", "arm_grip_link", "arm_grip_1_link")
_ARM_LINKS = ("arm_sh_p2_link", "arm_el_y_link", "arm_wr_r_link", "arm_wr_y_link", *_HAND_LINKS)
_SHOULDER_LINKS = ("arm_sh_p1_link", "arm_sh_r_link")
_TRUNK_LINKS = ("pelvis_link", "chest_link", "head_y_link", "head_p_link")
# [m] how far from a joint a point beyond it may be, along the links and up to the end of a held tube: its way per radian.
REACH = {
    "sh_p1": 0.93, "sh_r": 0.84, "sh_p2": 0.77, "el_y": 0.57, "wr_r": 0.39, "wr_y": 0.33, "wr_p": 0.25,
    "grip": 0.10, "head_y": 0.20, "head_p": 0.16, "torso_y": 1.20,
}
# A pair that is too near at the start may part; this is what Bullet's distances differ by between two like postures.
_SAME_DISTANCE = 2e-4

Pair = frozenset[str]
# What holds the upper arm, in every posture.
_SHOULDERS = {
    frozenset((f"{hand[0]}_{link}", f"{hand[0]}_arm_sh_p2_link")) for hand in HANDS for link in _SHOULDER_LINKS
}


@dataclass(frozen=True)
class Tubes:
    """Tubes as the robot believes them to be: feet (3,) [m] in base of those that stand, and by hand those that are held.

    A held tube is its name and end_from_tube (4, 4).
    """

    standing: Mapping[str, np.ndarray]
    held: Mapping[str, tuple[str, np.ndarray]]


@dataclass(frozen=True)
class Hit:
    """Two bodies that would come nearer than they may: how near [m], where (3,) [m] in base, when [s] after the start."""

    bodies: tuple[str, str]
    distance: float
    allowed: float
    where: np.ndarray
    elapsed: float

    def __str__(self) -> str:
        place = ", ".join(f"{value:.3f}" for value in self.where)
        return (
            f"{self.bodies[0]} and {self.bodies[1]} would come within {1000.0 * self.distance:.1f} mm of each other "
            f"at ({place}) m in base, {self.elapsed:.2f} s into the motion; expected at least {1000.0 * self.allowed:.1f} mm"
        )


def hand_links(hand: str) -> tuple[str, ...]:
    """Name the links of a hand, body and fingers."""
    return tuple(f"{hand[0]}_{link}" for link in _HAND_LINKS)


def finger_links(hand: str) -> tuple[str, ...]:
    """Name the links of a hand's fingers."""
    return hand_links(hand)[1:]


def tube_body(tube: str) -> str:
    """Name a tube as a body that may be hit."""
    return f"tube {tube}"


def _shoulder(hand: str) -> str:
    """Name the part of the robot that holds the upper arm."""
    return f"{hand} shoulder"


class CollisionChecker:
    """Finds the first posture of a motion in which two bodies are nearer than the margin.

    Checked are arm with arm, arms with trunk, head, both shoulders, furniture and standing tubes, and held tubes with all of
    these, the other held tube and the arm that holds them beyond its hand. Not checked are neighbours that a joint connects,
    and an arm with itself from the upper arm on: its joint limits keep all but a few millimetres of these boxes apart.
    """

    def __init__(self, settings: CollisionSettings, pieces: Pieces, arms: Mapping[str, Arm]):
        self._settings, self._arms = settings, arms
        self._client = pybullet.connect(pybullet.DIRECT)
        weakref.finalize(self, pybullet.disconnect, self._client)
        self._names: dict[tuple[int, int], str] = {}
        self._joints: dict[str, dict[str, int]] = {}
        self._parts: dict[str, int] = {}
        self._add_part("trunk", _TRUNK_LINKS, None)
        for hand in HANDS:
            self._add_part(hand, [f"{hand[0]}_{link}" for link in _ARM_LINKS], arms[hand])
            self._add_part(_shoulder(hand), [f"{hand[0]}_{link}" for link in _SHOULDER_LINKS], arms[hand])
        self._furniture = [self._add_box(name, box.centre, box.size) for name, box in settings.furniture.items()]
        self._tubes = {tube: self._add_tube(tube_body(tube), pieces) for tube in TUBES}
        for body in (*self._furniture, *self._tubes.values()):
            # Bullet rounds edges off by a margin, so that corners may be nearer than it says: here by up to 5 mm, at the
            # robot's links by 0.7 mm each, which cannot be changed.
            pybullet.changeDynamics(body, -1, collisionMargin=0.0, physicsClientId=self._client)

    def _add_part(self, part: str, links: Iterable[str], arm: Arm | None) -> None:
        """Load some links of the robot, and what they hang from, as one body: Bullet compares all links of two bodies."""
        with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
            file.write(_only(set(links), resource_path(URDF).read_text(encoding="utf-8"), arm))
            file.flush()
            body = pybullet.loadURDF(file.name, useFixedBase=True, physicsClientId=self._client)
        joints = {}
        for index in range(pybullet.getNumJoints(body, physicsClientId=self._client)):
            info = pybullet.getJointInfo(body, index, physicsClientId=self._client)
            self._names[body, index] = info[12].decode()
            if info[2] == pybullet.JOINT_REVOLUTE:
                joints[info[1].decode()] = index
        self._parts[part], self._joints[part] = body, joints

    def _add_box(self, name: str, centre: Sequence[float], size: Sequence[float]) -> int:
        half = [length / 2.0 for length in size]
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=self._client)
        body = pybullet.createMultiBody(0.0, shape, basePosition=centre, physicsClientId=self._client)
        self._names[body, -1] = name
        return body

    def _add_tube(self, name: str, pieces: Pieces) -> int:
        """Add a tube, origin at the underside of its foot, z toward its mouth: a wide foot and a solid wall."""
        heights = (pieces.foot_thickness, pieces.tube_height)
        shape = pybullet.createCollisionShapeArray(
            shapeTypes=[pybullet.GEOM_CYLINDER] * 2,
            radii=[pieces.foot_radius, pieces.tube_outer_radius],
            lengths=heights,
            collisionFramePositions=[[0.0, 0.0, height / 2.0] for height in heights],
            physicsClientId=self._client,
        )
        body = pybullet.createMultiBody(0.0, shape, physicsClientId=self._client)
        self._names[body, -1] = name
        return body

    def first_hit(
        self,
        joints: Mapping[str, float],
        times: np.ndarray,
        moving: Mapping[str, np.ndarray],
        tubes: Tubes,
        allowed: frozenset[Pair] = frozenset(),
    ) -> Hit | None:
        """Return where a motion first brings two bodies nearer than the margin, or None.

        joints: every controlled joint [rad] before the motion. times (k,) [s] and moving, name -> (k,) [rad]: the motion,
        finely sampled. allowed: pairs of bodies that may touch. Bodies nearer than the margin at the start may part but not
        come nearer.

        Postures are taken so far apart that what lies between them is clear too: nothing moves relative to anything else by
        more than the smallest distance plus the margin, and at the next posture all are at least the margin apart again
        (conservative advancement, Mirtich 1996).
        """
        margin = self._settings.margin
        travelled = _travelled(moving)
        moved = self._moved_by(moving)
        pairs = list(self._pairs(moved, tubes))
        self._place_standing(tubes)
        limits: dict[Pair, float] = {}
        index, last = 0, len(times) - 1
        while True:
            now = {**joints, **{name: values[index] for name, values in moving.items()}}
            self._place(now, tubes, self._parts if index == 0 else moved)
            nearest = self._settings.horizon
            for bodies, distance, ends in self._distances(pairs, tubes):
                pair = frozenset(bodies)
                if pair in allowed:
                    continue
                if index == 0:
                    limits[pair] = min(limits.get(pair, margin), distance - _SAME_DISTANCE)
                elif distance < limits.get(pair, margin):
                    return Hit(bodies, distance, limits.get(pair, margin), np.mean(ends, axis=0), float(times[index]))
                nearest = min(nearest, distance)
            if index == last:
                return None
            reached = travelled[index] + max(nearest, margin) + margin
            index = min(last, max(index + 1, int(np.searchsorted(travelled, reached, side="right")) - 1))

    def _moved_by(self, moving: Mapping[str, np.ndarray]) -> set[str]:
        """Return the parts of the robot that a motion of these joints moves."""
        return {part for part, joints in self._joints.items() if joints.keys() & moving.keys()}

    def _pairs(self, moved: set[str], tubes: Tubes) -> Iterator[tuple[int, int]]:
        """Yield the pairs of bodies whose distance a motion of these parts changes."""
        held = {hand: self._tubes[tube] for hand, (tube, _) in tubes.held.items()}
        fixed = [*self._furniture, *(self._tubes[tube] for tube in tubes.standing)]
        if moved & set(HANDS):
            yield self._parts["left"], self._parts["right"]
            yield from [tuple(held.values())] if len(held) == 2 else []
        for hand, other in zip(HANDS, reversed(HANDS)):
            carried = [held[hand]] if hand in held else []
            if hand in moved:
                yield from ((body, thing) for body in (self._parts[hand], *carried) for thing in fixed)
                yield from ((tube, self._parts[hand]) for tube in carried)
                yield from ((body, self._parts[_shoulder(hand)]) for body in (self._parts[hand], *carried))
            if hand in moved or "trunk" in moved:
                yield from ((body, self._parts["trunk"]) for body in (self._parts[hand], *carried))
            if moved & set(HANDS):
                yield from ((tube, self._parts[other]) for tube in carried)
                yield from ((body, self._parts[_shoulder(other)]) for body in (self._parts[hand], *carried))

    def _place_standing(self, tubes: Tubes) -> None:
        for tube, foot in tubes.standing.items():
            pybullet.resetBasePositionAndOrientation(
                self._tubes[tube], list(foot), (0.0, 0.0, 0.0, 1.0), physicsClientId=self._client
            )

    def _place(self, joints: Mapping[str, float], tubes: Tubes, parts: Iterable[str]) -> None:
        """Bring parts of the robot, and the tubes that hands hold, to where they are with joints [rad]."""
        angles = {name: joints[name] for name in CONTROLLED_JOINTS}
        for hand in HANDS:
            arm = self._arms[hand]
            angles.update(zip(arm.joints, arm.as_drawn(arm.positions(joints))))
            angles[f"{hand[0]}_arm_grip_1"] = angles[f"{hand[0]}_arm_grip"]
        for part in parts:
            mine = {index: angles[name] for name, index in self._joints[part].items()}
            pybullet.resetJointStatesMultiDof(
                self._parts[part], list(mine), [[angle] for angle in mine.values()], physicsClientId=self._client
            )
        for hand, (tube, end_from_tube) in tubes.held.items():
            pose = self._arms[hand].pose(joints) @ end_from_tube
            place, turn = pose[:3, 3].tolist(), matrix_to_quaternion(pose[:3, :3]).tolist()
            pybullet.resetBasePositionAndOrientation(self._tubes[tube], place, turn, physicsClientId=self._client)

    def _distances(
        self, pairs: Sequence[tuple[int, int]], tubes: Tubes
    ) -> Iterator[tuple[tuple[str, str], float, tuple[Sequence[float], Sequence[float]]]]:
        """Yield names, distance [m] and nearest points (x, y, z) [m] of all two bodies that are nearer than the horizon."""
        held = tubes.held.items()
        together = _SHOULDERS | {frozenset((tube_body(tube), link)) for hand, (tube, _) in held for link in hand_links(hand)}
        for first, second in pairs:
            for point in pybullet.getClosestPoints(first, second, self._settings.horizon, physicsClientId=self._client):
                names = self._names[first, point[3]], self._names[second, point[4]]
                if frozenset(names) not in together:
                    yield names, point[8], (point[5], point[6])


def _only(links: set[str], urdf: str, arm: Arm | None) -> str:
    """Return a robot description with these links alone and, without their shapes, those that they hang from.

    The links of an arm are as long as its calibration says.
    """
    robot = ElementTree.fromstring(urdf)
    above = {joint.find("child").get("link"): joint for joint in robot.findall("joint")}
    kept, waiting = set(), list(links)
    while waiting:
        link = waiting.pop()
        kept.add(link)
        if link in above:
            waiting.append(above[link].find("parent").get("link"))
    for link in robot.findall("link"):
        name = link.get("name")
        for shape in link.findall("visual") + ([] if name in links else link.findall("collision")):
            link.remove(shape)
        if name not in kept:
            robot.remove(link)
            robot.remove(above[name])
    stretches = arm.stretches() if arm else {}
    for joint in robot.findall("joint"):
        if stretches.get(joint.get("name")):
            origin = joint.find("origin")
            place = np.array([float(word) for word in origin.get("xyz").split()])
            away = arm.chain.first_joint_origin if joint.get("name") == arm.joints[0] else place
            stretched = place + stretches[joint.get("name")] * away / np.linalg.norm(away)
            origin.set("xyz", " ".join(map(str, stretched)))
    return ElementTree.tostring(robot, encoding="unicode")


def _travelled(moving: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return how far (k,) [m] any point may at most have come relative to any other since the start of a motion."""
    steps = sum(REACH[name.partition("_arm_")[2] or name] * np.abs(np.diff(values)) for name, values in moving.items())
    return np.concatenate([[0.0], np.cumsum(steps)])
