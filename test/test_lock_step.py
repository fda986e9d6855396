"""Holding the simulation back until the controller has answered, without a master."""

import threading
import time

import pytest

pytest.importorskip("rospy")

import rospy
from sensor_msgs.msg import JointState

from dr_eureka.nodes.lock_step import LockStep

CYCLE_NS = 8_000_000


def answer(number):
    command = JointState()
    command.header.stamp = rospy.Time(0, number * CYCLE_NS)
    return command


def expecting(number, limit_s=1.0, connected=True):
    lock_step = LockStep(limit_s, lambda: connected)
    lock_step.expect(number * CYCLE_NS)
    return lock_step


def took_s(lock_step):
    began_s = time.monotonic()
    lock_step.take()
    return time.monotonic() - began_s


def test_nobody_is_waited_for_before_the_first_answer():
    assert took_s(expecting(7)) < 0.5


def test_an_answer_of_this_cycle_is_waited_for_once_the_controller_has_answered():
    lock_step = expecting(7, limit_s=10.0)
    lock_step.on_command(answer(7))
    assert [command.header.stamp for command in lock_step.take()] == [answer(7).header.stamp]
    lock_step.expect(8 * CYCLE_NS)
    threading.Timer(0.1, lock_step.on_command, [answer(8)]).start()
    assert 0.05 < took_s(lock_step) < 5.0


def test_the_very_first_answer_is_waited_for_when_the_controller_is_known_to_be_there():
    lock_step = expecting(7, limit_s=10.0)
    lock_step.rely_on_answers()
    threading.Timer(0.1, lock_step.on_command, [answer(7)]).start()
    assert 0.05 < took_s(lock_step) < 5.0


def test_a_controller_a_few_cycles_late_is_waited_for_from_then_on():
    lock_step = expecting(7)
    lock_step.on_command(answer(4))
    assert lock_step.answering


def test_commands_of_somebody_who_answers_nothing_are_taken_but_not_waited_for():
    lock_step = expecting(1000)
    lock_step.on_command(answer(0))
    assert not lock_step.answering
    assert len(lock_step.take()) == 1


def test_a_controller_that_no_longer_answers_is_given_up_after_the_limit_and_only_once():
    lock_step = expecting(7, limit_s=0.2)
    lock_step.on_command(answer(7))
    lock_step.take()
    lock_step.expect(8 * CYCLE_NS)
    assert 0.15 < took_s(lock_step) < 2.0
    lock_step.expect(9 * CYCLE_NS)
    assert took_s(lock_step) < 0.1


def test_a_controller_that_went_away_is_not_waited_for():
    lock_step = expecting(7, limit_s=60.0, connected=False)
    lock_step.on_command(answer(7))
    lock_step.take()
    lock_step.expect(8 * CYCLE_NS)
    assert took_s(lock_step) < 5.0
