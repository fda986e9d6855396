"""What is seen at each of the four places in a tube where a ball may lie: a colour, nothing, or not known.

Where a tube is, is known; so is where the centre of each ball would be in the picture. There the colour tells ball from
background: neither the tape nor the next ball hides a ball's centre from a camera that looks down on the tube.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np

from dr_eureka.game.state import TUBE_CAPACITY
from dr_eureka.pieces import Pieces
from dr_eureka.vision.camera import CameraModel

UNKNOWN, EMPTY = "?", " "
_RING = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)


@dataclass(frozen=True)
class ContentsSettings:
    """The `contents:` block of config/dr_eureka_main.yaml, which gives meaning and unit of each key."""

    sample_share: float = field(metadata={"min": 0.1, "max": 1.0})
    smallest_seen_share: float = field(metadata={"min": 0.05, "max": 1.0})
    largest_empty_chroma: float = field(metadata={"min": 0.001, "max": 0.2})
    smallest_saturation: float = field(metadata={"min": 0.05, "max": 1.0})
    wall_transmission: float = field(metadata={"min": 0.05, "max": 1.0})
    smallest_resemblance: float = field(metadata={"min": -1.0, "max": 1.0})
    darkest_paper: float = field(metadata={"min": 0.0, "max": 1.0})
    darkest_held: float = field(metadata={"min": 0.0, "max": 255.0})
    lowest_held_m: float = field(metadata={"min": 0.0, "max": 0.2})
    darkest_ball: float = field(metadata={"min": 0.0, "max": 255.0})
    loose_margin_m: float = field(metadata={"min": 0.0, "max": 0.5})


@dataclass(frozen=True)
class Level:
    """One place in a tube: a ball's letter, EMPTY or UNKNOWN, and how sure that is (0..1)."""

    label: str
    confidence: float


_NOT_KNOWN = Level(UNKNOWN, 0.0)


class TubeView:
    """How one tube lies in the picture: its outline, and the discs of the balls it may hold.

    Args:
        base_from_tube: (4, 4), origin at the underside of the foot, z toward the mouth.
    """

    def __init__(self, camera: CameraModel, base_from_camera: np.ndarray, base_from_tube: np.ndarray, pieces: Pieces):
        self._camera = camera
        self._camera_from_tube = np.linalg.inv(base_from_camera) @ base_from_tube
        self._pieces = pieces
        self.distance = float(np.linalg.norm(self._camera_from_tube[:3, 3]))
        self.heights = pieces.tube_floor + pieces.ball_radius + pieces.ball_diameter * np.arange(TUBE_CAPACITY)
        points = np.outer(self.heights, [0.0, 0.0, 1.0])
        self.centres = self._project(points)
        self.radii = camera.matrix[0, 0] * pieces.ball_radius / self._in_camera(points)[:, 2]

    def _in_camera(self, points_tube: np.ndarray) -> np.ndarray:
        return points_tube @ self._camera_from_tube[:3, :3].T + self._camera_from_tube[:3, 3]

    def _project(self, points_tube: np.ndarray) -> np.ndarray:
        return self._camera.project(self._in_camera(points_tube))

    def _hull(self, *rings: tuple[float, float]) -> np.ndarray:
        """Outline (n, 2) [px] of the hull of circles (radius, height) round the axis [m]; empty if behind the camera."""
        points = [np.column_stack([r * np.cos(_RING), r * np.sin(_RING), np.full(len(_RING), z)]) for r, z in rings]
        seen = self._project(np.concatenate(points))
        if not np.isfinite(seen).all():
            return np.empty((0, 2), np.int32)
        return cv2.convexHull(np.rint(seen).astype(np.int32)).reshape(-1, 2)

    @cached_property
    def outline(self) -> np.ndarray:
        """Outline (n, 2) [px] of the whole tube with its foot."""
        return self._hull(
            (self._pieces.foot_radius, 0.0), (self._pieces.foot_radius, self._pieces.foot_thickness),
            (self._pieces.tube_outer_radius, self._pieces.tube_height),
        )

    @cached_property
    def base_outline(self) -> np.ndarray:
        """Outline (n, 2) [px] of the black foot and the taped part of the wall, through which nothing is seen."""
        top = self._pieces.foot_thickness + self._pieces.tape_height
        return self._hull((self._pieces.foot_radius, 0.0), (self._pieces.tube_outer_radius, top))


