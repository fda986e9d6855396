"""Values of the cores as messages of this package, and back."""

from __future__ import annotations

from typing import Sequence

import numpy as np
import rospy
from geometry_msgs.msg import Point, Pose, Quaternion
from std_msgs.msg import Header

from dr_eureka import msg
from dr_eureka.behaviour.looks import TubesFinding
from dr_eureka.behaviour.observation import EngineView, ImageHeader
from dr_eureka.behaviour.report import ActionRecord, GameCode, GameReport, Phase
from dr_eureka.control.codes import EngineCode, EngineState
from dr_eureka.control.engine import EngineStatus
from dr_eureka.errors import DrEurekaError
from dr_eureka.game.actions import Action
from dr_eureka.game.state import Pour
from dr_eureka.kinematics.transforms import matrix_to_quaternion, quaternion_to_matrix, transform
from dr_eureka.vision.card_drawing import balls_in_image
from dr_eureka.vision.cards import CardReading

BASE_FRAME = "base"
CAMERA_FRAME = "cam_link"


class MessageError(DrEurekaError):
    """A message that carries a value its definition does not know."""


_ENGINE_STATES = (EngineState.IDLE, EngineState.BUSY, EngineState.DONE, EngineState.FAULT)
# The state BUSY has the plain name in EngineStatus.msg, so the code has another.
_CODE_CONSTANTS = {code: "ENGINE_BUSY" if code == EngineCode.BUSY else code for code in EngineCode.ALL}


def engine_code_number(code: str) -> int:
    """Return the constant of EngineStatus.msg for a code of the engine; UNKNOWN for one the message lacks."""
    return getattr(msg.EngineStatus, _CODE_CONSTANTS.get(code, code), msg.EngineStatus.UNKNOWN)


def engine_code_name(number: int) -> str:
    """Return the engine's code for a constant of EngineStatus.msg."""
    names = {getattr(msg.EngineStatus, constant, None): code for code, constant in _CODE_CONSTANTS.items()}
    return names.get(number, "UNKNOWN")


def engine_status_to_message(status: EngineStatus, strategy_id: int, time: rospy.Time) -> msg.EngineStatus:
    """Return the engine's status, as of the joint state of this time, as its message."""
    message = msg.EngineStatus(
        state=getattr(msg.EngineStatus, status.state),
        code=engine_code_number(status.code),
        strategy_id=strategy_id,
        action_index=status.action_index,
        message=status.message,
        paused=status.paused,
        at_once=status.at_once,
    )
    message.header.stamp = time
    return message


def engine_view(status: msg.EngineStatus, heard_wall_s: float) -> EngineView:
    """Return the engine's status as the game flow sees it."""
    states = {getattr(msg.EngineStatus, state): state for state in _ENGINE_STATES}
    return EngineView(
        state=states.get(status.state, EngineState.FAULT),
        code=engine_code_name(status.code),
        strategy_id=status.strategy_id,
        action_index=status.action_index,
        message=status.message,
        heard_wall_s=heard_wall_s,
        held={tube.name: pose_from_message(tube.pose) for tube in status.held},
        at_once=max(1, status.at_once),
    )


def action_to_message(action: Action) -> msg.Action:
    """Return an action as its message; fields that do not apply are empty."""
    return msg.Action(
        kind=action.kind,
        hand=action.hand,
        tube=action.tube,
        target_hand=action.target_hand or "",
        target_tube=action.target_tube or "",
        count=action.count,
    )


def action_from_message(message: msg.Action) -> Action:
    """Return the action in a message; the engine judges whether it makes sense."""
    return Action(
        kind=message.kind,
        hand=message.hand,
        tube=message.tube,
        target_tube=message.target_tube or None,
        target_hand=message.target_hand or None,
        count=message.count,
    )


def pour_to_message(pour: Pour) -> msg.Pour:
    """Return a pour as its message."""
    return msg.Pour(source=pour.source, target=pour.target, count=pour.count)


def pours_from_messages(messages: Sequence[msg.Pour]) -> tuple[Pour, ...]:
    """Return the pours in a list of messages."""
    return tuple(Pour(message.source, message.target, message.count) for message in messages)


def tube_to_message(name: str, position: Sequence[float], sigma_m: float) -> msg.TubePlace:
    """Return a tube's place, foot centre in base [m], as its message."""
    return msg.TubePlace(name=name, position=Point(*map(float, position)), sigma=float(sigma_m))


def tubes_from_messages(messages: Sequence[msg.TubePlace]) -> dict[str, np.ndarray]:
    """Return the foot centres (3,) in base [m] by tube name."""
    return {tube.name: np.array([tube.position.x, tube.position.y, tube.position.z]) for tube in messages}


