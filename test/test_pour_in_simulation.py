"""Engine and simulated world in one process: tubes are gripped by friction, the balls meant go over, all else stays."""

from dataclasses import replace

import numpy as np
import pytest

from dr_eureka.bench.rehearsal import play_actions
from dr_eureka.control.codes import EngineCode, EngineState
from dr_eureka.control.engine import ControlEngine
from dr_eureka.control.port import grip_joint
from dr_eureka.control.settings import ControlSettings
from dr_eureka.game.actions import Action, actions_for
from dr_eureka.game.state import TUBES, Pour, State
from dr_eureka.pieces import load_pieces
from dr_eureka.resources import load_yaml
from dr_eureka.simulation.settings import load_world_settings
from dr_eureka.simulation.world import World

WHERE = "config/control_engine.yaml"


def make_engine() -> ControlEngine:
    return ControlEngine(ControlSettings.from_mapping(load_yaml(WHERE), WHERE), load_pieces())


@pytest.mark.parametrize(
    "start, pour, method, at_once",
    [
        ("RRGG|P|P", Pour("left", "center", 1), "lock", True),
        ("RG|GPP|R", Pour("center", "right", 1), "profiled", False),
        ("RG|GPP|R", Pour("center", "right", 2), "linear", False),
    ],
)
def test_exactly_the_balls_meant_go_from_one_tube_into_the_other(start, pour, method, at_once):
    state, engine = State.parse(start), make_engine()
    world = World(load_world_settings(), seed=5, start=state)
    # Tubes as a camera would locate them: 2 mm off.
    places = {tube: world.tube_pose(tube)[:3, 3] + np.array([0.0014, -0.0014, 0.0]) for tube in TUBES}
    tilt = []

    def watch(_: float) -> None:
        for hand, held in engine.body.held.items():
            if engine.body.goals[grip_joint(hand)] < engine.settings.grip.closed:
                continue
            true = world.tube_pose(held.tube)
            known = engine.body.arms[hand].pose(world.joint_positions()) @ held.end_from_tube
            tilt.append(np.degrees(np.arccos(np.clip(true[:3, 2] @ known[:3, 2], -1.0, 1.0))))

    balls = {tube: len(state.tube(tube)) for tube in TUBES}
    status = play_actions(world, engine, actions_for([pour]), places, balls, method, each_cycle=watch, hands_at_once=at_once)
    verdict = world.referee()
    world.close()
    assert status.state == EngineState.DONE, status
    assert verdict.state == str(state.after(pour))
    assert verdict.balls_lost == 0
    assert all(verdict.tubes_standing.values())
    assert max(tilt) < 1.0


def test_a_hand_that_closes_beside_the_tube_says_so_and_lifts_nothing():
    engine = make_engine()
    world = World(load_world_settings(), seed=5)
    foot = world.tube_pose("left")[:3, 3]
    places = {"left": foot + [-0.05, 0.06, 0.0], "right": foot}
    status = play_actions(world, engine, actions_for([Pour("left", "right", 1)]), places, {"left": 2}, "lock")
    standing = world.referee().tubes_standing
    world.close()
    assert status.code == EngineCode.GRASP_EMPTY
    assert standing["left"]


def test_a_tube_that_slips_out_of_the_fingers_is_missed():
    engine, settings = make_engine(), load_world_settings()
    world = World(replace(settings, physics=replace(settings.physics, pad_friction=0.0)), seed=5)
    places = {"left": world.tube_pose("left")[:3, 3]}
    status = play_actions(world, engine, [Action("pick", "left", "left")], places, {"left": 2}, "lock")
    world.close()
    assert status.code == EngineCode.TUBE_SLIPPED and "lifted tube 'left'" in status.message
    assert not engine.body.held
