"""Where the printed sheet lies, from its markers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dr_eureka.errors import DrEurekaError
from dr_eureka.pieces import Pieces
from dr_eureka.vision.aruco import find_markers, marker_image
from dr_eureka.vision.camera import CameraModel
from dr_eureka.vision.level_fit import LevelFit, LevelFitError, fit_level_sheet
from dr_eureka.vision.marker_edges import MODULE_PX, refine_corners, resemblance

FEWEST_MARKERS = 3


class SheetError(DrEurekaError):
    """The sheet was not located; the text says why. `markers` are the ids made out, `duplicates` those seen twice."""

    def __init__(self, reason: str, markers: tuple[int, ...] = (), duplicates: tuple[int, ...] = ()):
        super().__init__(reason)
        self.markers = markers
        self.duplicates = duplicates


@dataclass(frozen=True)
class SheetSettings:
    """How the sheet's pose is found; config/dr_eureka_main.yaml gives meaning and unit of each key."""

    edge_search_px: tuple[float, ...] = field(metadata={"min": 0.5, "max": 8.0})
    smallest_edge: float = field(metadata={"min": 1.0, "max": 255.0})
    smallest_resemblance: float = field(metadata={"min": 0.0, "max": 1.0})
    corner_sigma_px: float = field(metadata={"min": 0.001})
    tilt_sigma_rad: float = field(metadata={"min": 1e-6, "max": 0.1})
    largest_tilt_rad: float = field(metadata={"min": 0.0, "max": 0.5})
    largest_residual_px: float = field(metadata={"min": 0.01})
    lowest_m: float
    highest_m: float


@dataclass(frozen=True, eq=False)
class SheetPose:
    """A located sheet: the fit behind it and the markers that it rests on."""

    fit: LevelFit
    markers: tuple[int, ...]

    @property
    def base_from_sheet(self) -> np.ndarray:
        """Pose (4, 4) of the sheet in `base`, level."""
        return self.fit.base_from_sheet

    @property
    def camera_from_sheet(self) -> np.ndarray:
        """Pose (4, 4) of the sheet in the optical frame."""
        return np.linalg.inv(self.fit.base_from_camera) @ self.fit.base_from_sheet

    def covariance_at(self, position: np.ndarray) -> np.ndarray:
        """Covariance (2, 2) [m^2] in base x, y of a point (3,) of the sheet, since height and tilt are uncertain."""
        ray = position - self.fit.base_from_camera[:3, 3]
        # A tilt about an axis moves the ray's end by axis x ray; both kinds of shift then slide along the ray until
        # they are on the sheet again.
        shifts = np.column_stack([(0.0, 0.0, -1.0), np.cross((1.0, 0.0, 0.0), ray), np.cross((0.0, 1.0, 0.0), ray)])
        by_parameters = shifts[:2] - np.outer(ray[:2] / ray[2], shifts[2])
        return by_parameters @ self.fit.covariance @ by_parameters.T


def locate_sheet(
    grey: np.ndarray, camera: CameraModel, base_from_camera: np.ndarray, pieces: Pieces, settings: SheetSettings
) -> SheetPose:
    """Find the sheet's markers and fit the level sheet to all of their corners at once.

    The paper (section 3.2) takes the PnP pose of one marker; `fit_level_sheet` uses all, and what the joints know. The
    detector often misses a marker behind a tube's wall: the fit of those it found says where the others must be, and a
    marker counts if its four sides are there and it looks like its print.

    Args:
        grey: (height, width) uint8 picture without lens distortion.
        camera: camera without distortion.
        base_from_camera: (4, 4) pose of the optical frame in `base`.

    Raises:
        SheetError: no marker, fewer than three, or no three that fit a level sheet.
    """
    detection = find_markers(grey, pieces.marker_dictionary)
    corners = {marker: quad for marker, quad in detection.corners.items() if marker in pieces.marker_centres}
    twice = f", {list(detection.duplicates)} seen twice" if detection.duplicates else ""
    wanted = {marker for marker in pieces.marker_centres if marker not in detection.duplicates}
    smooth = grey.astype(np.float32)
    for search_px in settings.edge_search_px:
        if corners:
            pose = _fit(corners, camera, base_from_camera, pieces, settings)
            expected = _expected_corners(pose, wanted, camera, pieces) | corners
            corners = _measured(smooth, expected, search_px, pieces, settings)
    markers = tuple(sorted(corners))
    if len(markers) < FEWEST_MARKERS:
        limit = f"expected at least {FEWEST_MARKERS}"
        reason = f"markers {list(markers)} of {sorted(pieces.marker_centres)} seen{twice}, {limit}"
        raise SheetError(reason, markers, tuple(sorted(set(detection.duplicates) & set(pieces.marker_centres))))
    pose = _fit(corners, camera, base_from_camera, pieces, settings)
    _check(pose, settings)
    return pose


