"""Pours spoilt on purpose, with a made-up world."""

import math

import numpy as np
import pytest

from dr_eureka.game.state import TUBES
from dr_eureka.pieces import load_pieces
from dr_eureka.simulation.faults import RAMP_SECONDS, Fault, FaultName, PourSpoiler
from dr_eureka.simulation.settings import SimulationError

JOG = Fault(FaultName.JOG, {"l_arm_wr_r": -0.4}, seconds=2.0)
KNOCK_OUT = Fault(FaultName.KNOCK_OUT_BALL)


class Placement:
    base_from_sheet = np.array([[0.0, -1.0, 0.0, 0.5], [1.0, 0.0, 0.0, 0.1], [0.0, 0.0, 1.0, 0.775], [0.0, 0.0, 0.0, 1.0]])


class World:
    """Three tubes of which one may be tipped, two red balls in the left one and a green one in the right one."""

    placement = Placement()

    def __init__(self):
        self.time_s = 0.0
        self.elevations = dict.fromkeys(TUBES, 90.0)
        self.put = []

    def tube_pose(self, name):
        tilt = math.radians(90.0 - self.elevations[name])
        pose = np.eye(4)
        pose[:3, :3] = [[math.cos(tilt), 0.0, math.sin(tilt)], [0.0, 1.0, 0.0], [-math.sin(tilt), 0.0, math.cos(tilt)]]
        pose[:3, 3] = (0.44, {"left": 0.11, "center": 0.0, "right": -0.11}[name], 0.9)
        return pose

    def ball_positions(self):
        inside = (("G", "right", 0.015), ("R", "left", 0.037), ("R", "left", 0.015), ("P", "center", 0.2))
        return [(colour, (self.tube_pose(name) @ [0.0, 0.0, height, 1.0])[:3]) for colour, name, height in inside]

    def put_ball(self, index, centre):
        self.put.append((index, centre.round(3).tolist()))


@pytest.fixture
def world():
    return World()


@pytest.fixture
def spoiler(world):
    return PourSpoiler(world, load_pieces())


def pour(world, spoiler, tube="left"):
    """Tip a tube and stand it up again; return what was spoilt."""
    spoilt = []
    for elevation in (90.0, 60.0, 25.0, 0.0, -12.0, 12.0, 90.0):
        world.time_s += 0.1
        world.elevations[tube] = elevation
        spoilt.append(spoiler.step())
    return [(world_elevation, fault) for world_elevation, fault in zip((90, 60, 25, 0, -12, 12, 90), spoilt) if fault]


def test_nothing_happens_unless_asked_for(world, spoiler):
    assert pour(world, spoiler) == []
    assert spoiler.pushed({"l_arm_wr_r": 0.3}) == {"l_arm_wr_r": 0.3}
    assert world.put == []


def test_a_fault_acts_on_one_pour_when_the_tube_begins_to_tip(world, spoiler):
    spoiler.spoil_next_pour(KNOCK_OUT)
    assert pour(world, spoiler) == [(25, KNOCK_OUT)]
    assert pour(world, spoiler) == []


def test_a_pour_that_has_begun_is_left_alone(world, spoiler):
    world.elevations["left"] = 10.0
    spoiler.step()
    spoiler.spoil_next_pour(KNOCK_OUT)
    assert spoiler.step() is None
    world.elevations["left"] = 90.0
    spoiler.step()
    assert pour(world, spoiler, "right") == [(25, KNOCK_OUT)]


@pytest.mark.parametrize("tube, index", [("left", 1), ("right", 0)])
def test_the_uppermost_ball_of_the_tipped_tube_lies_on_the_sheet(world, spoiler, tube, index):
    spoiler.spoil_next_pour(KNOCK_OUT)
    pour(world, spoiler, tube)
    # x 0.09, y 0.05 of a sheet that is turned by 90 degrees, a ball's radius above it.
    assert world.put == [(index, [0.45, 0.19, 0.786])]


def test_an_empty_tube_loses_nothing(world, spoiler):
    spoiler.spoil_next_pour(KNOCK_OUT)
    assert pour(world, spoiler, "center") == [(25, KNOCK_OUT)]
    assert world.put == []


def test_a_jog_pushes_the_joint_for_its_time_and_the_encoder_does_not_notice(world, spoiler):
    spoiler.spoil_next_pour(JOG)
    world.elevations["left"] = 20.0
    assert spoiler.step() == JOG
    half = RAMP_SECONDS / 2
    for since, share in ((0.0, 0.0), (half, 0.5), (RAMP_SECONDS, 1.0), (1.5, 1.0), (2.0 - half, 0.5), (2.1, 0.0)):
        world.time_s = since
        pushed = spoiler.pushed({"l_arm_wr_r": 0.3, "l_arm_wr_p": 0.1})
        assert pushed == pytest.approx({"l_arm_wr_r": 0.3 - 0.4 * share, "l_arm_wr_p": 0.1})
        assert spoiler.noticed(pushed) == pytest.approx({"l_arm_wr_r": 0.3, "l_arm_wr_p": 0.1})


@pytest.mark.parametrize(
    "name, offsets, seconds, words",
    [
        ("EARTHQUAKE", {}, 1.0, "fault 'EARTHQUAKE': unknown; expected one of JOG, KNOCK_OUT_BALL"),
        ("JOG", {"l_arm_tentacle": 0.1}, 1.0, "unknown joint 'l_arm_tentacle'"),
        ("JOG", {"l_arm_wr_r": float("nan")}, 1.0, "is nan rad; expected at most 1 either way"),
        ("JOG", {"l_arm_wr_r": -1.5}, 1.0, "is -1.5 rad"),
        ("JOG", {}, 1.0, "0 joints for 1.0 s"),
        ("JOG", {"l_arm_wr_r": 0.1}, 0.0, "1 joints for 0.0 s"),
        ("JOG", {"l_arm_wr_r": 0.1}, float("inf"), "a finite time"),
    ],
)
def test_a_fault_that_makes_no_sense_is_refused_by_name(name, offsets, seconds, words):
    with pytest.raises(SimulationError) as caught:
        Fault(name, offsets, seconds)
    assert words in str(caught.value)