class LevelReader:
    """Reads the levels of tubes in a picture in which nearer tubes hide farther ones; read them from near to far.

    Args:
        image_rgb: (height, width, 3) uint8.
        paper: (height, width) bool, where white paper would be seen if nothing were in front of it.
        white: brightness of that paper [grey levels]; 0 if none is in view.
    """

    def __init__(self, image_rgb: np.ndarray, paper: np.ndarray, white: float, pieces: Pieces, settings: ContentsSettings):
        self._image = image_rgb
        self._paper = paper.astype(np.uint8)
        self._white = white
        self._settings = settings
        self._chromas = ball_chromas(pieces)
        self._hidden = np.zeros(image_rgb.shape[:2], np.uint8)
        self._walls = np.zeros(image_rgb.shape[:2], np.uint8)

    def read(self, view: TubeView, standing: bool) -> tuple[Level, ...]:
        """Read a tube's levels, bottom to top, and remember that it hides what is behind it.

        A tube that is held may be hidden by the hand: low down in any case, higher up where it is dark. A standing one is hidden by
        what is dark before paper.
        """
        if len(view.base_outline):
            # Through an empty tube its own tape is seen, not the paper behind that.
            cv2.fillConvexPoly(self._paper, view.base_outline, 0)
        places = zip(view.centres, view.radii, view.heights)
        levels = tuple(self._level(centre, radius, None if standing else height) for centre, radius, height in places)
        for level, centre, radius in zip(levels, view.centres, view.radii):
            if level.label != EMPTY and np.isfinite(centre).all():
                cv2.circle(self._hidden, np.rint(centre).astype(int).tolist(), round(radius), 1, -1)
        for mask, outline in ((self._hidden, view.base_outline), (self._walls, view.outline)):
            if len(outline):
                cv2.fillConvexPoly(mask, outline, 1)
        return levels

    def _level(self, centre: np.ndarray, radius: float, height_held: float | None) -> Level:
        """Read a disc [px]; `height_held` [m]: how far above the foot it is, of a tube that is held."""
        pixels, wanted = _disc(centre, radius * self._settings.sample_share, self._image.shape)
        in_view = pixels[self._hidden[pixels[:, 0], pixels[:, 1]] == 0]
        if len(in_view) < self._settings.smallest_seen_share * wanted:
            return _NOT_KNOWN
        rows, columns = in_view.T
        rgb = np.median(self._image[rows, columns], axis=0)
        behind_wall = self._walls[rows, columns].mean() > 0.5
        level = self._classify(rgb, self._settings.wall_transmission if behind_wall else 1.0)
        if level.label != EMPTY:
            return level
        if height_held is None:
            before_paper = self._paper[rows, columns].mean() > 0.8
            return _NOT_KNOWN if before_paper and rgb.max() < self._settings.darkest_paper * self._white else level
        in_hand = height_held < self._settings.lowest_held_m or rgb.max() < self._settings.darkest_held
        return _NOT_KNOWN if in_hand else level

    def _classify(self, rgb: np.ndarray, transmission: float) -> Level:
        """Name what a colour is, seen through its tube's own wall and `transmission` (0..1) of what else is in front.

        Chroma is the share of each channel, less a third: it is zero for any grey, keeps its direction under more or less
        light, and only shrinks behind a wall. Saturation is its length over that of the bare ball.
        """
        chroma = _chroma(rgb)
        strength = float(np.linalg.norm(chroma))
        limit = self._settings.largest_empty_chroma * transmission
        if strength < limit or rgb.max() < self._settings.darkest_ball:
            return Level(EMPTY, max(0.0, 1.0 - strength / limit))
        likeness = {k: float(chroma @ bare) / (strength * float(np.linalg.norm(bare))) for k, bare in self._chromas.items()}
        letter = max(likeness, key=likeness.get)
        saturation = strength / (float(np.linalg.norm(self._chromas[letter])) * transmission)
        if saturation < self._settings.smallest_saturation or likeness[letter] < self._settings.smallest_resemblance:
            return _NOT_KNOWN
        return Level(letter, min(1.0, saturation / self._settings.smallest_saturation - 1.0) * max(0.0, likeness[letter]))


def ball_chromas(pieces: Pieces) -> dict[str, np.ndarray]:
    """Return each ball's chroma (3,) by its letter: the shares of its channels, less a third."""
    return {letter: _chroma(np.array(colour)) for letter, colour in pieces.ball_colours.items()}


def _disc(centre: np.ndarray, radius: float, shape: tuple[int, ...]) -> tuple[np.ndarray, int]:
    """Return the pixels (n, 2) (row, column) of a disc [px] that are in the picture, and how many it has in all."""
    if not np.isfinite(centre).all():
        return np.empty((0, 2), int), 1
    reach = int(np.ceil(radius))
    rows, columns = (np.arange(-reach, reach + 1) + round(float(middle)) for middle in centre[::-1])
    grid = np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1).reshape(-1, 2)
    disc = grid[np.hypot(*(grid - centre[::-1]).T) <= radius]
    inside = ((disc >= 0) & (disc < shape[:2])).all(axis=1)
    return disc[inside], max(1, len(disc))


def _chroma(rgb: np.ndarray) -> np.ndarray:
    return rgb / max(float(rgb.sum()), 1.0) - 1.0 / 3.0
