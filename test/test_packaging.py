"""What the package imports is what its manifests say that it needs."""

import ast
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from catkin_pkg.package import Package, parse_package
from import_statements import imports

from tri_glide_kinematics import __version__
from tri_glide_kinematics.command_line import COMMANDS, PROGRAM
from tri_glide_kinematics.command_line import main as command_line_main

ROOT = Path(__file__).parents[1]
PACKAGE = "tri_glide_kinematics"
INSIDE = ("tri_glide_interfaces", "tri_glide_ruckig")
FOLDERS = [ROOT, *(ROOT / name for name in INSIDE)]
# The part of the index of ROS that is kept; make release-check gives it to rosdep and bloom.
INDEX = ROOT / "test" / "ros_index"
TESTS = ("test", "testing")

# Modules that a package of another name brings along: the key of rosdep, and the name for pip.
ROSDEP_KEYS = {
    "PIL": "python3-pil",
    "catkin_pkg": "python3-catkin-pkg-modules",
    "hypothesis": "python3-hypothesis",
    "matplotlib": "python3-matplotlib",
    "mpl_toolkits": "python3-matplotlib",
    "tqdm": "python3-tqdm",
    "numpy": "python3-numpy",
    "pytest": "python3-pytest",
    "scipy": "python3-scipy",
    "websockets": "python3-websockets",
    "yaml": "python3-yaml",
}
PIP_NAMES = {"PIL": "pillow", "mpl_toolkits": "matplotlib", "yaml": "pyyaml"}

# These come with viser, which is needed for the panel alone.
WITH_VISER = {"msgspec", "websockets", "zstandard"}
# There is no rosdep key for these; numba makes things faster where it is found.
WITHOUT_KEY = {"ruckig", "viser", "numba", "msgspec", "zstandard"}
WITHOUT_KEY |= {"mcap", "mcap_ros2"}
# Whoever has drives on CAN is told what to type.
WITHOUT_KEY |= {"can", "canopen"}


def imported(*folders: str) -> set[str]:
    """Top-level modules that are imported anywhere in folders, and are from elsewhere."""
    files = [
        file
        for folder in folders
        for file in (ROOT / folder).rglob("*")
        if file.suffix == ".py" or file.parent.name == "executables"
    ]
    assert files
    # A test may use another one's parts.
    helpers = {"integration", *(file.stem for file in (ROOT / "test").rglob("*.py"))}
    found = set()
    for file in files:
        for node in imports(file):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                found.add(str(node.module).split(".")[0])
    return found - helpers - {PACKAGE, "benchmarks", "testing"} - set(sys.stdlib_module_names)


def keys(modules: set[str]) -> set[str]:
    return {ROSDEP_KEYS.get(module, module) for module in modules - WITHOUT_KEY}


@pytest.fixture
def setup(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Return what setup.py tells setuptools."""
    arguments: dict[str, Any] = {}
    monkeypatch.setattr("setuptools.setup", lambda **given: arguments.update(given))
    monkeypatch.chdir(ROOT)
    exec(compile((ROOT / "setup.py").read_text(encoding="utf-8"), "setup.py", "exec"), {})
    return arguments


@pytest.fixture(scope="module")
def manifest() -> Package:
    return parse_package(str(ROOT))


def test_the_manifest_names_what_the_package_imports_and_nothing_else(manifest: Package):
    declared = {dependency.name for dependency in manifest.exec_depends}
    assert declared == keys(imported(PACKAGE, "executables", "launch") - WITH_VISER)


def test_the_manifest_names_what_the_tests_import_and_nothing_else(manifest: Package):
    declared = {dependency.name for dependency in manifest.test_depends}
    exec_depends = {dependency.name for dependency in manifest.exec_depends}
    assert declared == keys(imported(*TESTS)) - exec_depends


def test_the_python_package_names_what_it_imports_without_ros(setup: dict[str, Any]):
    always = [*setup["install_requires"], *setup["extras_require"]["pictures"]]
    without_ros = set(ROSDEP_KEYS) | {"ruckig"}
    for modules, declared in (
        (imported(PACKAGE) - WITH_VISER, always),
        (imported(PACKAGE, *TESTS), [*always, *setup["extras_require"]["test"]]),
    ):
        needed = {PIP_NAMES.get(module, module) for module in modules & without_ros}
        assert sorted(declared) == sorted(needed)


def test_the_version_is_one(setup: dict[str, Any]):
    folders = (ROOT, *ROOT.glob("tri_glide_*/package.xml"))
    assert len(folders) == 3
    versions = {parse_package(str(folder)).version for folder in folders}
    assert versions == {setup["version"], __version__}


def test_the_command_has_all_executables_that_need_no_ros(setup: dict[str, Any]):
    files = (ROOT / "executables").iterdir()
    starts = {
        file.name: re.findall(r"from tri_glide_kinematics\.(\S+) import main\b", file.read_text())
        for file in files
    }
    rooms_with_ros = ("demo.", "panel.")
    commands = {
        name: modules[0]
        for name, modules in starts.items()
        if modules and not modules[0].startswith(rooms_with_ros)
    }
    assert {name: command.module for name, command in COMMANDS.items()} == commands
    assert setup["entry_points"] == {
        "console_scripts": [f"{PROGRAM} = {command_line_main.__module__}:main"]
    }


def test_each_key_of_the_manifests_is_in_the_index_and_none_is_kept_without_use():
    released = yaml.safe_load((INDEX / "distribution.yaml").read_text())["repositories"]
    kept = set(yaml.safe_load((INDEX / "rosdep.yaml").read_text()))
    kept |= {name for each in released.values() for name in each["release"]["packages"]}
    manifests = [parse_package(str(folder)) for folder in FOLDERS]
    used = {key.name for manifest in manifests for key in _dependencies(manifest)}
    assert used == kept - {PACKAGE}
    # A package with a key that pip installs cannot be released into the index.
    assert not any(key.endswith("-pip") for key in used)


def test_colcon_finds_all_packages_as_the_readme_says(tmp_path: Path):
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / PACKAGE).symlink_to(ROOT)
    inside = [f"src/{PACKAGE}/{name}" for name in INSIDE]
    for folder, arguments in ((ROOT, ()), (tmp_path, ("--base-paths", "src", *inside))):
        command = [str(shutil.which("colcon")), "list", "--names-only", *arguments]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
        assert done.stdout.split() == sorted([PACKAGE, *INSIDE])


def _dependencies(manifest: Package) -> list:
    return [
        *(*manifest.buildtool_depends, *manifest.build_depends, *manifest.build_export_depends),
        *(*manifest.exec_depends, *manifest.test_depends),
    ]


@pytest.mark.parametrize("folder", FOLDERS)
def test_manifests_are_valid_and_promise_no_mailbox(folder: Path):
    warnings: list[str] = []
    manifest = parse_package(str(folder), warnings=warnings)
    manifest.validate(warnings)
    assert not warnings
    assert all(person.email.endswith(".invalid") for person in manifest.maintainers)
