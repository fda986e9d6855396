"""The command `recognise_card`: print the state of the card in each picture."""
from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Optional

import cv2
import numpy as np

from dr_eureka.errors import DrEurekaError
from dr_eureka.vision.cards import CardReader, CardReading, CardResult


class PictureError(DrEurekaError):
    """A file that cannot be opened as a picture."""


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code.

    0 when every picture could be opened, whatever it shows; 1 otherwise; 2 for bad arguments.
    """
    arguments = _parser().parse_args(argv)
    try:
        reader = CardReader.load()
    except DrEurekaError as error:
        print(f"recognise_card: {error}", file=sys.stderr)
        return 1
    failed = False
    for name in arguments.images:
        try:
            reading = reader.read(read_picture(Path(name)))
        except DrEurekaError as error:
            print(f"recognise_card: {error}", file=sys.stderr)
            failed = True
            continue
        print(json.dumps(reading_as_mapping(name, reading)) if arguments.json else _line(name, reading), flush=True)
    return 1 if failed else 0


def read_picture(path: Path) -> np.ndarray:
    """Return a picture file as RGB (h, w, 3) uint8. Raises PictureError naming the file."""
    try:
        data = np.frombuffer(path.read_bytes(), np.uint8)
    except OSError as error:
        raise PictureError(f"{path}: {error.strerror}; expected a picture") from error
    # cv2 answers an empty buffer with an exception and a broken one with None.
    image = cv2.imdecode(data, cv2.IMREAD_COLOR) if data.size else None
    if image is None:
        raise PictureError(f"{path}: not a picture that can be decoded; expected PNG, JPEG or the like")
    return cv2.cvtColor(image, cv2.COLOR_BGR2RGB)


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
        "gets NO_CARD, SEVERAL_CARDS or UNREADABLE and the reason.",
    )
    parser.add_argument("images", metavar="IMAGE", nargs="+", help="PNG, JPEG or other picture file")
    parser.add_argument("--json", action="store_true", help="print one JSON object a picture instead of text")
    return parser
