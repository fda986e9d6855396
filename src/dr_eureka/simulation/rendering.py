"""The head camera: what the robot sees, rendered along +z of cam_link by Bullet's renderers."""
from __future__ import annotations

import hashlib
import importlib.util
import subprocess
import sys
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Sequence

import cv2
import numpy as np
import pybullet
from pybullet_utils.bullet_client import BulletClient

from dr_eureka.pieces import Pieces
from dr_eureka.simulation.meshes import write_picture_plane
from dr_eureka.simulation.camera_model import camera_model
from dr_eureka.simulation.placement import Placement
from dr_eureka.simulation.robot import SimulatedRobot
from dr_eureka.simulation.settings import CameraSettings, SimulationError
from dr_eureka.simulation.tube_model import WALL_COLOUR, WALL_SHAPE
from dr_eureka.vision.aruco import marker_image

EGL, TINY = "egl", "tiny"
# Paper lies a little above what it covers, or the two flicker through one another.
PAPER_LIFT = 0.0004
LAMP_DISTANCE = 10.0
# The auto-exposure is off: white paper in nominal light is a light grey.
EXPOSURE = 0.85
NOISE_MARGIN = 32
HAND_MARKER_PX_PER_M = 4000
_PROBE = """
import importlib.util, pybullet
pybullet.connect(pybullet.DIRECT)
pybullet.loadPlugin(importlib.util.find_spec("eglRenderer").origin, "_eglRendererPlugin")
pybullet.getCameraImage(16, 16)
print("EGL renders")
"""


@dataclass(frozen=True, eq=False)
class SceneTextures:
    """Pictures in the scene as uint8, grey (n, m) or RGB (n, m, 3); None leaves them out.

    `sheet` has its first row at the sheet's far edge and its first column at the robot's left; `card` is square.
    """

    sheet: np.ndarray | None = None
    card: np.ndarray | None = None


@lru_cache(maxsize=1)
def egl_works() -> bool:
    """Return whether Bullet can render by EGL here.

    Asked in a process of its own: without a usable OpenGL, Bullet's plugin ends the process that loads it.
    """
    if importlib.util.find_spec("eglRenderer") is None:
        return False
    try:
        probe = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, timeout=60, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return b"EGL renders" in probe.stdout


def open_renderer(client: BulletClient, choice: str) -> str:
    """Make `client` ready to render, before it loads any body, and return the renderer in use, `egl` or `tiny`.

    Native code writes to standard output meanwhile; see `quiet_stdout`.

    Raises:
        SimulationError: `egl` was asked for and does not work here.
    """
    if choice == TINY or (choice == "auto" and not egl_works()):
        return TINY
    if not egl_works():
        raise SimulationError("camera renderer: egl does not work here (no OpenGL by EGL); expected auto or tiny")
    client.loadPlugin(importlib.util.find_spec("eglRenderer").origin, "_eglRendererPlugin")
    # The first two pictures write to standard output; here the caller can keep it quiet.
    for _ in range(2):
        client.getCameraImage(16, 16, renderer=pybullet.ER_BULLET_HARDWARE_OPENGL)
    return EGL


def projection_matrix(settings: CameraSettings, renderer: str = EGL) -> np.ndarray:
    """Return OpenGL's (4, 4) projection for pinhole intrinsics whose pixel centres are whole numbers, as in OpenCV."""
    width, height, near, far = settings.width, settings.height, settings.near, settings.far
    # OpenGL samples pixels at their centres, half a pixel in from the picture's edge; TinyRenderer at their left bottom.
    left, top = (0.5, 0.5) if renderer == EGL else (0.0, 1.0)
    return np.array([
        [2 * settings.fx / width, 0, 1 - 2 * (settings.cx + left) / width, 0],
        [0, 2 * settings.fy / height, 2 * (settings.cy + top) / height - 1, 0],
        [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)],
        [0, 0, -1, 0]])