def _fit(
    corners: dict[int, np.ndarray],
    camera: CameraModel,
    base_from_camera: np.ndarray,
    pieces: Pieces,
    settings: SheetSettings,
) -> SheetPose:
    """Fit the markers, leaving out the worst ones as long as three remain that might agree better."""
    used = sorted(corners)
    while True:
        printed = np.concatenate([pieces.marker_corners(marker) for marker in used])
        seen = np.concatenate([corners[marker] for marker in used])
        height = (settings.lowest_m + settings.highest_m) / 2
        try:
            fit = fit_level_sheet(
                printed, seen, camera, base_from_camera, height, settings.corner_sigma_px, settings.tilt_sigma_rad
            )
        except LevelFitError as error:
            raise SheetError(f"markers {used}: {error}", tuple(used)) from error
        if fit.residual_px <= settings.largest_residual_px or len(used) <= FEWEST_MARKERS:
            return SheetPose(fit, tuple(used))
        per_marker = np.linalg.norm(fit.residuals, axis=1).reshape(-1, 4).max(axis=1)
        used.pop(int(np.argmax(per_marker)))


def _expected_corners(
    pose: SheetPose, wanted: set[int], camera: CameraModel, pieces: Pieces
) -> dict[int, np.ndarray]:
    """Where the corners of the wanted markers must be in the picture if the pose is right."""
    rotation, place = pose.camera_from_sheet[:3, :2], pose.camera_from_sheet[:3, 3]
    return {marker: camera.project(pieces.marker_corners(marker) @ rotation.T + place) for marker in sorted(wanted)}


def _measured(
    grey: np.ndarray, expected: dict[int, np.ndarray], search_px: float, pieces: Pieces, settings: SheetSettings
) -> dict[int, np.ndarray]:
    """Measure each marker's corners round where they are expected; leave out what does not look like the marker."""
    measured = {}
    for marker, corners in expected.items():
        refined = refine_corners(grey, corners, search_px, settings.smallest_edge)
        if refined is None:
            continue
        printed = marker_image(marker, 6 * MODULE_PX, pieces.marker_dictionary)
        if resemblance(grey, refined, printed) >= settings.smallest_resemblance:
            measured[marker] = refined
    return measured


def _check(pose: SheetPose, settings: SheetSettings) -> None:
    """Raise SheetError for a pose that no sheet on a table has."""
    fit, markers = pose.fit, list(pose.markers)
    if fit.residual_px > settings.largest_residual_px:
        limit = f"expected at most {settings.largest_residual_px} px RMS"
        raise SheetError(f"markers {markers} miss a level sheet by {fit.residual_px:.2f} px, {limit}", pose.markers)
    tilt = float(np.linalg.norm(fit.tilt))
    if tilt > settings.largest_tilt_rad:
        limit = f"expected at most {settings.largest_tilt_rad} rad"
        raise SheetError(f"sheet and joints differ by {tilt:.3f} rad in how the camera tilts, {limit}", pose.markers)
    height = fit.base_from_sheet[2, 3]
    if not settings.lowest_m <= height <= min(settings.highest_m, fit.base_from_camera[2, 3]):
        limits = f"expected {settings.lowest_m} to {settings.highest_m} m, below the camera"
        raise SheetError(f"sheet seems to lie at z {height:.3f} m in base, {limits}", pose.markers)
