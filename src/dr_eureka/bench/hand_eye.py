"""How far the gripper is from the tube that it was sent to, for robots with hidden errors in their arms (paper 3.2)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Mapping, Sequence

import numpy as np

from dr_eureka.behaviour.arm_calibration import ArmCalibrationSettings, HandShow
from dr_eureka.bench.report import BenchError, BenchOptions, Row, mean_row, progress
from dr_eureka.bench.simulated_calibration import SimulatedRobot, imperfect, tubes_aside
from dr_eureka.control.arm import Arm
from dr_eureka.control.arm_calibration import ArmCalibration
from dr_eureka.control.codes import EngineCode
from dr_eureka.control.grasp import UP, hand_for_tube, level_hand, tube_in_hand
from dr_eureka.control.hand_eye import SeenHand, fit_affine, fit_calibration
from dr_eureka.control.pour_geometry import PourGeometry
from dr_eureka.control.settings import ControlSettings
from dr_eureka.game.hands import HANDS
from dr_eureka.game.planner_settings import load_planner_settings
from dr_eureka.kinematics.arms import arm_chain
from dr_eureka.pieces import Pieces, load_pieces
from dr_eureka.resources import load_yaml
from dr_eureka.simulation.camera_model import camera_model
from dr_eureka.simulation.rendering import SceneTextures
from dr_eureka.simulation.settings import load_camera_settings, load_world_settings
from dr_eureka.simulation.world import World
from dr_eureka.vision.sheet_renderer import sheet_image
from dr_eureka.vision.tubes import TubeResult, TubeSettings, locate_tubes

ROBOTS = 20
GOAL_MM = 2.0
BEFORE, AFFINE, AFTER = "before calibration", "affine alone, as in the paper", "after calibration"
# A hand turned less than this from the level was meant to be level [rad].
_LEVEL_RAD = 0.1
CONTROL = "config/control_engine.yaml"


@dataclass(frozen=True, eq=False)
class _Bench:
    """What every robot of the benchmark shares."""

    control: ControlSettings
    pieces: Pieces
    tubes: TubeSettings
    procedure: ArmCalibrationSettings
    textures: SceneTextures

    @classmethod
    def load(cls) -> _Bench:
        pieces = load_pieces()
        control = ControlSettings.from_mapping(load_yaml(CONTROL), CONTROL)
        textures = SceneTextures(sheet=sheet_image(pieces))
        return cls(control, pieces, TubeSettings.load(), ArmCalibrationSettings.load(), textures)


def run_rows(options: BenchOptions) -> list[Row]:
    """Calibrate both arms of each robot by its camera, send the hands to tubes that the camera located, measure by the truth.

    Errors are horizontal distances from the middle between the finger pads to the tube's axis where it would be gripped;
    the rows are means over robots. Tilts are of the hand against the level; mouths are the places of two held tubes' mouths
    to one another when a lock-pour begins. The paper names no figure.
    """
    bench, robots = _Bench.load(), min(options.trials or ROBOTS, ROBOTS)
    measured = [
        _measure(bench, options.seed * 1000 + number, options.seed + number)
        for number in progress(range(1, robots + 1), robots, "robots")
    ]
    rows = []
    for what, unit in (("gripper to tube", "mm"), ("hand tilt", "deg"), ("mouth to mouth", "mm")):
        for kind in (BEFORE, AFFINE, AFTER):
            values = [robot[what, kind] for robot in measured]
            goal = what == "gripper to tube" and kind == AFTER
            rows.append(
                mean_row(
                    f"hand-eye: {what}, {kind}", values, unit,
                    goal=f"<= {GOAL_MM:g} mm" if goal else None, ok=float(np.mean(values)) <= GOAL_MM if goal else None,
                )
            )
    return rows


def _measure(bench: _Bench, robot: int, seed: int) -> dict[tuple[str, str], float]:
    """Return one robot's mean errors [mm, deg] by what is measured and with which calibration."""
    believed, true = _tubes(bench, robot, seed)
    camera = replace(load_camera_settings(), hand_markers=True)
    # The same sheet, but nothing to knock over: an arm that is not calibrated may be a centimetre off.
    world = World(tubes_aside(imperfect(load_world_settings(), robot)), seed, textures=bench.textures, camera=camera)
    try:
        simulated = SimulatedRobot(world, camera_model(camera))
        errors = {}
        for kind, calibrations in _calibrations(bench, simulated).items():
            arms = {hand: Arm(hand, bench.control.kinematics, None, calibrations[hand]) for hand in HANDS}
            distances, tilts, held = _grasp(bench, world, simulated, arms, believed, true)
            errors["gripper to tube", kind] = 1000.0 * float(np.mean(distances))
            errors["hand tilt", kind] = float(np.degrees(np.mean(tilts)))
            errors["mouth to mouth", kind] = 1000.0 * _mouth_error(bench, world, simulated, arms, held)
        return errors
    finally:
        world.close()


def _tubes(bench: _Bench, robot: int, seed: int) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return the feet of the tubes (3,) [m] in base where the robot's camera locates them, and where they are."""
    camera = load_camera_settings()
    world = World(imperfect(load_world_settings(), robot), seed, textures=bench.textures, camera=camera)
    try:
        simulated = SimulatedRobot(world, camera_model(camera))
        gaze = bench.procedure.sheet_gaze
        simulated.move(_home(bench, HANDS) | {"head_y": gaze.head_y, "head_p": gaze.head_p})
        view = simulated.look()
        scene = locate_tubes(view.image, view.camera, view.base_from_camera, bench.pieces, bench.tubes)
        if scene.result != TubeResult.OK:
            raise BenchError(f"robot {robot}: the tubes were not located: {scene.reason}")
        believed = {name: place.position for name, place in scene.tubes.items()}
        return believed, {name: world.tube_pose(name)[:3, 3] for name in believed}
    finally:
        world.close()


