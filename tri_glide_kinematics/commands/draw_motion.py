"""The command ``draw_motion``: the motion of a file, as a picture and as setpoints; without ROS."""

from __future__ import annotations

import argparse
import math
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from tri_glide_kinematics.files import SETTINGS, find_file
from tri_glide_kinematics.picture_commands import (
    MILLIMETRES,
    add_file,
    add_machine_arguments,
    add_unit,
    check_apart,
    command_parser,
    exit_code,
    next_line,
    save_figure,
)

# More would take more memory than a small computer has.
MOST_SETPOINTS = 5_000_000

# Of parts of the motion that rest, and no more of them are named in a picture.
MOST_NAMES = 12


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw the motion of a file from the command line.

    Args:
        arguments: of the command; None for those of the process.

    Returns:
        Exit code: 0 if all is written, 1 after an error, 130 after Ctrl-C.
    """
    parser = make_parser()
    options = parser.parse_args(arguments)
    if options.rate is not None and not 1.0 <= options.rate <= 100_000.0:
        parser.error(f"--rate {options.rate:g}: must be from 1 to 100000 Hz")
    return exit_code("draw_motion", lambda: _draw(options))


def _draw(options: argparse.Namespace) -> None:
    """Plan the motion and write all files.

    Raises:
        KinematicsError: if the file has no motion, or one that the machine cannot do.
        OSError: if the picture cannot be written.
    """
    import numpy as np

    from tri_glide_kinematics.errors import KinematicsError
    from tri_glide_kinematics.figures import Span, file_figure
    from tri_glide_kinematics.motion import CommandStream, MotionKind
    from tri_glide_kinematics.programs import (
        load_own_settings,
        load_work,
        time_steps,
    )
    from tri_glide_kinematics.recordings import save_csv, save_mcap
    from tri_glide_kinematics.settings import (
        IK_NODE,
        file_values,
        scaled_limits_of,
        shaper_of,
        workspace_of,
    )

    signal.signal(signal.SIGINT, signal.default_int_handler)
    file, parameters = find_file(options.file), find_file(options.parameters)
    settings = options.settings and find_file(options.settings)
    check_apart((file, parameters, settings), (options.csv, options.mcap))
    values = file_values(str(parameters), options.node, IK_NODE)
    work = load_work(file, load_own_settings(settings), options.unit)
    if work.frame not in ("", values["base_frame"]):
        raise KinematicsError(
            f"{file}: its places are in the frame {work.frame}, and where that is from "
            f"{values['base_frame']} is known to a running machine only"
        )
    workspace = workspace_of(values)
    machine, bounds = workspace.machine, workspace.limits
    limits = scaled_limits_of(values, machine)
    timed = time_steps(
        work,
        workspace,
        limits,
        kind=MotionKind(values["motion"]),
        shaper=shaper_of(values),
    )
    period = 1.0 / (options.rate or values["rate"])
    duration = timed.trajectory.duration
    count = math.ceil(duration / period) + 1
    if count > MOST_SETPOINTS:
        raise KinematicsError(
            f"{count} setpoints of {duration:.0f} s, at most {MOST_SETPOINTS}: name a lower --rate"
        )
    setpoints = timed.trajectory.sample(period * np.arange(count))
    positions = machine.forward_batch(setpoints.heights)
    way = float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum())
    print(
        f"{file} with {parameters}: {duration:.3f} s, {MILLIMETRES * way:.1f} mm, {count} setpoints"
    )
    told = setpoints._replace(heights=setpoints.heights - np.array(values["height_offsets"]))
    for folder in (options.output, *(each.parent for each in (options.csv, options.mcap) if each)):
        folder.mkdir(parents=True, exist_ok=True)
    if options.csv is not None:
        save_csv(options.csv, told, positions)
        print(f"setpoints: {options.csv}")
    if options.mcap is not None:
        save_mcap(options.mcap, told, values["joint_names"], values["base_frame"])
        print(f"setpoints: {options.mcap}")
    rests = [
        (begin, end)
        for step, begin, end in zip(timed.steps, timed.begins, timed.begins[1:])
        if step.rest
    ]
    name = "rest" if len(rests) <= MOST_NAMES else ""
    stream = CommandStream.from_heights(setpoints.heights, period)
    figure = file_figure(
        stream,
        positions,
        limits,
        (bounds.lower_heights, bounds.upper_heights),
        [Span(name, *rest) for rest in rests],
        file.name,
    )
    picture = options.output / f"{file.stem}_motion.png"
    save_figure(figure, picture, 110)
    print(f"picture: {picture}")
    print(next_line("drive", options.file, "--check", "--parameters", options.parameters))


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line; its name is that of the program."""
    parser = command_parser(
        "Draw the motion of a program in G-code, of points, or of a drive file: the path of the "
        "platform, and heights, velocities, accelerations and jerks of the sliders with their "
        "limits. It needs no ROS and no machine. Outputs and stops take no time in it.",
        "program (.gcode, .nc, .ngc, ...), table of points (.csv), or drive file in YAML; those "
        "of config/ are found by their name alone",
    )
    add_file(parser, "--csv", "write the setpoints as a table, too")
    add_file(
        parser,
        "--mcap",
        "write the setpoints as a recording of joint_commands, too; needs mcap-ros2-support",
    )
    add_machine_arguments(parser)
    add_file(
        parser,
        "--settings",
        "what a program does not say: dialect, offsets, tools, home; of points, tolerance and "
        f"speed (default: {SETTINGS})",
        Path(SETTINGS),
    )
    add_unit(parser)
    return parser


if __name__ == "__main__":
    sys.exit(main())
