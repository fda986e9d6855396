"""Where the three tubes stand, from one picture and the camera's pose (paper section 3.2, Figures 9 and 10)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from itertools import combinations

import cv2
import numpy as np

from dr_eureka.game.state import TUBES
from dr_eureka.pieces import Pieces
from dr_eureka.resources import load_yaml
from dr_eureka.settings import build
from dr_eureka.vision.camera import CameraModel
from dr_eureka.vision.feet import Foot, FootSettings, find_feet
from dr_eureka.vision.rectified import SheetGrid, camera_pixel_size, camera_pixels, paper_brightness, rectify, wiped_out
from dr_eureka.vision.sheet import FEWEST_MARKERS, SheetError, SheetPose, SheetSettings, locate_sheet
from dr_eureka.vision.tube_faults import FaultSettings, litter_on_sheet, other_dictionary

NAMES = TUBES


class TubeResult:
    """Names of what came out of looking for the tubes."""

    OK = "OK"
    BAD_IMAGE = "BAD_IMAGE"
    NO_SHEET = "NO_SHEET"
    WRONG_DICTIONARY = "WRONG_DICTIONARY"
    DUPLICATE_MARKER = "DUPLICATE_MARKER"
    TOO_FEW_MARKERS = "TOO_FEW_MARKERS"
    TUBE_MISSING = "TUBE_MISSING"
    TUBE_HIDDEN = "TUBE_HIDDEN"
    TUBE_FALLEN = "TUBE_FALLEN"
    TUBE_OFF_SHEET = "TUBE_OFF_SHEET"
    TUBES_TOUCHING = "TUBES_TOUCHING"
    TOO_MANY_TUBES = "TOO_MANY_TUBES"


@dataclass(frozen=True)
class TubeSettings:
    """The `tubes:` block of config/dr_eureka_main.yaml."""

    pixels_per_metre: float = field(metadata={"min": 500.0, "max": 4000.0})
    marker_margin_m: float = field(metadata={"min": 0.0})
    smallest_contrast: float = field(metadata={"min": 1.0, "max": 255.0})
    systematic_sigma_m: float = field(metadata={"min": 0.0})
    smallest_gap_m: float = field(metadata={"min": 0.0, "max": 0.2})
    sheet: SheetSettings
    foot: FootSettings
    faults: FaultSettings

    @classmethod
    def load(cls, path: str = "config/dr_eureka_main.yaml") -> TubeSettings:
        """Read the block; raises ResourceError or SettingsError naming the file and the key."""
        return build(cls, load_yaml(path).get("tubes", {}), f"{path}: tubes")


@dataclass(frozen=True, eq=False)
class TubePlace:
    """A tube's axis where it meets the sheet: `position` (3,) in `base` [m], standard deviation along any axis [m]."""

    position: np.ndarray
    sigma_m: float


@dataclass(frozen=True, eq=False)
class TubeScene:
    """What one picture tells: `tubes` has all three names if the result is OK and is empty otherwise.

    `base_from_sheet` is None as long as no sheet was located; `reason` is one line, empty if OK.
    """

    result: str
    tubes: dict[str, TubePlace]
    base_from_sheet: np.ndarray | None
    markers_seen: tuple[int, ...]
    reason: str


