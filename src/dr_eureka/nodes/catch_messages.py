"""Values of the catching behaviour as messages of this package, and back."""

from __future__ import annotations

from typing import Sequence

import rospy
from geometry_msgs.msg import Point
from std_msgs.msg import Header

from dr_eureka import msg
from dr_eureka.catching.catch_report import CatchPhase, CatchResult, RobotWord
from dr_eureka.catching.catcher import Catcher
from dr_eureka.catching.seen_ball import SeenBall
from dr_eureka.nodes.messages import BASE_FRAME, MessageError


def seen_to_message(header: Header, side: str, balls: Sequence[SeenBall], problem: str) -> msg.SeenBalls:
    """Return what was found in the picture of this header as its message."""
    return msg.SeenBalls(
        header=header,
        side=side,
        balls=[msg.SeenBall(*ball.centre_px, ball.diameter_px, ball.confidence) for ball in balls],
        problem=problem,
    )


def status_to_message(catcher: Catcher, problem: str, stamp: rospy.Time) -> msg.CatchStatus:
    """Return the catcher's status, as of this time, as its message."""
    last = catcher.reports[-1] if catcher.reports else None
    status = msg.CatchStatus(
        phase=getattr(msg.CatchStatus, catcher.phase),
        balls=len(catcher.reports),
        result=getattr(msg.CatchStatus, last.result) if last else msg.CatchStatus.NONE,
        reason=last.reason if last else "",
        moves=last.moves if last else 0,
        message=problem,
    )
    status.header.stamp, status.header.frame_id = stamp, BASE_FRAME
    prediction = catcher.prediction or (last.prediction if last else None)
    if prediction is not None:
        status.predicted = True
        status.arrival = rospy.Time.from_sec(max(prediction.time_s, 0.0))
        status.arrival_sigma = prediction.time_sigma_s
        status.place = Point(*prediction.position)
        status.sigma = prediction.sigma_m
        status.points = prediction.points
    return status


def word_from_message(status: msg.CatchStatus) -> RobotWord:
    """Return what the robot says in its status; raises MessageError for a number that the message does not know."""
    result = "" if status.result == msg.CatchStatus.NONE else _named(CatchResult.ALL, status.result)
    phase = _named(CatchPhase.ALL, status.phase)
    return RobotWord(status.header.stamp.to_sec(), phase, status.balls, result, status.reason, status.moves)


def _named(names: Sequence[str], number: int) -> str:
    for name in names:
        if getattr(msg.CatchStatus, name) == number:
            return name
    raise MessageError(f"CatchStatus carries the number {number}, expected that of one of {', '.join(names)}")
