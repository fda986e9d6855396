"""Both tubes in the robot's hands, again and again: the bench on which pours are tried, calibrated and counted.

A world is made with the tubes between the open fingers, where a pick would have brought the hands; from there on all that
happens is the robot's doing: the fingers close, the arms lift and bring the tubes together, and pour. What is tried after
that starts from the world as it then was, so that many pours share one grasp.
"""
from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from dr_eureka.bench.pour_places import nominal_feet, scattered
from dr_eureka.bench.pour_spread import Spread
from dr_eureka.control.body import Held
from dr_eureka.control.codes import ControlError, EngineCode
from dr_eureka.control.engine import ControlEngine
from dr_eureka.control.grasp import UP, level_hand, tube_in_hand
from dr_eureka.control.limits import CommandLimiter, JointLimit
from dr_eureka.control.motion import Follow, Motion, Wait, settled
from dr_eureka.control.port import CONTROLLED_JOINTS, grip_joint
from dr_eureka.control.pouring import pour
from dr_eureka.control.settings import ControlSettings
from dr_eureka.control.trajectory import JointTrajectory
from dr_eureka.game.hands import HANDS, other_hand
from dr_eureka.game.state import State
from dr_eureka.kinematics.transforms import rotation_about, transform
from dr_eureka.pieces import Pieces
from dr_eureka.simulation.settings import CameraSettings, WorldSettings
from dr_eureka.simulation.stage import Stage
from dr_eureka.simulation.world import Snapshot, World

START_OF_TRIALS = State.parse("RR|GGPP|")
# [m] balls that a trial does not need fall for ever, from below the floor: they cost nothing and are nobody's.
FAR_BELOW = -10.0
# [s] until balls that were laid into a tube, or were poured, are at rest in it.
SETTLE_S = 0.12


@dataclass(frozen=True)
class PourKind:
    """A pour: by which method, out of the tube in which hand, balls in it before, balls to pour, balls in the other tube."""

    method: str
    hand: str
    held: int
    count: int
    in_target: int


@dataclass(frozen=True)
class Poured:
    """What became of it: balls that arrived, balls in neither tube, robot time from ready to ready [s].

    `code`: OK, or why the engine broke it off.
    """

    arrived: int
    lost: int
    seconds: float
    code: str = EngineCode.OK


@dataclass(frozen=True)
class _Moment:
    """The world at a moment, the joint goals [rad] then, and what the body knew of the pour: see `control.body.Body`."""

    world: Snapshot
    goals: dict[str, float]
    pour_ready: tuple[str, str] | None
    upright: dict[str, np.ndarray]