def held_tube_to_message(name: str, base_from_tube: np.ndarray) -> msg.HeldTube:
    """Return a tube in a hand, pose (4, 4) in base, as its message."""
    return msg.HeldTube(name=name, pose=pose_to_message(base_from_tube))


def pose_from_message(pose: Pose) -> np.ndarray:
    """Return a pose as a (4, 4) transform."""
    turn, place = pose.orientation, pose.position
    return transform(quaternion_to_matrix([turn.x, turn.y, turn.z, turn.w]), [place.x, place.y, place.z])


def pose_to_message(transform: np.ndarray) -> Pose:
    """Return a (4, 4) transform as a pose."""
    return Pose(Point(*transform[:3, 3]), Quaternion(*matrix_to_quaternion(transform[:3, :3])))


def card_to_message(reading: CardReading, header: ImageHeader, images: int) -> msg.CardDetection:
    """Return what was read in the image of this header, the decision of so many, as its message."""
    return msg.CardDetection(
        header=header_to_message(header),
        result=getattr(msg.CardDetection, reading.result),
        state=reading.state or "",
        confidence=float(reading.confidence),
        corners=[] if reading.corners is None else np.asarray(reading.corners, dtype=float).ravel().tolist(),
        balls=[msg.CardBall(ball.colour, ball.x, ball.y, ball.diameter, ball.confidence) for ball in balls_in_image(reading)],
        images=images,
        reason=reading.reason,
    )


def header_to_message(header: ImageHeader) -> Header:
    """Return an image's header as its message; the stamp is the image's to the nanosecond."""
    return Header(stamp=rospy.Time(0, header.stamp_ns), frame_id=header.frame_id)


def scene_to_message(finding: TubesFinding) -> msg.TubeScene:
    """Return located tubes and what they hold as their message."""
    scene = finding.scene
    message = msg.TubeScene(
        result=msg.TubeScene.OK,
        tubes=[tube_to_message(name, place.position, place.sigma_m) for name, place in scene.tubes.items()],
        sheet=pose_to_message(scene.base_from_sheet),
        markers_seen=list(scene.markers_seen),
        images=finding.images,
        state=str(finding.state),
    )
    message.header.stamp = header_to_message(finding.header).stamp
    message.header.frame_id = BASE_FRAME
    return message


def stamp(seconds: float) -> rospy.Time:
    """Return a time from robot seconds."""
    return rospy.Time.from_sec(seconds)


def report_to_message(report: GameReport, now_s: float) -> msg.GameStatus:
    """Return a game report as its message; times of actions become robot time again."""
    began_s = now_s - report.robot_seconds
    status = msg.GameStatus(
        phase=getattr(msg.GameStatus, report.phase),
        code=getattr(msg.GameStatus, report.code),
        game=report.game,
        games=report.games,
        start=report.start,
        card=report.card,
        goal=report.goal,
        strategy=report.strategy,
        pour=report.pour,
        pours=[pour_to_message(pour) for pour in report.pours],
        actions=[
            msg.ActionRecord(
                action=action_to_message(record.action),
                start=stamp(began_s + record.start_s),
                end=stamp(began_s + record.end_s),
                failed=record.failed,
            )
            for record in report.actions
        ],
        replans=report.replans,
        simulated_seconds=report.robot_seconds,
        wall_seconds=report.wall_seconds,
        message=report.message,
    )
    status.header.stamp = stamp(now_s)
    return status


def report_from_message(status: msg.GameStatus) -> GameReport:
    """Return the game report in a message."""
    began_s = status.header.stamp.to_sec() - status.simulated_seconds
    return GameReport(
        phase=_named(Phase.ALL, status.phase),
        code=_named(GameCode.ALL, status.code),
        game=status.game,
        games=status.games,
        start=status.start,
        card=status.card,
        goal=status.goal,
        strategy=status.strategy,
        pour=status.pour,
        pours=pours_from_messages(status.pours),
        actions=tuple(
            ActionRecord(
                action_from_message(record.action),
                record.start.to_sec() - began_s,
                record.end.to_sec() - began_s,
                record.failed,
            )
            for record in status.actions
        ),
        replans=status.replans,
        robot_seconds=status.simulated_seconds,
        wall_seconds=status.wall_seconds,
        message=status.message,
    )


def _named(names: Sequence[str], number: int) -> str:
    """Return the name among `names` whose constant in GameStatus.msg is `number`; raise MessageError for another number."""
    for name in names:
        if getattr(msg.GameStatus, name) == number:
            return name
    raise MessageError(f"GameStatus carries the number {number}, expected that of one of {', '.join(names)}")
