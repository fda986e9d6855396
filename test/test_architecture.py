"""The rules of the house: who may import whom, what is installed, what is documented."""

from __future__ import annotations

import ast
import graphlib
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "src" / "dr_eureka"

FOUNDATION = {"checkpoint", "errors", "memory", "pieces", "resources", "settings"}
# Room: the other rooms, or single modules of them, that it may import besides the foundation.
ALLOWED = {
    "game": set(),
    "kinematics": set(),
    "vision": {"game"},
    "control": {"game", "kinematics"},
    "catching": {"kinematics", "vision.camera"},
    # The simulator prints the sheet and the card with the same pictures that the robot's vision knows.
    "simulation": {
        "game", "kinematics", "catching", "vision.aruco", "vision.camera", "vision.card_renderer", "vision.sheet_renderer",
    },
    "printing": {"vision"},
    "behaviour": {"game", "vision", "control"},
    "bags": {"game", "kinematics", "vision", "behaviour"},
    "bench": {"catching", "game", "kinematics", "vision", "control", "simulation", "behaviour", "bags"},
    "cli": {"catching", "game", "kinematics", "vision", "control", "simulation", "behaviour", "bags", "bench", "printing"},
    "nodes": {"catching", "game", "kinematics", "vision", "control", "simulation", "behaviour", "bags"},
}
ROS_MODULES = {"cv_bridge", "genpy", "rosbag", "rosgraph", "roslaunch", "roslib", "rospy", "rostest", "std_srvs", "tf2_ros"}
# Packages that are needed without being imported: generated messages, and what launch files and commands start.
STARTED = {"message_runtime", "robot_state_publisher", "roslaunch"}
DEBIAN_PYTHON = {"cv2": "python3-opencv", "PyKDL": "python3-pykdl"}
ONLY_ON_PYPI = {"pybullet", "pybullet_utils", "rosbags", "ruamel", "ruckig"}
ROS_OF_OURS = {"dr_eureka.msg", "dr_eureka.srv"}

MODULES = {
    ".".join(file.relative_to(SOURCE.parent).with_suffix("").parts).removesuffix(".__init__"): file
    for file in sorted(SOURCE.rglob("*.py"))
}
ROOMS = sorted({name.split(".")[1] for name, file in MODULES.items() if file.parent != SOURCE})
PROGRAMS = sorted(
    file for file in (ROOT / "scripts").iterdir() if file.is_file() and file.read_bytes().startswith(b"#!/usr/bin/env python3\n")
)
LAUNCH_FILES = sorted((ROOT / "launch").glob("*.launch"))
ROSTESTS = sorted((ROOT / "test").glob("*.test"))


def imported_modules(file: Path) -> set[str]:
    """Return the dotted names that a file imports, wherever in the file; modules of ours as far as they exist."""
    names = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}:{node.lineno}: relative import; the house imports by full name"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return {_existing(name) for name in names}


def _existing(name: str) -> str:
    """Shorten `dr_eureka.game.state.State` to the module `dr_eureka.game.state`; leave foreign names alone."""
    while name.startswith("dr_eureka.") and name not in MODULES and name not in ROS_OF_OURS:
        name = name.rpartition(".")[0]
    return name


def is_ros(name: str) -> bool:
    package = name.split(".")[0]
    return package in ROS_MODULES or package.endswith("_msgs") or any(name.startswith(ours) for ours in ROS_OF_OURS)


IMPORTS = {module: imported_modules(file) for module, file in MODULES.items()}
CORE = [module for module in MODULES if not module.startswith("dr_eureka.nodes")]


def test_only_nodes_import_ros():
    offenders = {module: sorted(filter(is_ros, IMPORTS[module])) for module in CORE}
    assert {module: names for module, names in offenders.items() if names} == {}


def test_every_core_module_imports_where_there_is_no_ros():
    program = f"""
import importlib, sys
class Blocker:
    def find_spec(self, name, path=None, target=None):
        package = name.split(".")[0]
        if package in {ROS_MODULES!r} or package.endswith("_msgs"):
            raise ImportError("no ROS here: " + name)
sys.meta_path.insert(0, Blocker())
for module in {CORE!r}:
    importlib.import_module(module)
"""
    environment = {**os.environ, "PYTHONPATH": str(SOURCE.parent)}
    result = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr


def test_every_room_is_in_the_table():
    assert set(ROOMS) <= set(ALLOWED)


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_what_the_table_allows(room):
    allowed = ALLOWED[room] | FOUNDATION | {room}
    for module in filter(lambda name: name.startswith(f"dr_eureka.{room}"), MODULES):
        for name in IMPORTS[module]:
            if not name.startswith("dr_eureka.") or (is_ros(name) and room == "nodes"):
                continue
            parts = name.split(".")[1:]
            assert parts[0] in allowed or ".".join(parts) in allowed, f"{module} imports {name}; {room} may import {sorted(allowed)}"


def test_what_decides_never_sees_the_simulator():
    """Follow imports as far as they lead: not even through a third module may the robot know the simulator."""
    for room in ("game", "vision", "kinematics", "control", "catching", "behaviour"):
        reached, waiting = set(), [module for module in MODULES if module.startswith(f"dr_eureka.{room}")]
        while waiting:
            module = waiting.pop()
            if module in reached or module not in MODULES:
                continue
            reached.add(module)
            waiting.extend(IMPORTS[module])
        assert not [module for module in reached if module.startswith("dr_eureka.simulation")]


