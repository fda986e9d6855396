"""The pictures of a ChArUco board that a calibration rests on: which ones count, and how much of the image they cover."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from dr_eureka.resources import load_yaml
from dr_eureka.settings import build
from dr_eureka.vision.charuco import BoardView, CharucoBoard, find_board

CONFIG = "config/calibrate_camera.yaml"
_SHARE = {"min": 0.0, "max": 1.0}


@dataclass(frozen=True)
class CalibrationSettings:
    """Board, which pictures count, what a calibration needs; config/calibrate_camera.yaml gives meaning and unit."""

    board: CharucoBoard
    fewest_corners: int = field(metadata={"min": 4})
    smallest_shift: float = field(metadata=_SHARE)
    moving_shift: float = field(metadata=_SHARE)
    still_shift: float = field(metadata=_SHARE)
    most_views: int = field(metadata={"min": 3, "max": 200})
    fewest_views: int = field(metadata={"min": 3, "max": 200})
    coverage_cells: tuple[int, int] = field(metadata={"min": 1, "max": 50})
    smallest_coverage: float = field(metadata=_SHARE)
    smallest_tilt_spread: float = field(metadata={"min": 0.0, "max": 1.5})
    largest_focal_sigma: float = field(metadata=_SHARE)
    largest_centre_sigma: float = field(metadata=_SHARE)
    largest_rms: float = field(metadata={"min": 0.0})

    @classmethod
    def load(cls) -> CalibrationSettings:
        """Load the package's own; raises ResourceError or SettingsError naming the file and the key."""
        return build(cls, load_yaml(CONFIG), CONFIG)


class ViewCollection:
    """Views of the board that differ from one another, all of one image size.

    Attributes:
        size: (width, height) [px] of the first picture, None before it.
        views: those that count.
    """

    def __init__(self, settings: CalibrationSettings) -> None:
        self._settings = settings
        self._before: BoardView | None = None
        self.size: tuple[int, int] | None = None
        self.views: list[BoardView] = []

    def offer(self, image: np.ndarray, moving: bool = False) -> str | None:
        """Take a picture if it counts as a view; return why not in a few words, or None.

        Args:
            image: (height, width, 3) uint8 rgb.
            moving: pictures come from a camera or board in motion; only one in which the board rests counts.
        """
        size = (image.shape[1], image.shape[0])
        self.size = self.size or size
        if size != self.size:
            return f"{size[0]}x{size[1]} px, expected {self.size[0]}x{self.size[1]} like the first picture"
        if len(self.views) >= self._settings.most_views:
            return f"there are {len(self.views)} views already"
        board = self._settings.board
        view = find_board(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), board)
        before, self._before = self._before, view
        if len(view.ids) < self._settings.fewest_corners or not _span_plane(view, board):
            fewest = self._settings.fewest_corners
            return f"{len(view.ids)} of the board's corners seen, expected at least {fewest} in two rows and two columns"
        if moving and not self._within(view, before, self._settings.still_shift):
            return "the board moves"
        shift = self._settings.moving_shift if moving else self._settings.smallest_shift
        if any(self._within(view, other, shift) for other in self.views):
            return "like a view before"
        self.views.append(view)
        return None

    def _within(self, view: BoardView, other: BoardView | None, share: float) -> bool:
        """Tell whether the corners seen in both moved less, on average, than a share of the picture's width."""
        if other is None:
            return False
        _, here, there = np.intersect1d(view.ids, other.ids, return_indices=True)
        if not len(here):
            return False
        ways = np.linalg.norm(view.pixels[here] - other.pixels[there], axis=1)
        return bool(ways.mean() < share * self.size[0])

    def covered(self) -> np.ndarray:
        """Return which cells of the picture hold a corner of some view, (rows, columns) bool."""
        columns, rows = self._settings.coverage_cells
        cells = np.zeros((rows, columns), bool)
        for view in self.views:
            column, row = (np.clip(view.pixels / self.size, 0.0, 1.0 - 1e-9) * (columns, rows)).astype(int).T
            cells[row, column] = True
        return cells


def _span_plane(view: BoardView, board: CharucoBoard) -> bool:
    """Tell whether two rows and two columns have two corners each, so that no line holds all corners but one."""
    row, column = np.divmod(view.ids, board.columns - 1)
    return all(np.count_nonzero(np.bincount(line) >= 2) >= 2 for line in (row, column))
