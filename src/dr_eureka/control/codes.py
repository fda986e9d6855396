"""Names of the engine's states and of everything that can end a strategy."""

from __future__ import annotations

from dr_eureka.errors import DrEurekaError

POUR_METHODS = ("lock", "linear", "profiled")


class EngineState:
    """What the engine is doing."""

    IDLE = "IDLE"
    BUSY = "BUSY"
    DONE = "DONE"
    FAULT = "FAULT"


class EngineCode:
    """Why the engine is where it is; every fault has a name."""

    OK = "OK"
    BUSY = "BUSY"
    STOPPED = "STOPPED"
    UNKNOWN_JOINT = "UNKNOWN_JOINT"
    INVALID_VALUE = "INVALID_VALUE"
    INVALID_ACTION = "INVALID_ACTION"
    OUT_OF_LIMITS = "OUT_OF_LIMITS"
    UNREACHABLE_TUBE = "UNREACHABLE_TUBE"
    UNREACHABLE_POUR = "UNREACHABLE_POUR"
    COLLISION = "COLLISION"
    GRASP_EMPTY = "GRASP_EMPTY"
    TUBE_SLIPPED = "TUBE_SLIPPED"
    TRACKING_ERROR = "TRACKING_ERROR"
    JOINT_STATES_LOST = "JOINT_STATES_LOST"
    NO_JOINT_STATES = "NO_JOINT_STATES"
    INTERNAL_ERROR = "INTERNAL_ERROR"

    PUT_DOWN = (GRASP_EMPTY, TUBE_SLIPPED)
    """Faults after which the engine puts down what it still holds and goes home: one can look, and try again."""

    ALL = (
        OK, BUSY, STOPPED, UNKNOWN_JOINT, INVALID_VALUE, INVALID_ACTION, OUT_OF_LIMITS, UNREACHABLE_TUBE,
        UNREACHABLE_POUR, COLLISION, GRASP_EMPTY, TUBE_SLIPPED, TRACKING_ERROR, JOINT_STATES_LOST, NO_JOINT_STATES,
        INTERNAL_ERROR,
    )


class ControlError(DrEurekaError):
    """A motion that cannot be planned or must not go on; `code` is one of `EngineCode.ALL`."""

    def __init__(self, code: str, message: str):
        super().__init__(f"{code}: {message}")
        self.code = code
        self.message = message