def test_there_is_no_import_circle():
    graph = {module: {name for name in names if name in MODULES and name != module} for module, names in IMPORTS.items()}
    graphlib.TopologicalSorter(graph).prepare()


def test_every_test_module_is_one_that_pytest_collects_or_a_rostest_runs():
    used = set()
    for file in ROSTESTS:
        used |= {element.get("type") for element in ElementTree.parse(file).iter("test")}
    for file in (ROOT / "test").glob("*.py"):
        if re.search(r"^import rostest|^from rostest", file.read_text(encoding="utf-8"), re.MULTILINE):
            assert file.name in used, f"{file.name} is run by no test/*.test"
            assert not file.name.startswith("test_"), f"{file.name} needs a master; name it rostest_*.py, for pytest collects test_*.py"
        elif re.search(r"^def test_|^    def test_", file.read_text(encoding="utf-8"), re.MULTILINE):
            assert file.name.startswith("test_"), f"{file.name} holds tests that pytest does not collect"


@pytest.mark.parametrize("file", ROSTESTS, ids=lambda file: file.name)
def test_a_rostest_has_a_time_limit_and_names_files_that_exist(file):
    tests = list(ElementTree.parse(file).iter("test"))
    assert tests
    for element in tests:
        assert float(element.get("time-limit")) > 0
        assert os.access(ROOT / "test" / element.get("type"), os.X_OK)


def test_cmake_takes_every_rostest_and_the_folder_of_unit_tests():
    cmake = (ROOT / "CMakeLists.txt").read_text()
    assert re.search(r"file\(GLOB rostests .* test/\*\.test\)", cmake)
    assert re.search(r"-m pytest .*\$\{CMAKE_CURRENT_SOURCE_DIR\}/test ", cmake)


def test_cmake_lists_every_message_and_service():
    cmake = (ROOT / "CMakeLists.txt").read_text()
    listed = re.findall(r"^  (\w+\.(?:msg|srv))$", cmake, re.MULTILINE)
    assert sorted(listed) == sorted(file.name for folder in ("msg", "srv") for file in (ROOT / folder).iterdir())


def test_cmake_installs_every_program():
    cmake = (ROOT / "CMakeLists.txt").read_text()
    listed = re.search(r"catkin_install_python\(PROGRAMS\s+(.*?)\s+DESTINATION", cmake, re.DOTALL).group(1).split()
    assert listed == [f"scripts/{program.name}" for program in PROGRAMS]


def test_the_package_depends_on_what_it_imports_or_starts_and_on_nothing_else():
    packages = {name.split(".")[0] for names in IMPORTS.values() for name in names}
    packages -= {"dr_eureka", *sys.stdlib_module_names, *ONLY_ON_PYPI}
    needed = {name if is_ros(name) else DEBIAN_PYTHON.get(name, f"python3-{name}") for name in packages} | STARTED
    root = ElementTree.parse(ROOT / "package.xml").getroot()
    assert {element.text for kind in ("depend", "exec_depend") for element in root.findall(kind)} == needed


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda file: file.name)
def test_a_program_is_short_executable_and_without_suffix(program):
    assert program.suffix == ""
    assert os.access(program, os.X_OK)
    assert len(program.read_text().splitlines()) <= 40


@pytest.mark.parametrize("file", LAUNCH_FILES, ids=lambda file: file.name)
def test_every_launch_argument_says_what_it_is_for(file):
    for element in ElementTree.parse(file).getroot().findall("arg"):
        assert element.get("doc") or element.get("value"), f"{file.name}: <arg name={element.get('name')!r}> has no doc"


@pytest.mark.parametrize("name", ["game.launch", "replay.launch"])
def test_the_readme_lists_every_argument_that_a_person_may_give(name):
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for element in ElementTree.parse(ROOT / "launch" / name).getroot().findall("arg"):
        assert element.get("value") or f"| `{element.get('name')}` |" in readme


def test_the_readme_names_no_program_that_is_not_there():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert set(re.findall(r"rosrun dr_eureka (\w+)", readme)) <= {program.name for program in PROGRAMS}


def test_the_newest_entry_of_the_changelog_is_the_package_version():
    version = ElementTree.parse(ROOT / "package.xml").findtext("version")
    entries = re.findall(r"^(\d+\.\d+\.\d+) \(\d{4}-\d{2}-\d{2}\)\n-+$", (ROOT / "CHANGELOG.rst").read_text(), re.MULTILINE)
    assert entries[0] == version


def test_no_file_holds_an_absolute_path_of_somebodys_machine():
    pattern = re.compile(r"(?<![\w.$}])/(?:home|root|work|tmp|opt|mnt|media)/")
    for folder in ("src", "scripts", "launch", "config", "msg", "srv", "test"):
        for file in (ROOT / folder).rglob("*"):
            if not file.is_file() or file.suffix in {".npz", ".pyc", ".png", ".jpg", ".bag"} or file == Path(__file__).resolve():
                continue
            found = pattern.search(file.read_text(encoding="utf-8"))
            assert not found, f"{file.relative_to(ROOT)}: absolute path {found.group()}…"
