"""config/planner.yaml, and what is said of one that cannot be."""
import copy

import pytest
import yaml

from dr_eureka.game.planner_settings import PLANNER_FILE, load_planner_settings
from dr_eureka.resources import load_yaml
from dr_eureka.settings import SettingsError


def load_changed(tmp_path, change):
    content = copy.deepcopy(load_yaml(PLANNER_FILE))
    change(content)
    file = tmp_path / "planner.yaml"
    file.write_text(yaml.safe_dump(content))
    return load_planner_settings(str(file))


def test_the_shipped_settings_know_both_ways_to_pour():
    settings = load_planner_settings()
    assert settings.methods == ("lock", "linear", "profiled")
    assert settings.reach == {"left": ("left", "center"), "right": ("center", "right")}


LOPSIDED = {"intended": 0.8, "fewer": 0.08, "more": 0.5, "lost": 0.04}


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda c: c["reach"].pop("left"), "reach: lacks the key 'left'"),
        (lambda c: c["reach"].update(left=["middle"]), "is 'middle'; expected one of left, center, right"),
        (lambda c: c["reach"]["left"].append("right"), "durations.pick.from_home.left: lacks the key 'right'"),
        (lambda c: c["durations"]["ready"]["lock"].pop("center"), "durations.ready.lock: lacks the key 'center'"),
        (lambda c: c["durations"]["pour"]["lock"][2].update(seconds=0.0), "pour.lock.2.seconds: is 0; expected more"),
        (lambda c: c["durations"]["place"]["right"].pop("center"), "durations.place.right: lacks the key 'center'"),
        (lambda c: c["durations"]["pour"]["lock"].pop(3), "durations.pour.lock: lacks the key 3"),
        (lambda c: c["durations"]["upright"]["lock"].update(seconds=-1.0), "durations.upright.lock.seconds: is -1.0"),
        (lambda c: c["durations"]["upright"].pop("linear"), "durations.upright: lacks the key 'linear'"),
        (lambda c: c["outcomes"].pop("linear"), "outcomes: lacks the key 'linear'"),
        (lambda c: c["outcomes"]["linear"][4].update({3: LOPSIDED}), "outcomes.linear.4.3: shares add up to 1.42; expected 1"),
        (
            lambda c: c["outcomes"]["linear"][2].update({2: {"intended": 0.9, "more": 0.1}}),
            "outcomes.linear.2.2.more: is 0.1; expected 0, for the tube holds 2 balls",
        ),
        (lambda c: c["outcomes"]["lock"][1].update({1: {"intended": 0.0, "lost": 1.0}}), "outcomes.lock.1.1.intended: is 0"),
        (lambda c: c.update(hands_at_once="no"), "hands_at_once: is 'no'"),
    ],
)
def test_what_cannot_be_is_named(tmp_path, change, message):
    with pytest.raises(SettingsError) as caught:
        load_changed(tmp_path, change)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_figures_for_more_tubes_than_a_hand_reaches_are_no_mistake(tmp_path):
    settings = load_changed(tmp_path, lambda c: c["reach"].update(right=["right"]))
    assert settings.reach["right"] == ("right",)
