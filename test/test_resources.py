"""Files of the package: found in each kind of workspace, and refused when broken."""

import hashlib
import importlib.util
import shutil

import numpy as np
import pytest

from dr_eureka import resources
from dr_eureka.resources import ResourceError, WeightsError, load_weights, load_yaml, resource_path, save_weights


def test_a_checkout_is_its_own_package_root():
    assert (resources.package_root() / "src" / "dr_eureka" / "resources.py").is_file()
    assert resource_path("config/pieces.yaml").is_file()


def test_an_installed_module_finds_the_share_folder(tmp_path):
    modules = tmp_path / "lib" / "python3" / "dist-packages" / "dr_eureka"
    share = tmp_path / "share" / "dr_eureka"
    modules.mkdir(parents=True)
    share.mkdir(parents=True)
    shutil.copy(resources.__file__, modules)
    (share / "package.xml").touch()
    spec = importlib.util.spec_from_file_location("installed_resources", modules / "resources.py")
    installed = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(installed)
    assert installed.resource_path("config/pieces.yaml") == share / "config" / "pieces.yaml"


def test_an_absolute_path_is_kept(tmp_path):
    assert resource_path(tmp_path / "a.yaml") == tmp_path / "a.yaml"


def test_a_missing_yaml_is_named(tmp_path):
    with pytest.raises(ResourceError, match="nowhere.yaml: cannot be read: No such file or directory"):
        load_yaml(tmp_path / "nowhere.yaml")


def test_broken_yaml_names_file_and_line(tmp_path):
    file = tmp_path / "broken.yaml"
    file.write_text("a: 1\nb: [1, 2\nc: 3\n")
    with pytest.raises(ResourceError, match=r"broken.yaml:3: not valid yaml"):
        load_yaml(file)


def test_a_yaml_key_given_twice_is_refused(tmp_path):
    file = tmp_path / "twice.yaml"
    file.write_text("a: 1\nb: {c: 1}\na: 2\n")
    with pytest.raises(ResourceError, match="twice.yaml:3: not valid yaml: key 'a' is given twice"):
        load_yaml(file)


def test_a_yaml_that_is_no_mapping_is_refused(tmp_path):
    file = tmp_path / "list.yaml"
    file.write_text("- 1\n")
    with pytest.raises(ResourceError, match="holds list; expected a mapping"):
        load_yaml(file)


def test_yaml_cannot_make_python_objects(tmp_path):
    file = tmp_path / "object.yaml"
    file.write_text("a: !!python/object/apply:os.getcwd []\n")
    with pytest.raises(ResourceError, match="object.yaml:1: not valid yaml"):
        load_yaml(file)


def test_saved_weights_load_again(tmp_path):
    arrays = {"w": np.arange(6, dtype=np.float32).reshape(2, 3), "b": np.zeros(3)}
    file = save_weights("net.npz", arrays, tmp_path)
    loaded = load_weights("net.npz", tmp_path)
    assert sorted(loaded) == ["b", "w"]
    np.testing.assert_array_equal(loaded["w"], arrays["w"])
    sums = (tmp_path / "SHA256SUMS").read_text()
    assert sums == f"{hashlib.sha256(file.read_bytes()).hexdigest()}  net.npz\n"


def test_saving_one_file_keeps_the_other_sums(tmp_path):
    save_weights("b.npz", {"x": np.ones(1)}, tmp_path)
    save_weights("a.npz", {"x": np.ones(2)}, tmp_path)
    save_weights("b.npz", {"x": np.ones(3)}, tmp_path)
    assert [line[66:] for line in (tmp_path / "SHA256SUMS").read_text().splitlines()] == ["a.npz", "b.npz"]
    assert load_weights("b.npz", tmp_path)["x"].shape == (3,)


def test_equal_arrays_make_an_equal_file(tmp_path):
    first = save_weights("a.npz", {"x": np.ones(2)}, tmp_path).read_bytes()
    second = save_weights("a.npz", {"x": np.ones(2)}, tmp_path).read_bytes()
    assert first == second


def test_altered_weights_are_refused(tmp_path):
    file = save_weights("net.npz", {"w": np.ones(2)}, tmp_path)
    file.write_bytes(file.read_bytes() + b"x")
    with pytest.raises(WeightsError, match="net.npz: SHA-256 is .*; SHA256SUMS expects"):
        load_weights("net.npz", tmp_path)


def test_unlisted_weights_are_refused_with_the_listed_names(tmp_path):
    save_weights("net.npz", {"w": np.ones(2)}, tmp_path)
    with pytest.raises(WeightsError, match="other.npz: not listed in SHA256SUMS; it lists net.npz"):
        load_weights("other.npz", tmp_path)


def test_missing_weights_are_named(tmp_path):
    save_weights("net.npz", {"w": np.ones(2)}, tmp_path).unlink()
    with pytest.raises(WeightsError, match="net.npz: cannot be read: No such file or directory"):
        load_weights("net.npz", tmp_path)


def test_a_missing_list_of_sums_is_named(tmp_path):
    with pytest.raises(WeightsError, match="SHA256SUMS: cannot be read"):
        load_weights("net.npz", tmp_path)


@pytest.mark.parametrize("content", ["pickle", "text", "array"])
def test_weights_that_are_no_plain_npz_are_refused(tmp_path, content):
    file = tmp_path / "net.npz"
    if content == "pickle":
        np.savez(file, w=np.array([{"a": 1}], dtype=object))
    elif content == "text":
        file.write_text("not an archive")
    else:
        with file.open("wb") as stream:
            np.save(stream, np.ones(2))
    (tmp_path / "SHA256SUMS").write_text(f"{hashlib.sha256(file.read_bytes()).hexdigest()}  net.npz\n")
    with pytest.raises(WeightsError, match="net.npz: not a plain .npz"):
        load_weights("net.npz", tmp_path)


def test_every_shipped_weights_file_is_listed_and_loads():
    folder = resource_path("config/weights")
    names = sorted(file.name for file in folder.glob("*.npz"))
    sums = folder / "SHA256SUMS"
    assert names == (sorted(line[66:] for line in sums.read_text().splitlines()) if sums.exists() else [])
    for name in names:
        assert load_weights(name)
