"""A node's private parameters, read once."""

from __future__ import annotations

from typing import Any, Callable, TypeVar

import rospy

from dr_eureka.errors import DrEurekaError
from dr_eureka.game.state import State

T = TypeVar("T")


class ParameterError(DrEurekaError):
    """A parameter is missing or its value cannot be used."""


def private_parameters() -> dict[str, Any]:
    """Return all private parameters of this node as one nested mapping; empty when none is set."""
    parameters = rospy.get_param("~", {})
    if not isinstance(parameters, dict):
        raise ParameterError(f"{rospy.get_name()}: parameters are {parameters!r}; expected a mapping")
    return parameters


def take(parameters: dict[str, Any], key: str) -> Any:
    """Remove a parameter and return its value; raise ParameterError when the launch file does not set it."""
    try:
        return parameters.pop(key)
    except KeyError:
        raise ParameterError(f"{rospy.get_name()}/{key}: parameter is missing; the launch file sets it") from None


def refuse_rest(parameters: dict[str, Any]) -> None:
    """Raise ParameterError when a parameter is left that nobody took: a misspelt name would be ignored."""
    if parameters:
        raise ParameterError(f"{rospy.get_name()}/{sorted(parameters)[0]}: unknown parameter; this node does not know it")


def take_state(parameters: dict[str, Any], key: str) -> State:
    """Remove a parameter that holds a state of the game and return it."""
    return _convert(State.parse, str(take(parameters, key)), key)


def take_state_unless(parameters: dict[str, Any], key: str, word: str) -> State | None:
    """Remove a parameter that holds a state of the game and return it; None when it is empty or the given word."""
    text = str(take(parameters, key))
    return None if text in ("", word) else _convert(State.parse, text, key)


def take_choice(parameters: dict[str, Any], key: str, choices: tuple[str, ...]) -> str:
    """Remove a parameter that must be one of the choices and return it."""
    value = take(parameters, key)
    if value not in choices:
        raise ParameterError(f"{rospy.get_name()}/{key}: is {value!r}; expected one of {', '.join(choices)}")
    return value


def take_count(parameters: dict[str, Any], key: str, least: int) -> int:
    """Remove a parameter that must be a whole number, `least` or more, and return it."""
    value = take(parameters, key)
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise ParameterError(f"{rospy.get_name()}/{key}: is {value!r}; expected a whole number, at least {least}")
    return value


def take_number(parameters: dict[str, Any], key: str, least: float) -> float:
    """Remove a parameter that must be a finite number, `least` or more, and return it."""
    value = take(parameters, key)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value < float("inf"):
        raise ParameterError(f"{rospy.get_name()}/{key}: is {value!r}; expected a number, at least {least:g}")
    return float(value)


def _convert(make: Callable[[str], T], text: str, key: str) -> T:
    """Return `make(text)`; an error of ours gets the parameter's name in front."""
    try:
        return make(text)
    except DrEurekaError as error:
        raise ParameterError(f"{rospy.get_name()}/{key}: {error}") from error
