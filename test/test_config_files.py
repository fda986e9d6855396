"""The yaml files under config/: plain values throughout, and what nodes get of them through ROS is what stands in them."""

import math
import xml.etree.ElementTree as ElementTree
import xmlrpc.client
from pathlib import Path

import pytest
from rosgraph.names import is_legal_name
from roslaunch.config import ROSLaunchConfig
from roslaunch.xmlloader import XmlLoader

from dr_eureka.control.settings import ControlSettings
from dr_eureka.resources import load_yaml
from dr_eureka.settings import SettingsError

ROOT = Path(__file__).resolve().parent.parent
FILES = sorted((ROOT / "config").glob("**/*.yaml"))
LAUNCHES = [("game", []), ("game", ["robot:=real"]), ("replay", ["bag:=recorded.bag"]), ("catch", []), ("calibrate_arm", [])]
LOADED = sorted({
    element.get("file").replace("$(find dr_eureka)", str(ROOT))
    for launch in (ROOT / "launch").glob("*.launch")
    for element in ElementTree.parse(launch).iter("rosparam") if element.get("command") == "load"
})


def sent(config: ROSLaunchConfig) -> dict[str, object]:
    """Return parameters by full name as they come out at the other end of XML-RPC, without a master."""
    values = {}
    for name, parameter in config.params.items():
        (values[name],), _ = xmlrpc.client.loads(xmlrpc.client.dumps((parameter.value,)))
    return values


def leaves(content, path=()):
    """Yield every value of nested mappings and lists with the keys that lead to it."""
    if not isinstance(content, (dict, list)):
        yield path, content
        return
    for key, value in content.items() if isinstance(content, dict) else enumerate(content):
        yield from leaves(value, (*path, key))


@pytest.mark.parametrize("file", LOADED, ids=lambda file: Path(file).name)
def test_a_node_gets_what_stands_in_its_file(file):
    config = ROSLaunchConfig()
    XmlLoader().load_string(f'<launch><rosparam command="load" file="{file}"/></launch>', config, verbose=False)
    tree: dict = {}
    for name, value in sent(config).items():
        assert is_legal_name(name)
        *rooms, last = name.strip("/").split("/")
        inside = tree
        for room in rooms:
            inside = inside.setdefault(room, {})
        inside[last] = value
    assert tree == load_yaml(file)


@pytest.mark.parametrize("launch, arguments", LAUNCHES)
def test_all_parameters_of_a_launch_file_can_be_sent(launch, arguments, monkeypatch):
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(ROOT))
    config = ROSLaunchConfig()
    XmlLoader(resolve_anon=False).load(str(ROOT / "launch" / f"{launch}.launch"), config, argv=arguments, verbose=False)
    assert config.nodes and all(is_legal_name(name) for name in sent(config))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_a_file_holds_plain_finite_values(file):
    for path, value in leaves(load_yaml(file)):
        assert isinstance(value, (bool, int, float, str)) and (isinstance(value, str) or math.isfinite(value)), (path, value)


@pytest.mark.parametrize("block, table, key, problem", [
    ("profiled_pour", "dip_seconds", "2", "profiled_pour.dip_seconds: lacks the key 2; expected the keys 0, 1, 2, 3"),
    ("linear_pour", "return_steps", "3", "linear_pour.return_steps: lacks the key 3; expected the keys 1, 2, 3, 4"),
])
def test_a_direct_pour_that_lacks_a_turn_is_refused_before_anything_moves(block, table, key, problem):
    content = load_yaml(ROOT / "config" / "control_engine.yaml")
    del content[block][table][key]
    with pytest.raises(SettingsError, match=f"the engine: {problem}"):
        ControlSettings.from_mapping(content, "the engine")


@pytest.mark.parametrize("block, ready", [("linear_pour", "0.2758"), ("profiled_pour", "0.0873")])
def test_a_direct_pour_that_turns_back_below_its_ready_pose_is_refused(block, ready):
    content = load_yaml(ROOT / "config" / "control_engine.yaml")
    content[block]["return_elevation"] = 0.05
    with pytest.raises(SettingsError, match=f"the engine: {block}.return_elevation: is 0.05; expected ready_elevation, {ready}, or more"):
        ControlSettings.from_mapping(content, "the engine")
