"""Calibration and markers on photographs with known answers, which do not ship with the package.

The photographs are those of OpenCV's own tutorials (opencv_contrib, modules/aruco): four views of a ChArUco board with a
published calibration, and a sheet of six markers photographed with its print layout. Their folder is an argument.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import cv2
import numpy as np

from dr_eureka.bench.report import BenchError, Row
from dr_eureka.vision.aruco import detect_markers
from dr_eureka.vision.calibration import fit_camera, weaknesses
from dr_eureka.vision.calibration_views import CalibrationSettings, ViewCollection
from dr_eureka.vision.charuco import CharucoBoard

DICTIONARY = "DICT_6X6_250"
BOARD = CharucoBoard(columns=5, rows=7, square_side=0.04, marker_side=0.02, dictionary=DICTIONARY)
BOARD_PICTURES = "img_*.jpg"
PUBLISHED = "tutorial_camera_charuco.yml"
SHEET_PICTURE, SHEET_PRINT = "singlemarkersoriginal.jpg", "singlemarkerssource.png"
PRINT_MM_PER_PX = 25.4 / 200
LARGEST_RMS_RATIO, LARGEST_FOCAL_RATIO, LARGEST_MARKER_MM = 0.05, 0.02, 1.0


def photograph_rows(folder: Path) -> list[Row]:
    """Measure calibration and marker sheet on the photographs in a folder.

    Raises:
        BenchError: naming the file that is missing or unreadable, or does not show what it should.
    """
    return [*charuco_rows(folder), *marker_sheet_rows(folder)]


def charuco_rows(folder: Path) -> list[Row]:
    """Calibrate with the photographed ChArUco board and compare with the published calibration of the same pictures."""
    settings = replace(CalibrationSettings.load(), board=BOARD)
    collection = ViewCollection(settings)
    files = sorted(folder.glob(BOARD_PICTURES))
    for file in files:
        problem = collection.offer(cv2.cvtColor(_grey(file), cv2.COLOR_GRAY2RGB))
        if problem:
            raise BenchError(f"{file}: {problem}")
    if not files:
        raise BenchError(f"{folder}: holds no {BOARD_PICTURES}")
    published_rms, published_matrix = _published(folder / PUBLISHED)
    calibration = fit_camera(collection.views, BOARD, collection.size)
    matrix, count = calibration.camera.matrix, len(files)
    rows = [_compared("ChArUco RMS", calibration.rms_px, published_rms, LARGEST_RMS_RATIO, count)]
    for axis, name in enumerate(("fx", "fy")):
        row = _compared(f"ChArUco {name}", matrix[axis, axis], published_matrix[axis, axis], LARGEST_FOCAL_RATIO, count)
        # How far off the value may be by the pictures alone: these few, all tilted alike, leave it loose.
        reach = 1.96 * float(calibration.focal_sigmas[axis])
        rows.append(replace(row, interval95=(row.value - reach, row.value + reach)))
    refused = len(weaknesses(calibration, collection, settings))
    rows.append(Row("ChArUco: reasons why calibrate_camera refuses these views", refused, "", count))
    return rows


def marker_sheet_rows(folder: Path) -> list[Row]:
    """Rectify the photographed sheet by four of its six markers and measure how far off the other two come out."""
    seen, layout = (detect_markers(_grey(folder / name), DICTIONARY) for name in (SHEET_PICTURE, SHEET_PRINT))
    if len(layout) != 6 or set(seen) != set(layout):
        raise BenchError(f"{folder}: markers {sorted(seen)} photographed, {sorted(layout)} printed, expected the same six")
    printed = {marker: (corners + 0.5) * PRINT_MM_PER_PX for marker, corners in layout.items()}
    references = max(combinations(sorted(printed), 4), key=lambda four: _spread(printed, four))
    photo, paper = (np.vstack([corners[marker] for marker in references]) for corners in (seen, printed))
    paper_from_photo, _ = cv2.findHomography(photo, paper)
    rows = []
    for marker in sorted(set(printed) - set(references)):
        errors = cv2.perspectiveTransform(seen[marker][None], paper_from_photo)[0] - printed[marker]
        centre, corner = np.linalg.norm(errors.mean(axis=0)), np.linalg.norm(errors, axis=1).max()
        goal, ok = f"<= {LARGEST_MARKER_MM:g} mm", bool(corner <= LARGEST_MARKER_MM)
        name = f"marker {marker} on the photographed sheet"
        rows.append(Row(f"{name}, centre off by", float(centre), "mm", 1))
        rows.append(Row(f"{name}, worst corner off by", float(corner), "mm", 4, goal=goal, ok=ok))
    return rows


def _spread(corners: dict[int, np.ndarray], markers: tuple[int, ...]) -> float:
    """Return the area that markers span, the measure of how well they are spread."""
    return cv2.contourArea(cv2.convexHull(np.vstack([corners[marker] for marker in markers]).astype(np.float32)))


def _compared(name: str, value: float, published: float, ratio: float, count: int) -> Row:
    goal, ok = f"within {ratio:.0%} of {published:.5g}", bool(abs(value / published - 1) <= ratio)
    return Row(name, float(value), "px", count, goal=goal, ok=ok)


def _published(file: Path) -> tuple[float, np.ndarray]:
    """Return RMS [px] and matrix (3, 3) of a calibration in OpenCV's own yaml."""
    if not file.is_file():
        raise BenchError(f"{file}: no such file; expected the published calibration")
    storage = cv2.FileStorage(str(file), cv2.FILE_STORAGE_READ)
    rms, matrix = storage.getNode("avg_reprojection_error").real(), storage.getNode("camera_matrix").mat()
    if matrix is None or not rms:
        raise BenchError(f"{file}: holds no camera_matrix and avg_reprojection_error")
    return rms, matrix


def _grey(file: Path) -> np.ndarray:
    image = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) if file.is_file() else None
    if image is None:
        raise BenchError(f"{file}: no picture that can be opened")
    return image
