"""Wavefront OBJ files for what Bullet's primitives cannot show: a tube's wall, a picture on paper."""
from __future__ import annotations

import math
from pathlib import Path

ROUND_SIDES = 48


def write_ring(path: Path, inner: float, outer: float, bottom: float, top: float) -> None:
    """Write a hollow cylinder about z: radii and heights in m, both surfaces and the end rings, smoothly shaded."""
    lines = []
    for index in range(ROUND_SIDES):
        angles = [2 * math.pi * (index + side) / ROUND_SIDES for side in (0, 1)]
        radial = [(math.cos(angle), math.sin(angle), 0.0) for angle in angles]
        inward = [(-x, -y, 0.0) for x, y, _ in radial]
        outside = [_point(outer, angle, height) for height in (bottom, top) for angle in angles]
        inside = [_point(inner, angle, height) for height in (bottom, top) for angle in angles]
        lines += _quad(4 * index, [outside[0], outside[1], outside[3], outside[2]], [radial[0], radial[1], radial[1], radial[0]])
        lines += _quad(4 * index + 1, [inside[1], inside[0], inside[2], inside[3]], [inward[1], inward[0], inward[0], inward[1]])
        lines += _quad(4 * index + 2, [inside[2], outside[2], outside[3], inside[3]], [(0.0, 0.0, 1.0)] * 4)
        lines += _quad(4 * index + 3, [inside[1], outside[1], outside[0], inside[0]], [(0.0, 0.0, -1.0)] * 4)
    path.write_text("\n".join(lines) + "\n")


def write_picture_plane(path: Path, corners, picture: str) -> None:
    """Write a flat picture and its material: the image file `picture` in the same folder, spread over four points.

    `corners` (4 points [m]) are the picture's top left, top right, bottom right and bottom left. The material file names
    the image because Bullet's OpenGL renderer gives a texture set later to the wrong body.
    """
    top_left, top_right, bottom_right, bottom_left = corners
    lines = [f"mtllib {path.stem}.mtl", "usemtl picture"]
    lines += _quad(0, [bottom_left, bottom_right, top_right, top_left], [(0.0, 0.0, 1.0)] * 4)
    path.write_text("\n".join(lines) + "\n")
    path.with_suffix(".mtl").write_text(f"newmtl picture\nKa 1 1 1\nKd 1 1 1\nmap_Kd {picture}\n")


def _point(radius: float, angle: float, height: float) -> tuple[float, float, float]:
    return (radius * math.cos(angle), radius * math.sin(angle), height)


def _quad(number: int, corners, normals) -> list[str]:
    """Return OBJ lines of a file's quadrilateral `number`: counter-clockwise from outside, bottom left corner first."""
    texture = ((0, 0), (1, 0), (1, 1), (0, 1))
    lines = [f"v {x:.8f} {y:.8f} {z:.8f}" for x, y, z in corners]
    lines += [f"vt {u} {v}" for u, v in texture]
    lines += [f"vn {x:.6f} {y:.6f} {z:.6f}" for x, y, z in normals]
    first = 4 * number + 1
    a, b, c, d = (f"{index}/{index}/{index}" for index in range(first, first + 4))
    return lines + [f"f {a} {b} {c}", f"f {a} {c} {d}"]
