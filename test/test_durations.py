"""Durations measured in games whose actions last what is known, and the yaml that is told of them."""
import json
from dataclasses import asdict

import pytest

from dr_eureka.bench.durations import GameFileError, measure, read_games
from dr_eureka.bench.planner_file import rewrite
from dr_eureka.cli.measure_durations import main
from dr_eureka.game.actions import actions_for
from dr_eureka.game.planner import Planner
from dr_eureka.game.planner_settings import PLANNER_FILE, load_planner_settings
from dr_eureka.game.state import START, State
from dr_eureka.resources import resource_path

PICK = {"from_home": 4.0, "after_place": 3.0}
PLACE, READY, HOME, POUR = 5.0, {"left": 1.5, "center": 1.0, "right": 1.75}, 1.25, 2.5
UPRIGHT = {"lock": 0.75, "linear": 0.5}


def game(goal, strategy="fastest", pour="lock", pause=0.0):
    """Return a game as game.json tells it, with every action as long as it should be, and a look after every pour."""
    planner = Planner(strategy, pour)
    actions, now, placed, poured = [], 7.0, set(), None
    for action in actions_for(planner.pours(START, State.parse(goal)), planner.reach):
        upright = UPRIGHT[pour] if poured and poured != action.hand or poured and action.kind != "pour" else 0.0
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
        now += upright + seconds + (pause if action.kind == "pour" else 0.0)
    actions[-1]["end"] += HOME
    return {"solved": True, "pour": pour, "actions": actions}


GAMES = [game("GR|PG|RP"), game("R|GP|PRG", "fewest"), game("PR|PRG|G", "fewest")]


def found_in(games):
    """Return what is measured by its place under `durations`."""
    found = measure(games)
    assert {place for place, *_ in found} == {"durations"}
    return {place[1:]: figure for place, figure in found.items()}


@pytest.mark.parametrize("pause", [0.0, 1.8])
def test_what_actions_last_is_found_again(pause):
    games = [game("GR|PG|RP", pause=pause), game("R|GP|PRG", "fewest", pause=pause), game("PR|PRG|G", "fewest", pause=pause)]
    found = found_in(games)
    assert found["upright", "lock"]["seconds"] == UPRIGHT["lock"]
    assert found["home",] == {"seconds": HOME, "trials": len(games)}
    for key, figure in found.items():
        if key[0] == "pick":
            assert figure["seconds"] == PICK[key[1]]
        elif key[0] == "place":
            assert figure["seconds"] == PLACE
        elif key[0] == "pour":
            assert key[1] == "lock" and figure["seconds"] == POUR * key[2]
        elif key[0] == "ready":
            assert key[1] == "lock" and figure["seconds"] == READY[key[2]]
    alone = sum(figure["trials"] for key, figure in found.items() if key[0] in ("pick", "place", "pour"))
    assert alone == sum(len(game["actions"]) for game in games)


def test_each_game_counts_for_the_way_in_which_it_poured():
    found = found_in([*GAMES, game("GR|PG|RP", pour="linear")])
    assert {method: found["upright", method]["seconds"] for method in UPRIGHT} == UPRIGHT
    assert found["home",]["trials"] == len(GAMES) + 1


def test_actions_of_both_hands_at_once_each_last_as_long_as_both():
    actions = [
        {"kind": "pick", "hand": "left", "tube": "left", "start": 7.0, "end": 12.0},
        {"kind": "pick", "hand": "right", "tube": "right", "start": 7.0, "end": 12.0},
        {"kind": "pour", "hand": "left", "tube": "left", "count": 1, "start": 12.0, "end": 16.0},
        {"kind": "place", "hand": "left", "tube": "left", "start": 16.0, "end": 22.0},
        {"kind": "place", "hand": "right", "tube": "right", "start": 16.0, "end": 22.0},
    ]
    again = [dict(action, start=action["start"] + 15.0, end=action["end"] + 15.0) for action in actions]
    found = found_in([{"solved": True, "pour": "lock", "actions": actions + again}])
    assert found["pick", "from_home", "left", "left"] == {"seconds": 5.0, "trials": 1, "failed": 0}
    assert found["pick", "from_home", "right", "right"] == found["pick", "from_home", "left", "left"]
    assert found["pick", "after_place", "right", "right"]["seconds"] == 5.0
    # Both places begin with bringing the tubes upright; the second two end at home, the first two do not.
    assert found["home",] == {"seconds": 0.0, "trials": 2}


def test_what_cannot_be_told_apart_is_left_out():
    # One pour and its two places: no telling what of it was getting ready, or going home.
    found = found_in([game("RR|G|PPG", "fewest")])
    assert {key[0] for key in found} == {"pick"}


