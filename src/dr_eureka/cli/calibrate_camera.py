"""The command `calibrate_camera`: a camera's calibration from a ChArUco board in pictures, a bag or a live topic."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Optional

import numpy as np

from dr_eureka.bags.frames import IMAGE_TOPIC, RecordedCamera, Stillness
from dr_eureka.bags.recording import Recording
from dr_eureka.errors import DrEurekaError
from dr_eureka.vision.calibration import FEWEST_TO_FIT, Calibration, CalibrationError, fit_camera, weaknesses
from dr_eureka.vision.calibration_views import CalibrationSettings, ViewCollection
from dr_eureka.vision.camera import CameraError, load_camera, save_camera
from dr_eureka.vision.charuco import CharucoBoard
from dr_eureka.vision.pictures import PictureError, decode_picture

PICTURES = {".bmp", ".jpeg", ".jpg", ".png", ".tif", ".tiff"}
# Recorded images count wherever the head was: the board moves, not what it is seen from.
_ANY_HEAD = Stillness(still_window=0.0, still_tolerance=0.5)

# What a picture is called and its pixels, (height, width, 3) uint8 rgb.
Picture = tuple[str, np.ndarray]


def main(argv: Optional[Sequence[str]] = None, *, live_pictures: Callable[[str], Iterable[Picture]]) -> int:
    """Run the command with its arguments (default: the process's) and return its exit code.

    0 when a calibration was written, 1 when the views do not suffice for one, 2 for bad input. `live_pictures` gives
    the pictures of a topic; it comes from the caller because only nodes touch ROS.
    """
    arguments = _parser().parse_args(argv)
    try:
        settings = _settings(arguments)
        if arguments.topic:
            pictures = live_pictures(arguments.topic)
        elif arguments.bag:
            pictures = _recorded_pictures(arguments.bag, arguments.image)
        else:
            pictures = _picture_files(arguments.pictures)
        collection = ViewCollection(settings)
        _collect(pictures, collection, settings, moving=bool(arguments.topic or arguments.bag))
        if collection.size is None:
            raise CalibrationError("there is no picture to calibrate with")
    except DrEurekaError as error:
        print(f"calibrate_camera: {error}", file=sys.stderr)
        return 2
    return _conclude(collection, settings, arguments)


def _collect(pictures: Iterable[Picture], collection: ViewCollection, settings: CalibrationSettings, moving: bool) -> None:
    """Take views one after another and print what each adds; an interrupt or the last view that counts ends it."""
    said = None
    try:
        for name, image in pictures:
            problem = collection.offer(image, moving)
            if problem is None:
                print(f"{name}: {_progress(collection, settings.board)}", flush=True)
            elif problem != said or not moving:
                print(f"{name}: left out, {problem}", flush=True)
            said = problem
            if moving and len(collection.views) == settings.most_views:
                break
    except KeyboardInterrupt:
        print("interrupted: calibrating with the views so far", flush=True)


def _progress(collection: ViewCollection, board: CharucoBoard) -> str:
    """Return the newest view, what all cover, and how well a camera fits them so far."""
    count = len(collection.views)
    corners = f"{len(collection.views[-1].ids)} of {board.corner_count} corners"
    line = f"view {count}, {corners}, coverage {collection.covered().mean():.0%}"
    if count < FEWEST_TO_FIT:
        return line
    try:
        return f"{line}, RMS {fit_camera(collection.views, board, collection.size).rms_px:.3f} px"
    except CalibrationError:
        return f"{line}, no camera fits yet"


def _conclude(collection: ViewCollection, settings: CalibrationSettings, arguments: argparse.Namespace) -> int:
    """Calibrate with the collected views, write the file unless they are too weak, and return the exit code."""
    try:
        calibration = fit_camera(collection.views, settings.board, collection.size)
        print("\n".join(_summary(calibration, collection)))
        weak = weaknesses(calibration, collection, settings)
        if weak and not arguments.anyway:
            raise CalibrationError("; ".join(weak))
    except CalibrationError as error:
        print(f"calibrate_camera: refused, nothing written: {error}", file=sys.stderr)
        return 1
    try:
        save_camera(calibration.camera, arguments.out, arguments.name)
        loaded = load_camera(arguments.out)
    except DrEurekaError as error:
        print(f"calibrate_camera: {error}", file=sys.stderr)
        return 2
    if not np.array_equal(loaded.matrix, calibration.camera.matrix):
        print(f"calibrate_camera: {arguments.out}: reads back another camera than was written", file=sys.stderr)
        return 2
    for reason in weak:
        print(f"calibrate_camera: written all the same: {reason}", file=sys.stderr)
    print(f"{arguments.out}: written, and read back the same")
    return 0


def _summary(calibration: Calibration, collection: ViewCollection) -> Iterator[str]:
    yield f"corners were seen at # in the picture (coverage {collection.covered().mean():.0%}):"
    for row in collection.covered():
        yield "  " + "".join("#" if cell else "." for cell in row)
    camera = calibration.camera
    yield f"{camera.width}x{camera.height} px, {len(collection.views)} views, RMS {calibration.rms_px:.4f} px"
    figures = np.concatenate([np.diag(camera.matrix)[:2], camera.matrix[:2, 2]])
    sigmas = np.concatenate([calibration.focal_sigmas, calibration.centre_sigmas])
    named = zip(("fx", "fy", "cx", "cy"), figures, sigmas)
    yield ", ".join(f"{name} {figure:.2f} +-{sigma:.2f}" for name, figure, sigma in named) + " px"
    yield "distortion k1 {:.5f}, k2 {:.5f}, p1 {:.5f}, p2 {:.5f}, k3 {:.5f}".format(*camera.distortion)
    yield f"board tilted over {np.degrees(calibration.tilt_spread_rad):.0f} degrees"


def _picture_files(names: Sequence[str]) -> Iterator[Picture]:
    """Yield the pictures of files, and of folders in the order of their names; a file that is none is reported."""
    found = False
    for path in map(Path, names):
        for file in _pictures_in(path) if path.is_dir() else [path]:
            try:
                picture = decode_picture(file.read_bytes())
            except (OSError, PictureError) as error:
                reason = error.strerror if isinstance(error, OSError) else error
                print(f"calibrate_camera: {file}: {reason}", file=sys.stderr)
                continue
            found = True
            yield file.name, picture
    if not found:
        raise CameraError(f"{', '.join(names)}: no picture that can be opened, expected PNG, JPEG or the like")


def _pictures_in(folder: Path) -> list[Path]:
    return sorted(entry for entry in folder.iterdir() if entry.suffix.lower() in PICTURES)


def _recorded_pictures(bag: str, topic: str) -> Iterator[Picture]:
    with Recording(bag) as recording:
        for frame in RecordedCamera(recording, _ANY_HEAD, topic).frames():
            yield f"{frame.stamp_s:.3f} s", frame.image


def _settings(arguments: argparse.Namespace) -> CalibrationSettings:
    """Return the package's settings with the board that the arguments describe."""
    settings = CalibrationSettings.load()
    given = {
        "columns": arguments.size and arguments.size[0],
        "rows": arguments.size and arguments.size[1],
        "square_side": arguments.square,
        "marker_side": arguments.marker,
        "dictionary": arguments.dictionary,
    }
    given = {key: value for key, value in given.items() if value is not None}
    return replace(settings, board=replace(settings.board, **given))


def _board_size(text: str) -> tuple[int, int]:
    columns, _, rows = text.partition("x")
    if not (columns.isdecimal() and rows.isdecimal() and min(int(columns), int(rows)) >= 3):
        raise argparse.ArgumentTypeError(f"is {text!r}, expected columns x rows of at least 3, such as 7x5")
    return int(columns), int(rows)


def _side(text: str) -> float:
    try:
        side = float(text)
    except ValueError:
        side = 0.0
    if not 0.0 < side <= 1.0:
        raise argparse.ArgumentTypeError(f"is {text!r}, expected metres, more than 0 and at most 1, such as 0.036")
    return side


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="calibrate_camera",
        description="Calibrate a camera with a ChArUco board in pictures, a bag or a live topic, and write the camera_info "
        "yaml that ROS's camera drivers read.",
        epilog="Show the board (rosrun dr_eureka print_game board) near the camera, tilted to all sides, out to the edges "
        "of the picture, and hold it still each time. A live topic ends with Ctrl-C or when there are views enough. Views "
        "that do not fix the camera are refused with the reason and exit code 1; bad input ends with 2.",
    )
    source = parser.add_mutually_exclusive_group(required=True)
    # nargs "*" with a default, not "+": a positional in a group that excludes others must be optional to argparse.
    source.add_argument("pictures", metavar="PICTURE", nargs="*", default=[], help="picture files, or folders of such")
    source.add_argument("--bag", metavar="FILE", help="take the pictures from a ROS 1 bag")
    source.add_argument(
        "--topic",
        help="take the pictures from a live topic (sensor_msgs/Image; CompressedImage if it ends in /compressed)",
    )
    parser.add_argument(
        "--image", default=IMAGE_TOPIC, metavar="TOPIC", help="image topic in the bag (default: %(default)s)"
    )
    parser.add_argument(
        "--size", type=_board_size, metavar="COLUMNSxROWS", help="squares of the board (default: that of print_game)"
    )
    parser.add_argument("--square", type=_side, metavar="M", help="side of its squares [m]")
    parser.add_argument("--marker", type=_side, metavar="M", help="side of its markers [m]")
    parser.add_argument("--dictionary", metavar="NAME", help="its ArUco dictionary, such as DICT_5X5_50")
    parser.add_argument("--out", default="camera.yaml", metavar="FILE", help="file to write (default: %(default)s)")
    parser.add_argument("--name", default="camera", help="camera_name in the file (default: %(default)s)")
    parser.add_argument("--anyway", action="store_true", help="write the file also where the views are too weak to trust it")
    return parser
