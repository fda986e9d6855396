"""Saika's simulated world: the robot, its ball and its basket, moved by contact, gravity and servos alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Sequence

import numpy as np
import pybullet
from pybullet_utils.bullet_client import BulletClient

from dr_eureka.catching.saika import JOINTS, NECK, SaikaHead
from dr_eureka.catching.seen_ball import SeenBall
from dr_eureka.catching.settings import SaikaSettings
from dr_eureka.simulation.ball_mesh import write_ball
from dr_eureka.simulation.bodies import GRAVITY, scratch_folder
from dr_eureka.simulation.quiet import quiet_stdout
from dr_eureka.simulation.rendering import open_renderer
from dr_eureka.simulation.saika_cameras import AnalyticCamera, RenderedCamera
from dr_eureka.simulation.saika_robot import SimulatedSaika
from dr_eureka.simulation.saika_settings import SaikaWorldSettings
from dr_eureka.simulation.settings import SimulationError

FLYING, CAUGHT, MISSED = "FLYING", "CAUGHT", "MISSED"
_AIR_KG_M3 = 1.2
_FLOOR_M = (8.0, 8.0, 0.2)
# What is only seen: centre relative to the floor under the robot and size [m], colour. Wall, table, and a person who throws.
_ROOM = (
    ((0.0, 4.0, 1.4), (8.0, 0.05, 2.8), (0.78, 0.77, 0.72, 1.0)),
    ((0.0, 2.0, 2.9), (8.0, 8.0, 0.05), (0.85, 0.85, 0.84, 1.0)),
    ((1.3, 3.2, 0.36), (1.2, 0.7, 0.72), (0.52, 0.40, 0.28, 1.0)),
    ((-0.4, 2.9, 1.15), (0.44, 0.24, 0.60), (0.20, 0.28, 0.50, 1.0)),
    ((-0.4, 2.9, 0.42), (0.34, 0.22, 0.84), (0.30, 0.29, 0.28, 1.0)),
    ((-0.4, 2.88, 1.58), (0.16, 0.20, 0.24), (0.82, 0.62, 0.50, 1.0)),
)
_FLOOR_COLOUR = (0.45, 0.46, 0.48, 1.0)


@dataclass(frozen=True, eq=False)
class CatchVerdict:
    """What the referee sees: FLYING, CAUGHT or MISSED; the ball's true middle (3,) [m] and velocity (3,) [m/s] in base."""

    result: str
    ball_position: np.ndarray
    ball_velocity: np.ndarray


