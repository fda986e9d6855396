"""Durations measured in games whose actions last what is known, and the yaml that is told of them."""
import json
from dataclasses import asdict

import pytest

from dr_eureka.bench.durations import GameFileError, measure, read_games, rewrite
from dr_eureka.cli.measure_durations import main
from dr_eureka.game.actions import actions_for
from dr_eureka.game.planner import Planner
from dr_eureka.game.planner_settings import PLANNER_FILE, load_planner_settings
from dr_eureka.game.state import START, State
from dr_eureka.resources import resource_path

PICK = {"from_home": 4.0, "after_place": 3.0}
PLACE, READY, UPRIGHT, HOME, POUR = 5.0, {"left": 1.5, "center": 1.0, "right": 1.75}, 0.75, 1.25, 2.5


def game(goal, strategy="fastest"):
    """Return a game as game.json tells it, with every action as long as it should be."""
    planner = Planner(strategy)
    actions, now, placed, poured = [], 7.0, set(), None
    for action in actions_for(planner.pours(START, State.parse(goal)), planner.reach):
        upright = UPRIGHT if poured and poured != action.hand or poured and action.kind != "pour" else 0.0
        if action.kind == "pick":
            seconds = PICK["after_place" if action.hand in placed else "from_home"]
        elif action.kind == "place":
            placed.add(action.hand)
            seconds = PLACE
        else:
            seconds = POUR * action.count + (0.0 if poured == action.hand else READY[action.tube])
        poured = action.hand if action.kind == "pour" else None
        record = {key: value for key, value in asdict(action).items() if value}
        actions.append({**record, "start": now, "end": now + upright + seconds})
        now += upright + seconds
    actions[-1]["end"] += HOME
    return {"solved": True, "actions": actions}


GAMES = [game("GR|PG|RP"), game("R|GP|PRG", "fewest"), game("PR|PRG|G", "fewest")]


def test_what_actions_last_is_found_again():
    found = measure(GAMES, "lock")
    assert found["upright",].seconds == pytest.approx(UPRIGHT)
    assert found["home",].seconds == pytest.approx(HOME)
    assert found["home",].trials == len(GAMES)
    for key, duration in found.items():
        if key[0] == "pick":
            assert duration.seconds == pytest.approx(PICK[key[1]])
        elif key[0] == "place":
            assert duration.seconds == pytest.approx(PLACE)
        elif key[0] == "pour":
            assert key[1] == "lock" and duration.seconds == pytest.approx(POUR * key[2])
        elif key[0] == "ready":
            assert duration.seconds == pytest.approx(READY[key[1]])
    alone = sum(duration.trials for key, duration in found.items() if key[0] in ("pick", "place", "pour"))
    assert alone == sum(len(game["actions"]) for game in GAMES)


def test_what_cannot_be_told_apart_is_left_out():
    # One pour and its two places: no telling what of it was getting ready, or going home.
    found = measure([game("RR|G|PPG", "fewest")], "lock")
    assert {key[0] for key in found} == {"pick"}


def test_a_hand_that_has_been_home_since_starts_from_home_again():
    actions = [dict(action) for action in GAMES[0]["actions"]]
    later = [{**action, "start": action["start"] + 500.0, "end": action["end"] + 500.0} for action in actions]
    once, twice = measure(GAMES[:1], "lock"), measure([{**GAMES[0], "actions": actions + later}], "lock")
    assert {key: found.trials for key, found in twice.items()} == {key: 2 * found.trials for key, found in once.items()}


def test_the_action_that_ended_a_failed_game_does_not_count():
    failed = {**GAMES[1], "solved": False, "actions": GAMES[1]["actions"][:2] + [{**GAMES[1]["actions"][2], "end": 900.0}]}
    assert all(duration.seconds < 10.0 for duration in measure([failed], "lock").values())


def test_the_yaml_gets_new_figures_and_keeps_all_else():
    text = resource_path(PLANNER_FILE).read_text()
    changed = rewrite(text, measure(GAMES, "lock"))
    assert rewrite(text, {}) == text
    before, after = text.splitlines(), changed.splitlines()
    assert len(before) == len(after)
    assert [line.partition("#")[2] for line in before] == [line.partition("#")[2] for line in after]
    assert f"upright: {{seconds: {UPRIGHT}, trials: " in changed


def test_the_command_shows_the_figures_beside_those_of_the_yaml(tmp_path, capsys):
    file = tmp_path / "game.json"
    file.write_text(json.dumps({"games": GAMES}))
    assert main([str(tmp_path), "--pour", "direct"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("pour direct 1 ") for line in lines)
    line = next(line for line in lines if line.startswith("upright"))
    known = load_planner_settings().durations.upright
    assert line.split() == ["upright", f"{known.seconds:.2f}", str(known.trials), f"{UPRIGHT:.2f}", line.split()[-1]]


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"actions": [{}]}', '{"games": [3]}'])
def test_a_file_that_is_no_game_is_named(tmp_path, capsys, content):
    file = tmp_path / "game.json"
    file.write_text(content)
    with pytest.raises(GameFileError, match="expected the game.json of a game"):
        read_games(file)
    assert main([str(file)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
