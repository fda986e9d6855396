"""THORMANG3's upper body as URDF, made from the figures in config/robot/thormang3.yaml."""
from __future__ import annotations

import math
from typing import Any, Iterator, Mapping
from xml.etree import ElementTree

SERVO_GREY = "0.35 0.36 0.38 1"
FINGER_BLACK = "0.15 0.15 0.16 1"
# A frame without a body still needs an inertia: PyBullet gives a link that has none a mass of 1 kg.
FRAME_MASS = 1e-3
FRAME_INERTIA = [1e-7, 0.0, 0.0, 1e-7, 0.0, 1e-7]


def describe_robot(figures: Mapping[str, Any]) -> str:
    """Return the URDF text of the robot whose left side and middle `figures` describe.

    Lengths in `figures` are m, angles rad or deg as their keys say. The root link is the floor under the pelvis; links
    and joints keep ROBOTIS' names. Right-hand twins are mirrored at y = 0.
    """
    robot = ElementTree.Element("robot", name="thormang3_upper_body")
    ElementTree.SubElement(robot, "link", name=figures["root"]).append(_inertial(FRAME_MASS, [0, 0, 0], FRAME_INERTIA))
    pelvis = {"name": "pelvis_fixed", "parent": figures["root"], "child": "pelvis_link",
              "xyz": [0.0, 0.0, figures["pelvis_height"]]}
    robot.append(_joint(pelvis, figures))
    for name, link in _both_sides_links(figures["links"]):
        robot.append(_link(name, link))
    for joint in _both_sides_joints(figures["joints"]):
        robot.append(_joint(joint, figures))
    ElementTree.indent(robot)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(robot, encoding="unicode") + "\n"


def _both_sides_links(links: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    for name, link in links.items():
        yield name, link
    for name, link in links.items():
        if name.startswith("l_"):
            yield _twin(name), _mirrored_link(link)


def _both_sides_joints(joints: list[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
    yield from joints
    for joint in joints:
        if joint["name"].startswith("l_"):
            yield _mirrored_joint(joint)


def _twin(name: str) -> str:
    return "r_" + name[2:] if name.startswith("l_") else name


def _mirrored_link(link: Mapping[str, Any]) -> dict[str, Any]:
    mirrored = dict(link)
    if "mass" in link:
        mirrored["com"] = _mirrored_vector(link["com"])
        ixx, ixy, ixz, iyy, iyz, izz = link["inertia"]
        mirrored["inertia"] = [ixx, -ixy, ixz, iyy, -iyz, izz]
    mirrored["boxes"] = [{"centre": _mirrored_vector(box["centre"]), "size": box["size"],
                          "yaw_deg": -box.get("yaw_deg", 0.0)} for box in link.get("boxes", [])]
    return mirrored


def _mirrored_joint(joint: Mapping[str, Any]) -> dict[str, Any]:
    mirrored = dict(joint, name=_twin(joint["name"]), parent=_twin(joint["parent"]), child=_twin(joint["child"]),
                    xyz=_mirrored_vector(joint["xyz"]))
    if "rpy_deg" in joint:
        roll, pitch, yaw = joint["rpy_deg"]
        mirrored["rpy_deg"] = [-roll, pitch, -yaw]
    if "axis" in joint:
        # A reflection turns a rotation by q about a into one by -q about the reflected axis.
        mirrored["axis"] = _mirrored_vector(joint["axis"])
        if joint.get("same_sign_on_both_sides"):
            mirrored["axis"] = [-component for component in mirrored["axis"]]
        else:
            lower, upper = _limits(joint)
            mirrored.pop("limits_deg", None)
            mirrored["limits"] = [-upper, -lower]
    return mirrored


def _mirrored_vector(vector: list[float]) -> list[float]:
    x, y, z = vector
    return [x, -y if y else y, z]


def _limits(joint: Mapping[str, Any]) -> tuple[float, float]:
    if "limits" in joint:
        return tuple(joint["limits"])
    return tuple(math.radians(angle) for angle in joint["limits_deg"])


def _text(values) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def _origin(xyz, rpy=(0.0, 0.0, 0.0)) -> ElementTree.Element:
    return ElementTree.Element("origin", xyz=_text(xyz), rpy=_text(rpy))


def _inertial(mass: float, com, inertia) -> ElementTree.Element:
    inertial = ElementTree.Element("inertial")
    inertial.append(_origin(com))
    ElementTree.SubElement(inertial, "mass", value=f"{mass:.9g}")
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    ElementTree.SubElement(inertial, "inertia", {name: f"{value:.9g}" for name, value in zip(names, inertia)})
    return inertial


def _link(name: str, figures: Mapping[str, Any]) -> ElementTree.Element:
    link = ElementTree.Element("link", name=name)
    link.append(_inertial(figures.get("mass", FRAME_MASS), figures.get("com", [0, 0, 0]),
                          figures.get("inertia", FRAME_INERTIA)))
    colour = FINGER_BLACK if "grip" in name else SERVO_GREY
    for kind in ("collision", "visual"):
        for box in figures.get("boxes", []):
            shape = ElementTree.SubElement(link, kind)
            shape.append(_origin(box["centre"], (0.0, 0.0, math.radians(box.get("yaw_deg", 0.0)))))
            geometry = ElementTree.SubElement(shape, "geometry")
            ElementTree.SubElement(geometry, "box", size=_text(box["size"]))
            if kind == "visual":
                material = ElementTree.SubElement(shape, "material", name="finger" if "grip" in name else "servo")
                ElementTree.SubElement(material, "color", rgba=colour)
    return link


def _joint(figures: Mapping[str, Any], robot: Mapping[str, Any]) -> ElementTree.Element:
    moves = "axis" in figures
    joint = ElementTree.Element("joint", name=figures["name"], type="revolute" if moves else "fixed")
    joint.append(_origin(figures["xyz"], [math.radians(angle) for angle in figures.get("rpy_deg", (0.0, 0.0, 0.0))]))
    ElementTree.SubElement(joint, "parent", link=figures["parent"])
    ElementTree.SubElement(joint, "child", link=figures["child"])
    if moves:
        lower, upper = _limits(figures)
        ElementTree.SubElement(joint, "axis", xyz=_text(figures["axis"]))
        ElementTree.SubElement(joint, "limit", lower=f"{lower:.9g}", upper=f"{upper:.9g}",
                               velocity=f"{robot['speed_limit']:.9g}",
                               effort=f"{robot['actuators'][figures['actuator']]:.9g}")
    return joint
