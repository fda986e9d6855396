"""How pours ended, counted, and the yaml that is told of it."""
import pytest

from dr_eureka.bench import planner_file
from dr_eureka.bench.pour_trials import PourTrial, PourTrialError, read_trials, shares
from dr_eureka.cli.measure_pours import main
from dr_eureka.game.planner_settings import PLANNER_FILE, load_planner_settings, planner_settings
from dr_eureka.resources import load_yaml, resource_path
from dr_eureka.settings import SettingsError

RIGHT = PourTrial("linear", held=4, count=2, poured=2, lost=0)
LESS = PourTrial("linear", held=4, count=2, poured=1, lost=0)
NONE = PourTrial("linear", held=4, count=2, poured=0, lost=0)
MORE = PourTrial("linear", held=4, count=2, poured=3, lost=0)
LOST = PourTrial("linear", held=4, count=2, poured=2, lost=1)
KEY = ("outcomes", "linear", 4, 2)


@pytest.fixture
def planner_yaml(tmp_path, monkeypatch):
    """A copy of the planner's yaml that the command writes instead."""
    copy = tmp_path / "planner.yaml"
    copy.write_text(resource_path(PLANNER_FILE).read_text())
    monkeypatch.setattr(planner_file, "resource_path", lambda name: copy)
    return copy


def trials_file(folder, *trials):
    file = folder / "pours.jsonl"
    file.write_text("".join(trial.as_line() for trial in trials))
    return file


def test_a_trial_is_read_as_it_was_written(tmp_path):
    assert read_trials(trials_file(tmp_path, RIGHT, LOST)) == [RIGHT, LOST]


def test_endings_are_counted_for_each_kind_of_pour():
    figures = shares([RIGHT] * 5 + [LESS, NONE, MORE, LOST] + [PourTrial("lock", 1, 1, 1, 0)] * 3)
    assert figures[KEY] == {"intended": 0.5556, "fewer": 0.2222, "more": 0.1111, "lost": 0.1111, "trials": 9}
    assert figures["outcomes", "lock", 1, 1] == {"intended": 1.0, "trials": 3}


def test_a_lock_pour_of_several_balls_ends_as_one_ball_after_the_other_does():
    def locks(held, *poured):
        return [PourTrial("lock", held, 1, count, 0) for count in poured]

    figures = shares([*locks(3, *[1] * 8, 0, 2), *locks(2, *[1] * 15, *[2] * 5), *locks(1, 1, 0)])
    assert figures["outcomes", "lock", 3, 2] == {"intended": 0.6, "fewer": 0.1, "more": 0.3, "trials": 10}
    assert figures["outcomes", "lock", 2, 2] == {"intended": 0.625, "fewer": 0.375, "trials": 2}
    assert ("outcomes", "lock", 4, 2) not in figures


def test_shares_that_are_rounded_add_up_all_the_same():
    for total in (3, 7, 99, 4000):
        figure = shares([RIGHT] * (total - 2) + [LESS, LOST])[KEY]
        assert sum(value for name, value in figure.items() if name != "trials") == pytest.approx(1.0, abs=1e-9)


def test_the_command_tells_the_planner_and_keeps_the_comments(tmp_path, planner_yaml, capsys):
    before = planner_yaml.read_text()
    assert main([str(trials_file(tmp_path, *[RIGHT] * 98, LESS, MORE)), "--write"]) == 0
    assert "linear, 2 of 4 balls: trials          0.9800    0.0100    0.0100    0.0000     100" in capsys.readouterr().out
    after = planner_yaml.read_text()
    changed = [(old, new) for old, new in zip(before.splitlines(), after.splitlines()) if old != new]
    assert len(before.splitlines()) == len(after.splitlines())
    assert [new.strip() for _, new in changed] == ["2: {intended: 0.98, fewer: 0.01, more: 0.01, trials: 100}"]
    outcome = planner_settings(load_yaml(str(planner_yaml)), "told").outcomes["linear"][4][2]
    assert (outcome.intended, outcome.fewer, outcome.more, outcome.lost, outcome.trials) == (0.98, 0.01, 0.01, 0.0, 100)


def test_without_write_the_yaml_stays_as_it_is(tmp_path, planner_yaml):
    before = planner_yaml.read_text()
    assert main([str(trials_file(tmp_path, LESS, RIGHT))]) == 0
    assert planner_yaml.read_text() == before


def test_a_pour_that_never_does_what_it_should_is_not_written(tmp_path, planner_yaml, capsys):
    before = planner_yaml.read_text()
    assert main([str(trials_file(tmp_path, LESS, LESS)), "--write"]) == 2
    assert "outcomes.linear.4.2.intended: is 0; expected a pour that can go as intended" in capsys.readouterr().err
    assert planner_yaml.read_text() == before


@pytest.mark.parametrize(
    "line, message",
    [
        ("", "Expecting value"),
        ("[]", "expected a mapping"),
        ('{"pour": "linear", "held": 4, "count": 2, "poured": 2}', "lost"),
        (RIGHT.as_line().replace("linear", "sling"), "pour is 'sling'; expected lock or linear or profiled"),
        (RIGHT.as_line().replace('"count": 2', '"count": 0'), "0 of 4 balls"),
        (RIGHT.as_line().replace('"held": 4', '"held": 1'), "2 of 1 balls"),
        (RIGHT.as_line().replace('"lost": 0', '"lost": 3'), "2 poured and 3 lost; expected no more than the tube held"),
    ],
)
def test_a_line_that_is_no_pour_is_named(tmp_path, capsys, line, message):
    file = tmp_path / "pours.jsonl"
    file.write_text(f"{RIGHT.as_line()}{line.strip()}\n")
    with pytest.raises((PourTrialError, SettingsError), match="pours.jsonl:2: "):
        read_trials(file)
    assert main([str(file)]) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1


def test_a_file_that_is_missing_or_empty_is_refused(tmp_path, capsys):
    assert main([str(tmp_path / "none.jsonl")]) == 2
    assert "No such file or directory; expected pours" in capsys.readouterr().err
    (tmp_path / "empty.jsonl").touch()
    assert main([str(tmp_path / "empty.jsonl")]) == 2
    assert "no pour in any of the files" in capsys.readouterr().err


def test_every_kind_of_pour_that_a_trial_can_have_is_in_the_yaml():
    content = load_yaml(PLANNER_FILE)
    kinds = [("outcomes", method, held, count)
             for method in load_planner_settings().methods for held in range(1, 5) for count in range(1, held + 1)]
    assert all(planner_file.figure_at(content, kind) for kind in kinds)
