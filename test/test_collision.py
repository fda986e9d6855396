"""Collisions foreseen: distances against a least-squares solver on the robot's boxes, which shares nothing with Bullet."""

import xml.etree.ElementTree as ElementTree
from functools import lru_cache
from itertools import product

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from dr_eureka.control.arm import Arm
from dr_eureka.control.arm_calibration import ArmCalibration
from dr_eureka.control.collision import REACH, CollisionChecker, Tubes, tube_body
from dr_eureka.control.port import CONTROLLED_JOINTS
from dr_eureka.control.settings import ControlSettings
from dr_eureka.game.hands import HANDS
from dr_eureka.kinematics.arms import URDF
from dr_eureka.kinematics.chain import Chain
from dr_eureka.kinematics.transforms import rpy_to_matrix, transform
from dr_eureka.pieces import load_pieces
from dr_eureka.resources import load_yaml, resource_path
from dr_eureka.simulation.settings import load_world_settings

WHERE = "config/control_engine.yaml"
SETTINGS = ControlSettings.from_mapping(load_yaml(WHERE), WHERE)
MARGIN = SETTINGS.collision.margin
NO_TUBES = Tubes({}, {})
LINKS = ("sh_p2", "el_y", "wr_r", "wr_y", "wr_p", "grip", "grip_1")
TRUNK = ("pelvis_link", "chest_link", "head_y_link", "head_p_link")
TIMES = np.linspace(0.0, 2.0, 1001)


@pytest.fixture(scope="module")
def arms() -> dict[str, Arm]:
    return {hand: Arm(hand, SETTINGS.kinematics, None) for hand in HANDS}


@pytest.fixture(scope="module")
def checker(arms) -> CollisionChecker:
    return CollisionChecker(SETTINGS.collision, load_pieces(), arms)


@pytest.fixture(scope="module")
def boxes() -> dict[str, list[tuple[np.ndarray, np.ndarray]]]:
    """Return link_from_box (4, 4) and half the size (3,) [m] of every box of the robot, by link."""
    found = {}
    for link in ElementTree.parse(resource_path(URDF)).getroot().findall("link"):
        found[link.get("name")] = []
        for shape in link.findall("collision"):
            origin = shape.find("origin")
            numbers = {key: np.array([float(word) for word in origin.get(key).split()]) for key in ("xyz", "rpy")}
            half = np.array([float(word) for word in shape.find("geometry/box").get("size").split()]) / 2.0
            found[link.get("name")].append((transform(rpy_to_matrix(numbers["rpy"]), numbers["xyz"]), half))
    return found


def box_distance(pose: np.ndarray, half: np.ndarray, other_pose: np.ndarray, other_half: np.ndarray) -> float:
    """Return the distance [m] of two boxes: the least |p + R x - q - S y| over |x| <= half, |y| <= other half."""
    matrix = np.hstack([pose[:3, :3], -other_pose[:3, :3]])
    bounds = np.concatenate([half, other_half])
    best = lsq_linear(matrix, other_pose[:3, 3] - pose[:3, 3], (-bounds, bounds), method="bvls")
    return float(np.sqrt(2.0 * best.cost))


@lru_cache(maxsize=None)
def chain_to(link: str) -> Chain:
    return Chain.from_urdf(resource_path(URDF), "base", link)


