"""Settings: what fits is built, what does not is refused by name."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Optional

import pytest

from dr_eureka.settings import SettingsError, build


@dataclass(frozen=True)
class Inner:
    gain: float = field(metadata={"min": 0.0, "max": 1.0})


@dataclass(frozen=True)
class Outer:
    inner: Inner
    count: int = field(metadata={"min": 1})
    name: str = "a"
    on: bool = False
    limit: Optional[float] = None
    point: tuple[float, float] = (0.0, 0.0)
    gains: tuple[float, ...] = field(default=(), metadata={"max": 5.0})
    colours: dict[str, tuple[int, int, int]] = field(default_factory=dict, metadata={"max": 255})
    method: str = field(default="lock", metadata={"choices": ("lock", "direct")})


GOOD = {"inner": {"gain": 0.5}, "count": 2}


def test_defaults_fill_what_is_left_out():
    assert build(Outer, GOOD) == Outer(Inner(0.5), 2)


def test_every_kind_of_field_is_built():
    outer = build(
        Outer,
        {**GOOD, "name": "b", "on": True, "limit": 3, "point": [1, 2.5], "gains": [1, 2, 3], "colours": {"R": [1, 2, 3]}, "method": "direct"},
    )
    assert outer == Outer(Inner(0.5), 2, "b", True, 3.0, (1.0, 2.5), (1.0, 2.0, 3.0), {"R": (1, 2, 3)}, "direct")
    assert isinstance(outer.limit, float) and isinstance(outer.point[0], float)


def test_settings_cannot_be_changed_afterwards():
    with pytest.raises(dataclasses.FrozenInstanceError):
        build(Outer, GOOD).count = 3


def test_an_unknown_key_is_named_with_the_valid_ones():
    with pytest.raises(SettingsError) as caught:
        build(Outer, {**GOOD, "inner": {"gain": 0.5, "gian": 1}}, "config/x.yaml")
    assert str(caught.value) == "config/x.yaml: inner.gian: unknown key; expected one of gain"


def test_a_missing_key_is_named_with_what_it_takes():
    with pytest.raises(SettingsError) as caught:
        build(Outer, {"count": 2, "inner": {}}, "config/x.yaml")
    assert str(caught.value) == "config/x.yaml: inner.gain: missing key; expected a number from 0.0 to 1.0"


@pytest.mark.parametrize(
    "change, message",
    [
        ({"count": 2.5}, "count: is 2.5; expected a whole number, at least 1"),
        ({"count": True}, "count: is True; expected a whole number, at least 1"),
        ({"count": 0}, "count: is 0; expected a whole number, at least 1"),
        ({"name": 3}, "name: is 3; expected a word"),
        ({"name": None}, "name: is None; expected a word"),
        ({"on": 1}, "on: is 1; expected true or false"),
        ({"limit": "much"}, "limit: is 'much'; expected a number"),
        ({"limit": "1e-3"}, "limit: is '1e-3' (a word to yaml; write exponents as 1.0e-3); expected a number"),
        ({"point": [1, 2, 3]}, "point: has 3 values, [1, 2, 3]; expected a list of 2 values"),
        ({"point": 1}, "point: is 1; expected a list of 2 values"),
        ({"gains": [1, 6]}, "gains[1]: is 6.0; expected a number, at most 5.0"),
        ({"gains": [1, "x"]}, "gains[1]: is 'x'; expected a number, at most 5.0"),
        ({"colours": [1]}, "colours: is [1]; expected a mapping"),
        ({"colours": {"R": [1, 2, 256]}}, "colours.R[2]: is 256; expected a whole number, at most 255"),
        ({"colours": {1: [1, 2, 3]}}, "key of colours: is 1; expected a word"),
        ({"method": "throw"}, "method: is 'throw'; expected one of lock, direct"),
        ({"inner": 3}, "inner: is 3; expected a mapping with the keys of Inner"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(change, message):
    with pytest.raises(SettingsError) as caught:
        build(Outer, {**GOOD, **change}, "here")
    assert str(caught.value) == f"here: {message}"


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_is_refused(value):
    with pytest.raises(SettingsError, match="limit: is .*; expected a finite number"):
        build(Outer, {**GOOD, "limit": value})


def test_limits_themselves_are_allowed():
    assert build(Inner, {"gain": 0.0}).gain == 0.0
    assert build(Inner, {"gain": 1}).gain == 1.0


def test_a_top_level_that_is_no_mapping_is_refused():
    with pytest.raises(SettingsError, match="here: top level: is None; expected a mapping with the keys of Inner"):
        build(Inner, None, "here")


def test_an_error_carries_its_parts():
    with pytest.raises(SettingsError) as caught:
        build(Inner, {"gain": 2.0}, "here")
    error = caught.value
    assert (error.where, error.key, error.value, error.expected) == ("here", "gain", 2.0, "a number from 0.0 to 1.0")


def test_a_field_type_that_settings_do_not_know_is_a_programming_error():
    @dataclass(frozen=True)
    class Strange:
        value: int | str

    with pytest.raises(TypeError):
        build(Strange, {"value": 1})
