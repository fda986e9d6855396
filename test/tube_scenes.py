"""Synthetic pictures of the sheet with three tubes, drawn by projection alone: a renderer with a known answer.

It shares the printed sheet with the code under test, but not its geometry: points go through one 3x4 matrix made here.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from dr_eureka.pieces import Pieces
from dr_eureka.vision.camera import CameraModel
from dr_eureka.vision.sheet_renderer import sheet_image

SUPERSAMPLING = 3
WOOD, TAPE = (150, 110, 75), (22, 22, 24)


@dataclass
class Scene:
    """What stands where: sheet (x, y, yaw) in base, tubes (3, 2) in the sheet frame, balls as colours per tube."""

    sheet: tuple[float, float, float] = (0.475, 0.0, 0.0)
    height: float = 0.775
    tubes: np.ndarray = field(default_factory=lambda: np.array([[-0.035, 0.11], [-0.035, 0.0], [-0.035, -0.11]]))
    balls: tuple[str, ...] = ("RR", "GG", "PP")
    head_pitch: float = 0.87
    hidden_markers: tuple[int, ...] = ()
    light: float = 1.0
    light_slope: tuple[float, float] = (0.0, 0.0)
    noise: float = 0.0
    blur: float = 0.4
    seed: int = 0

    @property
    def base_from_sheet(self) -> np.ndarray:
        x, y, yaw = self.sheet
        c, s = np.cos(yaw), np.sin(yaw)
        return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, self.height], [0, 0, 0, 1.0]])

    @property
    def tubes_in_base(self) -> np.ndarray:
        """(3, 3) true places of the tubes' axes on the sheet, from left to right."""
        points = np.column_stack([self.tubes, np.zeros(len(self.tubes)), np.ones(len(self.tubes))])
        places = (points @ self.base_from_sheet.T)[:, :3]
        return places[np.argsort(-places[:, 1])]

    @property
    def base_from_camera(self) -> np.ndarray:
        """Head camera of the robot with its torso at 0: pitch axis over the pelvis, optical axes x right, y down."""
        c, s = np.cos(self.head_pitch), np.sin(self.head_pitch)
        place = np.array([0.02 + 0.0682 * c + 0.056 * s, 0.0, 1.16 - 0.0682 * s + 0.056 * c])
        right, down, forward = (0.0, -1.0, 0.0), (-s, 0.0, -c), (c, 0.0, -s)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = np.column_stack([right, down, forward]), place
        return pose


def random_scene(rng: np.random.Generator, pieces: Pieces, yaw_limit: float = 0.43, **changes) -> Scene:
    """Draw a sheet place, three tubes anywhere on the sheet off the markers, balls, light and noise."""
    placed: list[np.ndarray] = []
    room = pieces.foot_radius + 0.003
    limits = np.array([pieces.sheet_depth, pieces.sheet_width]) / 2 - room
    while len(placed) < 3:
        spot = rng.uniform(-limits, limits)
        off_markers = all(
            np.abs(spot - centre).max() > pieces.marker_side / 2 + pieces.foot_radius
            for centre in map(np.array, pieces.marker_centres.values())
        )
        if off_markers and all(np.linalg.norm(spot - other) > 0.06 for other in placed):
            placed.append(spot)
    balls = "".join(rng.permutation(list("RRGGPP")))
    cuts = sorted(rng.integers(1, 4, 2) + np.array([0, 1]))
    drawn = dict(
        sheet=(0.475 + rng.uniform(-0.008, 0.008), rng.uniform(-0.008, 0.008), rng.uniform(-yaw_limit, yaw_limit)),
        tubes=np.array(placed),
        balls=(balls[: cuts[0]], balls[cuts[0] : cuts[1]], balls[cuts[1] :]),
        light=rng.uniform(0.35, 1.0),
        light_slope=tuple(rng.uniform(-0.6, 0.6, 2)),
        noise=rng.uniform(0.0, 6.0),
        blur=rng.uniform(0.2, 0.8),
        head_pitch=0.87 + rng.uniform(-0.02, 0.02),
        seed=int(rng.integers(1 << 30)),
    )
    return Scene(**{**drawn, **changes})


def draw(scene: Scene, pieces: Pieces, camera: CameraModel) -> np.ndarray:
    """Draw the scene as the camera takes it: (height, width, 3) uint8 RGB, lens distortion included."""
    painter = _Painter(scene, pieces, camera)
    painter.sheet()
    eye = np.linalg.inv(scene.base_from_sheet) @ scene.base_from_camera[:, 3]
    by_distance = np.argsort(-np.linalg.norm(scene.tubes - eye[:2], axis=1))
    for index in by_distance:
        painter.tube(scene.tubes[index], scene.balls[index])
    return painter.picture()