class HeadCamera:
    """Renders the robot's view. See-through walls are blended by OpenGL, or from two pictures without it.

    Args:
        renderer: what `open_renderer` returned for this client.
        tubes: the bodies whose walls are see-through.
        folder: a scratch folder of this process.
    """

    def __init__(self, client: BulletClient, renderer: str, robot: SimulatedRobot, settings: CameraSettings,
                 pieces: Pieces, placement: Placement, tubes: Sequence[int], textures: SceneTextures, folder: Path,
                 seed: int) -> None:
        self._client = client
        self._renderer = renderer
        self._robot = robot
        self._settings = settings
        self._pieces = pieces
        self._placement = placement
        self._tubes = tubes
        self._folder = folder
        self._projection = projection_matrix(settings, renderer).flatten("F").tolist()
        self._rng = np.random.default_rng((seed, 1))
        shape = (settings.height + NOISE_MARGIN, settings.width + NOISE_MARGIN, 3)
        self._noise = self._rng.normal(0.0, settings.noise, shape).astype(np.float32)
        self._distortion_maps = _distortion_maps(settings)
        self._card: int | None = None
        if textures.sheet is not None:
            depth, width = pieces.sheet_depth / 2, pieces.sheet_width / 2
            corners = [(depth, width, 0.0), (depth, -width, 0.0), (-depth, -width, 0.0), (-depth, width, 0.0)]
            self._add_picture("sheet", textures.sheet, corners, placement.base_from_sheet)
        self._hand_markers = {f"{hand[0]}_arm_end_link": self._add_hand_marker(marker)
                              for hand, marker in pieces.hand_markers.items() if settings.hand_markers}
        self.show_card(textures.card)

    def show_card(self, picture: np.ndarray | None) -> None:
        """Show a card with this square picture at the world's card place, or none."""
        if self._card is not None:
            self._client.removeBody(self._card)
            self._card = None
        if picture is not None:
            side = self._pieces.card_side / 2
            corners = [(-side, side, 0.0), (side, side, 0.0), (side, -side, 0.0), (-side, -side, 0.0)]
            self._card = self._add_picture("card", picture, corners, self._placement.base_from_card)

    def _add_hand_marker(self, marker: int) -> int:
        """Add a body that shows a marker at its place in the frame of a hand's end link."""
        pieces = self._pieces
        lengths = (pieces.hand_marker_side, pieces.hand_marker_margin)
        side, margin = (round(length * HAND_MARKER_PX_PER_M) for length in lengths)
        picture = np.pad(marker_image(marker, side, pieces.marker_dictionary), margin, constant_values=255)
        centre = np.array(pieces.hand_marker_centre)
        outward = (pieces.hand_marker_corners() - centre) * (1.0 + 2.0 * pieces.hand_marker_margin / pieces.hand_marker_side)
        return self._add_picture(f"hand_marker_{marker}", picture, (centre + outward).tolist(), np.eye(4))

    def _place_hand_markers(self) -> None:
        for link, body in self._hand_markers.items():
            pose = self._robot.link_pose(link)
            self._client.resetBasePositionAndOrientation(body, pose[:3, 3].tolist(), _quaternion(pose[:3, :3]))

    def _add_picture(self, name: str, picture: np.ndarray, corners, base_from_picture: np.ndarray) -> int:
        """Add a flat body with a picture on it; only seen, never touched."""
        if picture.dtype != np.uint8 or picture.ndim not in (2, 3):
            raise SimulationError(f"{name} picture: is {picture.dtype} {picture.shape}; expected uint8 rows x columns (x 3)")
        # PyBullet remembers files by name for as long as the process lives: equal pictures share one, others need another.
        digest = hashlib.sha256(repr((picture.shape, corners)).encode() + picture.tobytes()).hexdigest()
        mesh = self._folder / f"{name}_{digest[:16]}.obj"
        image = mesh.with_suffix(".png")
        cv2.imwrite(str(image), picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
        write_picture_plane(mesh, corners, image.name)
        lifted = base_from_picture[:3, 3] + PAPER_LIFT * base_from_picture[:3, 2]
        body = self._client.createMultiBody(
            baseVisualShapeIndex=self._client.createVisualShape(
                pybullet.GEOM_MESH, fileName=str(mesh), rgbaColor=(1, 1, 1, 1), specularColor=(0.05, 0.05, 0.05)),
            basePosition=lifted.tolist(), baseOrientation=_quaternion(base_from_picture[:3, :3]))
        for file in (mesh, mesh.with_suffix(".mtl"), image):
            file.unlink()
        return body

    def image(self, base_from_camera: np.ndarray | None = None) -> np.ndarray:
        """Return the present view as (height, width, 3) uint8 RGB, with the sensor's gain and noise.

        base_from_camera (4, 4): where a camera of the same kind looks along its z, instead of the robot's own.
        """
        self._place_hand_markers()
        view = self._view(self._robot.link_pose("cam_link") if base_from_camera is None else base_from_camera)
        if self._renderer == EGL:
            scene = self._render(view)
        else:
            walls = self._render(view)
            self._set_walls(0.0)
            without = self._render(view)
            self._set_walls(self._settings.wall_tint)
            scene = cv2.addWeighted(walls, self._settings.wall_tint, without, 1.0 - self._settings.wall_tint, 0.0)
        if self._distortion_maps is not None:
            scene = cv2.remap(scene, *self._distortion_maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return self._sense(scene)

    def _set_walls(self, alpha: float) -> None:
        for tube in self._tubes:
            self._client.changeVisualShape(tube, -1, shapeIndex=WALL_SHAPE, rgbaColor=(*WALL_COLOUR, alpha))

    def _render(self, view: list[float]) -> np.ndarray:
        settings = self._settings
        lamp = (self._placement.light_direction * LAMP_DISTANCE).tolist()
        opengl = self._renderer == EGL
        pixels = self._client.getCameraImage(
            settings.width, settings.height, view, self._projection, lightDirection=lamp, lightColor=(1, 1, 1),
            # TinyRenderer's shadow map ends amid the table.
            shadow=int(opengl), flags=pybullet.ER_NO_SEGMENTATION_MASK,
            renderer=pybullet.ER_BULLET_HARDWARE_OPENGL if opengl else pybullet.ER_TINY_RENDERER)[2]
        rgba = np.asarray(pixels, dtype=np.uint8).reshape(settings.height, settings.width, 4)
        return np.ascontiguousarray(rgba[:, :, :3])

    @staticmethod
    def _view(base_from_camera: np.ndarray) -> list[float]:
        """Return OpenGL's view matrix, column by column: its camera looks along -z with y up."""
        base_from_camera = base_from_camera @ np.diag([1.0, -1.0, -1.0, 1.0])
        rotation, position = base_from_camera[:3, :3], base_from_camera[:3, 3]
        view = np.eye(4)
        view[:3, :3], view[:3, 3] = rotation.T, -rotation.T @ position
        return view.flatten("F").tolist()

    def _sense(self, scene: np.ndarray) -> np.ndarray:
        """Return the scene as the sensor gives it: the light's brightness, and noise that differs from frame to frame."""
        row, column = self._rng.integers(0, NOISE_MARGIN, 2)
        noise = self._noise[row : row + scene.shape[0], column : column + scene.shape[1]]
        return np.clip(scene * np.float32(EXPOSURE * self._placement.light) + noise, 0, 255).astype(np.uint8)


def _distortion_maps(settings: CameraSettings) -> tuple[np.ndarray, np.ndarray] | None:
    """Return where each pixel of the distorted picture lies in the rendered, straight one; None without distortion."""
    if not any(settings.distortion):
        return None
    matrix = camera_model(settings).matrix
    columns, rows = np.meshgrid(np.arange(settings.width), np.arange(settings.height))
    pixels = np.stack([columns, rows], axis=-1).reshape(-1, 1, 2).astype(np.float64)
    straight = cv2.undistortPoints(pixels, matrix, np.array(settings.distortion), P=matrix)
    maps = straight.reshape(settings.height, settings.width, 2).astype(np.float32)
    return maps[:, :, 0], maps[:, :, 1]


def _quaternion(rotation: np.ndarray) -> list[float]:
    """Return the quaternion x y z w of a rotation matrix (through OpenCV's rotation vector)."""
    vector = cv2.Rodrigues(rotation)[0].ravel()
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return [0.0, 0.0, 0.0, 1.0]
    return [*(np.sin(angle / 2) * vector / angle).tolist(), float(np.cos(angle / 2))]
