"""The control engine and the simulated world in one process, without ROS: as fast as the machine allows, repeatable by seed."""

from __future__ import annotations

from typing import Callable, Mapping, Sequence

from dr_eureka.control.codes import EngineState
from dr_eureka.control.engine import ControlEngine, EngineStatus
from dr_eureka.game.actions import Action
from dr_eureka.simulation.world import World


class WorldPort:
    """A RobotPort straight into a simulated world."""

    def __init__(self, world: World):
        self._world = world

    def read(self) -> tuple[float, Mapping[str, float]]:
        """Return the simulated time [s] and joint positions [rad]."""
        return self._world.time_s, self._world.joint_positions()

    def write(self, goals: Mapping[str, float]) -> None:
        """Set the joint goals [rad] and let one control cycle pass."""
        self._world.set_joint_goals(dict(goals))
        self._world.advance_cycle()


def run_until_idle(
    port: WorldPort, engine: ControlEngine, limit: float, each_cycle: Callable[[float], None] | None = None
) -> EngineStatus:
    """Tick the engine until it is no longer busy, at most `limit` simulated seconds; `each_cycle` gets the time [s]."""
    start, joints = port.read()
    while True:
        time_s, joints = port.read()
        port.write(engine.tick(time_s, joints))
        if each_cycle is not None:
            each_cycle(time_s)
        if engine.status.state != EngineState.BUSY or time_s - start > limit:
            return engine.status


def play_actions(
    world: World,
    engine: ControlEngine,
    actions: Sequence[Action],
    places: Mapping[str, Sequence[float]],
    balls: Mapping[str, int],
    method: str,
    limit: float = 600.0,
    each_cycle: Callable[[float], None] | None = None,
    hands_at_once: bool = False,
) -> EngineStatus:
    """Run a strategy in a world and return how it ended."""
    port = WorldPort(world)
    time_s, joints = port.read()
    engine.tick(time_s, joints)
    engine.start(actions, places, balls, method, hands_at_once=hands_at_once)
    return run_until_idle(port, engine, limit, each_cycle)
