"""Picking a tube up and putting it down: straight down over it, close, straight up."""

from __future__ import annotations

from typing import Iterator

import numpy as np

from dr_eureka.control.body import Body, Held
from dr_eureka.control.codes import ControlError, EngineCode
from dr_eureka.control.collision import Pair, finger_links, tube_body
from dr_eureka.control.grasp import UP, frame_along, hand_for_tube, level_hand, tube_in_hand
from dr_eureka.control.motion import Follow, Motion, Wait, settled
from dr_eureka.control.port import grip_joint
from dr_eureka.control.trajectory import JointTrajectory, MotionLimits
from dr_eureka.game.planner_settings import load_planner_settings


def fingers(body: Body, hand: str, angle: float) -> tuple[tuple[str], JointTrajectory]:
    """Return the track of a `Follow` that brings a hand's fingers to an angle [rad]."""
    joint = grip_joint(hand)
    return (joint,), JointTrajectory.lasting(np.array([[body.goals[joint]], [angle]]), body.settings.grip.travel_seconds)


def vertical(
    body: Body, hand: str, height: float, limits: MotionLimits, what: str, may_touch: frozenset[Pair] = frozenset()
) -> Follow:
    """Return a straight vertical motion of a hand by `height` [m]."""
    arm, start = body.arms[hand], body.commanded(hand)
    spacing, speed = body.settings.pick.way_point_spacing, body.settings.speeds.line
    line = arm.line(start, height * UP, spacing, speed, limits, EngineCode.UNREACHABLE_TUBE, what)
    return Follow(((arm.joints, line),), may_touch)


def grasp_contacts(hand: str, tube: str) -> frozenset[Pair]:
    """Return the contacts that closing and opening the fingers of a hand on a tube are for."""
    return frozenset(frozenset((tube_body(tube), finger)) for finger in finger_links(hand))


def _standing(body: Body, tube: str) -> frozenset[Pair]:
    """Return the contacts of a tube with what it may be put down on."""
    return frozenset(frozenset((tube_body(tube), name)) for name in body.settings.collision.furniture)


def _level_way(body: Body, hand: str, end: np.ndarray, limits: MotionLimits, what: str, rest: np.ndarray) -> JointTrajectory:
    """Return a straight way of the hand to a pose (4, 4), over standing tubes when both ends are above them."""
    spacing = body.settings.pick.way_point_spacing
    return body.arms[hand].glide(body.commanded(hand), end, spacing, limits, EngineCode.UNREACHABLE_TUBE, what, rest)


def go_home(body: Body) -> Iterator[Motion]:
    """Bring the empty hands to the home posture, above the tubes and out of the camera's view; a hand with a tube stays.

    Where they cannot go at once and straight in joint space, they go one after the other, up first, then over the tubes.
    """
    home = body.settings.postures.home
    limits = body.settings.speeds.move
    empty = {hand: arm for hand, arm in body.arms.items() if hand not in body.held}
    if not empty:
        return
    ways = [(arm.joints, arm.move(body.commanded(hand), arm.posture(home), limits)) for hand, arm in empty.items()]
    at_once = Follow(tuple(ways))
    if body.hit(at_once) is None:
        yield at_once
        return
    for hand, arm in empty.items():
        posture = arm.posture(home)
        end = arm.forward(posture)
        rise = end[2, 3] - arm.forward(body.commanded(hand))[2, 3]
        if rise > 0.0:
            yield vertical(body, hand, rise, limits, "home")
        yield Follow(((arm.joints, _level_way(body, hand, end, limits, "home", posture)),))


def pick(body: Body, hand: str, tube: str) -> Iterator[Motion]:
    """Pick a standing tube up and lift it; raises ControlError UNREACHABLE_TUBE, GRASP_EMPTY or TUBE_SLIPPED."""
    if hand in body.held:
        raise ControlError(EngineCode.INVALID_ACTION, f"{hand} hand already holds tube {body.held[hand].tube!r}")
    arm, settings = body.arms[hand], body.settings
    foot = body.place_of(tube)
    what = f"tube {tube!r}"
    grasp_centre = foot + settings.pick.grip_height * UP
    rest = arm.posture(settings.postures.pick)
    over = level_hand(grasp_centre + settings.pick.lift * UP, settings.pick.yaw_of(hand), settings.pick.centre_beyond_end)
    way = _level_way(body, hand, over, settings.speeds.move, what, rest)
    yield Follow(((arm.joints, way), fingers(body, hand, settings.grip.open)))
    yield vertical(body, hand, -settings.pick.lift, settings.speeds.move, what)
    yield Wait(settled(arm.joints), settings.grip.settle_seconds)

    yield Follow((fingers(body, hand, settings.grip.closed),), grasp_contacts(hand, tube))
    yield Wait(settled((grip_joint(hand),)), settings.grip.settle_seconds)
    body.check_grip(hand, EngineCode.GRASP_EMPTY, f"closed on tube {tube!r}")
    body.held[hand] = Held(tube, tube_in_hand(arm.pose(body.joints), foot))
    del body.places[tube]
    yield vertical(body, hand, settings.pick.lift, settings.speeds.carry, what)
    body.check_grip(hand, EngineCode.TUBE_SLIPPED, f"lifted tube {tube!r}")


def place(body: Body, hand: str, tube: str, foot: np.ndarray) -> Iterator[Motion]:
    """Put a held tube down with its foot at (3,) [m] in base and let go; raises ControlError."""
    arm, settings = body.arms[hand], body.settings
    held = body.held_in(hand, tube)
    what = f"the place of tube {tube!r}"
    yaw = settings.pick.yaw_of(hand)
    approach = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    base_from_tube = frame_along(UP, approach, foot + (settings.pick.lift + settings.pick.place_clearance) * UP)
    rest = arm.posture(settings.postures.pick)
    over = hand_for_tube(base_from_tube, held.end_from_tube)
    way = _level_way(body, hand, over, settings.speeds.carry, what, rest)
    yield Follow(((arm.joints, way),))
    body.check_grip(hand, EngineCode.TUBE_SLIPPED, f"over the place of tube {tube!r}")
    yield vertical(body, hand, -settings.pick.lift, settings.speeds.carry, what, _standing(body, tube))
    yield Wait(settled(arm.joints), settings.grip.settle_seconds)

    standing = (arm.pose(body.joints) @ held.end_from_tube)[:3, 3]
    yield Follow((fingers(body, hand, settings.grip.open),), grasp_contacts(hand, tube))
    yield Wait(settled((grip_joint(hand),)), settings.grip.settle_seconds)
    del body.held[hand]
    body.places[tube] = np.array([standing[0], standing[1], foot[2]])
    yield vertical(body, hand, settings.pick.lift, settings.speeds.move, what)
    if all(tube in reach for reach in load_planner_settings().reach.values()):
        # The other hand may come for it next.
        home = arm.posture(settings.postures.home)
        end = arm.forward(home)
        yield Follow(((arm.joints, _level_way(body, hand, end, settings.speeds.move, "home", home)),))
