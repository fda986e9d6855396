"""Where the three tubes stand, from one picture and the camera's pose (paper section 3.2, Figures 9 and 10)."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from dr_eureka.game.state import TUBES
from dr_eureka.pieces import Pieces
from dr_eureka.resources import load_yaml
from dr_eureka.settings import build
from dr_eureka.vision.camera import CameraModel
from dr_eureka.vision.feet import Foot, FootSettings, find_feet
from dr_eureka.vision.rectified import SheetGrid, paper_brightness, rectify
from dr_eureka.vision.sheet import FEWEST_MARKERS, SheetError, SheetPose, SheetSettings, locate_sheet

NAMES = TUBES


class TubeResult:
    """Names of what came out of looking for the tubes."""

    OK = "OK"
    NO_SHEET = "NO_SHEET"
    TOO_FEW_MARKERS = "TOO_FEW_MARKERS"
    TUBE_MISSING = "TUBE_MISSING"
    TOO_MANY_TUBES = "TOO_MANY_TUBES"
    BAD_IMAGE = "BAD_IMAGE"


@dataclass(frozen=True)
class TubeSettings:
    """The `tubes:` block of config/dr_eureka_main.yaml."""

    pixels_per_metre: float = field(metadata={"min": 500.0, "max": 4000.0})
    marker_margin_m: float = field(metadata={"min": 0.0})
    smallest_contrast: float = field(metadata={"min": 1.0, "max": 255.0})
    systematic_sigma_m: float = field(metadata={"min": 0.0})
    sheet: SheetSettings
    foot: FootSettings

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
    # Printed black is dark in every colour, a ball is bright in at least one: the brightest channel tells them apart.
    straight = camera.undistort(image_rgb)
    value = cv2.max(cv2.max(straight[..., 0], straight[..., 1]), straight[..., 2])
    camera = camera.without_distortion()

    try:
        sheet = locate_sheet(
            cv2.cvtColor(straight, cv2.COLOR_RGB2GRAY), camera, base_from_camera, pieces, settings.sheet
        )
    except SheetError as error:
        too_few = 0 < len(error.markers) < FEWEST_MARKERS
        result = TubeResult.TOO_FEW_MARKERS if too_few else TubeResult.NO_SHEET
        return TubeScene(result, {}, None, error.markers, str(error))

    grid = SheetGrid(pieces, settings.pixels_per_metre)
    rectified = rectify(value, camera, sheet.camera_from_sheet, grid)
    brightness = paper_brightness(
        rectified, grid, sheet.markers, settings.marker_margin_m, settings.smallest_contrast
    )
    if brightness is None:
        reason = f"markers have less than {settings.smallest_contrast:g} grey levels of contrast"
        return TubeScene(TubeResult.NO_SHEET, {}, None, sheet.markers, reason)
    below_camera = grid.pixels(np.linalg.inv(sheet.camera_from_sheet)[:2, 3])
    radius_px = pieces.foot_radius * settings.pixels_per_metre
    rim_px = radius_px - pieces.tube_outer_radius * settings.pixels_per_metre
    feet = find_feet(brightness, below_camera, radius_px, rim_px, settings.foot)
    if len(feet) != len(NAMES):
        result = TubeResult.TUBE_MISSING if len(feet) < len(NAMES) else TubeResult.TOO_MANY_TUBES
        reason = f"{len(feet)} tube feet seen on the sheet, expected {len(NAMES)}"
        return TubeScene(result, {}, sheet.base_from_sheet, sheet.markers, reason)
    places = [_place(foot, sheet, grid, settings) for foot in feet]
    places.sort(key=lambda place: -place.position[1])
    return TubeScene(TubeResult.OK, dict(zip(NAMES, places)), sheet.base_from_sheet, sheet.markers, "")


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
