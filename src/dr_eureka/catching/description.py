"""Saika as a URDF, drawn from the lengths and limits in config/saika.yaml."""

from __future__ import annotations

import math
from typing import Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from dr_eureka.catching.settings import ARM_JOINTS, BodySettings, HeadCameraSettings, JointSettings, SaikaSettings
from dr_eureka.kinematics.arms import SIDES

BASE_LINK = "base"
# Masses of a light robot, kg: nothing but the servos' load depends on them.
_TORSO_KG, _HEAD_KG, _UPPER_ARM_KG, _FOREARM_KG, _BASKET_KG, _HINGE_KG = 15.0, 2.0, 1.5, 1.0, 0.2, 0.05
_TORSO_HEIGHT_M = 0.50
_HEAD_SIZE_M = (0.19, 0.10, 0.10)
_TORQUE_NM = 60.0
_BASKET_WALLS = 20
_BASKET_THICKNESS_M = 0.006
_LIGHT, _DARK, _STEEL = "0.80 0.82 0.84 1", "0.25 0.26 0.28 1", "0.62 0.64 0.66 1"
_Box = tuple[Sequence[float], Sequence[float], float]  # centre [m], size [m], turn about x or z [rad]


def hand_link(side: str) -> str:
    """Return the name of the link in the middle of a hand's basket rim (see the frame `hand` of this package)."""
    return f"{side}_hand"


def camera_link(side: str) -> str:
    """Return the name of a camera's optical frame."""
    return f"{side}_camera"


def describe_saika(settings: SaikaSettings) -> str:
    """Return the URDF text of Saika: torso, neck, both arms, both cameras, and the basket on the left hand.

    The root link is `base`. Joints: neck_pan, neck_tilt, left_/right_ with shoulder_pitch ... forearm_roll, and each
    camera's own left_/right_ camera_pan and camera_tilt. Positive angles: pan to the left, tilt up, shoulder_pitch forward,
    shoulder_roll outward, upper_arm_yaw outward, elbow bent, forearm_roll as upper_arm_yaw when the arm hangs.
    """
    body, cameras = settings.body, settings.cameras
    robot = Element("robot", name="saika")
    _link(robot, BASE_LINK)
    depth, width = 2.0 * body.torso_half_depth_m, 2.0 * body.torso_half_width_m
    torso = ((0.0, 0.0, 0.04 - 0.5 * _TORSO_HEIGHT_M), (width, depth, _TORSO_HEIGHT_M), 0.0)
    _link(robot, "torso", _TORSO_KG, [torso], _LIGHT)
    _joint(robot, "torso_fixed", BASE_LINK, "torso", (0.0, 0.0, 0.0))
    _add_head(robot, body, cameras, settings.joints)
    for side in SIDES:
        _add_arm(robot, settings, side)
    indent(robot)
    return '<?xml version="1.0"?>\n' + tostring(robot, encoding="unicode") + "\n"


def _add_head(robot: Element, body: BodySettings, cameras: HeadCameraSettings, joints: dict[str, JointSettings]) -> None:
    between = body.neck_tilt_above_shoulders_m - body.neck_pan_above_shoulders_m
    _link(robot, "neck", _HINGE_KG, [((0.0, 0.0, 0.0), (0.06, 0.06, 0.04), 0.0)], _DARK)
    _joint(robot, "neck_pan", "torso", "neck", (0, 0, body.neck_pan_above_shoulders_m), (0, 0, 1), joints["neck_pan"])
    # The head ends behind the cameras, which look past it.
    head = (0.0, body.eyes_before_neck_m - 0.02 - 0.5 * _HEAD_SIZE_M[1], body.eyes_above_neck_tilt_m)
    _link(robot, "head", _HEAD_KG, [(head, _HEAD_SIZE_M, 0.0)], _LIGHT)
    _joint(robot, "neck_tilt", "neck", "head", (0.0, 0.0, between), (1, 0, 0), joints["neck_tilt"])
    for side, sign in zip(SIDES, (-1.0, 1.0)):
        eye = (0.5 * sign * cameras.baseline_m, body.eyes_before_neck_m, body.eyes_above_neck_tilt_m)
        limits = (cameras.pan_limit_deg, cameras.tilt_limit_deg)
        pan, tilt = (JointSettings((-limit, limit), joints["neck_pan"].speed) for limit in limits)
        _link(robot, f"{side}_camera_mount", _HINGE_KG)
        _joint(robot, f"{side}_camera_pan", "head", f"{side}_camera_mount", eye, (0, 0, 1), pan)
        _link(robot, f"{side}_camera_body", _HINGE_KG)
        _joint(robot, f"{side}_camera_tilt", f"{side}_camera_mount", f"{side}_camera_body", (0, 0, 0), (1, 0, 0), tilt)
        _link(robot, camera_link(side))
        # From x right, y forward, z up to an optical frame: x right, y down, z forward.
        _joint(robot, f"{side}_camera_fixed", f"{side}_camera_body", camera_link(side), (0, 0, 0), turn=-0.5 * math.pi)


