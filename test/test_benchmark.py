"""The command `benchmark`: what it runs, prints, writes, and exits with; and the rows that benchmarks answer with."""
import json
import math
import sys
from importlib.machinery import ModuleSpec
from types import ModuleType

import numpy as np
import pytest

from dr_eureka.bench.report import BenchError, BenchOptions, Row, mean_row, number, progress, share_row, table_lines
from dr_eureka.cli import benchmark


@pytest.fixture
def fakes(monkeypatch):
    """Put benchmarks that answer with rows, or raise an error, in place of the real ones; return the options they got."""
    given = {}

    def install(**answers):
        monkeypatch.setattr(benchmark, "NAMES", (*answers, "not_built_yet"))
        for name, answer in answers.items():
            module = ModuleType(f"dr_eureka.bench.{name}")
            module.__spec__ = ModuleSpec(module.__name__, None)

            def run(options, name=name, answer=answer):
                given[name] = options
                if isinstance(answer, Exception):
                    raise answer
                return answer

            module.run = run
            monkeypatch.setitem(sys.modules, module.__name__, module)
        return given

    return install


def test_the_interval_of_a_share_is_wilsons():
    hits, n, z = 17, 20, 1.959963984540054
    p = hits / n
    middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    reach = z / (1 + z**2 / n) * math.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    row = share_row("hits", hits, n, goal=">= 0.8", ok=True, paper=0.9)
    assert (row.value, row.n, row.unit, row.goal, row.ok, row.paper) == (0.85, 20, "share", ">= 0.8", True, 0.9)
    assert row.interval95 == pytest.approx((middle - reach, middle + reach), abs=1e-12)


def test_a_share_of_nothing_has_no_value():
    assert share_row("none", 0, 0).value is None


def test_the_interval_of_a_mean_is_students():
    row = mean_row("three", [1.0, 2.0, 3.0], "ms")
    assert (row.value, row.n) == (2.0, 3)
    assert row.interval95 == pytest.approx((2 - 4.302653 / math.sqrt(3), 2 + 4.302653 / math.sqrt(3)), abs=1e-5)
    assert mean_row("one", [5.0], "ms").interval95 is None
    assert mean_row("none", [], "ms").value is None


@pytest.mark.parametrize("value, text", [
    (None, ""), (0.0, "0"), (1.0, "1"), (0.99988, "0.99988"), (12.34567, "12.346"), (11019162, "11019162"), (1e-9, "1e-09"),
])
def test_figures_are_written_to_five_digits_and_whole_numbers_in_full(value, text):
    assert number(value) == text


def test_the_columns_of_a_table_stand_under_each_other():
    rows = [Row("brief", 1.0, "ms", ok=True), Row("a longer name", 0.12, "share", 7, (0.1, 0.2), 0.3, "<= 0.1", False)]
    heading, first, second = table_lines(rows)
    assert heading.index("unit") == first.index("ms") == second.index("share")
    assert first.endswith("ok") and second.endswith("SHORT")


def test_progress_passes_everything_on_and_draws_nothing_into_a_file(capsys):
    assert list(progress(range(3), 3, "three")) == [0, 1, 2]
    assert capsys.readouterr().err == ""


def test_a_run_writes_one_document_with_a_row_a_figure(fakes, tmp_path, capsys):
    options = fakes(first=[Row("seconds", 1.5, "s", 3, (1.0, 2.0), 2, "<= 2", True)], second=[Row("lost", math.nan, "1")])
    file, out = tmp_path / "rows.json", tmp_path / "new" / "plots"
    words = ["all", "--json", str(file), "--seed", "7", "--trials", "5", "--processes", "2", "--out", str(out)]
    code = benchmark.main(words)
    assert code == 0
    assert options == dict.fromkeys(("first", "second"), BenchOptions(7, 5, out, 2))
    document = json.loads(file.read_text())
    assert (document["what"], document["seed"]) == ("first second", 7)
    assert set(document["machine"]) == {"cpu", "cores", "python", "numpy", "cv2", "torch"}
    assert document["machine"]["cores"] >= 1
    assert document["rows"] == [
        {"what": "first", "name": "seconds", "value": 1.5, "unit": "s", "n": 3, "interval95": [1.0, 2.0], "paper": 2,
         "goal": "<= 2", "ok": True},
        {"what": "second", "name": "lost", "value": None, "unit": "1", "n": None, "interval95": None, "paper": None,
         "goal": None, "ok": None},
    ]
    assert out.is_dir()
    assert "seconds" in capsys.readouterr().out


@pytest.mark.parametrize("no", [False, np.False_])
def test_a_figure_that_falls_short_is_exit_code_1(fakes, capsys, no):
    fakes(first=[Row("seconds", 3.0, "s", goal="<= 2", ok=no)])
    assert benchmark.main(["first"]) == 1
    assert "SHORT" in capsys.readouterr().out


def test_a_goal_that_could_not_be_measured_is_no_success(fakes, capsys):
    fakes(first=[Row("share (no weights)", None, "share", goal=">= 0.9"), Row("seconds", 1.0, "s", goal="<= 2", ok=True)])
    assert benchmark.main(["first"]) == 1
    assert "1 of 2 goals met" in capsys.readouterr().out


def test_a_benchmark_that_fails_is_told_in_a_line_and_the_others_go_on(fakes, tmp_path, capsys):
    fakes(first=BenchError("no weights"), second=[Row("seconds", 1.0, "s")])
    file = tmp_path / "rows.json"
    assert benchmark.main(["first", "second", "--json", str(file)]) == 1
    assert capsys.readouterr().err == "benchmark first: no weights\n"
    assert [row["name"] for row in json.loads(file.read_text())["rows"]] == ["seconds"]


def test_an_unknown_benchmark_is_refused_with_the_valid_ones(fakes, capsys):
    options = fakes(first=[], second=[])
    assert benchmark.main(["first", "thrid"]) == 2
    assert capsys.readouterr().err == "benchmark: there is no benchmark 'thrid'; expected some of first, second, or all\n"
    assert benchmark.main(["not_built_yet"]) == 2
    assert options == {}


@pytest.mark.parametrize("arguments", [["--trials", "0"], ["--trials", "x"], ["--seed", "-1"], ["--processes", "0.5"], []])
def test_bad_arguments_are_exit_code_2(fakes, arguments, capsys):
    fakes(first=[])
    with pytest.raises(SystemExit) as ending:
        benchmark.main(arguments and ["first", *arguments])
    assert ending.value.code == 2
    assert capsys.readouterr().err


def test_places_where_nothing_can_be_written_are_refused_before_anything_runs(fakes, tmp_path, capsys):
    options = fakes(first=[])
    assert benchmark.main(["first", "--json", str(tmp_path / "missing" / "rows.json")]) == 2
    taken = tmp_path / "file"
    taken.write_text("")
    assert benchmark.main(["first", "--out", str(taken)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 2 and options == {}
