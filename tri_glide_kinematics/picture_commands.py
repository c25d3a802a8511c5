"""Code that all commands that draw share: their style, their files, how they end."""

from __future__ import annotations

import argparse
import math
import os
import shlex
import signal
import sys
from collections.abc import Callable, Iterable
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import PACKAGE, PARAMETERS, write_file
from tri_glide_kinematics.keys import UNITS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# How limits are drawn.
LIMIT_STYLE: dict[str, Any] = {"color": "0.35", "linestyle": "--", "linewidth": 0.9}

# In a metre.
MILLIMETRES = 1000.0

# What is written where no file is named.
STDOUT = "standard output"


def save_figure(figure: Figure, file: Path, resolution: float) -> None:
    """Save a ``figure`` as a PNG ``file``, with a ``resolution`` in pixels per inch.

    Raises:
        OSError: if it cannot be written.
    """
    picture = BytesIO()
    figure.savefig(picture, format="png", dpi=resolution)
    write_file(file, picture.getvalue())


def command_parser(description: str, file_help: str) -> argparse.ArgumentParser:
    """Return the parser of a command that reads a ``file`` and writes to the folder ``output``."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("file", type=Path, help=file_help)
    add_output(parser, Path("out"))
    return parser


def add_output(parser: argparse.ArgumentParser, default: Path | None) -> None:
    """Add the option that names the folder of all that a command writes."""
    meaning = f"folder (default: {default or 'nothing is written'})"
    parser.add_argument("--output", type=Path, default=default, metavar="DIR", help=meaning)


def next_line(name: str, *arguments: object) -> str:
    """Return what to type next: a command of this package and its arguments."""
    start = "tri-glide" if sys.argv[0].startswith("tri-glide") else f"ros2 run {PACKAGE}"
    return f"next: {start} {shlex.join([name, *map(str, arguments)])}"


def add_file(
    parser: argparse.ArgumentParser, name: str, meaning: str, default: Path | None = None
) -> None:
    """Add an option with this ``name`` to a ``parser``, which names a file."""
    parser.add_argument(name, type=Path, default=default, metavar="FILE", help=meaning)


def add_unit(parser: argparse.ArgumentParser) -> None:
    """Add the option that names the unit of points to a ``parser``."""
    parser.add_argument(
        "--unit", choices=tuple(UNITS), help="of points whose columns name none in their heads"
    )


def add_node_argument(parser: argparse.ArgumentParser) -> None:
    """Add what tells a command whose parameters of a file are those of the machine."""
    parser.add_argument(
        "--node",
        default="/ik_node",
        metavar="NAME",
        help="full name of the node whose parameters they are (default: /ik_node)",
    )


def add_machine_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what tells a command about the machine: the rate, and where its parameters are."""
    parser.add_argument(
        "--rate",
        type=above_zero("hertz"),
        metavar="HZ",
        help="of the setpoints (default: the parameter rate)",
    )
    add_parameter_arguments(parser)


def add_parameter_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what tells a command where the parameters of the machine are."""
    add_file(
        parser,
        "--parameters",
        f"parameters of the machine (default: {PARAMETERS})",
        Path(PARAMETERS),
    )
    add_node_argument(parser)


def number(what: str, above: float = -math.inf) -> Callable[[str], float]:
    """Return what reads a finite number of an option; ``what`` names it in errors."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and value > above):
            raise argparse.ArgumentTypeError(f"{text!r} is not {what}")
        return value

    return read


def above_zero(unit: str) -> Callable[[str], float]:
    """Return what reads a number of an option that is greater than 0."""
    return number(f"a number of {unit} greater than 0", 0.0)


def whole_number(least: int, most: int) -> Callable[[str], int]:
    """Return what reads a whole number of an option, not negative and within bounds."""

    def read(text: str) -> int:
        if not text.isdecimal() or not least <= int(text) <= most:
            reason = f"is not a whole number from {least} to {most}"
            raise argparse.ArgumentTypeError(f"{text!r} {reason}")
        return int(text)

    return read


def check_apart(read: Iterable[Path | None], written: Iterable[Path | None]) -> None:
    """Check that none of the files that are ``written`` is one of those that are ``read``.

    Raises:
        KinematicsError: if one is, which would be lost.
    """
    known = [file.resolve() for file in read if file is not None]
    for target in written:
        if target is not None and target.resolve() in known:
            raise KinematicsError(f"{target}: is read: write to another file")


def exit_code(name: str, work: Callable[[], int | None], failed: int = 1) -> int:
    """Do the ``work`` of a command, and return its exit code.

    Until ``work`` has loaded what it needs, Ctrl-C ends the process at once; then it sets
    ``signal.default_int_handler``.

    Args:
        name: of the command, for its errors.
        work: what it does; it returns its exit code, or None for 0.
        failed: exit code after an error.

    Returns:
        That of ``work``, or ``failed``, or 130 after Ctrl-C.
    """
    # Matrices are small here: threads of the linear algebra library would only wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    handler = signal.signal(signal.SIGINT, lambda *_: os._exit(128 + signal.SIGINT))
    try:
        return work() or 0
    except KinematicsError as error:
        reason = str(error)
    except OSError as error:
        reason = f"cannot write to {error.filename or STDOUT}: {error.strerror or error}"
    except ModuleNotFoundError as error:
        reason = f"the Python module {error.name!r} is missing"
    except KeyboardInterrupt:
        print(f"{name}: interrupted", file=sys.stderr)
        return 128 + signal.SIGINT
    finally:
        signal.signal(signal.SIGINT, handler)
    print(f"{name}: error: {reason}", file=sys.stderr)
    return failed
