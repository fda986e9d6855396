"""A simulated robot that shows its hands to its camera, in one process, without ROS."""

from __future__ import annotations

from dataclasses import replace
from typing import Mapping

from dr_eureka.behaviour.arm_calibration import View
from dr_eureka.kinematics.arms import base_from_camera
from dr_eureka.simulation.settings import WorldSettings
from dr_eureka.simulation.world import World
from dr_eureka.vision.camera import CameraModel

# On the sheet's far edge, where a person puts the tubes to have them out of the way.
TUBES_ASIDE = {"left": (0.1, 0.11), "center": (0.1, 0.0), "right": (0.1, -0.11)}
_REST_RAD = 1e-5
_REST_CYCLES = 10
_MOST_CYCLES = 1000


def imperfect(settings: WorldSettings, robot: int) -> WorldSettings:
    """Return a world's settings with the hidden arm errors of a robot."""
    return replace(settings, arm_errors=replace(settings.arm_errors, robot=robot))


def tubes_aside(settings: WorldSettings) -> WorldSettings:
    """Return a world's settings with the tubes out of the hands' way, and coarser physics: nothing is to be touched."""
    physics = replace(settings.physics, steps_per_cycle=2)
    return replace(settings, physics=physics, layout=replace(settings.layout, tubes_in_sheet=TUBES_ASIDE))


class SimulatedRobot:
    """A `CalibrationRobot` straight into a simulated world: as quick as its servos are, since nothing is in the way."""

    def __init__(self, world: World, camera: CameraModel):
        self._world = world
        self._camera = camera

    def move(self, goals: Mapping[str, float]) -> None:
        """Bring joints to positions [rad] and wait until nothing moves."""
        self._world.set_joint_goals(goals)
        still, last = 0, self._world.joint_positions()
        for _ in range(_MOST_CYCLES):
            self._world.advance_cycle()
            now = self._world.joint_positions()
            still = still + 1 if max(abs(now[name] - last[name]) for name in now) < _REST_RAD else 0
            last = now
            if still >= _REST_CYCLES:
                return

    def look(self) -> View:
        """Take a picture."""
        joints = self._world.joint_positions()
        return View(self._world.camera_image(), self._camera, base_from_camera(joints), joints)
