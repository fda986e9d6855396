"""Pages of a PDF at true scale: artwork centred or cut into parts, cut marks, a scale bar on each.

Drawn by ReportLab: it places vectors and JPEG pictures in real units, and is Debian's (matplotlib's PDF backend knows
figures, not pages). Lengths in m; ReportLab counts points of 1/72 inch from the lower left, y up.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas

from dr_eureka.errors import DrEurekaError

POINTS_PER_M = 1000 * mm
PAPERS = {"A4": (0.210, 0.297), "A3": (0.297, 0.420), "A2": (0.420, 0.594), "letter": (0.2159, 0.2794)}
MARGIN = 0.005  # most printers leave 3 to 4.5 mm blank; two cards must fit beside each other on A4
FOOTER = 0.012  # for the scale bar, below the artwork
SCALE_BAR = 0.100
_HAIRLINE = 0.1 * mm
_CUT_MARK = (0.001, 0.004)  # from the corner outward: beginning and end


class PrintError(DrEurekaError):
    """Something that cannot be printed, or a file that cannot be written."""


@dataclass(frozen=True)
class Artwork:
    """Something of true size to print: `draw` is called with the origin at its top left corner, y up, in points."""

    title: str
    width: float
    height: float
    draw: Callable[[Canvas], None]


@dataclass(frozen=True)
class Layout:
    """A page (width, height) and how many columns and rows of parts an artwork is cut into to fit."""

    page: tuple[float, float]
    columns: int
    rows: int


def printable_area(page: tuple[float, float]) -> tuple[float, float]:
    """Return the width and height that artwork may take on a page."""
    return page[0] - 2 * MARGIN, page[1] - 2 * MARGIN - FOOTER


def orientations(paper: str) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return a paper's size (width, height) upright and lying.

    Raises:
        PrintError: unknown paper.
    """
    if paper not in PAPERS:
        raise PrintError(f"paper is {paper!r}, expected one of {', '.join(PAPERS)}")
    width, height = PAPERS[paper]
    return (width, height), (height, width)


def lay_out(artwork: Artwork, paper: str) -> Layout:
    """Return how an artwork goes onto a paper with the fewest pages, all parts of equal size."""

    def parts(page: tuple[float, float]) -> Layout:
        room = printable_area(page)
        # Less than the hair's breadth by which 0.2 m may exceed 0.21 m - 2 x 0.005 m in floating point.
        columns, rows = (math.ceil(length / side - 1e-9) for length, side in zip((artwork.width, artwork.height), room))
        return Layout(page, columns, rows)

    return min(map(parts, orientations(paper)), key=lambda layout: layout.columns * layout.rows)


def write_pdf(artworks: Iterable[Artwork], paper: str, path: Path) -> int:
    """Write artworks one after another; equal ones make an equal file. Return how many pages there are.

    Raises:
        PrintError: unknown paper, or the file cannot be written.
    """
    canvas = Canvas(str(path), invariant=1)
    canvas.setTitle("Dr. Eureka")
    pages = 0
    for artwork in artworks:
        layout = lay_out(artwork, paper)
        for row in range(layout.rows):
            for column in range(layout.columns):
                _draw_page(canvas, artwork, layout, column, row)
                pages += 1
    try:
        canvas.save()
    except OSError as error:
        raise PrintError(f"{path}: cannot be written: {error.strerror}") from error
    return pages


def _draw_page(canvas: Canvas, artwork: Artwork, layout: Layout, column: int, row: int) -> None:
    width, height = artwork.width / layout.columns, artwork.height / layout.rows
    room_width, room_height = printable_area(layout.page)
    left = MARGIN + (room_width - width) / 2
    bottom = MARGIN + FOOTER + (room_height - height) / 2
    canvas.setPageSize(tuple(side * POINTS_PER_M for side in layout.page))
    canvas.saveState()
    window = canvas.beginPath()
    window.rect(*(length * POINTS_PER_M for length in (left, bottom, width, height)))
    canvas.clipPath(window, stroke=0, fill=0)
    canvas.translate((left - column * width) * POINTS_PER_M, (bottom + (row + 1) * height) * POINTS_PER_M)
    artwork.draw(canvas)
    canvas.restoreState()
    _draw_cut_marks(canvas, left, bottom, left + width, bottom + height)
    lines = [artwork.title, "Print at 100 % (actual size, not fitted to the page); the bar is 100 mm long."]
    if layout.columns * layout.rows > 1:
        place = f"row {row + 1} of {layout.rows}, column {column + 1} of {layout.columns}"
        lines.append(f"Part in {place}: cut along the marks and join edge to edge.")
    _draw_footer(canvas, lines)
    canvas.showPage()


def _draw_cut_marks(canvas: Canvas, left: float, bottom: float, right: float, top: float) -> None:
    canvas.setLineWidth(_HAIRLINE)
    for x, outward_x in ((left, -1), (right, 1)):
        for y, outward_y in ((bottom, -1), (top, 1)):
            near, far = _CUT_MARK
            canvas.line(*_points(x + near * outward_x, y, x + far * outward_x, y))
            canvas.line(*_points(x, y + near * outward_y, x, y + far * outward_y))


def _draw_footer(canvas: Canvas, lines: Sequence[str]) -> None:
    """Draw the scale bar with a tick every 10 mm, and text beside it."""
    canvas.setLineWidth(2 * _HAIRLINE)
    canvas.setFillGray(0.0)
    base = MARGIN + 0.002
    canvas.line(*_points(MARGIN, base, MARGIN + SCALE_BAR, base))
    for tick in range(11):
        x = MARGIN + SCALE_BAR * tick / 10
        canvas.line(*_points(x, base, x, base + (0.003 if tick % 5 == 0 else 0.0015)))
    canvas.setFont("Helvetica", 6)
    for number, line in enumerate(lines):
        canvas.drawString(*_points(MARGIN + SCALE_BAR + 0.003, MARGIN + 0.006 - 0.003 * number), line)


def _points(*lengths: float) -> tuple[float, ...]:
    return tuple(length * POINTS_PER_M for length in lengths)
