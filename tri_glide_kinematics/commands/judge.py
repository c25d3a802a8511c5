"""The command ``judge``: whether recorded setpoints of the sliders keep all limits; without ROS."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from tri_glide_kinematics.files import find_file
from tri_glide_kinematics.picture_commands import add_machine_arguments, exit_code


def main(arguments: Sequence[str] | None = None) -> int:
    """Judge a recording from the command line.

    Args:
        arguments: of the command; None for those of the process.

    Returns:
        Exit code: 0 if all is kept, 1 if something is not, 2 if that cannot be found out.
    """
    options = make_parser().parse_args(arguments)
    return exit_code("judge", lambda: _judge(options), failed=2)


def _judge(options: argparse.Namespace) -> int:
    """Tell what is kept, and return 0, or 1 if something is not; raises ``KinematicsError``."""
    from tri_glide_kinematics.motion.limits import QUANTITIES
    from tri_glide_kinematics.recordings import judge, load_recording
    from tri_glide_kinematics.settings import (
        IK_NODE,
        file_values,
        scaled_limits_of,
        workspace_of,
    )
    from tri_glide_kinematics.wording import number_text

    parameters = find_file(options.parameters)
    values = file_values(str(parameters), options.node, IK_NODE)
    recording = load_recording(options.file, values["joint_names"], options.topic)
    workspace = workspace_of(values)
    judgement = judge(
        recording,
        workspace,
        scaled_limits_of(values, workspace.machine),
        1.0 / (options.rate or values["rate"]),
        longest_gap=options.gap,
        may_pause=options.pauses,
        height_offsets=values["height_offsets"],
    )
    stretches = f", {judgement.beginnings} stretches" if judgement.beginnings > 1 else ""
    print(
        f"{options.file} with {parameters}: {judgement.rows} setpoints{stretches}, "
        f"{judgement.duration:.3f} s, longest gap {1e3 * judgement.longest_gap:.3f} ms"
    )
    for (quantity, _), part in zip(QUANTITIES, judgement.largest):
        print(f"  largest {quantity:12} {part:.6f} of its limit")
    for kind, part in judgement.added.items():
        print(f"  largest {kind.value:12} {part:.6f} of its limit")
    if judgement.last_speed > 0.0:
        speed = number_text(judgement.last_speed, 6, 0.0)
        print(f"it ends in motion: a slider moves at {speed} m/s there")
    if recording.velocities is None:
        print("it has no velocities, so none are compared with the heights")
    for each in judgement.violations:
        times = "once" if each.rows == 1 else f"{each.rows} times, first at {each.first:.6f} s"
        print(f"{each.kind.value}: at {each.time:.6f} s: {each.text} ({times})")
    print("some limits are not kept" if judgement.violations else "all limits are kept")
    return 1 if judgement.violations else 0


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line; its name is that of the program."""
    parser = argparse.ArgumentParser(
        description="Tell whether recorded setpoints of the sliders keep velocity, acceleration, "
        "jerk, travel and workspace, and the speed limit of the platform and the force limits that "
        "the parameters have; and whether some are missing. It needs no ROS.",
        epilog="Exit code: 0 if all is kept, 1 if something is not, 2 if that cannot be found out.",
    )
    parser.add_argument(
        "file",
        type=Path,
        help="folder of ros2 bag record with MCAP files, MCAP file, or table (.csv) as draw_motion "
        "writes it",
    )
    add_machine_arguments(parser)
    parser.add_argument(
        "--topic",
        default="joint_commands",
        metavar="NAME",
        help="of the messages, in any namespace (default: joint_commands)",
    )
    parser.add_argument(
        "--gap",
        type=float,
        metavar="SECONDS",
        help="longest time that there may be between two setpoints (default: 2.5 periods)",
    )
    parser.add_argument(
        "--pauses",
        action="store_true",
        help="setpoints may end at rest and begin anew, maybe elsewhere: the machine was disabled",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