def draw_fallen_tube(
    image: np.ndarray, scene: Scene, pieces: Pieces, camera: CameraModel, foot: tuple[float, float], heading: float
) -> None:
    """Draw an empty tube that lies on the sheet, its foot at `foot` in the sheet frame, its mouth toward `heading` [rad]."""
    axis, across = np.array([np.cos(heading), np.sin(heading), 0.0]), np.array([-np.sin(heading), np.cos(heading), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    camera_from_sheet = np.linalg.inv(scene.base_from_camera) @ scene.base_from_sheet
    turn = np.linspace(0, 2 * np.pi, 60)[:, None]

    def ring(along: float, radius: float) -> np.ndarray:
        centre = np.array([*foot, pieces.foot_radius]) + along * axis
        points = centre + radius * (np.cos(turn) * across + np.sin(turn) * up)
        return camera.project(points @ camera_from_sheet[:3, :3].T + camera_from_sheet[:3, 3])

    disc, tape, outer = pieces.foot_thickness, pieces.foot_thickness + pieces.tape_height, pieces.tube_outer_radius
    parts = [((0.0, pieces.foot_radius), (disc, pieces.foot_radius), 1.0, TAPE), ((disc, outer), (tape, outer), 1.0, TAPE),
             ((tape, outer), (pieces.tube_height, outer), 0.12, (200, 205, 210))]
    for start, end, opacity, colour in parts:
        hull = cv2.convexHull(np.concatenate([ring(*start), ring(*end)]).astype(np.float32))
        layer = image.copy()
        cv2.fillPoly(layer, [np.round(hull * 16).astype(np.int32)], colour, cv2.LINE_AA, 4)
        cv2.addWeighted(layer, opacity, image, 1 - opacity, 0, dst=image)


class _Painter:
    def __init__(self, scene: Scene, pieces: Pieces, camera: CameraModel):
        self.scene, self.pieces, self.camera = scene, pieces, camera
        # Distorted pixels are looked up in the undistorted picture, which must reach a little farther at its border.
        self.border = 40 if camera.is_distorted else 0
        k = SUPERSAMPLING
        intrinsics = camera.matrix.copy()
        intrinsics[:2, 2] += self.border
        scale = np.array([[k, 0, (k - 1) / 2], [0, k, (k - 1) / 2], [0, 0, 1]])
        camera_from_sheet = np.linalg.inv(scene.base_from_camera) @ scene.base_from_sheet
        self.matrix = scale @ intrinsics @ camera_from_sheet[:3]
        size = ((camera.height + 2 * self.border) * k, (camera.width + 2 * self.border) * k)
        self.canvas = np.empty((*size, 3), np.uint8)
        self.canvas[:] = WOOD

    def project(self, points: np.ndarray) -> np.ndarray:
        image = np.column_stack([points, np.ones(len(points))]) @ self.matrix.T
        return image[:, :2] / image[:, 2:]

    def sheet(self) -> None:
        per_metre = 3000
        image = sheet_image(self.pieces, per_metre)
        for marker in self.scene.hidden_markers:
            x, y = self.pieces.marker_centres[marker]
            row, column = (self.pieces.sheet_depth / 2 - x) * per_metre, (self.pieces.sheet_width / 2 - y) * per_metre
            cv2.rectangle(image, (int(column) - 40, int(row) - 130), (int(column) + 40, int(row) + 130), 235, -1)
        texels = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * (image.shape[1], image.shape[0]) - 0.5
        points = np.column_stack(
            [
                self.pieces.sheet_depth / 2 - (texels[:, 1] + 0.5) / per_metre,
                self.pieces.sheet_width / 2 - (texels[:, 0] + 0.5) / per_metre,
                np.zeros(4),
            ]
        )
        homography = cv2.getPerspectiveTransform(texels.astype(np.float32), self.project(points).astype(np.float32))
        size = self.canvas.shape[1::-1]
        paper = cv2.warpPerspective(np.full_like(image, 255), homography, size)
        printed = cv2.warpPerspective(image, homography, size, flags=cv2.INTER_AREA)
        self.canvas[paper > 127] = printed[paper > 127, None]

    def circle(
        self, centre: np.ndarray, radius: float, z: float, angles: tuple[float, float] = (0, 2 * np.pi)
    ) -> np.ndarray:
        turn = np.linspace(*angles, 90)
        ring = np.column_stack([centre[0] + radius * np.cos(turn), centre[1] + radius * np.sin(turn), np.full(90, z)])
        return self.project(ring)

    def fill(self, outline: np.ndarray, colour: tuple[int, ...], opacity: float = 1.0) -> None:
        points = [np.round(outline * 16).astype(np.int32)]
        if opacity == 1.0:
            cv2.fillPoly(self.canvas, points, colour, cv2.LINE_8, 4)
            return
        left, top, width, height = cv2.boundingRect(points[0] // 16)
        left, top = max(0, left), max(0, top)
        patch = self.canvas[top : top + height, left : left + width]
        layer = patch.copy()
        cv2.fillPoly(layer, [points[0] - (16 * left, 16 * top)], colour, cv2.LINE_8, 4)
        cv2.addWeighted(layer, opacity, patch, 1 - opacity, 0, dst=layer)
        patch[:] = layer

    def hull(self, *rings: np.ndarray) -> np.ndarray:
        return cv2.convexHull(np.concatenate(rings).astype(np.float32)).reshape(-1, 2)

    def tube(self, centre: np.ndarray, balls: str) -> None:
        pieces, outer = self.pieces, self.pieces.tube_outer_radius
        disc, tape = pieces.foot_thickness, pieces.foot_thickness + pieces.tape_height
        foot = [self.circle(centre, pieces.foot_radius, z) for z in (0, disc)]
        self.fill(self.hull(*foot), TAPE)
        self.fill(self.hull(self.circle(centre, outer, disc), self.circle(centre, outer, tape)), TAPE)
        self.fill(self.circle(centre, pieces.tube_bore / 2, tape), (70, 70, 72))
        for index, colour in enumerate(balls):
            height = pieces.tube_floor + pieces.ball_diameter * (index + 0.5)
            self.ball(np.array([*centre, height]), pieces.ball_colours[colour])
        eye = (np.linalg.inv(self.scene.base_from_sheet) @ self.scene.base_from_camera[:, 3])[:2]
        facing = np.arctan2(*(eye - centre)[::-1])
        front = (facing - np.pi / 2, facing + np.pi / 2)
        lower, upper = (self.circle(centre, outer, z, front) for z in (disc, tape))
        self.fill(np.concatenate([lower, upper[::-1]]), TAPE)
        wall = self.hull(self.circle(centre, outer, tape), self.circle(centre, outer, pieces.tube_height))
        self.fill(wall, (200, 205, 210), 0.12)
        mouth = np.round(self.circle(centre, outer, pieces.tube_height) * 16).astype(np.int32)
        cv2.polylines(self.canvas, [mouth], True, (215, 220, 225), 2, cv2.LINE_AA, 4)

    def ball(self, centre: np.ndarray, colour: tuple[int, ...]) -> None:
        eye = (np.linalg.inv(self.scene.base_from_sheet) @ self.scene.base_from_camera[:, 3])[:3]
        sight = (centre - eye) / np.linalg.norm(centre - eye)
        side = np.cross(sight, (0, 0, 1))
        side /= np.linalg.norm(side)
        up = np.cross(side, sight)
        turn = np.linspace(0, 2 * np.pi, 60)[:, None]
        for scale, gain, lift in ((1.0, 0.75, 0.0), (0.8, 0.9, 0.1), (0.5, 1.0, 0.25)):
            radius = self.pieces.ball_diameter / 2
            rim = centre + up * lift * radius + scale * radius * (np.cos(turn) * side + np.sin(turn) * up)
            self.fill(self.project(rim), tuple(int(c * gain) for c in colour))

    def picture(self) -> np.ndarray:
        k, scene, camera = SUPERSAMPLING, self.scene, self.camera
        image = cv2.resize(self.canvas, None, fx=1 / k, fy=1 / k, interpolation=cv2.INTER_AREA).astype(np.float32)
        rows, columns = np.indices(image.shape[:2], sparse=True)
        across, down = columns / image.shape[1] - 0.5, rows / image.shape[0] - 0.5
        slope = scene.light_slope[0] * across + scene.light_slope[1] * down
        image *= (scene.light * (1 + slope)).astype(np.float32)[..., None]
        image = cv2.GaussianBlur(image, (0, 0), scene.blur)
        if camera.is_distorted:
            rays = camera.rays(np.stack(np.meshgrid(np.arange(camera.width), np.arange(camera.height)), axis=-1))
            ideal = (rays @ camera.matrix.T)[..., :2] + self.border
            image = cv2.remap(image, ideal.astype(np.float32), None, cv2.INTER_LINEAR)
        if scene.noise > 0:
            image += scene.noise * np.random.default_rng(scene.seed).standard_normal(image.shape, np.float32)
        return np.clip(np.round(image), 0, 255).astype(np.uint8)
