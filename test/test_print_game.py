"""The printed game measured: pages are drawn by poppler at 254 dpi, ten pixels a millimetre, and looked at as pictures."""

import subprocess

import cv2
import numpy as np
import pytest

from dr_eureka.cli.print_game import main
from dr_eureka.pieces import load_pieces
from dr_eureka.printing.artwork import sheet_artwork
from dr_eureka.printing.pages import PAPERS, PrintError, lay_out, write_pdf
from dr_eureka.vision.aruco import detect_markers
from dr_eureka.vision.calibration_views import CalibrationSettings
from dr_eureka.vision.charuco import find_board

PX_PER_MM = 10
PIECES = load_pieces()


def printed_pages(folder, *words):
    """Return the pages that print_game writes for these arguments, grey."""
    file = folder / "game.pdf"
    assert main([*words, "--out", str(file)]) == 0
    command = ["pdftoppm", "-gray", "-r", str(25.4 * PX_PER_MM), str(file), str(folder / "page")]
    subprocess.run(command, check=True, capture_output=True)
    pages = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted(folder.glob("page*.pgm"))]
    for page in pages:
        assert bar_length_mm(page) == pytest.approx(100.0, abs=0.3)
    return pages


def bar_length_mm(page):
    """Return the longest black line in the lowest 15 mm of a page, the scale bar."""
    dark = page[-15 * PX_PER_MM :] < 128
    longest = 0
    for row in dark:
        ends = np.flatnonzero(np.diff(np.concatenate([[0], row.astype(int), [0]])))
        longest = max(longest, *(ends[1::2] - ends[::2]), 0) if len(ends) else longest
    return longest / PX_PER_MM


def sheet_markers_mm(page):
    """Return the corners of the sheet's markers on a page, in mm from its top left."""
    return {marker: (quad + 0.5) / PX_PER_MM for marker, quad in detect_markers(page, PIECES.marker_dictionary).items()}


def true_markers_mm():
    """Return where the markers' corners are on the sheet, in mm right and down from its far left corner."""
    return {
        marker: np.column_stack([PIECES.sheet_width / 2 - quad[:, 1], PIECES.sheet_depth / 2 - quad[:, 0]]) * 1000
        for marker, quad in ((marker, PIECES.marker_corners(marker)) for marker in PIECES.marker_centres)
    }


def test_the_whole_sheet_on_a2_has_its_markers_in_place(tmp_path):
    (page,) = printed_pages(tmp_path, "sheet", "--paper", "A2")
    assert page.shape == pytest.approx((4200, 5940), abs=1)
    found, true = sheet_markers_mm(page), true_markers_mm()
    assert sorted(found) == [0, 1, 2, 3]
    found, true = (np.vstack([corners[marker] for marker in range(4)]) for corners in (found, true))
    errors = found - true - (found - true).mean(axis=0)
    assert np.abs(errors).max() < 0.1
    # The sheet's own edges: a grey line whose outside is 430 x 260 mm.
    rows, columns = (np.flatnonzero((page == 190).mean(axis=axis) > 0.3) for axis in (1, 0))
    assert (np.ptp(columns) + 1) / PX_PER_MM == pytest.approx(430.0, abs=0.2)
    assert (np.ptp(rows) + 1) / PX_PER_MM == pytest.approx(260.0, abs=0.2)


@pytest.mark.parametrize("paper, parts", [("A4", 3), ("A3", 2), ("letter", 4)])
def test_the_parts_of_the_sheet_join_to_the_whole(tmp_path, paper, parts):
    pages = printed_pages(tmp_path, "sheet", "--paper", paper)
    layout = lay_out(sheet_artwork(PIECES), paper)
    assert len(pages) == layout.columns * layout.rows == parts
    width, height = 430 / layout.columns, 260 / layout.rows
    true, found = true_markers_mm(), set()
    for number, page in enumerate(pages):
        row, column = divmod(number, layout.columns)
        # The part is centred in what the page has room for: 5 mm at each edge and 12 mm for the bar are left.
        left = (page.shape[1] / PX_PER_MM - width) / 2 - column * width
        top = (page.shape[0] / PX_PER_MM - 12 - height) / 2 - row * height
        for marker, corners in sheet_markers_mm(page).items():
            found.add(marker)
            assert np.abs(corners - true[marker] - (left, top)).max() < 0.15
    assert found == {0, 1, 2, 3}