def placed_boxes(boxes, joints, links) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return base_from_box (4, 4) and half the size (3,) [m] of the boxes of some links, or of a piece of furniture."""
    placed = []
    for link in links:
        if link in SETTINGS.collision.furniture:
            box = SETTINGS.collision.furniture[link]
            placed.append((transform(None, box.centre), np.array(box.size) / 2.0))
            continue
        # The pelvis does not move, so it is no chain of its own.
        chain = chain_to("chest_link" if link == "pelvis_link" else link)
        pose = chain.forward_all(np.array([joints[name.removesuffix("_1")] for name in chain.joint_names]))[link]
        placed += [(pose @ link_from_box, half) for link_from_box, half in boxes[link]]
    return placed


def least_distance(boxes, joints, links, others) -> float:
    """Return the least distance [m] between links and others; boxes whose spheres are apart are not looked at."""
    least = np.inf
    for pose, half in placed_boxes(boxes, joints, links):
        for other, other_half in placed_boxes(boxes, joints, others):
            if np.linalg.norm(pose[:3, 3] - other[:3, 3]) < np.linalg.norm(half) + np.linalg.norm(other_half) + 0.01:
                least = min(least, box_distance(pose, half, other, other_half))
    return least


def posture(arms, left: list[float]) -> dict[str, float]:
    """Return all joints with both arms in mirrored postures, fingers half open."""
    joints = dict.fromkeys(CONTROLLED_JOINTS, 0.0)
    for hand in HANDS:
        joints.update(zip(arms[hand].joints, arms[hand].posture(left)))
        joints[f"{hand[0]}_arm_grip"] = 0.65
    return joints


def random_swing(arms, seed):
    """Return the joints before and a motion of both arms from home to somewhere before the robot, on all sorts of ways."""
    rng = np.random.default_rng(seed)
    start = posture(arms, SETTINGS.postures.home)
    end = dict(start)
    for hand in HANDS:
        away = np.array(SETTINGS.postures.pick) + [-0.2, 0.2, 0.0, 0.3, 0.0, 0.3, 0.0] + rng.uniform(-0.3, 0.3, 7)
        end.update(zip(arms[hand].joints, arms[hand].chain.clip(arms[hand].posture(away))))
    shares = np.linspace(0.0, 1.0, len(TIMES))
    return start, {name: start[name] + shares * (end[name] - start[name]) for name in start if end[name] != start[name]}


def test_a_hit_is_as_near_as_an_independent_solver_says_and_what_is_clear_never_touches(checker, arms, boxes):
    left, right = ([f"{side}_arm_{name}_link" for name in LINKS] for side in "lr")
    hits = []
    for seed in range(8):
        start, moving = random_swing(arms, seed)
        hit = checker.first_hit(start, TIMES, moving, NO_TUBES)
        until = len(TIMES) - 1 if hit is None else int(np.argmin(np.abs(TIMES - hit.elapsed)))
        for index in np.linspace(0.5 * until, until, 4).astype(int):
            joints = start | {name: values[index] for name, values in moving.items()}
            assert least_distance(boxes, joints, left, right) > 1e-3
            assert least_distance(boxes, joints, left + right, [*TRUNK, *SETTINGS.collision.furniture]) > 1e-3
        if hit is not None:
            hits.append(hit)
            assert hit.distance < MARGIN
            # Bullet rounds off the corners of links by (sqrt(3) - 1) mm.
            too_far = hit.distance - least_distance(boxes, joints, *([body] for body in hit.bodies))
            assert -1e-4 < too_far < 1.5e-3
    assert 3 <= len(hits) <= 6


def test_hands_that_are_brought_together_are_refused_with_both_names_and_the_place(checker, arms):
    start = posture(arms, SETTINGS.postures.pick)
    moving = {}
    for hand in HANDS:
        pose = arms[hand].pose(start)
        pose[1, 3] = 0.0
        goal = arms[hand].solve(arms[hand].positions(start), pose, "X", "the middle")
        shares = np.linspace(0.0, 1.0, len(TIMES))[:, None]
        moving.update(zip(arms[hand].joints, (arms[hand].positions(start) * (1 - shares) + goal * shares).T))
    hit = checker.first_hit(start, TIMES, moving, NO_TUBES)
    assert sorted(body[0] for body in hit.bodies) == ["l", "r"]
    assert 0.0 < hit.distance < MARGIN and abs(hit.where[1]) < 0.05
    assert hit.bodies[0] in str(hit) and hit.bodies[1] in str(hit) and f"{hit.elapsed:.2f} s" in str(hit)


def test_an_arm_that_swings_down_hits_the_table(checker, arms):
    start = posture(arms, SETTINGS.postures.home)
    hit = checker.first_hit(start, TIMES, {"l_arm_sh_p1": np.linspace(start["l_arm_sh_p1"], 1.2, len(TIMES))}, NO_TUBES)
    assert set(hit.bodies) & {"table", "board"} and any(body.startswith("l_arm") for body in hit.bodies)


def test_an_elbow_that_folds_in_hits_the_robot_itself(checker, arms):
    start = posture(arms, [0.6, -0.4, 0.9, 0.0, 0.0, 0.0, 0.0])
    hit = checker.first_hit(start, TIMES, {"r_arm_el_y": np.linspace(0.0, -1.2, len(TIMES))}, NO_TUBES)
    assert "pelvis_link" in hit.bodies and any(body.startswith("r_arm") for body in hit.bodies)


@pytest.mark.parametrize("side", HANDS)
def test_a_hand_that_folds_back_is_stopped_before_its_own_shoulder(side, checker, arms, boxes):
    shoulder, forearm = ([f"{side[0]}_arm_{name}_link" for name in names] for names in (("sh_p1", "sh_r"), LINKS[1:]))
    rng, shares, hits = np.random.default_rng(6), np.linspace(0.0, 1.0, len(TIMES))[:, None], 0
    for _ in range(6):
        stretched = np.array([-1.2, 0.7, 0.0, 0.0, 0.0, 0.0, 0.0]) + rng.uniform(-0.15, 0.15, 7)
        folded = np.append(stretched[:3], rng.uniform([0.9, -0.3, 1.2, 0.5], [1.2, 0.3, 1.4, 0.8]))
        ends = [arms[side].posture(angles) for angles in (stretched, folded)]
        start = posture(arms, SETTINGS.postures.home) | dict(zip(arms[side].joints, ends[0]))
        moving = dict(zip(arms[side].joints, (ends[0] * (1 - shares) + ends[1] * shares).T))
        hit = checker.first_hit(start, TIMES, moving, NO_TUBES)
        until = len(TIMES) - 1 if hit is None else int(np.argmin(np.abs(TIMES - hit.elapsed)))
        for index in np.linspace(0.5 * until, until, 3).astype(int):
            joints = start | {name: values[index] for name, values in moving.items()}
            assert least_distance(boxes, joints, shoulder, forearm) > 1e-3
        if hit is not None:
            hits += 1
            assert set(hit.bodies) & set(shoulder) and set(hit.bodies) & set(forearm)
            assert -1e-4 < hit.distance - least_distance(boxes, joints, *([body] for body in hit.bodies)) < 1.5e-3
    assert hits >= 3


@pytest.mark.parametrize("allowed", [False, True])
def test_fingers_may_close_on_a_tube_only_where_that_is_what_the_motion_is_for(allowed, checker, arms):
    start = posture(arms, SETTINGS.postures.pick)
    tip = arms["left"].pose(start) @ [SETTINGS.pick.centre_beyond_end, 0.0, 0.0, 1.0]
    tubes = Tubes({"left": tip[:3] - [0.0, 0.0, SETTINGS.pick.grip_height]}, {})
    moving = {"l_arm_grip": np.linspace(0.65, SETTINGS.grip.closed, len(TIMES))}
    may_touch = frozenset(frozenset((tube_body("left"), f"l_arm_{finger}_link")) for finger in ("grip", "grip_1"))
    hit = checker.first_hit(start, TIMES, moving, tubes, may_touch if allowed else frozenset())
    if allowed:
        assert hit is None
    else:
        assert set(hit.bodies) <= {"tube left", "l_arm_grip_link", "l_arm_grip_1_link"}


def test_a_held_tube_is_part_of_the_hand(checker, arms):
    """A tube that hangs far below the fingers meets the board before the hand does."""
    start = posture(arms, SETTINGS.postures.pick)
    end = arms["left"].pose(start)
    end[2, 3] -= 0.12
    goal = arms["left"].solve(arms["left"].positions(start), end, "X", "lower")
    shares = np.linspace(0.0, 1.0, len(TIMES))[:, None]
    moving = dict(zip(arms["left"].joints, (arms["left"].positions(start) * (1 - shares) + goal * shares).T))
    hanging = transform(None, [SETTINGS.pick.centre_beyond_end, 0.0, -0.15])
    free = checker.first_hit(start, TIMES, moving, NO_TUBES)
    hit = checker.first_hit(start, TIMES, moving, Tubes({}, {"left": ("center", hanging)}))
    assert "tube center" in hit.bodies and (free is None or free.elapsed > hit.elapsed)


def test_what_is_too_near_at_the_start_may_part_but_not_come_nearer(checker, arms):
    start = posture(arms, SETTINGS.postures.pick)
    tip = arms["left"].pose(start) @ [SETTINGS.pick.centre_beyond_end, 0.0, 0.0, 1.0]
    tubes = Tubes({"left": tip[:3] - [0.0, 0.0, SETTINGS.pick.grip_height]}, {})
    closed = start | {"l_arm_grip": 0.93}
    assert checker.first_hit(closed, TIMES, {"l_arm_grip": np.linspace(0.93, 0.65, len(TIMES))}, tubes) is None
    assert checker.first_hit(closed, TIMES, {"l_arm_grip": np.linspace(0.93, 1.10, len(TIMES))}, tubes) is not None


def test_no_point_of_a_hand_or_a_held_tube_moves_farther_than_the_reach_of_the_joints_that_turn(arms, boxes):
    rng = np.random.default_rng(3)
    links = [f"l_arm_{name}_link" for name in LINKS]
    pieces, shapes = load_pieces(), {link: [(pose, half) for pose, half in boxes[link]] for link in links}
    # A held tube as a box: upright between the fingers, from below its foot to above its mouth.
    middle = transform(None, [0.164, 0.045, pieces.tube_height / 2.0 - SETTINGS.pick.grip_height])
    shapes["l_arm_wr_p_link"].append((middle, np.array([pieces.foot_radius, pieces.foot_radius, pieces.tube_height / 2.0])))
    corners = np.array(list(product((-1.0, 1.0), repeat=3)))
    for _ in range(80):
        joints = dict.fromkeys(CONTROLLED_JOINTS, 0.0)
        joints.update(zip(arms["left"].joints, rng.uniform(arms["left"].chain.lower, arms["left"].chain.upper)))
        joints["l_arm_grip"] = rng.uniform(0.0, 1.15)
        name = rng.choice([*arms["left"].joints, "l_arm_grip", "torso_y"])
        turned = joints | {name: joints[name] + 0.01}
        before, after = (
            np.concatenate([
                (pose @ np.column_stack([corners * half, np.ones(8)]).T).T[:, :3]
                for pose, half in placed_boxes(shapes, state, links)
            ])
            for state in (joints, turned)
        )
        assert np.linalg.norm(after - before, axis=1).max() <= 0.01 * REACH[name.partition("_arm_")[2] or name]


def test_an_arm_is_where_its_calibration_has_it(arms, boxes):
    rng = np.random.default_rng(5)
    calibration = ArmCalibration("left", tuple(rng.uniform(-0.017, 0.017, 7)), tuple(rng.uniform(-0.004, 0.004, 7)))
    calibrated = arms | {"left": Arm("left", SETTINGS.kinematics, None, calibration)}
    start = posture(arms, SETTINGS.postures.home)
    moving = {"l_arm_sh_p1": np.linspace(start["l_arm_sh_p1"], 1.2, len(TIMES))}
    hit = CollisionChecker(SETTINGS.collision, load_pieces(), calibrated).first_hit(start, TIMES, moving, NO_TUBES)
    link, other = sorted(hit.bodies, key=lambda body: not body.startswith("l_arm"))
    drawn = Chain.from_urdf(resource_path(URDF), "base", link, held={"torso_y": 0.0})
    errors = [dict(zip(arms["left"].joints, values)) for values in (calibration.joint_offsets, calibration.link_stretches)]
    chain = drawn.adjusted(*(np.array([by_name.get(name, 0.0) for name in drawn.joint_names]) for by_name in errors))
    joints = start | {"l_arm_sh_p1": moving["l_arm_sh_p1"][np.argmin(np.abs(TIMES - hit.elapsed))]}
    pose = chain.forward(np.array([joints[name.removesuffix("_1")] for name in chain.joint_names]))
    ((furniture, half),) = placed_boxes(boxes, joints, [other])
    distances = [box_distance(pose @ link_from_box, size, furniture, half) for link_from_box, size in boxes[link]]
    assert -1e-4 < hit.distance - min(distances) < 8e-4


def test_the_robot_measures_its_furniture_as_the_simulator_builds_it():
    layout = load_world_settings().layout
    for name, centre, size in (
        ("table", layout.table_centre, layout.table_size), ("board", layout.board_centre, layout.board_size)
    ):
        box = SETTINGS.collision.furniture[name]
        np.testing.assert_allclose([box.centre, box.size], [centre, size], atol=0.002)
