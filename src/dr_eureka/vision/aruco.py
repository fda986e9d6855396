"""ArUco markers: the only file that touches `cv2.aruco`, whose names changed between OpenCV 4.6 and 4.7."""

from __future__ import annotations

from dataclasses import dataclass

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
    if not isinstance(image_grey, np.ndarray) or image_grey.ndim != 2 or image_grey.dtype != np.uint8:
        shape, dtype = getattr(image_grey, "shape", None), getattr(image_grey, "dtype", type(image_grey).__name__)
        raise ArucoError(f"marker picture has shape {shape} and type {dtype}, expected (height, width) uint8")
    if image_grey.size == 0:
        raise ArucoError(f"marker picture is empty: shape {image_grey.shape}")
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
    predefined = _predefined(dictionary)
    count = predefined.bytesList.shape[0]
    if not 0 <= marker_id < count:
        raise ArucoError(f"marker id {marker_id} is not in {dictionary}, expected 0..{count - 1}")
    if side_px < 1:
        raise ArucoError(f"marker side is {side_px} px, expected at least 1")
    modules = predefined.markerSize + 2
    draw = getattr(cv2.aruco, "generateImageMarker", None) or cv2.aruco.drawMarker
    picture = draw(predefined, marker_id, modules)
    enlarged = np.kron(picture, np.ones((side_px, side_px), np.uint8))
    return cv2.resize(enlarged, (side_px, side_px), interpolation=cv2.INTER_AREA)


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
