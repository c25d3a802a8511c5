"""The command ``ringdown``: from recordings of swings to modes, pictures, a parameter file.

Slow modules are imported after the command line has been read, so that a mistake in it is
told at once and Ctrl-C ends the process while modules are still being loaded.
"""

from __future__ import annotations

import argparse
import math
import shlex
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from tri_glide_kinematics.files import find_file
from tri_glide_kinematics.picture_commands import add_file, add_output, exit_code, next_line

PICTURE, MODES = "ringdown.png", "modes.yaml"
SHAPERS = ("zv", "mzv", "zvd", "ei", "two_hump_ei", "three_hump_ei")


# Lets a machine swing, and returns the recordings; told whether measured heights are recorded.
Measure = Callable[[bool], Sequence[Path]]


def main(arguments: Sequence[str] | None = None, measure: Measure | None = None) -> int:
    """Find modes from the command line.

    Args:
        arguments: of the command; None for those of the process.
        measure: what ``--machine`` does; None where there is no ROS.

    Returns:
        Exit code: 0 if there is a mode, 1 after an error or if none is known, 130 after Ctrl-C.
    """
    parser = make_parser()
    options = parser.parse_args(arguments)
    if options.machine == bool(options.files):
        parser.error("either files, or --machine")
    if options.machine and measure is None:
        parser.error("--machine needs ROS 2: start this command with ros2 run")
    if options.heights and not options.machine:
        parser.error("--heights is for --machine")
    if options.output is not None:
        options.picture = options.picture or options.output / PICTURE
        options.write = options.write or options.output / MODES
    return exit_code("ringdown", options.picture, lambda: _find(options, measure))


def _find(options: argparse.Namespace, measure: Measure | None) -> None:
    """Find the modes, tell of them and write all files.

    Raises:
        KinematicsError: if there is no recording, or no mode is known.
        OSError: if the picture cannot be written.
    """
    if measure is not None and options.machine:
        options.files = measure(options.heights)
    from tri_glide_kinematics.calibration.ringdown import (
        CombinedModes,
        ModeFileError,
        NoModeError,
        combine_modes,
        combined_report,
        find_modes,
        load_recording,
        ringdown_report,
        save_modes,
    )
    from tri_glide_kinematics.motion.shaping import ShaperKind

    signal.signal(signal.SIGINT, signal.default_int_handler)
    recordings = [load_recording(find_file(file), options.unit) for file in options.files]
    swings = [find_modes(each.between(options.start, options.end)) for each in recordings]
    found = combine_modes(swings) if len(swings) > 1 else swings[0]
    for file, swing in zip(options.files, swings):
        title = f"{file}\n" if len(swings) > 1 else ""
        print(f"{title}{ringdown_report(swing)}\n")
    if isinstance(found, CombinedModes):
        print(f"All swings together\n{combined_report(found)}\n")
    if options.picture is not None:
        from tri_glide_kinematics.figures import ringdown_figure
        from tri_glide_kinematics.picture_commands import save_figure

        options.picture.parent.mkdir(parents=True, exist_ok=True)
        for number, swing in enumerate(swings, 1):
            picture = options.picture
            if len(swings) > 1:
                picture = picture.with_name(f"{picture.stem}_{number}{picture.suffix}")
            save_figure(ringdown_figure(swing), picture, 110)
            print(f"picture: {picture}")
    if found.reason is not None:
        raise NoModeError(found.reason)
    if options.write is None:
        print(next_line("ringdown", *options.files, "--output", "out"))
        return
    with ModeFileError.of_writing(options.write):
        options.write.parent.mkdir(parents=True, exist_ok=True)
    save_modes(options.write, found, ShaperKind(options.shaper))
    print(f"parameter file for ik_node: {options.write}")
    start = "next: ros2 run tri_glide_kinematics ik_node --ros-args --params-file my_machine.yaml"
    print(f"{start} --params-file {shlex.quote(str(options.write))}")


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line; its name is that of the program."""
    parser = argparse.ArgumentParser(
        description="Find the modes of vibration of a machine from recordings of how it swings "
        "after a motion: frequency and damping, each with its standard deviation, or why they are "
        "not known.",
    )
    parser.add_argument(
        "files",
        type=Path,
        nargs="*",
        metavar="file",
        help="table of times and one to three axes (CSV), or the name of a file that is installed "
        "in config/; several are swings of one machine",
    )
    parser.add_argument(
        "--machine",
        action="store_true",
        help="let calibration_node move the machine and record the swings, instead of files",
    )
    parser.add_argument(
        "--heights",
        action="store_true",
        help="with --machine: record measured heights, not what an accelerometer tells",
    )
    parser.add_argument(
        "--unit", help="of axes without one in the head: m, mm, um, m/s2, mm/s2, g or mg"
    )
    parser.add_argument(
        "--from",
        dest="start",
        type=_time,
        default=-math.inf,
        metavar="S",
        help="time in the file at which the motion is over [s] (default: the first)",
    )
    parser.add_argument(
        "--to",
        dest="end",
        type=_time,
        default=math.inf,
        metavar="S",
        help="time in the file at which the next motion begins [s] (default: the last)",
    )
    add_output(parser, None)
    add_file(
        parser,
        "--picture",
        f"picture to write elsewhere than in {PICTURE} of --output; of several files, P_1.png, "
        "P_2.png and so on",
    )
    add_file(parser, "--write", f"parameter file to write elsewhere than in {MODES} of --output")
    parser.add_argument(
        "--shaper", choices=SHAPERS, default="ei", help="that the file names (default: ei)"
    )
    return parser


def _time(text: str) -> float:
    try:
        time = float(text)
    except ValueError:
        time = math.nan
    if not math.isfinite(time):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds")
    return time


if __name__ == "__main__":
    sys.exit(main())