def test_a_hand_that_has_been_home_since_starts_from_home_again():
    actions = [dict(action) for action in GAMES[0]["actions"]]
    later = [{**action, "start": action["start"] + 500.0, "end": action["end"] + 500.0} for action in actions]
    once, twice = measure(GAMES[:1]), measure([{**GAMES[0], "actions": actions + later}])
    assert twice.keys() == once.keys()
    assert all(twice[key]["trials"] == 2 * once[key]["trials"] for key in once)


def test_the_action_that_ended_a_failed_game_does_not_count():
    failed = {**GAMES[1], "solved": False, "actions": GAMES[1]["actions"][:2] + [{**GAMES[1]["actions"][2], "end": 900.0}]}
    assert all(figure["seconds"] < 10.0 for figure in measure([failed]).values())


def test_a_pick_that_a_fault_ended_is_counted_and_does_not_lengthen_the_others():
    actions = [dict(action) for action in GAMES[0]["actions"]]
    tried = [actions[0], {**actions[1], "end": 60.0, "failed": True}]
    later = [{**action, "start": action["start"] + 100.0, "end": action["end"] + 100.0} for action in actions]
    found, smooth = found_in([{**GAMES[0], "actions": tried + later}]), found_in(GAMES[:1])
    first, second = (("pick", "from_home", action["hand"], action["tube"]) for action in actions[:2])
    assert (actions[0]["kind"], actions[1]["kind"]) == ("pick", "pick")
    assert found[first] == {"seconds": PICK["from_home"], "trials": smooth[first]["trials"] + 1, "failed": 0}
    assert found[second] == {"seconds": PICK["from_home"], "trials": smooth[second]["trials"], "failed": 1}
    assert found.keys() == smooth.keys()


def test_the_yaml_gets_new_figures_and_keeps_all_else():
    text = resource_path(PLANNER_FILE).read_text()
    changed = rewrite(text, measure(GAMES))
    assert rewrite(text, {}) == text
    before, after = text.splitlines(), changed.splitlines()
    assert len(before) == len(after)
    assert [line.partition("#")[2] for line in before] == [line.partition("#")[2] for line in after]
    assert f"    lock: {{seconds: {UPRIGHT['lock']}, trials: " in changed


def test_what_both_hands_did_last_in_a_game_that_was_not_solved_does_not_count():
    unsolved = {**GAMES[0], "solved": False, "actions": [{**action, "start": 0.0, "end": 9.0} for action in GAMES[0]["actions"][:2]]}
    assert [action["hand"] for action in unsolved["actions"]] == ["left", "right"]
    assert measure([unsolved]) == {}


def test_names_in_quotes_keep_them_as_ros_wants_numbers_for_names():
    text = 'turns:\n  "2": {"1": 213, "2": 390} # steps\n'
    assert rewrite(text, {("turns", "2"): {"1": 210, "2": 350}}) == text.replace("213", "210").replace("390", "350")


def test_the_command_shows_the_figures_beside_those_of_the_yaml(tmp_path, capsys):
    file = tmp_path / "game.json"
    file.write_text(json.dumps({"games": GAMES}))
    assert main([str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("pour lock 1 ") for line in lines)
    line = next(line for line in lines if line.startswith("upright"))
    known = load_planner_settings().durations.upright["lock"]
    assert line.split()[:-1] == ["upright", "lock", f"{known.seconds:.2f}", str(known.trials), f"{UPRIGHT['lock']:.2f}"]


@pytest.mark.parametrize(
    "change, message",
    [
        ({"pour": "sling"}, "pour is 'sling'; expected a game whose pour is lock or linear or profiled"),
        ({"pour": None}, "pour is None"),
        ({"actions": []}, "no duration can be told from these games"),
    ],
)
def test_a_game_that_tells_nothing_is_refused(tmp_path, capsys, change, message):
    (tmp_path / "game.json").write_text(json.dumps({**GAMES[0], **change}))
    assert main([str(tmp_path)]) == 2
    assert message in capsys.readouterr().err


def test_a_game_of_before_that_does_not_tell_how_it_poured_is_refused(tmp_path, capsys):
    (tmp_path / "game.json").write_text(json.dumps({key: value for key, value in GAMES[0].items() if key != "pour"}))
    assert main([str(tmp_path)]) == 2
    assert "it does not tell how it poured; expected a game whose pour is lock or linear or profiled" in capsys.readouterr().err


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"actions": [{}]}', '{"games": [3]}'])
def test_a_file_that_is_no_game_is_named(tmp_path, capsys, content):
    file = tmp_path / "game.json"
    file.write_text(content)
    with pytest.raises(GameFileError, match="expected the game.json of a game"):
        read_games(file)
    assert main([str(file)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
