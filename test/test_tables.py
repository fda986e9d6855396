"""Tables kept in a cache folder: used when they are as they were written, made anew otherwise."""
import numpy as np
import pytest

from dr_eureka.game.tables import cache_folder, load_or_make, table_key


class Maker:
    """Makes a table and counts how often."""

    def __init__(self):
        self.made = 0

    def __call__(self):
        self.made += 1
        return {"numbers": np.arange(5)}


def test_a_table_is_made_once_and_then_loaded(tmp_path):
    make = Maker()
    first, second = load_or_make("a", make, tmp_path), load_or_make("a", make, tmp_path)
    assert make.made == 1
    assert np.array_equal(first["numbers"], second["numbers"])


@pytest.mark.parametrize("name", ["table.npz", "SHA256SUMS"])
@pytest.mark.parametrize("damage", [b"", b"nonsense\n"])
def test_an_altered_or_truncated_table_is_made_anew_and_kept(tmp_path, name, damage):
    make = Maker()
    load_or_make("a", make, tmp_path)
    (tmp_path / "a" / name).write_bytes(damage)
    assert np.array_equal(load_or_make("a", make, tmp_path)["numbers"], np.arange(5))
    load_or_make("a", make, tmp_path)
    assert make.made == 2


def test_a_place_that_cannot_be_written_to_costs_time_only(tmp_path):
    (tmp_path / "file").write_text("in the way")
    make = Maker()
    for folder in (tmp_path / "file", None):
        assert np.array_equal(load_or_make("a", make, folder)["numbers"], np.arange(5))
    assert make.made == 2


def test_the_user_chooses_the_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "dr_eureka"
    monkeypatch.setenv("HOME", str(tmp_path))
    for unusable in ("", "relative/folder"):
        monkeypatch.setenv("XDG_CACHE_HOME", unusable)
        assert cache_folder() == tmp_path / ".cache" / "dr_eureka"


def test_the_name_of_a_table_depends_on_all_that_it_is_made_from():
    names = {table_key(np.array([1.0, 2.0])), table_key(np.array([1.0, 3.0])), table_key(np.array([1.0]), np.array([2.0])),
             table_key(np.array([1.0, 2.0]), b"code")}
    assert len(names) == 4
    assert table_key(np.array([1.0, 2.0])) in names
