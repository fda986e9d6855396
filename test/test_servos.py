"""The simulated joints and hands against what a control engine relies on."""
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dr_eureka.game.state import State
from dr_eureka.simulation.joints import ALL_JOINTS
from dr_eureka.simulation.settings import SimulationError, load_world_settings
from dr_eureka.simulation.world import World

SETTINGS = load_world_settings()


@pytest.fixture
def world():
    world = World(SETTINGS, 1)
    yield world
    world.close()


def run(world, seconds):
    for _ in range(round(seconds / SETTINGS.cycle)):
        world.advance_cycle()


def test_arms_hold_against_gravity_with_the_published_torques(world):
    start = world.joint_positions()
    run(world, 0.5)
    error = max(abs(angle - start[name]) for name, angle in world.joint_positions().items() if "grip" not in name)
    assert np.degrees(error) < 0.1
    torques = world.motor_torques()
    # Static figures of this posture with open fingers; half closed, they differ by a hundredth of a newton metre.
    expected = {"sh_p1": -0.624, "sh_r": -2.978, "sh_p2": -2.479, "el_y": 3.688, "wr_r": 0.134, "wr_p": 0.385}
    for joint, torque in expected.items():
        assert torques[f"l_arm_{joint}"] == pytest.approx(torque, abs=0.03)
        assert torques[f"r_arm_{joint}"] == pytest.approx(-torque, abs=0.03)


def test_a_smooth_motion_is_followed_within_two_cycles_without_overshoot(world):
    name, start, travel, duration = "l_arm_wr_p", 0.08517, 0.6, 0.6
    goals, angles = [], []
    for cycle in range(1, round(duration / SETTINGS.cycle) + 26):
        share = min(cycle * SETTINGS.cycle / duration, 1.0)
        goals.append(start + travel * share**3 * (10 - 15 * share + 6 * share**2))
        world.set_joint_goals({name: goals[-1]})
        world.advance_cycle()
        angles.append(world.joint_positions()[name])
    goals, angles = np.array(goals), np.array(angles)
    two_cycles_late = np.concatenate([[start, start], goals[:-2]])
    assert (angles >= two_cycles_late - 1e-3).all() and (angles <= goals + 1e-3).all()
    assert angles[-1] == pytest.approx(start + travel, abs=np.radians(0.1))


def test_no_joint_exceeds_the_speed_limit_on_a_sudden_goal(world):
    world.set_joint_goals({"head_p": 1.2, "head_y": -1.0})
    angles = [world.joint_positions()]
    for _ in range(60):
        world.advance_cycle()
        angles.append(world.joint_positions())
    for name in ("head_p", "head_y"):
        speeds = np.abs(np.diff([state[name] for state in angles])) / SETTINGS.cycle
        assert speeds.max() < 3.4 * 1.05
    assert angles[-1]["head_p"] == pytest.approx(1.2, abs=1e-3)


def test_a_goal_beyond_the_hard_stop_ends_there(world):
    world.set_joint_goals({"head_p": 5.0})
    run(world, 0.7)
    assert np.degrees(world.joint_positions()["head_p"]) == pytest.approx(87, abs=0.1)
    assert world.joint_goals()["head_p"] == 5.0


@pytest.mark.parametrize("goals, problem", [
    ({"l_arm_thumb_y": 0.1}, "unknown joint 'l_arm_thumb_y'"), ({"head_p": float("nan")}, "head_p: is nan"),
])
def test_an_impossible_goal_is_refused_in_one_line_and_nothing_moves(world, goals, problem):
    before = world.joint_goals()
    with pytest.raises(SimulationError, match=problem) as caught:
        world.set_joint_goals({"head_y": 0.5, **goals})
    assert "\n" not in str(caught.value)
    assert world.joint_goals() == before


def test_all_31_joints_are_reported_with_legs_at_zero(world):
    positions = world.joint_positions()
    assert set(positions) == set(ALL_JOINTS)
    assert all(positions[name] == 0.0 for name in ALL_JOINTS if "leg" in name)


# Left arm, degrees, sh_p1 to wr_p: a hand in front of the robot's middle, and one at its own chest.
MIDDLE = (-54.86, 58.12, 59.27, 32.57, 54.02, -36.28, -56.16)
CHEST = (32.6, 59.1, 45.8, 71.6, 28.6, -9.0, 4.9)


@pytest.mark.parametrize("posture, stopped_by", [(MIDDLE, "r_arm"), (CHEST, "chest_link")])
def test_an_arm_is_stopped_by_the_other_arm_and_by_the_chest(world, posture, stopped_by):
    suffixes = ("sh_p1", "sh_r", "sh_p2", "el_y", "wr_r", "wr_y", "wr_p")
    goals = {f"{side}_arm_{suffix}": sign * np.radians(angle) for side, sign in (("l", 1), ("r", -1))
             for suffix, angle in zip(suffixes, posture)}
    world.set_joint_goals(goals)
    met = set()
    for _ in range(125):
        world.advance_cycle()
        met |= {pair for pair in world.contacts() if any(name.startswith("l_arm") for name in pair)}
    assert any(name.startswith(stopped_by) for pair in met for name in pair)
    assert max(abs(world.joint_positions()[name] - goal) for name, goal in goals.items()) > 0.02


