"""Nothing is decided by a text that is meant for people."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ("tri_glide_kinematics", "examples", "launch")
# What people read, as it is named in messages and in the package.
TEXTS = {"reason", "text", "refusal_text", "last_refusal", "target_text", "newest_target", "remark"}
SEARCHES = {"startswith", "endswith", "find", "index", "count", "partition"}
REGULAR = {"search", "match", "fullmatch", "findall"}


def is_text(node):
    """Tell whether an expression is such a text, or the text of an error."""
    if isinstance(node, ast.Attribute):
        return node.attr in TEXTS
    if isinstance(node, ast.Name):
        return node.id in TEXTS - {"text"}
    return isinstance(node, ast.Call) and ast.unparse(node) == "str(error)"


def is_fixed(node):
    """Tell whether an expression is written out, or a constant by its name."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, str)
    return isinstance(node, ast.Name) and node.id.isupper()


def decides(node):
    """Tell whether an expression compares a text with a fixed one, or searches it."""
    if isinstance(node, ast.Compare):
        sides = [node.left, *node.comparators]
        if isinstance(node.ops[0], (ast.In, ast.NotIn)):
            return is_text(node.comparators[0])
        return any(map(is_text, sides)) and any(map(is_fixed, sides))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        if node.func.attr in SEARCHES:
            return is_text(node.func.value)
        return node.func.attr in REGULAR and any(map(is_text, node.args))
    if isinstance(node, ast.Match):
        return is_text(node.subject)
    return False


def found(source):
    return [node.lineno for node in ast.walk(ast.parse(source)) if decides(node)]


def test_no_module_compares_or_searches_what_people_read():
    places = {
        f"{path.relative_to(ROOT)}:{line}"
        for folder in FOLDERS
        for path in (ROOT / folder).rglob("*.py")
        for line in found(path.read_text())
    }
    assert places == set()


@pytest.mark.parametrize(
    "line",
    [
        "late = reason == LATE",
        "late = 'no twist for' in status.reason",
        "late = LATE_TWIST not in reason",
        "done = goal.result.text == 'there'",
        "done = message.refusal_text.startswith('refused')",
        "what = re.search('stop', status.newest_target)",
        "if 'silent' in str(error): pass",
    ],
)
def test_each_way_to_do_it_is_seen(line):
    assert found(line) == [1]


@pytest.mark.parametrize(
    "line", ["if reason is not None: tell(reason.text)", "if label.text != refusal: show(refusal)"]
)
def test_to_look_whether_there_is_one_or_a_new_one_is_no_search(line):
    assert found(line) == []
