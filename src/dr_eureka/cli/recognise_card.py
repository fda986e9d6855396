"""The command `recognise_card`: print the state of the card in each picture."""
from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Optional

import numpy as np

from dr_eureka.errors import DrEurekaError
from dr_eureka.vision.cards import CardReader, CardReading, CardResult
from dr_eureka.vision.pictures import PictureError, decode_picture

#: Result of a file that is missing or no whole picture; the others are those of `CardResult`.
UNREADABLE_FILE = "UNREADABLE_FILE"


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code.

    0 when every picture could be opened, whatever it shows; 2 otherwise, and for bad arguments.
    """
    arguments = _parser().parse_args(argv)
    try:
        reader = CardReader.load()
    except DrEurekaError as error:
        print(f"recognise_card: {error}", file=sys.stderr)
        return 2
    unopened = 0
    for name in arguments.images:
        try:
            reading = reader.read(read_picture(Path(name)))
        except PictureError as error:
            reading = CardReading(UNREADABLE_FILE, reason=str(error))
            unopened += 1
        print(json.dumps(reading_as_mapping(name, reading)) if arguments.json else _line(name, reading), flush=True)
    if unopened:
        print(f"recognise_card: {unopened} of {len(arguments.images)} pictures could not be opened", file=sys.stderr)
    return 2 if unopened else 0


def read_picture(path: Path) -> np.ndarray:
    """Return a picture file as RGB (h, w, 3) uint8. Raises PictureError."""
    try:
        return decode_picture(path.read_bytes())
    except OSError as error:
        raise PictureError(f"{error.strerror}; expected a picture") from error


def reading_as_mapping(name: str, reading: CardReading) -> dict[str, Any]:
    """Return a reading in the shape of `--json`."""
    mapping: dict[str, Any] = {"image": name, "result": reading.result, "state": reading.state}
    if reading.result == CardResult.OK:
        mapping["confidence"] = round(reading.confidence, 4)
    else:
        mapping["reason"] = reading.reason
    if reading.corners is not None:
        mapping["corners"] = [[round(float(v), 1) for v in corner] for corner in reading.corners]
    return mapping


def _line(name: str, reading: CardReading) -> str:
    return f"{name}: {reading.state or f'{reading.result}, {reading.reason}'}"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="recognise_card",
        description="Read the Dr. Eureka card in each picture and print it as a state like RR|GG|PP.",
        epilog="Tubes left to right, balls bottom to top, R red, G green, P purple. A picture without one readable card "
        "gets NO_CARD, SEVERAL_CARDS or UNREADABLE and the reason; a file that cannot be opened gets UNREADABLE_FILE, and "
        "the exit code is then 2.",
    )
    parser.add_argument("images", metavar="IMAGE", nargs="+", help="PNG, JPEG or other picture file")
    parser.add_argument("--json", action="store_true", help="print one JSON object a picture instead of text")
    return parser
