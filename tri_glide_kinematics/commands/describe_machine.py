"""The command ``describe_machine``: a machine as URDF and as MJCF; without ROS."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from tri_glide_kinematics.picture_commands import (
    above_zero,
    add_file,
    add_node_argument,
    check_apart,
    exit_code,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Describe a machine from the command line.

    Args:
        arguments: of the command; None for those of the process.

    Returns:
        Exit code: 0 if all is written, 1 after an error, 130 after Ctrl-C.
    """
    options = make_parser().parse_args(arguments)
    return exit_code("describe_machine", lambda: _describe(options))


def _describe(options: argparse.Namespace) -> None:
    """Write the files, or the URDF to standard output.

    Raises:
        KinematicsError: if the parameters are those of no machine.
        OSError: if a file cannot be written.
    """
    from tri_glide_kinematics.description import mjcf_text, urdf_text
    from tri_glide_kinematics.files import find_file, write_file
    from tri_glide_kinematics.settings import IK_NODE, description_of, file_values, forces_of

    signal.signal(signal.SIGINT, signal.default_int_handler)
    files = [find_file(file) for file in options.files]
    check_apart(files, (options.urdf, options.mjcf))
    first, *later = map(str, files)
    node = f"/{options.node.strip('/')}"
    values = file_values(first, node, IK_NODE, *later)
    description = description_of(values, options.rod_distance)
    if options.urdf is None and options.mjcf is None:
        print(urdf_text(description), end="")
    if options.urdf is not None:
        options.urdf.parent.mkdir(parents=True, exist_ok=True)
        write_file(options.urdf, urdf_text(description))
        print(f"URDF: {options.urdf}")
    if options.mjcf is not None:
        forces = forces_of(values, description.machine)
        text = mjcf_text(description, None if forces is None else forces.masses)
        options.mjcf.parent.mkdir(parents=True, exist_ok=True)
        write_file(options.mjcf, text)
        print(f"MJCF: {options.mjcf}{'' if forces else ', with masses that are assumed'}")


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line; its name is that of the program."""
    parser = argparse.ArgumentParser(
        description="Describe a machine for other programs: as URDF for RViz and Foxglove, and as "
        "MJCF for MuJoCo. It needs no ROS and no machine. Without --urdf and --mjcf it prints "
        "the URDF.",
    )
    parser.add_argument(
        "files",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="parameters of the machine; those of config/ are found by their name alone; of two "
        "files, the later one wins, as that of a calibration",
    )
    add_node_argument(parser)
    add_file(parser, "--urdf", "write the URDF to this file")
    add_file(parser, "--mjcf", "write the MJCF to this file")
    parser.add_argument(
        "--rod-distance",
        type=above_zero("metres"),
        metavar="METRES",
        help="distance of the two rods of an arm (default: 0.072 of the longest arm)",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