def _home(bench: _Bench, hands: Sequence[str]) -> dict[str, float]:
    """Return joint goals [rad] that bring arms to the home posture."""
    arms = [Arm(hand, bench.control.kinematics, None) for hand in hands]
    return {name: float(angle) for arm in arms for name, angle in zip(arm.joints, arm.posture(bench.control.postures.home))}


def _calibrations(bench: _Bench, robot: SimulatedRobot) -> dict[str, dict[str, ArmCalibration]]:
    """Calibrate both arms; return calibrations by kind and hand."""
    found: dict[str, dict[str, ArmCalibration]] = {kind: {} for kind in (BEFORE, AFFINE, AFTER)}
    for hand in HANDS:
        show = HandShow(robot, hand, bench.control, bench.tubes.sheet, bench.pieces, bench.procedure)
        looks = show.collect(lambda line: None)
        found[BEFORE][hand] = ArmCalibration(hand)
        found[AFFINE][hand] = _affine_alone(hand, looks)
        found[AFTER][hand] = fit_calibration(hand, looks, bench.procedure.hand_eye)
    return found


def _affine_alone(hand: str, looks: Sequence[SeenHand]) -> ArmCalibration:
    """Return the paper's calibration: an affine map from the places of the level hand, nothing else."""
    level = [look for look in looks if look.base_from_end[2, 2] > np.cos(_LEVEL_RAD)]
    drawn = arm_chain(hand).forward(np.array([look.joints for look in level]))
    affine = fit_affine(np.array([look.base_from_end[:3, 3] for look in level]), drawn[:, :3, 3])
    return ArmCalibration(hand, affine=tuple(map(tuple, affine.tolist())))


def _grasp(
    bench: _Bench, world: World, robot: SimulatedRobot, arms: Mapping[str, Arm], believed: Mapping[str, np.ndarray],
    true: Mapping[str, np.ndarray],
) -> tuple[list[float], list[float], dict[str, tuple[np.ndarray, np.ndarray]]]:
    """Send each hand to each of its tubes, as a pick does.

    Returns distances [m], tilts [rad] and, by hand, end_from_tube (4, 4) of its last tube as believed and as it is.
    """
    pick = bench.control.pick
    distances, tilts, held = [], [], {}
    for hand, arm in arms.items():
        yaw = pick.yaw_of(hand)
        rest = arm.posture(bench.control.postures.pick)
        for tube in sorted(load_planner_settings().reach[hand], key=lambda name: name != "center"):
            centre = believed[tube] + pick.grip_height * UP
            over, down = (level_hand(point, yaw, pick.centre_beyond_end) for point in (centre + pick.lift * UP, centre))
            above, there = (arm.solve(rest, pose, EngineCode.UNREACHABLE_TUBE, tube, rest).tolist() for pose in (over, down))
            robot.move(dict(zip(arm.joints, above)))
            robot.move(dict(zip(arm.joints, there)))
            base_from_end = world.link_pose(f"{hand[0]}_arm_end_link")
            reached = base_from_end @ (pick.centre_beyond_end, 0.0, 0.0, 1.0)
            distances.append(float(np.hypot(*(reached[:2] - true[tube][:2]))))
            tilts.append(float(np.arccos(np.clip(base_from_end[2, 2], -1.0, 1.0))))
            in_hand = tube_in_hand(arm.pose(world.joint_positions()), believed[tube])
            held[hand] = (in_hand, tube_in_hand(base_from_end, true[tube]))
            robot.move(dict(zip(arm.joints, above)))
        robot.move(_home(bench, (hand,)))
    return distances, tilts, held


def _mouth_error(
    bench: _Bench, world: World, robot: SimulatedRobot, arms: Mapping[str, Arm],
    held: Mapping[str, tuple[np.ndarray, np.ndarray]],
) -> float:
    """Return how far [m] the left tube's mouth is from its place at the right tube's, at the start of a lock-pour."""
    lock, postures = bench.control.lock_pour, bench.control.postures
    geometry = PourGeometry(bench.control.pour_place, lock.lip, bench.pieces)
    wanted = {"left": geometry.source(lock.ready_elevation), "right": geometry.target()}
    goals, true = {}, {}
    for hand, posture in (("left", postures.pour_source), ("right", postures.pour_target)):
        arm = arms[hand]
        rest = arm.posture(posture)
        pose = hand_for_tube(wanted[hand], held[hand][0])
        goals |= dict(zip(arm.joints, arm.solve(rest, pose, EngineCode.UNREACHABLE_POUR, "the pour", rest).tolist()))
    robot.move(goals)
    for hand in arms:
        true[hand] = world.link_pose(f"{hand[0]}_arm_end_link") @ held[hand][1]
    robot.move(_home(bench, HANDS))
    mouth = np.array([0.0, 0.0, bench.pieces.tube_height, 1.0])
    apart = [np.linalg.solve(tubes["right"], tubes["left"] @ mouth)[:3] for tubes in (wanted, true)]
    return float(np.linalg.norm(apart[1] - apart[0]))
