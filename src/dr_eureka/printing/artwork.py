"""What is printed: the sheet that the tubes stand on, what calibrates camera and arms, and cards."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from io import BytesIO

import cv2
import numpy as np
from reportlab.lib.utils import ImageReader
from reportlab.pdfgen.canvas import Canvas

from dr_eureka.pieces import Pieces
from dr_eureka.printing.pages import POINTS_PER_M, Artwork, PrintError, orientations, printable_area
from dr_eureka.vision.aruco import module_rectangles
from dr_eureka.vision.card_renderer import draw_card
from dr_eureka.vision.charuco import CharucoBoard
from dr_eureka.vision.sheet_renderer import OUTLINE, OUTLINE_WIDTH_M

CARD_DOTS_PER_M = 8000  # 203 dpi: a camera that fills its picture with a card sees less
_JPEG_QUALITY = 92
_CUT_LINE_M = 0.0001


def sheet_artwork(pieces: Pieces) -> Artwork:
    """Return the sheet as the robot sees it lying in front of it, with the same outline as its drawing has."""
    black = []
    for marker in pieces.marker_centres:
        far, left_y = pieces.marker_corners(marker)[0]
        modules = module_rectangles(marker, pieces.marker_side, pieces.marker_dictionary)
        black.append(modules + (pieces.sheet_width / 2 - left_y, pieces.sheet_depth / 2 - far, 0.0, 0.0))

    def draw(canvas: Canvas) -> None:
        _fill(canvas, np.vstack(black))
        line = OUTLINE_WIDTH_M
        canvas.setStrokeGray(OUTLINE / 255)
        canvas.setLineWidth(line * POINTS_PER_M)
        outline = (line / 2, line / 2 - pieces.sheet_depth, pieces.sheet_width - line, pieces.sheet_depth - line)
        canvas.rect(*(length * POINTS_PER_M for length in outline), stroke=1, fill=0)

    width, height = (f"{side * 1000:g}" for side in (pieces.sheet_width, pieces.sheet_depth))
    title = f"Dr. Eureka sheet, {width} x {height} mm, its top edge away from the robot"
    return Artwork(title, pieces.sheet_width, pieces.sheet_depth, draw)


def board_artwork(board: CharucoBoard) -> Artwork:
    """Return the ChArUco board."""
    width, height = board.columns * board.square_side, board.rows * board.square_side
    squares, markers = (f"{side * 1000:g} mm" for side in (board.square_side, board.marker_side))
    title = f"ChArUco board, {board.columns} x {board.rows} squares of {squares}, markers {markers} {board.dictionary}"
    return Artwork(title, width, height, lambda canvas: _fill(canvas, board.black_rectangles()))


def hands_artwork(pieces: Pieces) -> Artwork:
    """Return the markers of both hands beside one another, from the left hand's on, each with a line to cut along.

    Their top edges, toward the fingers when glued on, are up.
    """
    side, margin = pieces.hand_marker_side, pieces.hand_marker_margin
    label = side + 2 * margin
    black = []
    for index, marker in enumerate(pieces.hand_markers.values()):
        black.append(module_rectangles(marker, side, pieces.marker_dictionary) + (index * label + margin, margin, 0.0, 0.0))

    def draw(canvas: Canvas) -> None:
        _fill(canvas, np.vstack(black))
        canvas.setStrokeGray(OUTLINE / 255)
        canvas.setLineWidth(_CUT_LINE_M * POINTS_PER_M)
        for index in range(len(black)):
            canvas.rect(*(length * POINTS_PER_M for length in (index * label, -label, label, label)), stroke=1, fill=0)

    hands = ", ".join(f"{hand} {marker}" for hand, marker in pieces.hand_markers.items())
    title = f"Markers of the hands, {side * 1000:g} mm {pieces.marker_dictionary}: {hands}; top edge toward the fingers"
    return Artwork(title, len(black) * label, label, draw)


def card_artworks(states: Sequence[str], seed: int, side: float, paper: str) -> Iterator[Artwork]:
    """Yield pages of cards, as many beside and above one another as the paper holds.

    Args:
        states: one a card.
        seed: draws each card's look; a card's look depends on its place among the states, not on the paper.
        side: of a card [m].

    Raises:
        PrintError: unknown paper, or one that is smaller than a card.
        CardRenderError: a state that cannot be drawn.
    """
    rooms = map(printable_area, orientations(paper))
    grids = [tuple(int(length / side + 1e-9) for length in room) for room in rooms]
    columns, rows = max(grids, key=lambda grid: grid[0] * grid[1])
    if columns * rows == 0:
        raise PrintError(f"paper {paper} is too small for a card of {side * 1000:g} mm")
    for first in range(0, len(states), columns * rows):
        page = states[first : first + columns * rows]
        generators = [np.random.default_rng((seed, first + index)) for index in range(len(page))]
        used_columns, used_rows = min(columns, len(page)), -(-len(page) // columns)
        yield Artwork(
            f"Cards of {side * 1000:g} mm: {'   '.join(page)}",
            used_columns * side,
            used_rows * side,
            _cards_drawing(page, generators, side, used_columns),
        )


def _cards_drawing(
    states: Sequence[str], generators: Sequence[np.random.Generator], side: float, columns: int
) -> Callable[[Canvas], None]:
    def draw(canvas: Canvas) -> None:
        for index, (state, rng) in enumerate(zip(states, generators)):
            drawing = draw_card(state, rng, round(side * CARD_DOTS_PER_M))
            # What lies outside the rounded corners stays paper.
            inside = drawing.outline_mask()[..., None]
            picture = np.rint(drawing.image * inside + 255 * (1 - inside)).astype(np.uint8)
            bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
            _, data = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
            row, column = divmod(index, columns)
            left, bottom, length = (value * POINTS_PER_M for value in (column * side, -(row + 1) * side, side))
            canvas.drawImage(ImageReader(BytesIO(data.tobytes())), left, bottom, length, length)
            canvas.setStrokeGray(OUTLINE / 255)
            canvas.setLineWidth(_CUT_LINE_M * POINTS_PER_M)
            canvas.roundRect(left, bottom, length, length, drawing.style.corner_radius * length, stroke=1, fill=0)

    return draw


def _fill(canvas: Canvas, rectangles: np.ndarray) -> None:
    """Fill rectangles (n, 4) left, top, width, height [m], black.

    One path for all: neighbours drawn one by one would show seams where a viewer smooths their edges.
    """
    path = canvas.beginPath()
    for left, top, width, height in rectangles * POINTS_PER_M:
        path.rect(left, -top - height, width, height)
    canvas.setFillGray(0.0)
    canvas.drawPath(path, stroke=0, fill=1)

