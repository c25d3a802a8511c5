"""The command ``drive``: a file of moves, paths and waits is driven, one after the other.

Ctrl-C lets the platform come to rest, on its path if it follows one; once more ends the command at
once, while the platform may still move.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.picture_commands import find_file
from tri_glide_kinematics.programs import DriveFile, ProgressLine, is_whole, load_drive, table
from tri_glide_kinematics.ros.clients import GoalSender, StepDriver
from tri_glide_kinematics.ros.starting import EndSignals, choose_transport, shut_down


def _drive(drive: DriveFile) -> int:
    """Drive, and return the exit code."""
    # Signals are handled here alone: rclpy's handlers would end all talk with the machine before it
    # is told to stop.
    signals = EndSignals()
    # They are counted: the second one ends the command, not the process.
    signals.call(lambda: None)
    rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = Node("drive")
        driver = StepDriver(
            GoalSender(node),
            lambda longest: rclpy.spin_once(node, timeout_sec=longest),
            ProgressLine(),
            lambda: len(signals.came),
        )
        reports = driver.drive(drive)
    finally:
        shut_down()
    print(f"\n{table(reports)}\n")
    if signals.came:
        print("drive: interrupted")
        return 128 + signals.came[0]
    return 0 if is_whole(reports) else 1


def main() -> int:
    """Drive a file from the command line; the exit code is 0 if all of it has been driven."""
    parser = argparse.ArgumentParser(
        prog="drive", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "file", type=Path, help="YAML file; those of config/ are found by their name alone"
    )
    parser.add_argument("--check", action="store_true", help="check the file and drive nothing")
    arguments = parser.parse_args(remove_ros_args(sys.argv)[1:])
    try:
        file = find_file(arguments.file)
        drive = load_drive(file)
        if arguments.check:
            print(f"drive: {file} has {len(drive.steps)} steps")
            return 0
        choose_transport()
        return _drive(drive)
    except KinematicsError as error:
        print(f"drive: error: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
