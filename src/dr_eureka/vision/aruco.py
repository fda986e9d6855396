"""ArUco markers: the only file that touches `cv2.aruco`, whose names changed between OpenCV 4.6 and 4.7."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from dr_eureka.errors import DrEurekaError


class ArucoError(DrEurekaError):
    """Raised for a dictionary, marker id or picture that the ArUco detector cannot use."""


@dataclass(frozen=True)
class MarkerDetection:
    """Markers of one picture: `corners` of each id seen once, and `duplicates`, the ids seen more than once."""

    corners: dict[int, np.ndarray]
    duplicates: tuple[int, ...]


def detect_markers(image_grey: np.ndarray, dictionary: str) -> dict[int, np.ndarray]:
    """Detect the markers of `dictionary` that occur exactly once.

    Same as `find_markers(...).corners`: a marker seen twice is no reference, so its id is left out.
    """
    return find_markers(image_grey, dictionary).corners


def find_markers(image_grey: np.ndarray, dictionary: str) -> MarkerDetection:
    """Detect the markers of `dictionary` and say which ids occur more than once.

    Args:
        image_grey: (height, width) uint8 picture.
        dictionary: name of a predefined dictionary, such as `DICT_4X4_1000`.

    Returns:
        Corners as (4, 2) float64 sub-pixel positions [px] (column, row), clockwise from the marker's own top left.

    Raises:
        ArucoError: unknown dictionary, or a picture that is not a two-dimensional uint8 array.
    """
    _check_picture(image_grey)
    predefined = _predefined(dictionary)
    if hasattr(cv2.aruco, "ArucoDetector"):
        detector = cv2.aruco.ArucoDetector(predefined, _parameters(cv2.aruco.DetectorParameters()))
        corners, ids, _ = detector.detectMarkers(image_grey)
    else:
        parameters = _parameters(cv2.aruco.DetectorParameters_create())
        corners, ids, _ = cv2.aruco.detectMarkers(image_grey, predefined, parameters=parameters)
    if ids is None:
        return MarkerDetection({}, ())
    found = [int(marker) for marker in np.ravel(ids)]
    duplicates = tuple(sorted({marker for marker in found if found.count(marker) > 1}))
    once = {
        marker: np.asarray(quad, dtype=np.float64).reshape(4, 2)
        for marker, quad in sorted(zip(found, corners), key=lambda pair: pair[0])
        if marker not in duplicates
    }
    return MarkerDetection(once, duplicates)


def marker_image(marker_id: int, side_px: int, dictionary: str = "DICT_4X4_1000") -> np.ndarray:
    """Draw a marker with its one-module black border.

    Args:
        marker_id: id within the dictionary.
        side_px: side of the black square [px], at least 1; edges that fall between pixels come out grey.
        dictionary: name of a predefined dictionary.

    Returns:
        (side_px, side_px) uint8, row 0 at the marker's top edge.

    Raises:
        ArucoError: unknown dictionary, id outside of it, or a side below 1.
    """
    if side_px < 1:
        raise ArucoError(f"marker side is {side_px} px, expected at least 1")
    picture = np.where(marker_modules(marker_id, dictionary), 0, 255).astype(np.uint8)
    enlarged = np.kron(picture, np.ones((side_px, side_px), np.uint8))
    return cv2.resize(enlarged, (side_px, side_px), interpolation=cv2.INTER_AREA)


def marker_modules(marker_id: int, dictionary: str) -> np.ndarray:
    """Return which modules of a marker are black, its border of one module included, as (side, side) bool, row 0 on top.

    Raises:
        ArucoError: unknown dictionary, or id outside of it.
    """
    predefined = _predefined(dictionary)
    count = predefined.bytesList.shape[0]
    if not 0 <= marker_id < count:
        raise ArucoError(f"marker id {marker_id} is not in {dictionary}, expected 0..{count - 1}")
    draw = getattr(cv2.aruco, "generateImageMarker", None) or cv2.aruco.drawMarker
    return draw(predefined, marker_id, predefined.markerSize + 2) == 0


def module_rectangles(marker: int, side: float, dictionary: str) -> np.ndarray:
    """Return a marker's black modules, (n, 4) left, top, width, height from its top left corner, in the unit of `side`.

    Raises:
        ArucoError: unknown dictionary, or id outside of it.
    """
    modules = marker_modules(marker, dictionary)
    size = side / len(modules)
    rows, columns = np.nonzero(modules)
    return np.column_stack([columns * size, rows * size, np.full((len(rows), 2), size)])


def find_charuco_corners(
    image_grey: np.ndarray, squares: tuple[int, int], marker_share: float, dictionary: str
) -> tuple[np.ndarray, np.ndarray]:
    """Find the inner chessboard corners of a ChArUco board, each known by the markers beside it.

    Args:
        image_grey: (height, width) uint8 picture.
        squares: columns and rows of the board; its first square, top left, is black. Rows must be odd in number, since
            OpenCV before and after 4.6 puts the first square of the others differently.
        marker_share: side of a marker as a share of a square's, between 0 and 1.
        dictionary: name of the predefined dictionary whose first markers fill the white squares row by row.

    Returns:
        Ids (n,) int, counted row by row from the top left, and sub-pixel positions (n, 2) float64 [px] (column, row).

    Raises:
        ArucoError: a board that cannot be, or a picture that is not a two-dimensional uint8 array.
    """
    _check_picture(image_grey)
    columns, rows = squares
    if columns < 2 or rows < 3 or rows % 2 == 0:
        raise ArucoError(f"ChArUco board has {columns}x{rows} squares, expected at least 2x3 and an odd number of rows")
    if not 0.0 < marker_share < 1.0:
        raise ArucoError(f"markers are {marker_share:g} times as wide as their squares, expected between 0 and 1")
    predefined = _predefined(dictionary)
    markers, known = columns * rows // 2, predefined.bytesList.shape[0]
    if markers > known:
        raise ArucoError(f"ChArUco board has {markers} markers, expected at most the {known} of {dictionary}")
    ids, corners = _detect_charuco(image_grey, squares, marker_share, predefined)
    return ids, corners - _charuco_offset_px()


def _detect_charuco(
    image_grey: np.ndarray, squares: tuple[int, int], marker_share: float, predefined: cv2.aruco.Dictionary
) -> tuple[np.ndarray, np.ndarray]:
    ids = None
    if hasattr(cv2.aruco, "CharucoDetector"):
        board = cv2.aruco.CharucoBoard(squares, 1.0, marker_share, predefined)
        corners, ids, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(image_grey)
    else:
        board = cv2.aruco.CharucoBoard_create(*squares, 1.0, marker_share, predefined)
        quads, seen, _ = cv2.aruco.detectMarkers(image_grey, predefined)
        if seen is not None:
            _, corners, ids = cv2.aruco.interpolateCornersCharuco(quads, seen, image_grey, board)
    if ids is None:
        return np.zeros(0, int), np.zeros((0, 2))
    return np.ravel(ids).astype(int), np.asarray(corners, np.float64).reshape(-1, 2)


@lru_cache(maxsize=1)
def _charuco_offset_px() -> float:
    """Return how far right and down of its true place this OpenCV puts ChArUco corners: half a pixel or nothing.

    Half a pixel from 4.5.4 on until its issue 25539 was mended. Measured on a drawn board, since versions do not tell.
    """
    side, dictionary = 40, "DICT_4X4_50"
    picture = np.full((5 * side, 5 * side), 255, np.uint8)
    for index in range(9):
        top, left = (1 + np.array(divmod(index, 3))) * side
        # Squares are black and white in turn; every second one holds the next marker.
        square = picture[top : top + side, left : left + side]
        if index % 2 == 0:
            square[:] = 0
        else:
            square[8:-8, 8:-8] = marker_image(index // 2, side - 16, dictionary)
    ids, corners = _detect_charuco(picture, (3, 3), 1.0 - 16 / side, _predefined(dictionary))
    # A pixel's coordinates are those of its centre, so that the edge before pixel n is at n - 0.5.
    true = np.column_stack([ids % 2, ids // 2]) * side + 2 * side - 0.5
    return float(np.rint(2 * np.mean(corners - true)) / 2)


def _check_picture(image_grey: np.ndarray) -> None:
    if not isinstance(image_grey, np.ndarray) or image_grey.ndim != 2 or image_grey.dtype != np.uint8:
        shape, dtype = getattr(image_grey, "shape", None), getattr(image_grey, "dtype", type(image_grey).__name__)
        raise ArucoError(f"marker picture has shape {shape} and type {dtype}, expected (height, width) uint8")
    if image_grey.size == 0:
        raise ArucoError(f"marker picture is empty: shape {image_grey.shape}")


def _predefined(name: str):
    valid = [entry for entry in dir(cv2.aruco) if entry.startswith("DICT_")]
    if name not in valid:
        raise ArucoError(f"ArUco dictionary {name!r} is unknown, expected one of {', '.join(valid)}")
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


def _parameters(parameters):
    # The sheet's markers have only 5 mm (about 5 px) of white round them: a wider window would see the sheet's edge.
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    parameters.cornerRefinementWinSize = 3
    return parameters
