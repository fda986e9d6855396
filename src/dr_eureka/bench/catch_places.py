"""A ball that rests in the air at known places, and what both cameras' pictures say of where it is."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from dr_eureka.bench.report import progress
from dr_eureka.catching.ball_finder import find_balls
from dr_eureka.catching.localisation import Eye, Rig, locate_by_parallax, locate_by_size, rig_at
from dr_eureka.catching.saika import SaikaHead
from dr_eureka.catching.seen_ball import SeenBall
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.simulation.saika import SaikaWorld
from dr_eureka.simulation.saika_settings import SaikaWorldSettings

_PLACES_A_WORLD = 25  # each world has another light
_SIDES = ("left", "right")


@dataclass(frozen=True)
class Measured:
    """One place of a ball that rests in the air: true depth [m], and what both pictures gave.

    parallax_px, size_px: seen in the pictures, None where no ball was found. centre_errors_px: (column, row) of each view.
    depth_by_...: by our localisation; whole_pixels_...: by the same formulas from values rounded to whole pixels, as the
    paper's tracking processor gives them. extra: things taken for a ball that are none. find_ms: processor time a picture.
    """

    depth_m: float
    parallax_px: float | None
    size_px: float | None
    true_size_px: float
    centre_errors_px: tuple[tuple[float, float], ...]
    depth_by_parallax_m: float | None
    depth_by_size_m: float | None
    whole_pixels_parallax_m: float | None
    whole_pixels_size_m: float | None
    extra: int
    find_ms: float


def measure(
    settings: SaikaSettings,
    world_settings: SaikaWorldSettings,
    depths_m: tuple[float, float],
    count: int,
    seed: int,
    both: bool,
) -> list[Measured]:
    """Let a ball rest at drawn places seen whole by the left or by both cameras, and measure it in rendered pictures."""
    rng, found = np.random.default_rng([seed, 2]), []
    rig, label = rig_at(settings, SaikaHead(settings)), "catch, parallax" if both else "catch, size"
    world: SaikaWorld | None = None
    for index in progress(range(count), count, label):
        if index % _PLACES_A_WORLD == 0:
            if world is not None:
                world.close()
            world = SaikaWorld(settings, seed * 1000 + index, rendered=True, world=world_settings)
        place = draw_place(settings, rig, depths_m, both, rng)
        world.drop_ball(place)
        pictures = {side: world.capture(side)[1] for side in (_SIDES if both else _SIDES[:1])}
        begin = time.process_time()
        views = {side: find_balls(picture, settings) for side, picture in pictures.items()}
        find_ms = 1000.0 * (time.process_time() - begin) / len(views)
        found.append(_judge(settings, rig, place, views, find_ms))
    if world is not None:
        world.close()
    return found


def draw_place(
    settings: SaikaSettings, rig: Rig, depths_m: tuple[float, float], both: bool, rng: np.random.Generator
) -> np.ndarray:
    """Return a place (3,) [m] in base at a drawn depth, where the ball is whole in the left view or in both."""
    while True:
        depth = rng.uniform(*depths_m)
        margin = 0.55 * settings.ball_diameter_m * settings.cameras.focal_px / depth + 2.0
        size = np.array([settings.cameras.width, settings.cameras.height]) - 1.0
        if np.any(size <= 2.0 * margin):
            continue
        place = _in_base(rig.left, depth, rng.uniform(margin, size - margin))
        pixel = pixel_of(rig.right, place)
        if not both or np.all((pixel > margin) & (pixel < size - margin)):
            return place


def _judge(
    settings: SaikaSettings, rig: Rig, place: np.ndarray, views: dict[str, tuple[SeenBall, ...]], find_ms: float
) -> Measured:
    eyes = {"left": rig.left, "right": rig.right}
    depth = float(in_camera(rig.left, place)[2])
    true_size = settings.ball_diameter_m * settings.cameras.focal_px / depth
    nearest, errors = {}, []
    for side, balls in views.items():
        off = [np.array(ball.centre_px) - pixel_of(eyes[side], place) for ball in balls]
        if balls:
            index = int(np.argmin(np.linalg.norm(off, axis=1)))
            nearest[side] = balls[index]
            errors.append(tuple(off[index].tolist()))
    extra = sum(max(len(balls) - 1, 0) for balls in views.values())
    left, right = nearest.get("left"), nearest.get("right")
    by_size = by_parallax = whole_size = whole_parallax = parallax = None
    if left is not None:
        by_size = float(in_camera(rig.left, locate_by_size(left.centre_px, left.diameter_px, rig.left)[0])[2])
        whole_size = settings.ball_diameter_m * settings.cameras.focal_px / round(left.diameter_px)
    if left is not None and right is not None:
        by_parallax = float(in_camera(rig.left, locate_by_parallax(left.centre_px, right.centre_px, rig)[0])[2])
        parallax = left.centre_px[0] - right.centre_px[0]
        whole = round(left.centre_px[0]) - round(right.centre_px[0])
        whole_parallax = settings.cameras.baseline_m * settings.cameras.focal_px / whole
    size = None if left is None else left.diameter_px
    return Measured(
        depth, parallax, size, true_size, tuple(errors), by_parallax, by_size, whole_parallax, whole_size, extra, find_ms
    )


def _in_base(eye: Eye, depth: float, pixel: np.ndarray) -> np.ndarray:
    return eye.base_from_camera[:3, :3] @ (depth * eye.camera.rays(pixel)) + eye.base_from_camera[:3, 3]


def in_camera(eye: Eye, place: np.ndarray) -> np.ndarray:
    """Return a place (3,) [m] of base in a camera's optical frame."""
    return eye.base_from_camera[:3, :3].T @ (place - eye.base_from_camera[:3, 3])


def pixel_of(eye: Eye, place: np.ndarray) -> np.ndarray:
    """Return the pixel (2,) in which a camera sees a place (3,) [m] of base."""
    return eye.camera.project(in_camera(eye, place))
