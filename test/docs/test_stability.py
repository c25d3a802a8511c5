"""What ``docs/stability.md`` promises is what the code has."""

import ast
import re
from importlib import import_module

import pytest
from documents import PAGES, ROOT, blocks, text
from policies import allowed

import tri_glide_kinematics
from tri_glide_kinematics.command_line import COMMANDS, PROGRAM
from tri_glide_kinematics.settings import NODES

PAGE = ROOT / "docs" / "stability.md"
PACKAGE = "tri_glide_kinematics"
INTERFACES = ROOT / "tri_glide_interfaces"
# What rclpy gives each node, and commands that nobody else talks to.
OF_EACH_NODE = re.compile(r"/parameter_events|/rosout|~/(\w+_parameters\w*|get_\w+)")
COMMAND_NODES = ("drive", "ringdown")
NOT_PROMISED = {"demo", "calibration_demo", "calm_demo", "pick_demo"}


def lists(heading: str) -> dict[str, set[str]]:
    """Return the names in the block below a heading, by what stands before them in their line."""
    section = text(PAGE).partition(f"\n### {heading}\n")[2]
    block = re.search(r"```text\n(.*?)```", section, flags=re.DOTALL)
    assert block, heading
    found: dict[str, set[str]] = {}
    for line in re.sub(r"\n +", " ", block.group(1)).splitlines():
        key, _, names = line.partition(": ")
        assert key not in found
        found[key] = set(names.split())
    return found


def test_the_names_of_the_package_are_promised():
    assert lists("Python")[PACKAGE] == set(tri_glide_kinematics.__all__)


@pytest.mark.parametrize("room", lists("Python"))
def test_promised_names_are_there(room):
    module = import_module(room)
    assert {name for name in lists("Python")[room] if not hasattr(module, name)} == set()


def test_what_documents_and_examples_show_is_promised():
    sources = [code for page in PAGES for code in blocks(page, "python")]
    sources += [text(file) for file in (ROOT / "examples").glob("*.py")]
    promised = lists("Python")
    for node in (node for source in sources for node in ast.walk(ast.parse(source))):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith(PACKAGE):
            names = {alias.name for alias in node.names}
            known = promised[str(node.module)] | promised[PACKAGE]
            assert names <= known, node.module


def test_topics_services_and_actions_are_those_of_the_nodes():
    words = {
        "publish": "publishes",
        "subscribe": "subscribes",
        "reply": "serves",
        "execute": "does",
    }
    used = {
        f"{node} {words[permission]}": {name for name in names if not OF_EACH_NODE.fullmatch(name)}
        for node, uses in allowed().items()
        if node not in COMMAND_NODES
        for permission, names in uses.items()
        if permission in words
    }
    assert lists("Topics, services, actions") == {
        key: names for key, names in used.items() if names
    }


def test_types_are_those_of_the_interface_package():
    kinds = ("msg", "srv", "action")
    there = {kind: {file.stem for file in (INTERFACES / kind).iterdir()} for kind in kinds}
    assert lists("Types of tri_glide_interfaces") == there


def test_parameters_are_those_of_the_tables():
    there = {node: {entry.name for entry in table} for node, table in NODES.items()}
    assert lists("Parameters") == there


def test_commands_are_those_that_are_installed():
    there = {file.name for file in (ROOT / "executables").iterdir()} - NOT_PROMISED
    launched = {file.name for file in (ROOT / "launch").glob("*.launch.py")}
    without_ros = set(COMMANDS)
    assert lists("Commands") == {"ros2 run": there, "ros2 launch": launched, PROGRAM: without_ros}