def locate_tubes(
    image_rgb: np.ndarray,
    camera: CameraModel,
    base_from_camera: np.ndarray,
    pieces: Pieces,
    settings: TubeSettings,
) -> TubeScene:
    """Locate the three tubes standing on the sheet and name them from left to right (falling y in `base`).

    Args:
        image_rgb: (height, width, 3) uint8 picture as the camera took it, lens distortion included.
        camera: calibration of the camera.
        base_from_camera: (4, 4) pose of the optical frame in `base` at the image's stamp, from the joint states.
        pieces: sizes of tubes and sheet [m].

    Returns:
        A scene whose `result` is one of `TubeResult`; a pose is only in it when it was measured.
    """
    problem = _image_problem(image_rgb, camera)
    if problem:
        return TubeScene(TubeResult.BAD_IMAGE, {}, None, (), problem)
    base_from_camera = np.asarray(base_from_camera, dtype=np.float64)
    if not _is_rigid(base_from_camera):
        return TubeScene(TubeResult.NO_SHEET, {}, None, (), "the camera's pose in base is not a rigid transform")
    straight, camera = camera.undistort(image_rgb), camera.without_distortion()
    grey = cv2.cvtColor(straight, cv2.COLOR_RGB2GRAY)
    try:
        sheet = locate_sheet(grey, camera, base_from_camera, pieces, settings.sheet)
    except SheetError as error:
        result, reason = _sheet_fault(error, grey, pieces)
        return TubeScene(result, {}, None, error.markers, reason)

    # Printed black is dark in every colour, a ball is bright in at least one: the brightest channel tells them apart.
    value = cv2.max(cv2.max(straight[..., 0], straight[..., 1]), straight[..., 2])
    grid = SheetGrid(pieces, settings.pixels_per_metre)
    brightness = _brightness(value, camera, sheet, grid, settings)
    if brightness is None:
        reason = f"markers have less than {settings.smallest_contrast:g} grey levels of contrast"
        return TubeScene(TubeResult.NO_SHEET, {}, None, sheet.markers, reason)
    feet = _feet(straight, brightness, camera, sheet, grid, settings)
    places = sorted((_place(foot, sheet, grid, settings) for foot in feet), key=lambda place: -place.position[1])
    if len(feet) < len(NAMES):
        result, reason = _why_missing(straight, value, brightness, camera, sheet, feet, grid, settings)
    else:
        result, reason = _fault_of(places, pieces, settings)
    tubes = dict(zip(NAMES, places)) if result == TubeResult.OK else {}
    return TubeScene(result, tubes, sheet.base_from_sheet, sheet.markers, reason)


def _sheet_fault(error: SheetError, grey: np.ndarray, pieces: Pieces) -> tuple[str, str]:
    """Return result and reason when the sheet was not located."""
    if len(error.markers) >= FEWEST_MARKERS:
        return TubeResult.NO_SHEET, str(error)
    if len(error.markers) + len(error.duplicates) >= FEWEST_MARKERS:
        return TubeResult.DUPLICATE_MARKER, str(error)
    other = other_dictionary(grey, pieces.marker_dictionary, set(pieces.marker_centres))
    if other:
        return TubeResult.WRONG_DICTIONARY, f"the sheet's markers are of {other}, expected {pieces.marker_dictionary}"
    return TubeResult.TOO_FEW_MARKERS if error.markers else TubeResult.NO_SHEET, str(error)


def _brightness(
    value: np.ndarray, camera: CameraModel, sheet: SheetPose, grid: SheetGrid, settings: TubeSettings
) -> np.ndarray | None:
    rectified = rectify(value, camera, sheet.camera_from_sheet, grid)
    return paper_brightness(rectified, grid, sheet.markers, settings.marker_margin_m, settings.smallest_contrast)


def _feet(
    straight: np.ndarray,
    brightness: np.ndarray,
    camera: CameraModel,
    sheet: SheetPose,
    grid: SheetGrid,
    settings: TubeSettings,
) -> list[Foot]:
    below_camera = grid.pixels(np.linalg.inv(sheet.camera_from_sheet)[:2, 3])
    radius_px = grid.pieces.foot_radius * grid.pixels_per_metre
    rim_px = radius_px - grid.pieces.tube_outer_radius * grid.pixels_per_metre
    wiped = wiped_out(grid, settings.marker_margin_m)
    pixel_size = partial(camera_pixel_size, camera, sheet.camera_from_sheet, grid)
    tint = _tint_on(straight, camera, sheet, grid)
    return find_feet(brightness, wiped, below_camera, pixel_size, tint, radius_px, rim_px, settings.foot)


def _tint_on(
    straight: np.ndarray, camera: CameraModel, sheet: SheetPose, grid: SheetGrid
) -> Callable[[np.ndarray], float]:
    """Return what tells how coloured places (..., 2) [px] of a grid are together, under the light on the paper."""
    def colour(pixels: np.ndarray) -> np.ndarray:
        where = np.rint(camera_pixels(camera, sheet.camera_from_sheet, grid, pixels)).astype(int).reshape(-1, 2)
        columns, rows = np.clip(where, 0, (camera.width - 1, camera.height - 1)).T
        return np.median(straight[rows, columns], axis=0)

    # Of places all over the sheet the median is paper: tubes and markers cover less than half of it.
    shares = np.stack(np.meshgrid(*[np.linspace(-0.95, 0.95, 20)] * 2), axis=-1)
    half = np.array([grid.pieces.sheet_depth, grid.pieces.sheet_width]) / 2
    paper = np.maximum(colour(grid.pixels(half * shares)), 1.0)
    return lambda pixels: float(np.ptp(colour(pixels) / paper))


