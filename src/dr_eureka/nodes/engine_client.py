"""The control engine seen from another node: requests that end in time, and its last status."""

from __future__ import annotations

import threading
import time
from typing import Any, Mapping, Optional, Sequence

import rospy
from std_srvs.srv import Trigger, TriggerRequest

from dr_eureka import msg, srv
from dr_eureka.behaviour.observation import NO_ANSWER, Answer, EngineView, Gaze
from dr_eureka.game.actions import Action
from dr_eureka.nodes import messages


class EngineClient:
    """Commands `control_engine` by service (`behaviour.observation.Robot`) and listens to its status.

    With `hands_at_once`, strategies are asked for with both hands picking and placing at the same time.
    """

    def __init__(self, limit_s: float, hands_at_once: bool = False):
        self._limit_s = limit_s
        self._hands_at_once = hands_at_once
        self._view: Optional[EngineView] = None
        self._set_joints = rospy.ServiceProxy("control_engine/set_joints", srv.SetJoints)
        self._execute_strategy = rospy.ServiceProxy("control_engine/execute_strategy", srv.ExecuteStrategy)
        self._go_on = rospy.ServiceProxy("control_engine/go_on", srv.GoOn)
        self._stop = rospy.ServiceProxy("control_engine/stop", Trigger)
        rospy.Subscriber("control_engine/status", msg.EngineStatus, self._on_status, queue_size=10)

    @property
    def view(self) -> Optional[EngineView]:
        """The last status, None before the first."""
        return self._view

    def look_at(self, gaze: Gaze, duration_s: float) -> Answer:
        """Begin to turn the head."""
        return self.move_joints({"head_y": gaze.head_y, "head_p": gaze.head_p}, duration_s)

    def move_joints(self, goals: Mapping[str, float], duration_s: float = 0.0) -> Answer:
        """Begin to bring joints to positions [rad], as quickly as the engine's limits allow when no duration is given."""
        return self._ask(self._set_joints, srv.SetJointsRequest(list(goals), list(goals.values()), duration_s))

    def execute(self, actions: Sequence[Action], tubes: Mapping[str, Any], balls: Mapping[str, int], pour: str) -> Answer:
        """Begin a strategy that pauses after each pour but the last.

        `tubes` are `vision.tubes.TubePlace` by name, `balls` how many each tube holds.
        """
        request = srv.ExecuteStrategyRequest(
            actions=[messages.action_to_message(action) for action in actions],
            tubes=[messages.tube_to_message(name, place.position, place.sigma_m) for name, place in tubes.items()],
            balls=bytes(balls[name] for name in tubes),
            pour=pour,
            pause_after_pours=True,
            hands_at_once=self._hands_at_once,
        )
        return self._ask(self._execute_strategy, request)

    def go_on(self, put_down: bool) -> Answer:
        """End the engine's pause after a pour: carry the strategy on, or put down what is held and leave the rest."""
        return self._ask(self._go_on, srv.GoOnRequest(put_down))

    def stop(self) -> Answer:
        """Stop whatever moves, and hold."""
        return self._ask(self._stop, TriggerRequest())

    def _on_status(self, status: msg.EngineStatus) -> None:
        self._view = messages.engine_view(status, time.monotonic())

    def _ask(self, service: rospy.ServiceProxy, request: Any) -> Answer:
        """Call a service, but never wait longer than the limit: a stopped process would keep rospy waiting for ever.

        A request that was not sent within the limit is not sent later.
        """
        name = service.resolved_name
        answers: list[Answer] = []
        given_up = threading.Event()

        def call() -> None:
            try:
                rospy.wait_for_service(name, self._limit_s)
                if given_up.is_set():
                    return
                response = service(request)
                strategy_id = getattr(response, "strategy_id", 0)
                result = getattr(response, "result", msg.EngineStatus.OK)
                answers.append(Answer(messages.engine_code_name(result), response.message, strategy_id))
            except (rospy.ROSException, rospy.ServiceException) as error:
                answers.append(Answer(NO_ANSWER, f"{name}: {error}"))

        caller = threading.Thread(target=call, daemon=True)
        caller.start()
        caller.join(self._limit_s)
        given_up.set()
        return answers[0] if answers else Answer(NO_ANSWER, f"{name}: no answer within {self._limit_s:g} s")
