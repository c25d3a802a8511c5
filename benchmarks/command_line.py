"""Numbers that a benchmark or a soak is given on its command line."""

from __future__ import annotations

import argparse
from collections.abc import Sequence


def numbers(
    module: str | None,
    arguments: Sequence[str] | None = None,
    **options: tuple[float, str],
) -> argparse.Namespace:
    """Return the numbers of the command line, each whole if its default is.

    Args:
        module: what it says of itself, which is the help.
        arguments: of the command line; those of this process by default.
        options: of each number its default and what it is.
    """
    parser = argparse.ArgumentParser(description=module)
    for name, (default, what) in options.items():
        flag = f"--{name.replace('_', '-')}"
        parser.add_argument(flag, type=type(default), default=default, help=what)
    return parser.parse_args(arguments)
