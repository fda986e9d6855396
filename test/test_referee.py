"""The referee's rulings on poses made by hand."""
from __future__ import annotations

import numpy as np
import pytest

from dr_eureka.game.state import State
from dr_eureka.pieces import load_pieces
from dr_eureka.simulation.referee import judge
from dr_eureka.simulation.settings import load_world_settings

PIECES = load_pieces()
SETTINGS = load_world_settings().referee
SHEET = 0.775
FEET = {"left": (0.44, 0.11), "center": (0.44, 0.0), "right": (0.44, -0.11)}


def upright(name, height=SHEET, lean=0.0):
    pose = np.eye(4)
    pose[:3, :3] = [[1, 0, 0], [0, np.cos(lean), -np.sin(lean)], [0, np.sin(lean), np.cos(lean)]]
    pose[:3, 3] = (*FEET[name], height)
    return pose


def stacked(pose, colours):
    heights = [PIECES.tube_floor + PIECES.ball_radius + index * PIECES.ball_diameter for index in range(len(colours))]
    return [(colour, pose[:3, 3] + height * pose[:3, 2]) for colour, height in zip(colours, heights)]


def rule(balls, **poses):
    tubes = {name: poses.get(name, upright(name)) for name in FEET}
    return judge(tubes, balls, SHEET, PIECES, SETTINGS)


def test_balls_are_named_from_bottom_to_top_in_whatever_order_they_come():
    balls = stacked(upright("left"), "RG") + stacked(upright("right"), "PPGR")
    verdict = rule(balls[::-1])
    assert verdict.state == "RG||PPGR"
    assert verdict.tubes == {"left": "RG", "center": "", "right": "PPGR"}
    assert verdict.balls_lost == 0 and all(verdict.tubes_standing.values())


def test_a_ball_beside_a_tube_is_lost_and_there_is_no_state():
    balls = stacked(upright("left"), "RRGG") + stacked(upright("right"), "P")
    verdict = rule([*balls, ("P", np.array([0.30, 0.0, SHEET + 0.011]))])
    assert verdict.balls_lost == 1 and verdict.state is None
    assert not verdict.solved("RRGG||P")


@pytest.mark.parametrize("above_rim, inside", [(-0.001, True), (0.001, False)])
def test_a_ball_counts_while_its_centre_is_below_the_rim(above_rim, inside):
    pose = upright("center")
    verdict = rule([("G", pose[:3, 3] + [0, 0, PIECES.tube_height + above_rim])])
    assert (verdict.tubes["center"] == "G") is inside


def test_balls_stay_with_a_tube_that_is_held_tilted():
    pose = upright("left", height=1.0, lean=np.radians(100))
    verdict = rule(stacked(pose, "RGP"), left=pose)
    assert verdict.tubes["left"] == "RGP"
    assert verdict.tubes_standing == {"left": False, "center": True, "right": True}


@pytest.mark.parametrize("pose, standing", [
    (upright("left", lean=0.05), True), (upright("left", lean=0.2), False),
    (upright("left", height=SHEET + 0.005), True), (upright("left", height=SHEET + 0.02), False),
    (upright("left", height=0.75), False),
])
def test_standing_means_upright_on_the_sheet(pose, standing):
    assert rule([], left=pose).tubes_standing["left"] is standing


def test_solved_needs_the_goal_and_every_tube_standing():
    balls = stacked(upright("left"), "RR") + stacked(upright("center"), "GG") + stacked(upright("right"), "PP")
    assert rule(balls).solved("RR|GG|PP") and rule(balls).solved(State.parse("RR|GG|PP"))
    assert not rule(balls).solved("RRGG||PP")
    lifted = upright("left", height=0.9)
    held = stacked(lifted, "RR") + balls[2:]
    assert rule(held, left=lifted).state == "RR|GG|PP"
    assert not rule(held, left=lifted).solved("RR|GG|PP")
