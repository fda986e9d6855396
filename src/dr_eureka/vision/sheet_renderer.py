"""What the printed sheet looks like that the tubes stand on."""

from __future__ import annotations

import numpy as np

from dr_eureka.pieces import Pieces
from dr_eureka.vision.aruco import marker_image

PAPER, OUTLINE = 255, 190
OUTLINE_WIDTH_M = 0.0005


def sheet_image(pieces: Pieces, pixels_per_metre: int = 2000) -> np.ndarray:
    """Draw the printed sheet as the robot sees it lying in front of it.

    Row 0 is the far edge and rows grow toward sheet -x; column 0 is the left edge and columns grow toward sheet -y.
    So the pixel (row, column) shows the point x = sheet_depth / 2 - (row + 0.5) / pixels_per_metre,
    y = sheet_width / 2 - (column + 0.5) / pixels_per_metre of the sheet frame.

    Args:
        pieces: sizes of the sheet and its markers [m].
        pixels_per_metre: resolution [px/m]; the default gives 520 x 860 px.

    Returns:
        (sheet_depth, sheet_width) x pixels_per_metre grey uint8: white paper, black markers, thin grey outline.
    """
    rows, columns = (round(length * pixels_per_metre) for length in (pieces.sheet_depth, pieces.sheet_width))
    image = np.full((rows, columns), PAPER, np.uint8)
    line = max(1, round(OUTLINE_WIDTH_M * pixels_per_metre))
    image[:line], image[-line:], image[:, :line], image[:, -line:] = (OUTLINE,) * 4
    side = round(pieces.marker_side * pixels_per_metre)
    for marker in pieces.marker_centres:
        far, left_y = pieces.marker_corners(marker)[0]
        top = round((pieces.sheet_depth / 2 - far) * pixels_per_metre)
        left = round((pieces.sheet_width / 2 - left_y) * pixels_per_metre)
        image[top : top + side, left : left + side] = marker_image(marker, side, pieces.marker_dictionary)
    return image
