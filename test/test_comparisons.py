"""What holds an array is compared by identity."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "tri_glide_kinematics"


def are_compared(source):
    """Return the names of dataclasses that compare arrays, which has no answer."""
    return [
        node.name
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ClassDef)
        and any("Array" in ast.unparse(each.annotation) for each in fields(node))
        and any(is_by_value(ast.unparse(each)) for each in node.decorator_list)
    ]


def fields(node):
    return [each for each in node.body if isinstance(each, ast.AnnAssign)]


def is_by_value(decorator):
    return decorator.startswith("dataclass") and "eq=False" not in decorator


def test_no_dataclass_compares_arrays():
    files = [path for path in PACKAGE.rglob("*.py") if "Array" in path.read_text()]
    assert [(path.name, names) for path in files if (names := are_compared(path.read_text()))] == []


@pytest.mark.parametrize(
    ("options", "found"), [("", ["A"]), ("(frozen=True)", ["A"]), ("(eq=False)", [])]
)
def test_it_is_seen(options, found):
    assert are_compared(f"@dataclass{options}\nclass A:\n    numbers: FloatArray | None\n") == found
