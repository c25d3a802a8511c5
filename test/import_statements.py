"""What a file imports, in functions as well."""

import ast
import re
from functools import cache
from pathlib import Path
from textwrap import dedent

# Strings of several lines may hold code of other files.
STRING = re.compile(r'("""|\'\'\').*?\1', re.DOTALL)
STATEMENT = re.compile(
    r"^[ ]*(?:from[ ]+[\w.]+[ ]+import[ ]+(?:\([^)]*\)|[^\n]*)|import[ ]+[^\n]*)", re.MULTILINE
)


@cache
def imports(path: Path) -> list[ast.Import | ast.ImportFrom]:
    """Return all imports of a file. To parse the rest of it, too, takes twenty times as long."""
    text = STRING.sub(lambda found: "\n" * found[0].count("\n"), path.read_text(encoding="utf-8"))
    nodes = []
    for found in STATEMENT.finditer(text):
        (node,) = ast.parse(dedent(found[0])).body
        assert isinstance(node, (ast.Import, ast.ImportFrom)), found[0]
        nodes.append(ast.increment_lineno(node, text.count("\n", 0, found.start())))
    return nodes
