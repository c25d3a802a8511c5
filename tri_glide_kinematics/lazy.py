"""Public names of a room, each loaded when it is first used (PEP 562).

So who imports a little of a room waits for no more than that.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path


def when_first_used(
    package: str, file: str
) -> tuple[list[str], Callable[[str], object], Callable[[], list[str]]]:
    """Return ``__all__``, ``__getattr__`` and ``__dir__`` of a package.

    The names are those that the package imports ``if TYPE_CHECKING``, so that they stand in one
    place for the interpreter, type checkers and editors.

    Args:
        package: its name.
        file: its source.
    """
    home_of = _imports_of(file)

    def load(name: str) -> object:
        if name not in home_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(home_of[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        # Names that the package itself needs are not among them.
        own = (name for name in vars(sys.modules[package]) if name.startswith("__"))
        return sorted({*home_of, *own})

    return sorted(home_of), load, names


def _imports_of(file: str) -> dict[str, str]:
    """Return the names that a ``file`` imports for type checkers, and their modules."""
    tree = ast.parse(Path(file).read_text(encoding="utf-8"))
    return {
        alias.name: str(statement.module)
        for block in tree.body
        if isinstance(block, ast.If)
        for statement in block.body
        if isinstance(statement, ast.ImportFrom)
        for alias in statement.names
    }
