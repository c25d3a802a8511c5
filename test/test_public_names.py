"""What the package and its rooms export, loaded when first used."""

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import tri_glide_kinematics

ROOT = Path(tri_glide_kinematics.__file__).parent
PACKAGES = sorted(
    ".".join(path.parent.relative_to(ROOT.parent).parts)
    for path in ROOT.rglob("__init__.py")
    if "when_first_used" in path.read_text()
)


@pytest.mark.parametrize("package", PACKAGES)
def test_what_type_checkers_see_is_what_there_is(package):
    module = import_module(package)
    tree = ast.parse(Path(module.__file__).read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If))
    seen = {alias.asname: node.module for node in block.body for alias in node.names}
    assert sorted(seen) == module.__all__
    for name, home in seen.items():
        assert getattr(module, name) is getattr(import_module(home), name)
    with pytest.raises(AttributeError, match=f"{package}.* has no attribute 'nonsense'"):
        _ = module.nonsense


def test_nothing_is_loaded_before_it_is_used():
    large = {"numpy", "rclpy", "ruckig"}
    code = f"import sys, {', '.join(PACKAGES)}; print({large} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_completion_shows_the_public_names():
    code = (
        "from importlib import import_module\n"
        f"for name in {PACKAGES}: print(*dir(import_module(name)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    for package, shown in zip(PACKAGES, done.stdout.splitlines(), strict=True):
        assert {*import_module(package).__all__, "__doc__", "__path__"} <= set(shown.split())
        assert not {"TYPE_CHECKING", "lazy", "when_first_used"} & set(shown.split())
