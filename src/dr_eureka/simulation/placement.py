"""Where things stand in one simulated world, drawn from its seed."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dr_eureka.game.state import TUBES
from dr_eureka.simulation.settings import SimulationError, WorldSettings


@dataclass(frozen=True, eq=False)
class Placement:
    """One world's draw.

    `base_from_sheet` (4, 4) [m]; `tubes` name -> foot (3,) in base [m]; `tube_yaws` name -> rad; `base_from_card` (4, 4),
    the card's picture seen from its +z, x to the picture's right, y up; `light_direction` (3,) toward the lamp, `light`
    its brightness (1 nominal); `friction`, `restitution` factors of the materials.
    """

    base_from_sheet: np.ndarray
    tubes: dict[str, np.ndarray]
    tube_yaws: dict[str, float]
    base_from_card: np.ndarray
    light_direction: np.ndarray
    light: float
    friction: float
    restitution: float


def draw_placement(settings: WorldSettings, seed: int, camera_position: np.ndarray) -> Placement:
    """Draw a world's placement; equal seeds give equal worlds.

    `camera_position` (3,) in base [m] is what the card faces.

    Raises:
        SimulationError: the layout places other tubes than the game's.
    """
    layout, scatter = settings.layout, settings.scatter
    if set(layout.tubes_in_sheet) != set(TUBES):
        raise SimulationError(f"layout tubes_in_sheet: has {', '.join(layout.tubes_in_sheet)}; expected {', '.join(TUBES)}")
    rng = np.random.default_rng(seed)

    def spread(limit: float) -> float:
        return float(rng.uniform(-limit, limit))

    yaw = spread(scatter.sheet_yaw)
    base_from_sheet = np.eye(4)
    base_from_sheet[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    base_from_sheet[:3, 3] = np.add(layout.sheet_centre, (spread(scatter.sheet), spread(scatter.sheet), 0.0))
    tubes, tube_yaws = {}, {}
    for name in TUBES:
        x, y = layout.tubes_in_sheet[name]
        in_sheet = np.array([x + spread(scatter.tubes), y + spread(scatter.tubes), 0.0, 1.0])
        tubes[name] = (base_from_sheet @ in_sheet)[:3]
        tube_yaws[name] = spread(np.pi)
    card_position = np.array([rng.uniform(*limits) for limits in (layout.card_x, layout.card_y, layout.card_z)])
    base_from_card = np.eye(4)
    facing = _facing(camera_position - card_position)
    tilt = _rotation((1.0, 0.0, 0.0), spread(scatter.card_tilt)) @ _rotation((0.0, 1.0, 0.0), spread(scatter.card_tilt))
    base_from_card[:3, :3] = facing @ tilt @ _rotation((0.0, 0.0, 1.0), spread(scatter.card_turn))
    base_from_card[:3, 3] = card_position
    lamp = np.array([spread(scatter.light), spread(scatter.light), 0.0]) * 2 + (-0.3, 0.2, 1.0)
    return Placement(base_from_sheet, tubes, tube_yaws, base_from_card, lamp / np.linalg.norm(lamp),
                     light=1.0 + spread(scatter.light), friction=1.0 + spread(scatter.materials),
                     restitution=1.0 + spread(scatter.materials))


def _facing(direction: np.ndarray) -> np.ndarray:
    """Return the rotation whose z points along `direction` and whose x is level."""
    z = direction / np.linalg.norm(direction)
    x = np.cross((0.0, 0.0, 1.0), z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _rotation(axis: tuple[float, float, float], angle: float) -> np.ndarray:
    """Return the rotation by `angle` [rad] about one of the coordinate axes (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