def _add_arm(robot: Element, settings: SaikaSettings, side: str) -> None:
    body = settings.body
    sign = -1.0 if side == "left" else 1.0
    # Reflected in x = 0, a turn about x keeps its sense and one about y or z is reversed.
    axes = ((1, 0, 0), (0, -sign, 0), (0, 0, -sign), (1, 0, 0), (0, 0, -sign))
    below_shoulder = (0.0, 0.0, -body.upper_arm_m)
    origins = ((sign * body.shoulder_half_width_m, 0, 0), (0, 0, 0), (0, 0, 0), below_shoulder, (0, 0, 0))
    thick = 1.4 * body.arm_radius_m  # a square beam about as thick as the round arm
    upper = ((0.0, 0.0, -0.5 * body.upper_arm_m), (thick, thick, body.upper_arm_m), 0.0)
    fore = ((0.0, 0.0, -0.5 * body.forearm_m), (thick, thick, body.forearm_m), 0.0)
    shapes = ([], [], [upper], [], [fore])
    masses = (_HINGE_KG, _HINGE_KG, _UPPER_ARM_KG, _HINGE_KG, _FOREARM_KG)
    parent = "torso"
    for name, axis, origin, boxes, mass in zip(ARM_JOINTS, axes, origins, shapes, masses):
        link = f"{side}_{name}_link"
        _link(robot, link, mass, boxes, _LIGHT)
        _joint(robot, f"{side}_{name}", parent, link, origin, axis, settings.joints[name])
        parent = link
    reach = body.forearm_m + body.basket_beyond_wrist_m
    turn = -0.5 * math.pi - math.radians(body.basket_rim_level_at_deg)
    if side == "left":
        _link(robot, hand_link(side), _BASKET_KG, _basket_boxes(settings), _STEEL, turns_about="z")
    else:
        _link(robot, hand_link(side))
    _joint(robot, f"{side}_hand_fixed", parent, hand_link(side), (0.0, 0.0, -reach), turn=turn)


def _basket_boxes(settings: SaikaSettings) -> list[_Box]:
    """Return the basket in its hand's frame: walls around the rim's inner width, a floor, and the handle."""
    body, radius = settings.body, 0.5 * settings.basket_diameter_m
    middle = radius + 0.5 * _BASKET_THICKNESS_M
    width = 2.0 * (radius + _BASKET_THICKNESS_M) * math.tan(math.pi / _BASKET_WALLS)
    boxes: list[_Box] = []
    for index in range(_BASKET_WALLS):
        angle = 2.0 * math.pi * index / _BASKET_WALLS
        centre = (middle * math.cos(angle), middle * math.sin(angle), -0.5 * body.basket_depth_m)
        boxes.append((centre, (_BASKET_THICKNESS_M, width, body.basket_depth_m), angle))
    floor = -body.basket_depth_m - 0.5 * _BASKET_THICKNESS_M
    boxes.append(((0.0, 0.0, floor), (2.0 * radius, 2.0 * radius, _BASKET_THICKNESS_M), 0.0))
    handle = body.basket_beyond_wrist_m - radius - _BASKET_THICKNESS_M
    boxes.append(((0.0, -radius - _BASKET_THICKNESS_M - 0.5 * handle, -0.02), (0.025, handle, 0.025), 0.0))
    return boxes


def _link(
    robot: Element, name: str, mass: float = 1e-3, boxes: Sequence[_Box] = (), colour: str = _LIGHT, turns_about: str = "x"
) -> None:
    """Add a link made of boxes of one colour, its mass spread as in the box around all of them."""
    link = SubElement(robot, "link", name=name)
    low = [min((centre[i] - 0.5 * size[i] for centre, size, _ in boxes), default=-0.005) for i in range(3)]
    high = [max((centre[i] + 0.5 * size[i] for centre, size, _ in boxes), default=0.005) for i in range(3)]
    x, y, z = (above - below for below, above in zip(low, high))
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "origin", xyz=_text([0.5 * (below + above) for below, above in zip(low, high)]))
    SubElement(inertial, "mass", value=f"{mass:.9g}")
    moments = {"ixx": y * y + z * z, "iyy": x * x + z * z, "izz": x * x + y * y}
    across = {key: f"{mass * value / 12.0:.9g}" for key, value in moments.items()}
    SubElement(inertial, "inertia", across | {"ixy": "0", "ixz": "0", "iyz": "0"})
    for kind in ("visual", "collision"):
        for centre, size, turn in boxes:
            shape = SubElement(link, kind)
            rpy = (turn, 0.0, 0.0) if turns_about == "x" else (0.0, 0.0, turn)
            SubElement(shape, "origin", xyz=_text(centre), rpy=_text(rpy))
            SubElement(SubElement(shape, "geometry"), "box", size=_text(size))
            if kind == "visual":
                SubElement(SubElement(shape, "material", name=f"rgba {colour}"), "color", rgba=colour)


def _joint(
    robot: Element,
    name: str,
    parent: str,
    child: str,
    origin: Sequence[float],
    axis: Sequence[float] | None = None,
    limits: JointSettings | None = None,
    turn: float = 0.0,
) -> None:
    """Add a joint at `origin` [m] of its parent, turned by `turn` [rad] about x; without an axis a fixed one."""
    joint = SubElement(robot, "joint", name=name, type="fixed" if axis is None else "revolute")
    SubElement(joint, "origin", xyz=_text(origin), rpy=_text((turn, 0.0, 0.0)))
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    if axis is not None and limits is not None:
        lower, upper = (math.radians(angle) for angle in limits.range_deg)
        SubElement(joint, "axis", xyz=_text(axis))
        values = {"lower": lower, "upper": upper, "velocity": limits.speed, "effort": _TORQUE_NM}
        SubElement(joint, "limit", {key: f"{value:.9g}" for key, value in values.items()})


def _text(values: Sequence[float]) -> str:
    return " ".join(f"{value:.9g}" for value in values)
