"""Code outside a room imports from the room, not from its modules. No import leads in a circle."""

import ast
import re
from configparser import ConfigParser
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from import_statements import imports

ROOT = Path(__file__).parents[1]
PACKAGE = "tri_glide_kinematics"
ROOMS = {
    ".".join(path.parent.relative_to(ROOT).parts): path
    for path in (ROOT / PACKAGE).rglob("__init__.py")
    if "when_first_used" in path.read_text()
}
# A layer of setup.cfg may be a single module.
CONTRACTS = ConfigParser()
CONTRACTS.read(ROOT / "setup.cfg")
LAYERS = {
    f"{contract['containers']}.{layer}"
    for contract in CONTRACTS.values()
    if "layers" in contract
    for layer in re.findall(r"\w+", contract["layers"])
}
FOLDERS = (PACKAGE, "test", "testing", "benchmarks", "examples")
FILES = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py"))]


def room_of(module: str) -> str | None:
    """Return the room that a module is in; None if it is a room itself."""
    room = module.rpartition(".")[0]
    return None if module in ROOMS or module in LAYERS or room not in ROOMS else room


def place_of(path: Path) -> str:
    """Return the package that a file is in, or is a test of."""
    folder, *rest = path.relative_to(ROOT).parent.parts
    return ".".join([PACKAGE if folder == "test" else folder, *rest])


def is_passed_on(path: Path, room: str) -> bool:
    """Return whether a file is that by which a larger room exports the names of this one."""
    return path.name == "__init__.py" and room.startswith(place_of(path))


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_who_is_outside_a_room_imports_from_the_room(path):
    for node in imports(path):
        if not isinstance(node, ast.ImportFrom) or not node.module:
            continue
        room = room_of(node.module)
        if room is None or f"{place_of(path)}.".startswith(f"{room}.") or is_passed_on(path, room):
            continue
        # A function with the name of its module cannot be a name of the room as well.
        own_name = node.module.rpartition(".")[2]
        names = {alias.name for alias in node.names}
        names = {name for name in names if name != own_name and not name.startswith("_")}
        assert not names, f"line {node.lineno}: {names} from {node.module}, not from {room}"


def test_no_import_leads_in_a_circle():
    """Imports for types and those in functions count: who reads a module has to read those, too."""
    found_in = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): imports(
            path
        )
        for path in (ROOT / PACKAGE).rglob("*.py")
    }
    passed_on = {
        (room, alias.name): node.module
        for room in ROOMS
        for node in found_in[room]
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }

    def home_of(module: str, name: str) -> str:
        while (module, name) in passed_on:
            module = passed_on[module, name]
        return f"{module}.{name}" if f"{module}.{name}" in found_in else module

    needs: dict[str, set[str]] = {}
    for module in found_in.keys() - ROOMS.keys():
        found = set()
        for node in found_in[module]:
            if isinstance(node, ast.Import):
                found |= {alias.name for alias in node.names}
            else:
                assert node.module, f"{module} imports without the full name"
                found |= {home_of(node.module, alias.name) for alias in node.names}
        needs[module] = found & found_in.keys()
    # Raises CycleError, which names the circle.
    TopologicalSorter(needs).prepare()
