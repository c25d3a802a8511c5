"""The command ``ringdown``: from recordings of swings to modes, pictures, a parameter file.

Its option ``--machine`` lets ``calibration_node`` record the swings, and ROS is loaded for it only.
There, Ctrl-C stops the machine; once more ends the command at once, while the platform may still
move.
"""

from __future__ import annotations

import argparse
import math
import shlex
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import find_file
from tri_glide_kinematics.picture_commands import (
    add_file,
    add_output,
    check_apart,
    exit_code,
    next_line,
    number,
)

if TYPE_CHECKING:
    from rclpy.node import Node

PICTURE, MODES = "ringdown.png", "modes.yaml"
SHAPERS = ("zv", "mzv", "zvd", "ei", "two_hump_ei", "three_hump_ei")

SERVICE = "calibration_node/find_modes"
# Of the files in the folder of calibration_node.
NAME = "swing"

# Until the service is found, and until it is taken to be gone [s].
START_TIMEOUT = 10.0
SILENCE = 3.0
# How long one listens before one looks up [s].
NAP = 0.05


class NotMeasuredError(KinematicsError):
    """There are no recordings; the text says why."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Find modes from the command line.

    Args:
        arguments: of the command; None for those of the process that are not for ROS.

    Returns:
        Exit code: 0 if there is a mode, 1 after an error or if none is known, 130 after Ctrl-C.
    """
    if arguments is None:
        arguments = sys.argv[1:]
        if "--ros-args" in arguments:
            arguments = arguments[: arguments.index("--ros-args")]
    parser = make_parser()
    options = parser.parse_args(arguments)
    if options.machine == bool(options.files):
        parser.error("either files, or --machine")
    if options.heights and not options.machine:
        parser.error("--heights is for --machine")
    if options.output is not None:
        options.picture = options.picture or options.output / PICTURE
        options.write = options.write or options.output / MODES
    return exit_code("ringdown", lambda: _find(options))


def _find(options: argparse.Namespace) -> None:
    """Find the modes, tell of them and write all files.

    Raises:
        KinematicsError: if there is no recording, or no mode is known.
        OSError: if the picture cannot be written.
    """
    if options.machine:
        options.files = _measured(options.heights)
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
    files = [find_file(file) for file in options.files]
    pictures = _pictures(options.picture, len(files))
    check_apart(files, pictures)
    recordings = [load_recording(file, options.unit) for file in files]
    swings = [find_modes(each.between(options.start, options.end)) for each in recordings]
    found = combine_modes(swings) if len(swings) > 1 else swings[0]
    for file, swing in zip(options.files, swings):
        title = f"{file}\n" if len(swings) > 1 else ""
        print(f"{title}{ringdown_report(swing)}\n")
    if isinstance(found, CombinedModes):
        print(f"All swings together\n{combined_report(found)}\n")
    if pictures:
        from tri_glide_kinematics.figures import ringdown_figure
        from tri_glide_kinematics.picture_commands import save_figure

        options.picture.parent.mkdir(parents=True, exist_ok=True)
        for picture, swing in zip(pictures, swings):
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


def _pictures(picture: Path | None, count: int) -> list[Path]:
    """Return the files of the pictures of so many swings."""
    if picture is None or count == 1:
        return [picture] if picture else []
    names = (f"{picture.stem}_{number}{picture.suffix}" for number in range(1, count + 1))
    return [picture.with_name(name) for name in names]


def _measured(by_heights: bool) -> Sequence[Path]:
    """Let the machine swing, and return the files of its recordings.

    Raises:
        NotMeasuredError: if there are none.
        KeyboardInterrupt: after a signal, when the platform rests.
    """
    import rclpy
    from rclpy.node import Node
    from rclpy.signals import SignalHandlerOptions

    from tri_glide_kinematics.ros.starting import EndSignals, choose_transport, shut_down

    choose_transport()
    # rclpy's handlers would end all talk with the machine before it is told to stop.
    signals = EndSignals()
    signals.call(lambda: None)
    rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    try:
        return _asked(Node("ringdown"), by_heights, signals.came)
    finally:
        shut_down()


def _asked(node: Node, by_heights: bool, signals: Sequence[int]) -> Sequence[Path]:
    """Ask for a search; ``signals`` are those that have come."""
    from std_srvs.srv import Trigger

    from tri_glide_interfaces.srv import FindModes
    from tri_glide_kinematics.ros.loop import OtherTurns

    turns = OtherTurns(node)
    client = node.create_client(FindModes, SERVICE)
    stop = node.create_client(Trigger, "calibration_node/stop")
    end = time.monotonic() + START_TIMEOUT
    while not client.service_is_ready():
        if signals:
            raise KeyboardInterrupt
        if time.monotonic() > end:
            raise NotMeasuredError(
                f"nobody offers {client.srv_name} after {START_TIMEOUT:g} s: is calibration_node "
                "running, in this domain and this namespace?"
            )
        turns.spin_once(NAP)
    request = FindModes.Request(recordings=NAME)
    if by_heights:
        request.source = FindModes.Request.MEASURED_HEIGHTS
    print("the machine moves and is listened to: about half a minute", flush=True)
    answer = client.call_async(request)
    heard = time.monotonic()
    is_stopped = False
    while not answer.done():
        now = time.monotonic()
        heard = now if client.service_is_ready() else heard
        if now - heard > SILENCE:
            raise NotMeasuredError("calibration_node is gone")
        if len(signals) > 1:
            raise KeyboardInterrupt
        if signals and not is_stopped:
            is_stopped = True
            stop.call_async(Trigger.Request())
        turns.spin_once(NAP)
    if signals:
        raise KeyboardInterrupt
    found = answer.result()
    if not found.files:
        raise NotMeasuredError(found.message)
    return [Path(file) for file in found.files]


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
        type=number("a number of seconds"),
        default=-math.inf,
        metavar="S",
        help="time in the file at which the motion is over [s] (default: the first)",
    )
    parser.add_argument(
        "--to",
        dest="end",
        type=number("a number of seconds"),
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


if __name__ == "__main__":
    sys.exit(main())