class SaikaWorld:
    """One catch's world; frames and units as in `dr_eureka.catching`, joints in the order of `catching.saika.JOINTS`.

    Equal arguments and calls give equal worlds. Time begins at 0 with all joints at `start` and no ball.

    Args:
        settings: the robot.
        seed: draws when the cameras take pictures, light and noise.
        rendered: whether there are pictures (`capture`); without, the world is made faster and only `observe` works.
        start: joints (12,) [rad], default all 0: arms hanging, looking ahead.
        world: physics, sensors, referee; the package's by default.
    """

    def __init__(
        self,
        settings: SaikaSettings,
        seed: int,
        rendered: bool = False,
        start: Sequence[float] | None = None,
        world: SaikaWorldSettings | None = None,
    ) -> None:
        self._settings, self._world = settings, world or SaikaWorldSettings.load()
        self._steps, self._rest_since = 0, math.inf
        self._head = SaikaHead(settings)
        self._rng = np.random.default_rng([seed, 1])
        self._first_exposure = float(self._rng.uniform(0.0, settings.cameras.period_s))
        with quiet_stdout():
            self._client = BulletClient(pybullet.DIRECT)
            renderer = open_renderer(self._client, self._world.sensor.renderer) if rendered else None
        self._client.setGravity(0, 0, -GRAVITY)
        physics = self._world.physics
        self._client.setPhysicsEngineParameter(
            fixedTimeStep=physics.step_s, numSubSteps=0, numSolverIterations=physics.solver_iterations,
            deterministicOverlappingPairs=1, restitutionVelocityThreshold=0.05,
        )
        self._robot = SimulatedSaika(self._client, settings, physics, np.zeros(len(JOINTS)) if start is None else start)
        self._add_room(rendered)
        self._balls: list[int] = []
        sensor = self._world.sensor
        self._analytic = AnalyticCamera(settings, sensor, self._rng)
        self._rendered = RenderedCamera(self._client, renderer, settings, sensor, self._rng) if rendered else None

    def _add_room(self, rendered: bool) -> None:
        client, floor = self._client, -self._settings.body.floor_below_shoulders_m
        shape = client.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.5 * length for length in _FLOOR_M])
        seen = self._seen_box(_FLOOR_M, _FLOOR_COLOUR)
        self._floor = client.createMultiBody(0, shape, seen, basePosition=(0.0, 1.0, floor - 0.5 * _FLOOR_M[2]))
        client.changeDynamics(self._floor, -1, restitution=self._world.physics.basket_restitution)
        for centre, size, colour in _ROOM if rendered else ():
            seen = self._seen_box(size, colour)
            client.createMultiBody(0, -1, seen, basePosition=(centre[0], centre[1], centre[2] + floor))

    def _seen_box(self, size: Sequence[float], colour: Sequence[float]) -> int:
        half = [0.5 * length for length in size]
        return self._client.createVisualShape(
            pybullet.GEOM_BOX, halfExtents=half, rgbaColor=colour, specularColor=(0.05, 0.05, 0.05)
        )

    @property
    def time_s(self) -> float:
        """Simulated time since the start [s]."""
        return self._steps * self._world.physics.step_s

    def next_exposure(self, side: str) -> float:
        """Return when [s] a camera takes its next picture; both take one a period, the right one `lag_s` later."""
        cameras = self._settings.cameras
        first = self._first_exposure + (cameras.lag_s if side == "right" else 0.0)
        # The physics' steps are the world's shortest time: what is due within half a step is being taken now.
        done = math.floor((self.time_s + 0.5 * self._world.physics.step_s - first) / cameras.period_s)
        return first + max(done + 1, 0) * cameras.period_s

    def drop_ball(self, position: Sequence[float], ball: int = 0) -> None:
        """Let a ball go at rest, its middle at (3,) [m] in base."""
        self.throw_ball(position, (0.0, 0.0, 0.0), ball)

    def throw_ball(self, position: Sequence[float], velocity: Sequence[float], ball: int = 0) -> None:
        """Let a ball go at (3,) [m] with (3,) [m/s], in base. A ball of a number that was not yet there is a further one.

        Raises SimulationError for values that are not finite or a number beyond the next free one.
        """
        if not np.all(np.isfinite([*position, *velocity])) or not 0 <= ball <= len(self._balls):
            what = f"ball {ball} at {list(position)} with {list(velocity)}"
            raise SimulationError(f"{what}; expected a number up to {len(self._balls)}, finite values")
        if ball == len(self._balls):
            self._balls.append(self._make_ball())
        self._rest_since = math.inf
        self._client.resetBasePositionAndOrientation(self._balls[ball], list(map(float, position)), (0.0, 0.0, 0.0, 1.0))
        self._client.resetBaseVelocity(self._balls[ball], list(map(float, velocity)), (0.0, 0.0, 0.0))

    def _make_ball(self) -> int:
        client, physics, radius = self._client, self._world.physics, 0.5 * self._settings.ball_diameter_m
        seen = -1
        if self._rendered is not None:
            mesh = scratch_folder() / f"ball_{radius:.6f}.obj"
            write_ball(mesh, radius)
            colour = [*np.divide(self._settings.ball_finder.ball_rgb, 255.0), 1.0]
            seen = client.createVisualShape(
                pybullet.GEOM_MESH, fileName=str(mesh), rgbaColor=colour, specularColor=(0.3, 0.3, 0.3)
            )
        shape = client.createCollisionShape(pybullet.GEOM_SPHERE, radius=radius)
        ball = client.createMultiBody(physics.ball_mass_kg, shape, seen)
        # Bullet multiplies a rolling friction by the other body's sliding friction.
        rolling = physics.rolling_resistance_m / max(physics.basket_friction, 1e-6)
        client.changeDynamics(
            ball, -1, restitution=physics.ball_restitution, lateralFriction=physics.ball_friction, rollingFriction=rolling,
            linearDamping=0, angularDamping=0,
        )
        return ball

    def command(self, joints: Sequence[float]) -> None:
        """Set goals of the joints (12,) [rad]; each goes there at its largest speed, within its limits.

        Raises SimulationError for another number of joints, or values that are not finite.
        """
        self._robot.command(joints)

    def aim_cameras(self, left_pan_tilt: Sequence[float], right_pan_tilt: Sequence[float]) -> None:
        """Set goals of each camera's own pan and tilt (2,) [rad]."""
        self._robot.aim_cameras(left_pan_tilt, right_pan_tilt)

    def joints(self) -> np.ndarray:
        """Return the joints' present angles (12,) [rad]."""
        return self._robot.joints()

    def camera_pan_tilt(self, side: str) -> np.ndarray:
        """Return a camera's own present pan and tilt (2,) [rad]."""
        return self._robot.camera_pan_tilt(side)

    def step(self, dt: float) -> None:
        """Advance by dt [s], rounded to whole steps of the physics."""
        physics = self._world.physics
        for _ in range(round(dt / physics.step_s)):
            self._robot.drive()
            if physics.drag_coefficient > 0.0:
                self._drag()
            self._client.stepSimulation()
            self._steps += 1
        self._watch()

    def _drag(self) -> None:
        area = math.pi * (0.5 * self._settings.ball_diameter_m) ** 2
        for ball in self._balls:
            velocity = np.array(self._client.getBaseVelocity(ball)[0])
            force = -0.5 * _AIR_KG_M3 * self._world.physics.drag_coefficient * area * np.linalg.norm(velocity) * velocity
            centre = self._client.getBasePositionAndOrientation(ball)[0]
            self._client.applyExternalForce(ball, -1, force.tolist(), centre, pybullet.WORLD_FRAME)

    def capture(self, side: str) -> tuple[float, np.ndarray]:
        """Return when [s] and what a camera sees now, (height, width, 3) uint8 RGB. Raises SimulationError: no pictures."""
        return self.time_s, self.picture_from(self._base_from_camera(side))

    def picture_from(self, base_from_camera: np.ndarray) -> np.ndarray:
        """Return what a camera like the head's would see from any pose (4, 4), for people; raises as `capture` does."""
        if self._rendered is None:
            raise SimulationError("camera: this world was made without pictures; expected SaikaWorld(..., rendered=True)")
        return self._rendered.picture(base_from_camera)

    def observe(self, side: str) -> tuple[float, tuple[SeenBall, ...]]:
        """Return when [s] and which balls a camera sees now, as the ball finder would find them, by the analytic camera."""
        places = [self._ball_state(ball)[0] for ball in self._balls]
        return self.time_s, self._analytic.balls(self._base_from_camera(side), places)

    def _base_from_camera(self, side: str) -> np.ndarray:
        return self._head.base_from_camera(side, self.camera_pan_tilt(side), self.joints()[NECK])

    def _ball_state(self, ball: int) -> tuple[np.ndarray, np.ndarray]:
        return (
            np.array(self._client.getBasePositionAndOrientation(ball)[0]), np.array(self._client.getBaseVelocity(ball)[0])
        )

    def referee(self) -> CatchVerdict:
        """Judge ball 0 as it is now; for people, tests and benchmarks only. Raises SimulationError before there is a ball.

        CAUGHT: it came to rest inside the basket and is still there. MISSED: it touches the floor, or is below it.
        """
        if not self._balls:
            raise SimulationError("referee: no ball was let go; expected drop_ball or throw_ball before")
        position, velocity = self._ball_state(self._balls[0])
        if self._caught():
            return CatchVerdict(CAUGHT, position, velocity)
        on_floor = bool(self._client.getContactPoints(self._balls[0], self._floor))
        below_floor = position[2] < -self._settings.body.floor_below_shoulders_m
        return CatchVerdict(MISSED if on_floor or below_floor else FLYING, position, velocity)

    def _watch(self) -> None:
        """Note since when ball 0 rests in the basket."""
        if not self._balls:
            return
        position, velocity = self._ball_state(self._balls[0])
        base_from_hand, hand_velocity = self._robot.hand_motion()
        x, y, z = base_from_hand[:3, :3].T @ (position - base_from_hand[:3, 3])
        inside = math.hypot(x, y) < 0.5 * self._settings.basket_diameter_m and -self._settings.body.basket_depth_m < z < 0.0
        slow = float(np.linalg.norm(velocity - hand_velocity)) < self._world.referee.rest_speed_m_s
        # Once caught it stays so while it is inside: when the basket moves on, the ball may roll in it.
        if inside and (slow or self._caught()):
            self._rest_since = min(self._rest_since, self.time_s)
        else:
            self._rest_since = math.inf

    def _caught(self) -> bool:
        return self.time_s - self._rest_since >= self._world.referee.rest_s

    def close(self) -> None:
        """Free the world's physics and renderer; a second call does nothing."""
        if self._client is not None:
            with quiet_stdout():
                self._client.disconnect()
            self._client = None
