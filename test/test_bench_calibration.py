"""The rows on photographs with known answers, measured here on drawn stand-ins for the photographs."""

import cv2
import numpy as np
import pytest
from board_views import LAB, board_picture, good_poses

from dr_eureka.bench.calibration import (
    BOARD,
    BOARD_PICTURES,
    DICTIONARY,
    PUBLISHED,
    SHEET_PICTURE,
    SHEET_PRINT,
    photograph_rows,
)
from dr_eureka.bench.report import BenchError
from dr_eureka.vision.aruco import marker_image

PLACES = {23: (976, 445), 40: (1264, 1237), 62: (491, 848), 98: (1608, 919), 124: (1494, 243), 203: (391, 206)}


def publish(folder, rms, matrix):
    storage = cv2.FileStorage(str(folder / PUBLISHED), cv2.FILE_STORAGE_WRITE)
    storage.write("camera_matrix", matrix)
    storage.write("avg_reprojection_error", rms)
    storage.release()


@pytest.fixture(scope="module")
def photographs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("photographs")
    for number, (turn, _) in enumerate(good_poses()[:6]):
        picture = board_picture(BOARD, LAB, turn, (0.0, 0.0, 0.42), seed=number)
        cv2.imwrite(str(folder / BOARD_PICTURES.replace("*", f"{number:02d}")), picture, [cv2.IMWRITE_JPEG_QUALITY, 98])
    page = np.full((1700, 2200), 255, np.uint8)
    for marker, (left, top) in PLACES.items():
        page[top : top + 200, left : left + 200] = marker_image(marker, 200, DICTIONARY)
    cv2.imwrite(str(folder / SHEET_PRINT), page)
    corners = np.float32([[0, 0], [2200, 0], [2200, 1700], [0, 1700]])
    seen_from = cv2.getPerspectiveTransform(corners, np.float32([[240, 120], [1060, 130], [1260, 850], [15, 845]]))
    photo = cv2.warpPerspective(page, seen_from, (1280, 960), borderValue=90)
    cv2.imwrite(str(folder / SHEET_PICTURE), cv2.resize(photo, (640, 480), interpolation=cv2.INTER_AREA))
    return folder


def values(rows):
    return {row.name: row for row in rows}


def test_the_rows_compare_with_what_was_published(photographs):
    publish(photographs, 0.07, LAB.matrix)
    rows = values(photograph_rows(photographs))
    fx = rows["ChArUco fx"]
    assert fx.ok and fx.value == pytest.approx(LAB.matrix[0, 0], rel=0.02)
    assert fx.interval95[0] < fx.value < fx.interval95[1]
    assert rows["ChArUco fy"].value == pytest.approx(LAB.matrix[1, 1], rel=0.02)
    assert fx.goal == "within 2% of 617.73" and fx.n == 6
    publish(photographs, 2 * rows["ChArUco RMS"].value, 1.1 * LAB.matrix)
    rows = values(photograph_rows(photographs))
    assert not rows["ChArUco RMS"].ok and not rows["ChArUco fx"].ok


def test_the_two_markers_inside_the_four_outer_ones_are_placed(photographs):
    publish(photographs, 0.07, LAB.matrix)
    rows = [row for row in photograph_rows(photographs) if row.name.startswith("marker")]
    assert [row.name.split()[1] for row in rows] == ["23", "23", "98", "98"]
    assert all(row.value < 1.0 for row in rows)
    assert [row.ok for row in rows] == [None, True, None, True]


def test_a_missing_file_is_named(photographs, tmp_path):
    with pytest.raises(BenchError, match="holds no img_"):
        photograph_rows(tmp_path)
    (photographs / PUBLISHED).unlink()
    with pytest.raises(BenchError, match=f"{PUBLISHED}: no such file"):
        photograph_rows(photographs)
