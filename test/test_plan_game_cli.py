"""The command `plan_game`, run as a person or a program would run it."""
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from dr_eureka.cli.plan_game import main
from dr_eureka.game.actions import actions_for
from dr_eureka.game.planner import Planner, plan_pours
from dr_eureka.game.planner_settings import Outcome, load_planner_settings
from dr_eureka.game.state import START, Pour, State

PACKAGE = Path(__file__).resolve().parent.parent


def run(*arguments, stdout=subprocess.PIPE):
    """Run the executable in a fresh process without a ROS master."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("ROS_")}
    environment["PYTHONPATH"] = str(PACKAGE / "src")
    command = [sys.executable, str(PACKAGE / "scripts" / "plan_game"), *arguments]
    return subprocess.run(command, env=environment, stdout=stdout, stderr=subprocess.PIPE, text=True, timeout=30)


def test_help_needs_no_master():
    finished = run("--help")
    assert finished.returncode == 0
    assert "--start STATE" in finished.stdout


def test_an_impossible_goal_ends_with_one_line_and_code_2():
    finished = run("RRR|GG|PP")
    assert finished.returncode == 2
    assert finished.stdout == ""
    assert finished.stderr == "plan_game: RRR|GG|PP: 3 red balls, expected 2\n"


def test_an_impossible_start_ends_with_one_line_and_code_2(capsys):
    assert main(["RR|GG|PP", "--start", "RR|GG"]) == 2
    assert capsys.readouterr().err == "plan_game: RR|GG: 2 tubes, expected 3 separated by '|'\n"


def test_the_json_plan_leads_from_start_to_goal():
    finished = run("RRP|PG|G", "--json")
    assert finished.returncode == 0
    plan = json.loads(finished.stdout)
    assert (plan["start"], plan["goal"], plan["strategy"], plan["cost"]) == ("RR|GG|PP", "RRP|PG|G", "fewest", 6)
    tubes = {"left": "RR", "center": "GG", "right": "PP"}
    for pour in plan["pours"]:
        for _ in range(pour["count"]):
            tubes[pour["target"]] += tubes[pour["source"]][-1]
            tubes[pour["source"]] = tubes[pour["source"]][:-1]
    assert tubes == {"left": "RRP", "center": "PG", "right": "G"}
    assert plan["actions"][0] == {"kind": "pick", "hand": "left", "tube": "left"}
    assert plan["actions"][2] == {
        "kind": "pour", "hand": "right", "tube": "right", "target_tube": "left", "target_hand": "left", "count": 1,
    }
    assert len(plan["actions"]) == len(actions_for(plan_pours(START, State.parse("RRP|PG|G"))))
    assert len(plan["states"]) == 6 and plan["states"][-1] == "RRP|PG|G"
    assert plan["states"][0] == str(START.after(Pour(**plan["pours"][0])))
    assert plan["pour"] == "lock"


def test_a_goal_that_is_the_start_is_a_plan_of_no_pours(capsys):
    assert main(["GR|PP|RG", "--start", "GR|PP|RG", "--json"]) == 0
    plan = json.loads(capsys.readouterr().out)
    assert (plan["cost"], plan["pours"], plan["actions"]) == (0, [], [])
    assert main(["RR|GG|PP"]) == 0
    assert "Nothing to do: the goal is the start." in capsys.readouterr().out


def test_the_printed_plan_draws_the_tubes_after_each_pour(capsys):
    assert main(["RR|G|PPG"]) == 0
    seconds = Planner().plan(START, State.parse("RR|G|PPG")).seconds
    assert capsys.readouterr().out == f"""\
RR|GG|PP to RR|G|PPG: 1 pour, 4 picks and places, about {seconds:.0f} s

  |   |    |   |    |   |
  |   |    |   |    |   |
  | R |    | G |    | P |
  | R |    | G |    | P |
  +---+    +---+    +---+
   left    center   right

  1. pick the center tube with the left hand
  2. pick the right tube with the right hand
  3. pour 1 ball from the center tube (left hand) into the right tube (right hand)

  |   |    |   |    |   |
  |   |    |   |    | G |
  | R |    |   |    | P |
  | R |    | G |    | P |
  +---+    +---+    +---+
   left    center   right    RR|G|PPG

  4. place the center tube with the left hand
  5. place the right tube with the right hand
"""


def test_the_fastest_plan_pours_several_balls_at_once(capsys):
    assert main(["RRPP|GG|", "--strategy", "fastest", "--json"]) == 0
    plan = json.loads(capsys.readouterr().out)
    assert plan["pours"] == [{"source": "right", "target": "left", "count": 2}]
    assert (plan["strategy"], plan["unit"], plan["cost"]) == ("fastest", "s", plan["seconds"])


@pytest.fixture
def pours_that_may_go_wrong(monkeypatch, tmp_path):
    """Plans are made as if every linear pour might end otherwise than intended, whatever the trials said."""
    settings = load_planner_settings()

    def outcome(held, count):
        return Outcome(0.95, fewer=0.03, lost=0.02) if count == held else Outcome(0.95, fewer=0.02, more=0.02, lost=0.01)

    linear = {held: {count: outcome(held, count) for count in range(1, held + 1)} for held in range(1, 5)}
    changed = replace(settings, outcomes={**settings.outcomes, "linear": linear})
    monkeypatch.setattr("dr_eureka.game.planner.load_planner_settings", lambda: changed)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def test_the_surest_plan_says_what_to_do_when_a_pour_goes_wrong(capsys, pours_that_may_go_wrong):
    arguments = ["RRP|PG|G", "--strategy", "surest", "--pour", "linear"]
    assert main([*arguments, "--json"]) == 0
    plan = json.loads(capsys.readouterr().out)
    assert 0.9 < plan["chance"] < 1.0
    assert len(plan["otherwise"]) == len(plan["pours"])
    wrong = [result for results in plan["otherwise"] for result in results]
    assert all(result["pour"] for result in wrong if result["state"] not in (None, "RRP|PG|G"))
    assert main(arguments) == 0
    text = capsys.readouterr().out
    assert f"Solved {plan['chance']:.1%} of the time" in text
    assert text.count("of the time a ball is lost") == sum(result["state"] is None for result in wrong)


def test_an_unknown_strategy_is_refused_with_those_there_are(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["RR|GG|PP", "--strategy", "nicest"])
    assert caught.value.code == 2
    assert "fewest" in capsys.readouterr().err


def test_a_missing_goal_is_refused(capsys):
    with pytest.raises(SystemExit) as caught:
        main([])
    assert caught.value.code == 2
    assert "GOAL" in capsys.readouterr().err
