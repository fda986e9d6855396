"""Settings as immutable dataclasses, built once from a mapping and checked as a whole.

A node's yaml or ROS parameters arrive as nested dicts. `build` turns them into frozen dataclasses, so that the code
behind never meets a missing, misspelt or impossible value. Limits stand beside the field they limit:

    step_m: float = field(metadata={"min": 0.0, "max": 0.05})
    pour: str = field(default="lock", metadata={"choices": ("lock", "linear")})
"""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from typing import Any, Iterable, Mapping, TypeVar

from dr_eureka.errors import DrEurekaError

T = TypeVar("T")


class SettingsError(DrEurekaError):
    """A setting is unknown, missing, of the wrong type or out of range.

    Attributes: `where` (file or source), `key` (dotted), `value` (what was found, None when missing), `expected`.
    """

    def __init__(self, where: str, key: str, problem: str, expected: str, value: Any = None):
        super().__init__(f"{where}: {key}: {problem}; expected {expected}")
        self.where = where
        self.key = key
        self.value = value
        self.expected = expected


def expect_keys(where: str, key: str, table: Mapping[Any, Any], needed: Iterable, allowed: Iterable = ()) -> None:
    """Raise SettingsError when a table lacks a needed key or has one that is neither needed nor allowed."""
    needed = tuple(needed)
    strange = [name for name in table if name not in (*needed, *allowed)]
    missing = [name for name in needed if name not in table]
    if strange or missing:
        problem = f"has the unknown key {strange[0]!r}" if strange else f"lacks the key {missing[0]!r}"
        raise SettingsError(where, key, problem, f"the keys {', '.join(map(str, needed))}", table)


def build(cls: type[T], mapping: Mapping[str, Any], where: str = "settings") -> T:
    """Build the frozen dataclass `cls` from a mapping, refusing whatever does not fit.

    Fields may be bool, int, float, str, nested dataclasses, `tuple[X, ...]`, `tuple[X, Y]`, `dict[K, V]` and
    `Optional[X]`. A whole number is taken for a float field, and digits for the key of a
    `dict[int, V]`; nothing else is converted. The field metadata `min` and
    `max` (both allowed values) and `choices` hold for each number or word inside a tuple or dict as well.
    Raises SettingsError naming `where`, the key, the value and what was expected.
    """
    return _dataclass(cls, mapping, where, "")


def _dataclass(cls: type, mapping: Any, where: str, key: str) -> Any:
    if not isinstance(mapping, Mapping):
        raise SettingsError(where, key or "top level", f"is {mapping!r}", f"a mapping with the keys of {cls.__name__}", mapping)
    fields = {field.name: field for field in dataclasses.fields(cls) if field.init}
    for name in mapping:
        if name not in fields:
            raise SettingsError(where, _join(key, name), "unknown key", f"one of {', '.join(fields)}", mapping[name])
    hints = typing.get_type_hints(cls)
    values = {}
    for name, field in fields.items():
        if name in mapping:
            values[name] = _value(hints[name], mapping[name], where, _join(key, name), field.metadata)
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            raise SettingsError(where, _join(key, name), "missing key", _describe(hints[name], field.metadata))
    return cls(**values)


def _value(hint: Any, value: Any, where: str, key: str, limits: Mapping[str, Any]) -> Any:
    origin = typing.get_origin(hint)
    if origin in (typing.Union, types.UnionType):
        inner = [arg for arg in typing.get_args(hint) if arg is not type(None)]
        if len(inner) != 1 or type(None) not in typing.get_args(hint):
            raise TypeError(f"{key}: settings know Optional[X], not {hint}")
        return None if value is None else _value(inner[0], value, where, key, limits)
    if dataclasses.is_dataclass(hint):
        return _dataclass(hint, value, where, key)
    if origin is tuple:
        return _tuple(hint, value, where, key, limits)
    if origin is dict:
        return _dict(hint, value, where, key, limits)
    return _leaf(hint, value, where, key, limits)


def _tuple(hint: Any, value: Any, where: str, key: str, limits: Mapping[str, Any]) -> tuple:
    args = typing.get_args(hint)
    if not isinstance(value, (list, tuple)):
        raise SettingsError(where, key, f"is {value!r}", _describe(hint, limits), value)
    if len(args) == 2 and args[1] is Ellipsis:
        args = (args[0],) * len(value)
    if len(args) != len(value):
        raise SettingsError(where, key, f"has {len(value)} values, {list(value)!r}", _describe(hint, limits), value)
    return tuple(_value(arg, item, where, f"{key}[{index}]", limits) for index, (arg, item) in enumerate(zip(args, value)))


def _dict(hint: Any, value: Any, where: str, key: str, limits: Mapping[str, Any]) -> dict:
    key_hint, value_hint = typing.get_args(hint)
    if not isinstance(value, Mapping):
        raise SettingsError(where, key, f"is {value!r}", _describe(hint, {}), value)
    built = {}
    for name, item in value.items():
        # ROS parameters have words alone for names: there a whole number is written as one.
        number = int(name) if key_hint is int and isinstance(name, str) and name.isdecimal() else name
        built[_leaf(key_hint, number, where, f"key of {key}", {})] = _value(value_hint, item, where, _join(key, name), limits)
    return built


def _leaf(hint: Any, value: Any, where: str, key: str, limits: Mapping[str, Any]) -> Any:
    # bool is an int to Python, but a yaml "true" where a number belongs is a mistake.
    accepted = (int, float) if hint is float else (hint,)
    if not isinstance(value, accepted) or (isinstance(value, bool) and hint is not bool):
        raise SettingsError(where, key, f"is {value!r}{_exponent_hint(hint, value)}", _describe(hint, limits), value)
    if hint is float:
        value = float(value)
        if not math.isfinite(value):
            raise SettingsError(where, key, f"is {value}", "a finite number", value)
    too_low = "min" in limits and value < limits["min"]
    too_high = "max" in limits and value > limits["max"]
    if too_low or too_high or ("choices" in limits and value not in limits["choices"]):
        raise SettingsError(where, key, f"is {value!r}", _describe(hint, limits), value)
    return value


def _exponent_hint(hint: Any, value: Any) -> str:
    """Explain the commonest surprise: yaml 1.1 reads 1e-3 as a word."""
    if hint is not float or not isinstance(value, str):
        return ""
    try:
        float(value)
    except ValueError:
        return ""
    return " (a word to yaml; write exponents as 1.0e-3)"


def _describe(hint: Any, limits: Mapping[str, Any]) -> str:
    """Say in words what a field takes."""
    if "choices" in limits:
        return "one of " + ", ".join(map(str, limits["choices"]))
    names = {float: "a number", int: "a whole number", str: "a word", bool: "true or false"}
    args = [arg for arg in typing.get_args(hint) if arg is not type(None)]
    if hint in names:
        text = names[hint]
    elif typing.get_origin(hint) is tuple:
        text = f"a list, each {_describe(args[0], {})}" if Ellipsis in args else f"a list of {len(args)} values"
    elif typing.get_origin(hint) is dict:
        text = "a mapping"
    elif len(args) == 1:
        text = _describe(args[0], {}) + " or null"
    else:
        text = f"a mapping with the keys of {getattr(hint, '__name__', hint)}"
    if "min" in limits and "max" in limits:
        return f"{text} from {limits['min']} to {limits['max']}"
    if "min" in limits:
        return f"{text}, at least {limits['min']}"
    if "max" in limits:
        return f"{text}, at most {limits['max']}"
    return text


def _join(key: str, name: Any) -> str:
    return f"{key}.{name}" if key else str(name)
