"""Numbers and flags that a benchmark or a soak is given on its command line."""

import argparse


def numbers(module: str | None, **options: tuple[float, str]) -> argparse.Namespace:
    """Return the numbers of the command line, each whole if its default is, and the flags.

    Args:
        module: what it says of itself, which is the help.
        options: of each number its default and what it is; that of a flag is false.
    """
    parser = argparse.ArgumentParser(description=module)
    for name, (default, what) in options.items():
        flag = f"--{name.replace('_', '-')}"
        if default is False:
            parser.add_argument(flag, action="store_true", help=what)
        else:
            parser.add_argument(flag, type=type(default), default=default, help=what)
    return parser.parse_args()
