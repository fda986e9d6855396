"""Tubes, balls and furniture as rigid bodies, with the materials that the pours were tried with."""
from __future__ import annotations

import tempfile
from functools import lru_cache
from math import sqrt
from pathlib import Path
from typing import Sequence

import numpy as np
import pybullet
from pybullet_utils.bullet_client import BulletClient

from dr_eureka.pieces import Pieces
from dr_eureka.simulation.settings import PhysicsSettings, SimulationError
from dr_eureka.simulation.tube_model import collision_shape_count, mass_properties, write_tube_urdf

GRAVITY = 9.81
UPRIGHT = (0.0, 0.0, 0.0, 1.0)


@lru_cache(maxsize=1)
def _scratch() -> tempfile.TemporaryDirectory:
    return tempfile.TemporaryDirectory(prefix="dr_eureka_")


def scratch_folder() -> Path:
    """Return this process's folder for files that Bullet reads, gone when the process ends.

    PyBullet remembers files by name in each process, so no two processes may share them.
    """
    return Path(_scratch().name)


def set_up_physics(client: BulletClient, physics: PhysicsSettings, cycle: float) -> None:
    """Set gravity and the solver; one physics step is `cycle` [s] / steps_per_cycle."""
    client.setGravity(0, 0, -GRAVITY)
    client.setPhysicsEngineParameter(
        fixedTimeStep=cycle / physics.steps_per_cycle, numSubSteps=0, numSolverIterations=physics.solver_iterations,
        enableConeFriction=1, deterministicOverlappingPairs=1,
        restitutionVelocityThreshold=physics.restitution_velocity_threshold,
        contactBreakingThreshold=physics.contact_breaking_threshold)


class BodyMaker:
    """Makes one world's bodies.

    Args:
        friction, restitution: factors of this world's materials: by how much ball on tube differs from the settings' product.
        wall_tint: 0..1, how much of a tube's wall one sees.
    """

    def __init__(self, client: BulletClient, physics: PhysicsSettings, pieces: Pieces, friction: float = 1.0,
                 restitution: float = 1.0, wall_tint: float = 1.0) -> None:
        self._client = client
        self._physics = physics
        self._pieces = pieces
        # Bullet multiplies the values of two touching bodies: so the product for two pieces varies by just these factors.
        self._friction = sqrt(friction)
        self._restitution = sqrt(restitution)
        self._tube_com, _ = mass_properties(pieces, physics.tube_mass)
        self._tube_file = scratch_folder() / "tube.urdf"
        write_tube_urdf(self._tube_file, pieces, physics.tube_mass, physics.wall_boxes, wall_tint)

    def scenery(self, centre: Sequence[float], size: Sequence[float], colour: Sequence[float]) -> int:
        """Add a box [m] that is only seen, never touched."""
        return self._client.createMultiBody(0, -1, self._seen_box(size, colour), basePosition=centre)

    def furniture(self, centre: Sequence[float], size: Sequence[float], colour: Sequence[float]) -> int:
        """Add a box [m] that never moves."""
        shape = self._client.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[length / 2 for length in size])
        block = self._client.createMultiBody(0, shape, self._seen_box(size, colour), basePosition=centre)
        self._client.changeDynamics(block, -1, lateralFriction=self._physics.table_friction * self._friction,
                                    restitution=self._physics.table_restitution * self._restitution)
        return block

    def tube(self, foot: Sequence[float], orientation: Sequence[float] = UPRIGHT, fixed: bool = False) -> int:
        """Add a tube with the underside of its foot at `foot` [m], `orientation` x y z w; a fixed one never moves."""
        tube = self._client.loadURDF(str(self._tube_file), foot, orientation, useFixedBase=fixed,
                                     flags=pybullet.URDF_USE_INERTIA_FROM_FILE)
        found = len(self._client.getCollisionShapeData(tube, -1))
        expected = collision_shape_count(self._physics.wall_boxes)
        if found != expected:
            raise SimulationError(f"tube: PyBullet made {found} collision shapes; expected {expected}")
        self._set_piece_material(tube, 0.0)
        return tube

    def ball(self, centre: Sequence[float], colour: str) -> int:
        """Add a ball at `centre` [m]; `colour` is its letter."""
        radius = self._pieces.ball_radius
        shape = self._client.createCollisionShape(pybullet.GEOM_SPHERE, radius=radius)
        seen = self._client.createVisualShape(
            pybullet.GEOM_SPHERE, radius=radius, specularColor=(0.3, 0.3, 0.3),
            rgbaColor=[*np.divide(self._pieces.ball_colours[colour], 255.0), 1.0])
        ball = self._client.createMultiBody(self._physics.ball_mass, shape, seen, basePosition=centre)
        # Bullet multiplies a rolling friction by the other body's sliding friction.
        self._set_piece_material(ball, self._physics.rolling_resistance * radius
                                 / (self._physics.piece_friction * self._friction))
        return ball

    def tube_pose(self, tube: int) -> np.ndarray:
        """Return the (4, 4) pose of a tube: origin at the underside of its foot, z toward its mouth [m]."""
        position, orientation = self._client.getBasePositionAndOrientation(tube)
        pose = np.eye(4)
        pose[:3, :3] = np.reshape(self._client.getMatrixFromQuaternion(orientation), (3, 3))
        # Bullet reports the centre of mass.
        pose[:3, 3] = np.asarray(position) - self._tube_com * pose[:3, 2]
        return pose

    def _seen_box(self, size: Sequence[float], colour: Sequence[float]) -> int:
        return self._client.createVisualShape(pybullet.GEOM_BOX, halfExtents=[length / 2 for length in size],
                                              rgbaColor=colour, specularColor=(0.1, 0.1, 0.1))

    def _set_piece_material(self, body: int, rolling: float) -> None:
        self._client.changeDynamics(
            body, -1, linearDamping=0, angularDamping=0, rollingFriction=rolling,
            lateralFriction=self._physics.piece_friction * self._friction,
            restitution=self._physics.piece_restitution * self._restitution)
