"""The command ``identify``: masses and friction of a machine from the efforts of its drives.

It needs no ROS. With ``--excite`` it writes the moves that ``drive`` drives meanwhile.
"""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from tri_glide_kinematics.files import find_file
from tri_glide_kinematics.picture_commands import (
    above_zero,
    add_parameter_arguments,
    exit_code,
    number,
)

FIRST_LINE = "# Moves that tell the most of masses and friction; written by identify."

# Options that have a meaning for one of both alone.
FOR_MOVES = ("duration", "seed")
FOR_A_RECORDING = ("topic", "known", "any_arms", "write")


def main(arguments: Sequence[str] | None = None) -> int:
    """Identify a machine from the command line.

    Args:
        arguments: of the command; None for those of the process.

    Returns:
        Exit code: 0 if masses are told or moves are written, 1 after an error, 130 after Ctrl-C.
    """
    parser = make_parser()
    options = parser.parse_args(arguments)
    if (options.excite is None) == (options.file is None):
        parser.error("either a recording, or --excite")
    others = FOR_MOVES if options.excite is None else FOR_A_RECORDING
    for name in others:
        if getattr(options, name) != parser.get_default(name):
            what = "--excite" if others is FOR_MOVES else "a recording"
            parser.error(f"--{name.replace('_', '-')} is for {what}")
    if options.any_arms and options.write is not None:
        parser.error("--write is for uniform arms: --any-arms tells sums, which no parameter is")
    work = _identify if options.excite is None else _excite
    return exit_code("identify", lambda: work(options))


def _excite(options: argparse.Namespace) -> None:
    """Write a drive file with verified moves.

    Raises:
        KinematicsError: if there are none.
        OSError: if the file cannot be written.
    """
    from tri_glide_kinematics.calibration import exciting_moves
    from tri_glide_kinematics.files import replace_file
    from tri_glide_kinematics.motion import MotionKind
    from tri_glide_kinematics.settings import (
        IK_NODE,
        file_values,
        scaled_limits_of,
        shaper_of,
        workspace_of,
    )

    signal.signal(signal.SIGINT, signal.default_int_handler)
    values = file_values(str(find_file(options.parameters)), options.node, IK_NODE)
    workspace = workspace_of(values)
    # As ik_node will drive them.
    found = exciting_moves(
        workspace,
        scaled_limits_of(values, workspace.machine),
        options.duration,
        seed=options.seed,
        kind=MotionKind(values["motion"]),
        shaper=shaper_of(values),
    )
    moves = "".join(
        f"  - move: {{ to: [{', '.join(map(repr, place))}] }}\n" for place in found.positions
    )
    options.excite.parent.mkdir(parents=True, exist_ok=True)
    replace_file(options.excite, f"{FIRST_LINE}\nsteps:\n{moves}")
    print(
        f"{options.excite}: {len(found.positions)} moves, all of them verified; "
        f"{found.trajectory.duration:.1f} s from the first place on"
    )
    print("the machine will move through all of its workspace, as fast as its limits allow")


def _identify(options: argparse.Namespace) -> None:
    """Tell masses and friction, and write the parameter file.

    Raises:
        KinematicsError: if the recording does not tell them.
    """
    from tri_glide_kinematics.dynamics import COUNTERWEIGHTS
    from tri_glide_kinematics.recordings import (
        load_recording,
        masses_report,
        measured_masses,
        save_masses,
    )
    from tri_glide_kinematics.settings import IK_NODE, file_values, machine_of

    signal.signal(signal.SIGINT, signal.default_int_handler)
    parameters = find_file(options.parameters)
    values = file_values(str(parameters), options.node, IK_NODE)
    recording = load_recording(options.file, values["joint_names"], options.topic)
    found = measured_masses(
        recording,
        machine_of(values),
        height_offsets=values["height_offsets"],
        gravity=values["gravity"],
        uniform_arms=not options.any_arms,
        known={**dict(zip(COUNTERWEIGHTS, values["counterweight_masses"])), **dict(options.known)},
    )
    print(f"{options.file} with {parameters}: {recording.stamps[-1]:.1f} s")
    print(masses_report(found))
    if options.write is not None:
        options.write.parent.mkdir(parents=True, exist_ok=True)
        save_masses(options.write, found.masses(values["gravity"]))
        print(f"parameter file for ik_node: {options.write}")


def _known(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name.strip(), number("a number")(value)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"{text!r} is not a name, =, and a number") from error


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line; its name is that of the program."""
    parser = argparse.ArgumentParser(
        description="Tell masses and friction of a machine, with standard deviations, from the "
        "efforts of its drives while it moves. It needs no ROS.",
    )
    parser.add_argument(
        "file",
        type=Path,
        nargs="?",
        help="recording of measured heights and efforts: folder of ros2 bag record with MCAP "
        "files, MCAP file, or table (.csv) with time, height_1 to height_3, effort_1 to effort_3",
    )
    parser.add_argument(
        "--excite",
        type=Path,
        metavar="MOVES.yaml",
        help="write the moves that tell the most, for the command drive",
    )
    parser.add_argument(
        "--duration",
        type=above_zero("seconds"),
        default=60.0,
        metavar="S",
        help="of the moves, at least (default: 60)",
    )
    parser.add_argument("--seed", type=int, default=0, help="of the moves (default: 0)")
    add_parameter_arguments(parser)
    parser.add_argument(
        "--topic",
        default="joint_states",
        metavar="NAME",
        help="of the messages, in any namespace (default: joint_states)",
    )
    parser.add_argument(
        "--known",
        type=_known,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help='what was weighed, by the name that is told, as "arm 1=0.25"; may be given again',
    )
    parser.add_argument(
        "--any-arms", action="store_true", help="arms are not uniform: tell sums of their masses"
    )
    parser.add_argument(
        "--write", type=Path, metavar="MASSES.yaml", help="parameter file for ik_node to write"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