@pytest.mark.parametrize("paper", ["A4", "letter"])
def test_the_board_is_one_page_and_opencv_finds_its_corners_at_true_scale(tmp_path, paper):
    (page,) = printed_pages(tmp_path, "board", "--paper", paper)
    board = CalibrationSettings.load().board
    view = find_board(page, board)
    assert len(view.ids) == board.corner_count
    errors = view.pixels / PX_PER_MM - board.corner_points(view.ids)[:, :2] * 1000
    assert np.abs(errors - errors.mean(axis=0)).max() < 0.05
    ground = board.black_rectangles()
    black = np.sum(ground[:, 2] * ground[:, 3]) * 1e6
    # The footer's bar and words are black too, a few square millimetres.
    assert np.sum(255 - page[: -15 * PX_PER_MM].astype(float)) / 255 / PX_PER_MM**2 == pytest.approx(black, rel=0.002)


def test_the_markers_of_both_hands_have_their_size_and_white_round_them(tmp_path):
    (page,) = printed_pages(tmp_path, "hands")
    found = {marker: (quad + 0.5) / PX_PER_MM for marker, quad in detect_markers(page, PIECES.marker_dictionary).items()}
    assert sorted(found) == sorted(PIECES.hand_markers.values())
    side, apart = PIECES.hand_marker_side * 1000, (PIECES.hand_marker_side + 2 * PIECES.hand_marker_margin) * 1000
    square = np.array([(0, 0), (side, 0), (side, side), (0, side)])
    left, right = (found[PIECES.hand_markers[hand]] for hand in ("left", "right"))
    assert np.abs(left - left[0] - square).max() < 0.1 and np.abs(right - right[0] - square).max() < 0.1
    assert right[0] - left[0] == pytest.approx([apart, 0.0], abs=0.1)


def test_four_cards_of_100_mm_fill_a_page_of_a4(tmp_path):
    pages = printed_pages(tmp_path, "cards", "--states", "RRGG||PP", "RR|GG|PP", "GP|RPGR|", "P|RG|GPR", "RG|PG|RP")
    assert len(pages) == 2
    for page, columns, rows in ((pages[0], 2, 2), (pages[1], 1, 1)):
        lines = page < 230
        # Cut lines run along straight sides, seen where the cards' chalkboards are not: near the edges.
        across = np.flatnonzero(lines[: -15 * PX_PER_MM].mean(axis=0) > 0.15)
        down = np.flatnonzero(lines[: -15 * PX_PER_MM].mean(axis=1) > 0.15)
        assert np.ptp(across) / PX_PER_MM == pytest.approx(100.0 * columns, abs=0.3)
        assert np.ptp(down) / PX_PER_MM == pytest.approx(100.0 * rows, abs=0.3)


def test_equal_arguments_write_an_equal_file_and_another_seed_another(tmp_path):
    files = []
    for name, seed in (("a", "3"), ("b", "3"), ("c", "4")):
        assert main(["cards", "--cards", "1", "--seed", seed, "--out", str(tmp_path / name)]) == 0
        files.append((tmp_path / name).read_bytes())
    assert files[0] == files[1] != files[2]


def test_everything_is_printed_unless_told_otherwise(tmp_path, capsys):
    assert main(["--cards", "1", "--out", str(tmp_path / "all.pdf")]) == 0
    assert "all.pdf: 6 pages A4" in capsys.readouterr().out


@pytest.mark.parametrize(
    "words", [["rules"], ["--paper", "A5"], ["--cards", "0"], ["--cards", "1711"], ["--cards", "few"], ["--seed", "-1"]]
)
def test_arguments_that_make_no_sense_are_a_usage_error(tmp_path, words):
    with pytest.raises(SystemExit) as stop:
        main([*words, "--out", str(tmp_path / "x.pdf")])
    assert stop.value.code == 2
    assert not (tmp_path / "x.pdf").exists()


def test_an_impossible_card_and_a_folder_that_is_not_there_end_with_one_line(tmp_path, capsys):
    assert main(["cards", "--states", "RRR||", "--out", str(tmp_path / "x.pdf")]) == 2
    assert main(["board", "--out", str(tmp_path / "nowhere" / "x.pdf")]) == 2
    errors = capsys.readouterr().err.splitlines()
    assert len(errors) == 2
    assert errors[1].endswith("x.pdf: cannot be written: No such file or directory")


def test_an_unknown_paper_is_refused_with_those_there_are(tmp_path):
    with pytest.raises(PrintError, match=f"'B9', expected one of {', '.join(PAPERS)}"):
        write_pdf([sheet_artwork(PIECES)], "B9", tmp_path / "x.pdf")
