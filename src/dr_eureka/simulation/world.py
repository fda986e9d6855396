"""The simulated world: robot, table, sheet, tubes and balls as rigid bodies that move by contact alone."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Mapping

import numpy as np
import pybullet

from dr_eureka.game.state import START, TUBES, State
from dr_eureka.pieces import Pieces, load_pieces
from dr_eureka.simulation.arm_errors import draw_arm_errors
from dr_eureka.simulation.bodies import BodyMaker, scratch_folder, set_up_physics
from dr_eureka.simulation.placement import draw_placement
from dr_eureka.simulation.referee import Verdict, judge
from dr_eureka.simulation.rendering import HeadCamera, SceneTextures
from dr_eureka.simulation.robot import SimulatedRobot
from dr_eureka.simulation.settings import CameraSettings, SimulationError, WorldSettings
from dr_eureka.simulation.stage import Stage

# Before time 0 the balls fall the last half millimetre into place; a stack is at rest below this speed.
SETTLE_SECONDS = 2.0
SETTLED_SPEED = 0.003
DROP_GAP = 0.0005
TABLE_COLOUR = (0.52, 0.40, 0.28, 1.0)
BOARD_COLOUR = (0.66, 0.60, 0.52, 1.0)
# What is seen beyond the table: centre and size [m], colour. Only seen, never touched.
ROOM = (((1.0, 0.0, -0.01), (6.0, 6.0, 0.02), (0.45, 0.46, 0.48, 1.0)),
        ((2.6, 0.0, 1.4), (0.02, 6.0, 2.8), (0.78, 0.77, 0.72, 1.0)))


@dataclass(frozen=True)
class Snapshot:
    """A moment of one world: Bullet's number for it, the servos' goals, the control cycles until then."""

    bullet_state: int
    servos: tuple[np.ndarray, ...]
    cycles: int


class World:
    """One game's world, stepped one control cycle at a time.

    Equal settings, seed and commands give equal states. Balls start at rest inside the tubes; after that nothing is
    moved, held or attached except by contact and the robot's motors. Frames: everything in `base`, SI units.

    Args:
        settings: physics, layout and scatter.
        seed: draws placement, materials, light, card place and sensor noise.
        start: which balls are in which tube at time 0.
        textures: pictures of the sheet and of a card, if any is to be seen.
        pieces: sizes of the game's pieces; the package's by default.
        camera: the head camera; without one, the world has no pictures and is made faster.
        stage: cleared and built upon, its owner closes it; by default one of the world's own. Worlds that share one must
            not live at the same time.
    """

    def __init__(self, settings: WorldSettings, seed: int, start: State = START,
                 textures: SceneTextures = SceneTextures(), pieces: Pieces | None = None,
                 camera: CameraSettings | None = None, stage: Stage | None = None) -> None:
        self._settings = settings
        self._pieces = pieces or load_pieces()
        self._cycles = 0
        self._own_stage = None if stage else Stage(camera.renderer if camera else None)
        stage = stage or self._own_stage
        client, layout = stage.clear(), settings.layout
        self._client = client
        set_up_physics(client, settings.physics, settings.cycle)
        self._robot = SimulatedRobot(client, settings.servos, settings.physics, settings.cycle, layout.start_joints,
                                     draw_arm_errors(settings.arm_errors))
        self.placement = draw_placement(settings, seed, self._robot.link_pose("cam_link")[:3, 3])
        self._bodies = BodyMaker(client, settings.physics, self._pieces, self.placement.friction,
                                 self.placement.restitution, camera.wall_tint if camera else 1.0)
        self._furniture = {
            "table": self._bodies.furniture(layout.table_centre, layout.table_size, TABLE_COLOUR),
            "board": self._bodies.furniture(layout.board_centre, layout.board_size, BOARD_COLOUR)}
        self._tubes = {name: self._bodies.tube(self.placement.tubes[name], pybullet.getQuaternionFromEuler(
            (0.0, 0.0, self.placement.tube_yaws[name]))) for name in TUBES}
        self._balls = [ball for name in TUBES for ball in self._fill(name, start.tube(name))]
        self._settle()
        self._camera = None
        if camera:
            for block in ROOM:
                self._bodies.scenery(*block)
            self._camera = HeadCamera(client, stage.renderer, self._robot, camera, self._pieces, self.placement,
                                      tuple(self._tubes.values()), textures, scratch_folder(), seed)

    def _fill(self, name: str, colours: str) -> list[tuple[str, int]]:
        """Stack balls in a tube, each a little above where it will rest; return colour and body of each."""
        diameter = self._pieces.ball_diameter
        lowest = self._pieces.tube_floor + self._pieces.ball_radius + DROP_GAP
        return [(colour, self._bodies.ball(
            self.placement.tubes[name] + (0.0, 0.0, lowest + index * (diameter + DROP_GAP)), colour))
            for index, colour in enumerate(colours)]

    def _settle(self) -> None:
        steps = self._settings.physics.steps_per_cycle
        for _ in range(int(SETTLE_SECONDS / self._settings.cycle)):
            for _ in range(steps):
                self._robot.drive(1.0)
                self._client.stepSimulation()
            if all(np.linalg.norm(self._client.getBaseVelocity(ball)[0]) < SETTLED_SPEED for _, ball in self._balls):
                return

    @property
    def time_s(self) -> float:
        """Simulated time since the start [s]."""
        return self._cycles * self._settings.cycle

    def advance_cycle(self) -> None:
        """Advance the world by one control cycle."""
        steps = self._settings.physics.steps_per_cycle
        self._robot.begin_cycle()
        for step in range(1, steps + 1):
            self._robot.drive(step / steps)
            self._client.stepSimulation()
        self._cycles += 1

    def set_joint_goals(self, goals: Mapping[str, float]) -> None:
        """Set joint goals [rad] by name; they act from the next cycle on, within speed, torque and joint limits.

        Raises:
            SimulationError: an unknown joint or a value that is not finite.
        """
        self._robot.set_goals(goals)

    def joint_positions(self) -> dict[str, float]:
        """Return the present angle [rad] of the manager's 31 joints."""
        return self._robot.positions()

    def joint_goals(self) -> dict[str, float]:
        """Return the commanded angle [rad] of the manager's 31 joints."""
        return self._robot.goals()

    def motor_torques(self) -> dict[str, float]:
        """Return the torque [N m] of each simulated joint's motor in the last physics step."""
        return self._robot.torques()

    def link_pose(self, link: str) -> np.ndarray:
        """Return the true (4, 4) pose of a robot link in `base`."""
        return self._robot.link_pose(link)

    def tube_pose(self, name: str) -> np.ndarray:
        """Return the true (4, 4) pose of a tube in `base`: origin at the underside of its foot, z toward its mouth."""
        return self._bodies.tube_pose(self._tubes[name])

    def ball_positions(self) -> list[tuple[str, np.ndarray]]:
        """Return each ball's colour letter and true centre in `base` [m]."""
        return [(colour, np.array(self._client.getBasePositionAndOrientation(ball)[0])) for colour, ball in self._balls]

    def put_ball(self, index: int, centre: np.ndarray) -> None:
        """Put the ball that `ball_positions` lists at `index` at rest with its centre (3,) in `base` [m].

        For `faults` and for what trials begin with; in a game nothing else moves a ball but contact.
        """
        ball = self._balls[index][1]
        self._client.resetBasePositionAndOrientation(ball, np.asarray(centre).tolist(), (0.0, 0.0, 0.0, 1.0))
        self._client.resetBaseVelocity(ball, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    def contacts(self) -> set[tuple[str, str]]:
        """Return the pairs of things that touch one another now, by name: robot's links, tubes, table, board, balls."""
        pairs = set()
        for contact in self._client.getContactPoints():
            if contact[8] <= 0.0:
                pairs.add(tuple(sorted((self._name(contact[1], contact[3]), self._name(contact[2], contact[4])))))
        return pairs

    def _name(self, body: int, link: int) -> str:
        if body == self._robot.body:
            return next(name for name, index in self._robot.link_index.items() if index == link)
        named = {**{b: f"tube_{n}" for n, b in self._tubes.items()}, **{b: n for n, b in self._furniture.items()}}
        return named.get(body, "ball")

    def referee(self) -> Verdict:
        """Judge the world as it is now."""
        return judge({name: self.tube_pose(name) for name in TUBES}, self.ball_positions(),
                     self._settings.layout.sheet_centre[2], self._pieces, self._settings.referee)

    def camera_image(self) -> np.ndarray:
        """Render the head camera's view as (height, width, 3) uint8 RGB; raises SimulationError without a camera."""
        return self._need_camera().image()

    def picture_from(self, base_from_camera: np.ndarray) -> np.ndarray:
        """Render what a camera like the head's sees from elsewhere, (4, 4) looking along z, for people who watch."""
        return self._need_camera().image(base_from_camera)

    def show_card(self, picture: np.ndarray | None) -> None:
        """Hold up a card with this (n, n, 3) uint8 RGB picture, white border included, or take it away (None)."""
        self._need_camera().show_card(picture)

    def _need_camera(self) -> HeadCamera:
        if self._camera is None:
            raise SimulationError("camera: this world was made without one; expected World(..., camera=...)")
        return self._camera

    def remember(self) -> Snapshot:
        """Return all that moves as it is now, for `go_back`."""
        return Snapshot(self._client.saveState(), self._robot.servo_state(), self._cycles)

    def go_back(self, snapshot: Snapshot) -> None:
        """Let everything be as it was when it was remembered, time included; for trials that share a beginning.

        A hand that held a tube then, and has opened since, holds it again by contacts that are found anew: up to 4 mm otherwise.
        """
        self._client.restoreState(snapshot.bullet_state)
        self._robot.set_servo_state(snapshot.servos)
        self._cycles = snapshot.cycles

    def close(self) -> None:
        """Free the world's physics and renderer, unless they are another's; a second call does nothing."""
        if self._own_stage is not None:
            self._own_stage.close()
