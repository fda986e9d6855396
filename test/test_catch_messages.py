"""The catcher's status and what it saw as messages, and back; needs the built messages, but no master."""

import numpy as np
import pytest

pytest.importorskip("dr_eureka.msg", reason="the package's messages are not built")

import rospy
from catch_stand_in import StandIn, thrown_to
from std_msgs.msg import Header

from dr_eureka import msg
from dr_eureka.catching.catch_report import CatchPhase, CatchResult
from dr_eureka.catching.seen_ball import SeenBall
from dr_eureka.nodes import catch_messages
from dr_eureka.nodes.messages import MessageError


@pytest.mark.parametrize("name", CatchPhase.ALL + CatchResult.ALL)
def test_every_phase_and_result_has_a_constant(name):
    assert isinstance(getattr(msg.CatchStatus, name), int)


def test_a_status_tells_phase_last_result_and_prediction():
    stand_in = StandIn()
    report = stand_in.run(lambda t: [thrown_to((-0.3, 0.4, -0.3)).at(t)])
    status = catch_messages.status_to_message(stand_in.catcher, "a problem", rospy.Time(3))
    assert (status.balls, status.result, status.reason) == (1, msg.CatchStatus.MISSED, report.reason)
    assert status.message == "a problem"
    assert status.arrival.to_sec() == pytest.approx(report.prediction.time_s)
    np.testing.assert_allclose([status.place.x, status.place.y, status.place.z], report.prediction.position)
    word = catch_messages.word_from_message(status)
    assert (word.time_s, word.phase) == (3.0, CatchPhase.GETTING_READY)
    assert (word.balls, word.result, word.moves) == (1, "MISSED", report.moves)


def test_a_status_before_the_first_ball_tells_of_none():
    status = catch_messages.status_to_message(StandIn().catcher, "", rospy.Time())
    assert (status.balls, status.result, status.predicted) == (0, msg.CatchStatus.NONE, False)
    assert catch_messages.word_from_message(status).result == ""


def test_a_number_that_the_message_does_not_know_is_refused():
    with pytest.raises(MessageError, match="99"):
        catch_messages.word_from_message(msg.CatchStatus(phase=99))


def test_seen_balls_keep_the_picture_s_header():
    header = Header(stamp=rospy.Time(1, 5), frame_id="left_camera")
    seen = catch_messages.seen_to_message(header, "left", [SeenBall((1.5, 2.5), 30.0, 0.9)], "")
    assert (seen.header.stamp, seen.side) == (rospy.Time(1, 5), "left")
    ball = seen.balls[0]
    assert (ball.column, ball.row, ball.diameter, ball.confidence) == (1.5, 2.5, 30.0, 0.9)