class PourRig:
    """One grasp of both tubes, drawn from a seed, and pours from there; raises ControlError when the grasp itself fails.

    `feet`: by tube, where the robot believes that it stands (3,) [m] in base, by default its nominal place. Each hand takes the
    tube of its side.
    Source: the trials of paper 4.4, Table 2.
    """

    def __init__(
        self, control: ControlSettings, world: WorldSettings, pieces: Pieces, spread: Spread, seed: int, stage: Stage,
        camera: CameraSettings | None = None, feet: Mapping[str, np.ndarray] | None = None,
    ):
        self._control, self._pieces, self._spread = control, pieces, spread
        self._rng = np.random.default_rng((seed, 7))
        self.tilts: dict[str, float] = {}
        """By hand, how far [rad] the tube in it leans to how it is believed to."""
        engine = ControlEngine(control, pieces)
        self.body, self._ranges = engine.body, engine.ranges
        feet = feet or nominal_feet(world)
        self.world = World(self._laid_out(world, feet), seed, START_OF_TRIALS, pieces=pieces, camera=camera, stage=stage)
        joints = self.world.joint_positions()
        self.body.goals = {name: joints[name] for name in CONTROLLED_JOINTS}
        self.body.joints, self.body.places = joints, {"center": feet["center"]}
        self._limiter = self._fresh_limiter()
        self._run(self._grasp(feet))
        self._lifted = self._moment()
        self._ready: dict[tuple[str, str], _Moment] = {}

    def _laid_out(self, world: WorldSettings, feet: Mapping[str, np.ndarray]) -> WorldSettings:
        """Return a world with the open fingers round where the tubes are believed to stand, `feet` (3,) [m]."""
        pick, grip = self._control.pick, self._control.grip
        start = {"head_p": 0.42}
        for hand in HANDS:
            arm, foot = self.body.arms[hand], feet[hand]
            yaw = pick.yaw_of(hand)
            pose = level_hand(foot + pick.grip_height * UP, yaw, pick.centre_beyond_end)
            rest = arm.posture(self._control.postures.pick)
            angles = arm.solve(rest, pose, EngineCode.UNREACHABLE_TUBE, f"the {hand} tube", rest)
            start |= dict(zip(arm.joints, angles.tolist()))
            start[grip_joint(hand)] = grip.open
        world = scattered(world, self._spread)
        return replace(world, layout=replace(world.layout, start_joints=start))

    def _grasp(self, feet: Mapping[str, np.ndarray]) -> Iterator[Motion]:
        """Close both hands and lift, as two picks do."""
        control, body = self._control, self.body
        joints = tuple(grip_joint(hand) for hand in HANDS)
        ends = np.array([[control.grip.open] * 2, [control.grip.closed] * 2])
        yield Follow(((joints, JointTrajectory.lasting(ends, control.grip.travel_seconds)),))
        yield Wait(settled(joints), control.grip.settle_seconds)
        lines = []
        for hand in HANDS:
            body.check_grip(hand, EngineCode.GRASP_EMPTY, f"closed on tube {hand!r}")
            arm = body.arms[hand]
            end_from_tube = tube_in_hand(arm.pose(body.joints), feet[hand])
            body.held[hand] = Held(hand, end_from_tube @ self._misjudged(hand))
            start, lift, spacing = body.commanded(hand), control.pick.lift * UP, control.pick.way_point_spacing
            speeds = control.speeds
            line = arm.line(start, lift, spacing, speeds.line, speeds.carry, EngineCode.UNREACHABLE_TUBE, hand)
            lines.append((arm.joints, line))
        yield Follow(tuple(lines))

    def _misjudged(self, hand: str) -> np.ndarray:
        """Draw how a held tube sits to how it is believed to, tube_from_believed (4, 4): about the middle of the grasp."""
        shift = self._rng.uniform(-self._spread.grasp, self._spread.grasp, 3)
        tilts = self._rng.uniform(-self._spread.tilt, self._spread.tilt, 2)
        turn = rotation_about((1.0, 0.0, 0.0), tilts[0]) @ rotation_about((0.0, 1.0, 0.0), tilts[1])
        self.tilts[hand] = float(np.linalg.norm(tilts))
        centre = self._control.pick.grip_height * UP
        return transform(turn, centre + shift - turn @ centre)

    def pour(
        self, kind: PourKind, settings: ControlSettings | None = None, each_cycle: Callable[[float], None] | None = None
    ) -> Poured:
        """Pour once from the ready pose of that kind and count, with the rig's own or other settings.

        `each_cycle` gets the time since the pour began [s] in each control cycle. Raises ControlError where the tubes do not even
        come to the ready pose.
        """
        self.body.settings = settings or self._control
        target_hand = other_hand(kind.hand)
        self._make_ready(kind, target_hand)
        self._fill({kind.hand: kind.held, target_hand: kind.in_target})
        skill = pour(self.body, kind.hand, target_hand, kind.method, kind.held, kind.count)
        began, code = self.world.time_s, EngineCode.OK
        try:
            self._run(skill, each_cycle)
        except ControlError as error:
            code = error.code
        seconds = self.world.time_s - began
        self._wait(SETTLE_S)
        held = {hand: len(self.world.referee().tubes[hand]) for hand in HANDS}
        lost = kind.held + kind.in_target - sum(held.values())
        return Poured(held[target_hand] - kind.in_target, lost, seconds, code)

    def _make_ready(self, kind: PourKind, target_hand: str) -> None:
        """Go back to when the tubes came to the ready pose, or bring them there for the first time."""
        key = kind.method, kind.hand
        if key not in self._ready:
            self._back_to(self._lifted)
            for motion in pour(self.body, kind.hand, target_hand, kind.method, kind.held, kind.count):
                if self.body.pour_ready is not None:
                    break
                self._run([motion])
            self._wait(SETTLE_S)
            self._ready[key] = self._moment()
        self._back_to(self._ready[key])

    def _fill(self, counts: dict[str, int]) -> None:
        """Lay balls into the held tubes where they come to rest, and let them."""
        pieces, balls = self._pieces, iter(range(len(self.world.ball_positions())))
        for ball in range(len(self.world.ball_positions())):
            self.world.put_ball(ball, np.array([0.1 * ball, 0.0, FAR_BELOW]))
        for hand, count in counts.items():
            pose = self.world.tube_pose(hand)
            down = -UP - (-UP @ pose[:3, 2]) * pose[:3, 2]
            aside = (pieces.tube_bore / 2.0 - pieces.ball_radius) * down / max(np.linalg.norm(down), 1e-9)
            for place in range(count):
                along = pieces.tube_floor + pieces.ball_radius + place * pieces.ball_diameter
                self.world.put_ball(next(balls), pose[:3, 3] + along * pose[:3, 2] + aside)
        self._wait(SETTLE_S)

    def _moment(self) -> _Moment:
        return _Moment(self.world.remember(), dict(self.body.goals), self.body.pour_ready, dict(self.body.upright))

    def _back_to(self, moment: _Moment) -> None:
        self.world.go_back(moment.world)
        self.body.goals, self.body.upright = dict(moment.goals), dict(moment.upright)
        self.body.pour_ready = moment.pour_ready
        self.body.joints = self.world.joint_positions()
        self._limiter = self._fresh_limiter()

    def _fresh_limiter(self) -> CommandLimiter:
        speeds = self._control.speeds
        limits = {name: JointLimit(*ends, speeds.hardware) for name, ends in self._ranges.items()}
        limiter = CommandLimiter(limits, speeds.longest_step)
        limiter.reset(self.world.time_s, self.body.goals)
        return limiter

    def _wait(self, seconds: float) -> None:
        self._run([Wait(lambda *_: False, seconds)])

    def _run(self, motions: Iterable[Motion], each_cycle: Callable[[float], None] | None = None) -> None:
        """Let motions happen one after the other, checked and cycle by cycle as the engine does."""
        started = self.world.time_s
        for motion in motions:
            hit = self.body.hit(motion) if isinstance(motion, Follow) else None
            if hit is not None:
                raise ControlError(EngineCode.COLLISION, str(hit))
            began = self.world.time_s
            while True:
                now = self.world.time_s
                self.body.joints = self.world.joint_positions()
                self.body.goals |= self._limiter.apply(now, self.body.goals | motion.goals(now - began))
                if motion.over(now - began, self.body.joints):
                    break
                self.world.set_joint_goals(self.body.goals)
                self.world.advance_cycle()
                if each_cycle is not None:
                    each_cycle(now - started)
