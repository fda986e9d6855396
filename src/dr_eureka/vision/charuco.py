"""The ChArUco board that calibrates the camera: a chessboard whose white squares hold ArUco markers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dr_eureka.errors import DrEurekaError
from dr_eureka.vision.aruco import find_charuco_corners, module_rectangles

_SIDE = {"min": 1e-3, "max": 1.0}


class BoardError(DrEurekaError):
    """A ChArUco board that cannot be printed or found."""


@dataclass(frozen=True)
class CharucoBoard:
    """A board of columns x rows squares, the first black. Lengths in m.

    The frame `board` has its origin at the printed top left corner, x right, y down, z into the paper.

    Raises:
        BoardError: an even number of rows (OpenCV versions disagree about those), or markers that fill their squares.
    """

    columns: int = field(metadata={"min": 3, "max": 50})
    rows: int = field(metadata={"min": 3, "max": 50})
    square_side: float = field(metadata=_SIDE)
    marker_side: float = field(metadata=_SIDE)
    dictionary: str

    def __post_init__(self) -> None:
        if self.rows % 2 == 0:
            wanted = "expected an odd number of rows, on which OpenCV versions agree"
            raise BoardError(f"ChArUco board has {self.columns}x{self.rows} squares; {wanted}")
        if self.marker_side >= self.square_side:
            wanted = f"expected less than the squares' {self.square_side:g} m"
            raise BoardError(f"markers have sides of {self.marker_side:g} m; {wanted}")

    @property
    def corner_count(self) -> int:
        """How many inner corners the board has."""
        return (self.columns - 1) * (self.rows - 1)

    def corner_points(self, ids: np.ndarray) -> np.ndarray:
        """Return the inner corners of these ids, (n, 3) [m] in `board`; ids count row by row from the top left."""
        row, column = np.divmod(np.asarray(ids), self.columns - 1)
        return np.column_stack([column + 1, row + 1, np.zeros(len(row))]) * self.square_side

    def black_rectangles(self) -> np.ndarray:
        """Return what is printed black, (n, 4) left, top, width, height [m] in `board`: squares, and modules of markers."""
        margin = (self.square_side - self.marker_side) / 2
        rectangles, marker = [], 0
        for row in range(self.rows):
            for column in range(self.columns):
                left, top = column * self.square_side, row * self.square_side
                if (row + column) % 2 == 0:
                    rectangles.append(np.array([[left, top, self.square_side, self.square_side]]))
                else:
                    modules = module_rectangles(marker, self.marker_side, self.dictionary)
                    rectangles.append(modules + (left + margin, top + margin, 0.0, 0.0))
                    marker += 1
        return np.vstack(rectangles)


@dataclass(frozen=True, eq=False)
class BoardView:
    """The corners of a board made out in one picture: ids (n,) and pixels (n, 2) (column, row)."""

    ids: np.ndarray
    pixels: np.ndarray


def find_board(image_grey: np.ndarray, board: CharucoBoard) -> BoardView:
    """Find the board's corners in a (height, width) uint8 picture; none found is a view without corners.

    Raises:
        ArucoError: unknown or too small dictionary, or what is no grey picture.
    """
    marker_share = board.marker_side / board.square_side
    return BoardView(*find_charuco_corners(image_grey, (board.columns, board.rows), marker_share, board.dictionary))