def _fault_of(places: list[TubePlace], pieces: Pieces, settings: TubeSettings) -> tuple[str, str]:
    """Return result and reason for three feet or more, from left to right."""
    if len(places) > len(NAMES):
        return TubeResult.TOO_MANY_TUBES, f"{len(places)} tube feet seen on the sheet, expected {len(NAMES)}"
    for (first, one), (second, other) in combinations(zip(NAMES, places), 2):
        gap = float(np.linalg.norm(one.position - other.position)) - 2 * pieces.foot_radius
        if gap < settings.smallest_gap_m:
            limit = f"expected at least {1000 * settings.smallest_gap_m:g} mm"
            return TubeResult.TUBES_TOUCHING, f"feet of the {first} and {second} tube are {1000 * gap:.1f} mm apart, {limit}"
    return TubeResult.OK, ""


def _why_missing(
    straight: np.ndarray,
    value: np.ndarray,
    brightness: np.ndarray,
    camera: CameraModel,
    sheet: SheetPose,
    feet: list[Foot],
    grid: SheetGrid,
    settings: TubeSettings,
) -> tuple[str, str]:
    """Return result and reason when fewer than three feet stand on the sheet."""
    pieces, faults = grid.pieces, settings.faults
    count = f"{len(feet)} tube feet seen on the sheet, expected {len(NAMES)}"
    around = SheetGrid(pieces, settings.pixels_per_metre, faults.margin_m)
    half = np.array([pieces.sheet_depth, pieces.sheet_width]) / 2
    anywhere = _feet(straight, _brightness(value, camera, sheet, around, settings), camera, sheet, around, settings)
    outside = sum((np.abs(around.points(foot.centre)) > half).any() for foot in anywhere)
    if outside:
        return TubeResult.TUBE_OFF_SHEET, f"{count}; {outside} beside it"
    points = np.array([grid.points(foot.centre) for foot in feet]).reshape(-1, 2)
    camera_in_sheet = np.linalg.inv(sheet.camera_from_sheet)[:3, 3]
    rectified = rectify(straight, camera, sheet.camera_from_sheet, grid)
    litter = litter_on_sheet(rectified, brightness, points, camera_in_sheet, grid, faults)
    if litter.cover:
        return TubeResult.TUBE_HIDDEN, f"{count}; something as large as {litter.cover:.1f} feet covers the sheet"
    if litter.behind:
        return TubeResult.TUBE_HIDDEN, f"{count}; something black is behind a tube"
    if litter.black:
        return TubeResult.TUBE_FALLEN, f"{count}; something black lies on it, as large as {litter.black:.1f} feet"
    return TubeResult.TUBE_MISSING, count


def _image_problem(image: np.ndarray, camera: CameraModel) -> str:
    expected = (camera.height, camera.width, 3)
    if not isinstance(image, np.ndarray):
        return f"image is a {type(image).__name__}, expected an array of shape {expected}"
    if image.shape != expected or image.dtype != np.uint8:
        return f"image has shape {image.shape} and type {image.dtype}, expected {expected} uint8"
    return ""


def _is_rigid(transform: np.ndarray) -> bool:
    if transform.shape != (4, 4) or not np.isfinite(transform).all():
        return False
    rotation = transform[:3, :3]
    return bool(
        np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-4)
        and np.linalg.det(rotation) > 0
        and np.allclose(transform[3], (0, 0, 0, 1))
    )


def _place(foot: Foot, sheet: SheetPose, grid: SheetGrid, settings: TubeSettings) -> TubePlace:
    position = (sheet.base_from_sheet @ [*grid.points(foot.centre), 0.0, 1.0])[:3]
    # Errors of the sheet's x, y and yaw move nothing: the foot was seen through the same camera as the markers.
    by_sheet = np.linalg.eigvalsh(sheet.covariance_at(position))[-1]
    by_edge = np.linalg.eigvalsh(foot.covariance)[-1] / grid.pixels_per_metre**2
    return TubePlace(position, float(np.sqrt(by_sheet + by_edge + settings.systematic_sigma_m**2)))