@pytest.fixture
def tube_in_hand():
    """A world whose left tube stands between the pads of the left hand as the world starts, and where it is gripped."""
    layout = replace(SETTINGS.layout, board_centre=(0.455, 0.0, 0.7525), board_size=(0.33, 0.9, 0.025),
                     sheet_centre=(0.475, 0.0, 0.765),
                     tubes_in_sheet={"left": (-0.156, 0.312), "center": (-0.035, 0.0), "right": (-0.035, -0.11)})
    scatter = replace(SETTINGS.scatter, sheet=0.0, sheet_yaw=0.0, tubes=0.0)
    world = World(replace(SETTINGS, layout=layout, scatter=scatter), 2, State.parse("RRGG||PP"))
    world.set_joint_goals({"l_arm_grip": 1.15})
    run(world, 0.9)
    yield world
    world.close()


def in_hand(world):
    return np.linalg.inv(world.link_pose("l_arm_end_link")) @ world.tube_pose("left")


def lift_and_turn(world):
    sh_p1, wr_r = (world.joint_positions()[name] for name in ("l_arm_sh_p1", "l_arm_wr_r"))
    cycles = 125
    for cycle in range(1, cycles + 1):
        share = cycle / cycles
        ramp = share**2 * (3 - 2 * share)
        world.set_joint_goals({"l_arm_sh_p1": sh_p1 - 0.4 * ramp, "l_arm_wr_r": wr_r + 1.0 * ramp})
        world.advance_cycle()


def test_a_hand_lifts_turns_and_holds_a_full_tube_by_friction_alone(tube_in_hand):
    world = tube_in_hand
    assert world.joint_positions()["l_arm_grip"] == pytest.approx(0.959, abs=0.006)
    assert {("l_arm_grip_1_link", "tube_left"), ("l_arm_grip_link", "tube_left")} <= world.contacts()
    gripped = in_hand(world)
    # Held at the grasp centre, 19 mm beyond the end frame.
    assert gripped[:2, 3] == pytest.approx((0.019, 0.0), abs=0.001)
    lift_and_turn(world)
    run(world, 3.0)
    change = np.linalg.inv(gripped) @ in_hand(world)
    turned = np.degrees(np.arccos(np.clip((np.trace(change[:3, :3]) - 1) / 2, -1, 1)))
    assert world.tube_pose("left")[2, 3] > 0.85
    assert world.tube_pose("left")[2, 2] < np.cos(np.radians(35))
    assert np.linalg.norm(change[:3, 3]) < 0.0005 and turned < 0.5
    verdict = world.referee()
    assert verdict.tubes["left"] == "RRGG" and not verdict.tubes_standing["left"]


def pad_normals(world, finger):
    """Return the normals (k, 3) of a left finger's contacts with the left tube, in the finger's frame."""
    robot = world._robot
    contacts = world._client.getContactPoints(robot.body, world._tubes["left"], robot.link_index[f"l_arm_{finger}_link"])
    return np.array([contact[7] for contact in contacts]).reshape(-1, 3) @ world.link_pose(f"l_arm_{finger}_link")[:3, :3]


def test_a_hand_that_opens_after_it_turned_forgets_how_its_pads_lay_before(tube_in_hand):
    world, pads = tube_in_hand, ("grip", "grip_1")
    # Both pads face the tube squarely; the solver holds on to normals of the time when they closed.
    square = {pad: np.array([-0.26, side, 0.0]) for pad, side in zip(pads, (0.966, -0.966))}
    lift_and_turn(world)
    run(world, 0.5)
    held = np.concatenate([pad_normals(world, pad) @ square[pad] for pad in pads])
    assert held.min() < 0.9
    closed = world.joint_positions()["l_arm_grip"]
    world.set_joint_goals({"l_arm_grip": 0.5})
    for _ in range(15):
        world.advance_cycle()
        if world.joint_positions()["l_arm_grip"] < closed - 0.0005:
            break
    opening = np.concatenate([pad_normals(world, pad) @ square[pad] for pad in pads])
    assert len(opening) > 0 and opening.min() > 0.99


def test_both_fingers_close_together_and_an_empty_hand_closes_further(world):
    world.set_joint_goals({"r_arm_grip": 1.15})
    run(world, 1.0)
    closed = world.joint_positions()["r_arm_grip"]
    assert 1.09 < closed < 1.13
    right, left = (world.link_pose(f"r_arm_{finger}_link") for finger in ("grip", "grip_1"))
    hand = world.link_pose("r_arm_end_link")
    angles = [np.arctan2(*(hand[:3, :3].T @ finger[:3, 0])[[1, 0]]) for finger in (right, left)]
    assert angles[0] == pytest.approx(-angles[1], abs=0.005)
