"""The command `print_game`: sheet, calibration board, markers of the hands and cards as a PDF at true scale."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Optional

import numpy as np

from dr_eureka.bench.report import progress
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.state import State, all_states
from dr_eureka.pieces import load_pieces
from dr_eureka.printing.artwork import board_artwork, card_artworks, hands_artwork, sheet_artwork
from dr_eureka.printing.pages import PAPERS, Artwork, write_pdf
from dr_eureka.vision.calibration_views import CalibrationSettings

ITEMS = ("sheet", "board", "hands", "cards")
CARDS_IN_A_BOX = 54


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code, 2 for bad input."""
    arguments = _parser().parse_args(argv)
    try:
        artworks = [artwork for item in arguments.items or ITEMS for artwork in _artworks(item, arguments)]
        pages = write_pdf(progress(artworks, len(artworks), "pages"), arguments.paper, Path(arguments.out))
    except DrEurekaError as error:
        print(f"print_game: {error}", file=sys.stderr)
        return 2
    count = f"{pages} {'page' if pages == 1 else 'pages'} {arguments.paper}"
    print(f"{arguments.out}: {count}; print at 100 %, then measure the bar: 100 mm")
    return 0


def _artworks(item: str, arguments: argparse.Namespace) -> list[Artwork]:
    pieces = load_pieces()
    if item == "sheet":
        return [sheet_artwork(pieces)]
    if item == "board":
        return [board_artwork(CalibrationSettings.load().board)]
    if item == "hands":
        return [hands_artwork(pieces)]
    if arguments.states:
        states = [str(State.parse(text)) for text in arguments.states]
    else:
        every = [str(state) for state in all_states()]
        count = len(every) if arguments.cards == "all" else arguments.cards
        states = [every[index] for index in np.random.default_rng(arguments.seed).permutation(len(every))[:count]]
    return list(card_artworks(states, arguments.seed, pieces.card_side, arguments.paper))


def _item(text: str) -> str:
    # Not argparse's `choices`, which would be asked whether the empty list is one.
    if text not in ITEMS:
        raise argparse.ArgumentTypeError(f"is {text!r}, expected one of {', '.join(ITEMS)}")
    return text


def _card_count(text: str) -> int | str:
    count = len(all_states())
    if text != "all" and not (text.isdecimal() and 1 <= int(text) <= count):
        raise argparse.ArgumentTypeError(f"is {text!r}, expected 1 to {count}, or all")
    return text if text == "all" else int(text)


def _seed(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"is {text!r}, expected a whole number, at least 0")
    return int(text)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="print_game",
        description="Write the game's paper as a PDF at true scale: the sheet for the tubes, the ChArUco board for "
        "calibrate_camera, the markers of the hands for calibrate_arm, and cards.",
        epilog="What is larger than the paper is cut into parts with marks to cut along; the sheet fits A2 whole. Each page "
        "has a bar of 100 mm to measure it by. Sizes come from config/pieces.yaml and config/calibrate_camera.yaml.",
    )
    parser.add_argument("items", metavar="ITEM", nargs="*", type=_item, help=f"{', '.join(ITEMS)} (default: all of them)")
    parser.add_argument("--paper", choices=tuple(PAPERS), default="A4", help="default: %(default)s")
    parser.add_argument(
        "--cards",
        type=_card_count,
        default=CARDS_IN_A_BOX,
        metavar="N",
        help="how many cards, drawn at random and all different, or all (default: %(default)s)",
    )
    parser.add_argument("--states", nargs="+", metavar="STATE", help="these cards instead, such as 'RRGG||PP'")
    parser.add_argument("--seed", type=_seed, default=1, help="draws the cards and their looks (default: %(default)s)")
    parser.add_argument("--out", default="dr_eureka.pdf", metavar="FILE", help="file to write (default: %(default)s)")
    return parser
