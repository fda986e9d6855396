"""Geometry of the game's pieces, known to the robot and the simulator alike."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dr_eureka.resources import load_yaml
from dr_eureka.settings import build

_LENGTH = {"min": 1e-4, "max": 1.0}


@dataclass(frozen=True)
class Pieces:
    """Balls, tubes, sheet, cards and the markers of the hands. Lengths in m, colours in sRGB 0-255; see `config/pieces.yaml`.

    The frame `sheet` has its origin at the centre of the printed side, x away from the robot, y to its left, z up.
    """

    ball_diameter: float = field(metadata=_LENGTH)
    ball_colours: dict[str, tuple[int, int, int]] = field(metadata={"min": 0, "max": 255})
    tube_bore: float = field(metadata=_LENGTH)
    tube_wall: float = field(metadata=_LENGTH)
    tube_height: float = field(metadata=_LENGTH)
    tube_floor: float = field(metadata=_LENGTH)
    foot_radius: float = field(metadata=_LENGTH)
    foot_thickness: float = field(metadata=_LENGTH)
    tape_height: float = field(metadata=_LENGTH)
    sheet_depth: float = field(metadata=_LENGTH)
    sheet_width: float = field(metadata=_LENGTH)
    marker_side: float = field(metadata=_LENGTH)
    marker_dictionary: str
    marker_centres: dict[int, tuple[float, float]] = field(metadata={"min": -1.0, "max": 1.0})
    card_side: float = field(metadata=_LENGTH)
    hand_marker_side: float = field(metadata=_LENGTH)
    hand_marker_margin: float = field(metadata=_LENGTH)
    hand_markers: dict[str, int]
    hand_marker_centre: tuple[float, float, float] = field(metadata={"min": -1.0, "max": 1.0})

    @property
    def ball_radius(self) -> float:
        """Radius of a ball [m]."""
        return self.ball_diameter / 2

    @property
    def tube_outer_radius(self) -> float:
        """Radius of a tube's outside wall [m]."""
        return self.tube_bore / 2 + self.tube_wall

    def marker_corners(self, marker: int) -> np.ndarray:
        """Return a marker's corners as (4, 2) points [m] in `sheet`, in ArUco's order.

        That order is top left, top right, bottom right, bottom left as printed; the top edge lies toward +x and the
        print's left toward +y. Raises KeyError for a marker that is not on the sheet.
        """
        half = self.marker_side / 2
        return np.add(self.marker_centres[marker], [(half, half), (half, -half), (-half, -half), (-half, half)])

    def hand_marker_corners(self) -> np.ndarray:
        """Return the corners (4, 3) [m] of the marker on a hand, in the frame of its end link and in ArUco's order."""
        half = self.hand_marker_side / 2
        flat = [(half, half, 0.0), (half, -half, 0.0), (-half, -half, 0.0), (-half, half, 0.0)]
        return np.add(self.hand_marker_centre, flat)


def load_pieces(path: str = "config/pieces.yaml") -> Pieces:
    """Load the pieces; raises ResourceError or SettingsError naming the file and the key."""
    return build(Pieces, load_yaml(path), path)
