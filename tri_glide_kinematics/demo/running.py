"""How a demonstration runs: on this computer alone, with nodes that are patient, until Ctrl-C."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.picture_commands import save_figure
from tri_glide_kinematics.ros.starting import (
    COMPUTER,
    choose_transport,
    default_parameter_file,
    raise_at_signals,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tri_glide_kinematics.vectors import Vector3

# A busy computer may let the simulated machine wait for longer than a real one ever falls silent,
# and follow from farther behind.
PATIENCE = ("-p", "measured_timeout:=2.0")
MORE_PATIENCE = (*PATIENCE, "-p", "tracking_error_limit:=0.3")

# A namespace of its own keeps a demonstration away from a machine on this computer.
NAMESPACE = f"/tri_glide_demo_{os.getpid()}"


def node_arguments(values: Mapping[str, object], *files: Path) -> list[str]:
    """Return the arguments of a node that is patient, with ``values`` of some parameters.

    The other ones are those of the default file, or of more ``files``.
    """
    found = ["-r", f"__ns:={NAMESPACE}", "--log-level", "WARN"]
    for file in (default_parameter_file(), *files):
        found += ["--params-file", str(file)]
    return [*found, *MORE_PATIENCE, *parameter_arguments(values)]


def parameter_arguments(values: Mapping[str, object]) -> list[str]:
    """Return the arguments that give a node the ``values`` of parameters."""
    return [word for name, value in values.items() for word in ("-p", f"{name}:={value}")]


def save_page(folder: Path, name: str, figure: Figure) -> Path:
    """Save a page in a ``folder``, which is made if needed; tell and return the picture."""
    folder.mkdir(parents=True, exist_ok=True)
    picture = folder / f"{name}.png"
    save_figure(figure, picture, 110)
    say(f"picture: {picture}")
    return picture


def say(text: str, name: str = "demo") -> None:
    """Print one line of progress at once, of the command with this ``name``."""
    print(f"{name}: {text}", flush=True)


def in_millimetres(vector: Vector3) -> str:
    """Return a vector [m] as text [mm]."""
    return "(" + ", ".join(f"{1000.0 * value:7.2f}" for value in vector) + ")"


def run_demo(
    name: str,
    description: str | None,
    demonstrate: Callable[..., int],
    **options: dict[str, Any],
) -> int:
    """Run a demonstration from the command line, and return its exit code.

    It gets the folder of all its files as ``output``, and the ``options`` of its own.
    """
    parser = argparse.ArgumentParser(prog=name, description=description)
    parser.add_argument(
        "--output", type=Path, default=Path("out"), help="folder of all files (default: out)"
    )
    for option, meaning in options.items():
        parser.add_argument(f"--{option}", **meaning)
    values = vars(parser.parse_args())
    return run_command(name, lambda: demonstrate(**values))


def run_command(name: str, demonstrate: Callable[[], int]) -> int:
    """Run a demonstration on this computer alone, and return the exit code of its command."""
    raise_at_signals()
    try:
        # For this process and the nodes that it starts.
        say(choose_transport(COMPUTER).text, name)
        return demonstrate()
    except KeyboardInterrupt:
        say("interrupted; all nodes are stopped", name)
        return 128 + signal.SIGINT
    except (KinematicsError, OSError) as error:
        print(f"{name}: error: {error}", file=sys.stderr)
        return 1
