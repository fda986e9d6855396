"""The direct pour's tilt over time: within its limits, back where it began, turned when the settings say."""

from dataclasses import replace

import numpy as np
import pytest

from dr_eureka.control.codes import ControlError, EngineCode
from dr_eureka.control.pour_tilt import linear_tilt, profiled_tilt
from dr_eureka.control.settings import ControlSettings
from dr_eureka.resources import load_yaml

WHERE = "config/control_engine.yaml"
SETTINGS = ControlSettings.from_mapping(load_yaml(WHERE), WHERE)
LINEAR, PROFILED = SETTINGS.linear_pour, SETTINGS.profiled_pour
POURS = [(held, count) for held in range(1, 5) for count in range(1, held + 1)]


@pytest.mark.parametrize("held, count", POURS)
@pytest.mark.parametrize("tilt, settings", [(linear_tilt, LINEAR), (profiled_tilt, PROFILED)])
def test_a_tilt_begins_and_ends_at_the_ready_elevation_within_its_limits(tilt, settings, held, count):
    times, elevations = tilt(settings, held, count)
    assert (np.diff(times) > 0.0).all()
    assert elevations[[0, -1]] == pytest.approx([settings.ready_elevation] * 2)
    rates = np.diff(elevations) / np.diff(times)
    assert np.abs(rates).max() <= 1.01 * settings.limits.rate
    # The very last step of each way closes what is left of a milliradian or two.
    accelerations = np.abs(np.diff(rates) / np.diff(times)[1:])
    assert np.quantile(accelerations, 0.98) <= 1.01 * settings.limits.acceleration


@pytest.mark.parametrize("held, count", POURS)
def test_the_linear_tilt_goes_down_evenly_until_its_return_step(held, count):
    times, elevations = linear_tilt(LINEAR, held, count)
    rate = (LINEAR.pouring_elevation - LINEAR.ready_elevation) / (LINEAR.step_seconds * (LINEAR.poses + 1))
    turn = LINEAR.step_seconds * LINEAR.return_steps[held][count]
    before = times < min(turn, LINEAR.step_seconds * (LINEAR.poses + 1))
    straight = LINEAR.ready_elevation + rate * times[before]
    # The wrist needs a moment to get going.
    assert np.abs(elevations[before] - straight).max() < abs(rate) * 0.02
    assert times[np.argmin(elevations)] == pytest.approx(min(turn, times[before][-1]), abs=0.03)


def test_more_balls_to_pour_take_a_later_turn_in_both_forms():
    for staying in range(3):
        assert PROFILED.dip_seconds[staying] > PROFILED.dip_seconds[staying + 1]
    for steps in LINEAR.return_steps.values():
        assert list(steps.values()) == sorted(steps.values())


@pytest.mark.parametrize("tilt, settings", [(linear_tilt, LINEAR), (profiled_tilt, PROFILED)])
def test_both_tilts_brake_the_balls_well_above_level(tilt, settings):
    assert settings.return_elevation > settings.ready_elevation
    for held, count in POURS:
        assert tilt(settings, held, count)[1].max() == pytest.approx(settings.return_elevation)


def test_the_papers_own_return_ends_at_the_ready_elevation():
    _, elevations = linear_tilt(replace(LINEAR, return_elevation=LINEAR.ready_elevation), 3, 1)
    assert elevations.max() == pytest.approx(LINEAR.ready_elevation)


def test_the_profiled_tilt_dips_as_deep_as_it_is_told_at_most_and_takes_less_than_the_goal():
    for held, count in POURS[1:]:
        times, elevations = profiled_tilt(PROFILED, held, count)
        assert PROFILED.dip_elevation - 0.003 <= elevations.min() < 0.0
        assert times[-1] < (0.8 if held > count else 1.0)


@pytest.mark.parametrize("tilt, settings", [(linear_tilt, LINEAR), (profiled_tilt, PROFILED)])
@pytest.mark.parametrize("held, count", [(2, 3), (5, 1), (1, 0)])
def test_a_pour_that_is_not_possible_is_refused(tilt, settings, held, count):
    with pytest.raises(ControlError, match=f"pour of {count} out of {held} balls is not possible") as caught:
        tilt(settings, held, count)
    assert caught.value.code == EngineCode.INVALID_ACTION


def test_a_longer_dip_goes_deeper():
    deepest = [
        profiled_tilt(replace(PROFILED, dip_seconds={0: seconds}), 1, 1)[1].min() for seconds in (0.08, 0.10, 0.12, 0.14)
    ]
    assert deepest == sorted(deepest, reverse=True)
