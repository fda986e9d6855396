"""A Dr. Eureka tube as a rigid body: flat boxes round the bore on an octagonal foot.

Bullet has no hollow primitive. Sixteen boxes roll a ball as theory says (1.217 m/s2 at 10 deg) and are cheap; a concave
mesh loses its contacts, convex pieces grow by a margin that narrows the bore.
"""
from __future__ import annotations

import math
from pathlib import Path

from dr_eureka.pieces import Pieces
from dr_eureka.simulation.meshes import write_ring

FOOT_PLATES = 3
WALL_COLOUR = (0.82, 0.90, 0.96)
BLACK = (0.03, 0.03, 0.035)
# The place of the see-through wall among a tube's visual shapes.
WALL_SHAPE = 2
TAPE_THICKNESS = 0.0002


def collision_shape_count(wall_boxes: int) -> int:
    """Return how many collision shapes a tube has; Bullet drops surplus ones without a word, so check."""
    return wall_boxes + FOOT_PLATES


def write_tube_urdf(path: Path, pieces: Pieces, mass: float, wall_boxes: int, wall_tint: float) -> None:
    """Write the URDF of a tube and, beside it, the meshes it is seen by.

    The link's origin is at the underside of its foot, z toward the mouth. `mass` in kg; `wall_tint` 0..1 is how much of
    the wall one sees.
    """
    com, inertia = mass_properties(pieces, mass)
    shapes = "\n".join([*_visuals(path.parent, pieces, wall_tint), *_collision_boxes(pieces, wall_boxes)])
    path.write_text(f"""<?xml version="1.0"?>
<robot name="tube">
  <link name="tube">
    <inertial>
      <origin xyz="0 0 {com:.9g}"/>
      <mass value="{mass:.9g}"/>
      <inertia ixx="{inertia[0]:.9g}" ixy="0" ixz="0" iyy="{inertia[1]:.9g}" iyz="0" izz="{inertia[2]:.9g}"/>
    </inertial>
{shapes}
  </link>
</robot>
""")


def mass_properties(pieces: Pieces, mass: float) -> tuple[float, tuple[float, float, float]]:
    """Return height of the centre of mass above the foot [m] and principal inertias [kg m^2] of wall plus foot disc."""
    inner, outer, foot = pieces.tube_bore / 2, pieces.tube_outer_radius, pieces.foot_radius
    length, thickness = pieces.tube_height - pieces.foot_thickness, pieces.foot_thickness
    wall_volume = (outer**2 - inner**2) * length
    foot_volume = foot**2 * thickness
    wall, disc = (mass * volume / (wall_volume + foot_volume) for volume in (wall_volume, foot_volume))
    wall_z, disc_z = thickness + length / 2, thickness / 2
    com = (wall * wall_z + disc * disc_z) / mass
    axial = wall * (outer**2 + inner**2) / 2 + disc * foot**2 / 2
    across = (wall * (3 * (outer**2 + inner**2) + length**2) / 12 + wall * (wall_z - com) ** 2
              + disc * (3 * foot**2 + thickness**2) / 12 + disc * (disc_z - com) ** 2)
    return com, (across, across, axial)


def _visuals(folder: Path, pieces: Pieces, wall_tint: float):
    inner, outer, foot = pieces.tube_bore / 2, pieces.tube_outer_radius, pieces.foot_thickness
    rings = {"foot": (1e-5, pieces.foot_radius, 0.0, foot, (*BLACK, 1.0)),
             "tape": (outer, outer + TAPE_THICKNESS, foot, foot + pieces.tape_height, (*BLACK, 1.0)),
             "wall": (inner, outer, foot, pieces.tube_height, (*WALL_COLOUR, wall_tint))}
    for name, (inside, outside, bottom, top, colour) in rings.items():
        write_ring(folder / f"tube_{name}.obj", inside, outside, bottom, top)
        rgba = " ".join(f"{value:.4g}" for value in colour)
        yield (f'    <visual><geometry><mesh filename="tube_{name}.obj"/></geometry>'
               f'<material name="{name}"><color rgba="{rgba}"/></material></visual>')


def _collision_boxes(pieces: Pieces, wall_boxes: int):
    outer, wall, foot = pieces.tube_outer_radius, pieces.tube_wall, pieces.foot_radius
    # Two crossed plates have the eight corners of an octagon on the foot's circle; a third, lifted clear of the table,
    # closes the floor under the bore.
    corner = math.radians(22.5)
    long, short = 2 * foot * math.cos(corner), 2 * foot * math.sin(corner)
    thickness = pieces.foot_thickness
    yield _box((0, 0, thickness / 2), 0.0, (long, short, thickness))
    yield _box((0, 0, thickness / 2), 0.0, (short, long, thickness))
    lifted = thickness / 4
    side = 2 * outer * math.sqrt(0.5)
    yield _box((0, 0, (pieces.tube_floor + lifted) / 2), math.pi / 4, (side, side, pieces.tube_floor - lifted))
    length = pieces.tube_height - thickness
    width = 2 * outer * math.tan(math.pi / wall_boxes)
    for index in range(wall_boxes):
        angle = 2 * math.pi * index / wall_boxes
        radius = outer - wall / 2
        centre = (radius * math.cos(angle), radius * math.sin(angle), thickness + length / 2)
        yield _box(centre, angle, (wall, width, length))


def _box(centre, yaw: float, size) -> str:
    xyz, dimensions = (" ".join(f"{value:.9g}" for value in triple) for triple in (centre, size))
    return (f'    <collision><origin xyz="{xyz}" rpy="0 0 {yaw:.9g}"/>'
            f'<geometry><box size="{dimensions}"/></geometry></collision>')
