"""The command ``drive``: a file of moves, paths and waits is driven, one after the other.

Ctrl-C lets the platform come to rest, on its path if it follows one; once more ends the command at
once, while the platform may still move.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path

import rclpy
from geometry_msgs.msg import Point
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from tri_glide_interfaces.action import FollowPath
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.engine import GoalCode
from tri_glide_kinematics.picture_commands import find_file
from tri_glide_kinematics.programs import (
    NOT_DRIVEN,
    DriveFile,
    MoveStep,
    PathStep,
    ProgressLine,
    Step,
    StepReport,
    in_millimetres,
    is_whole,
    load_drive,
    table,
)
from tri_glide_kinematics.ros.goal_sender import GoalSender, SentGoal
from tri_glide_kinematics.ros.starting import EndSignals, choose_transport, shut_down
from tri_glide_kinematics.vectors import Vector3

# Until ik_node is found, and until it is taken to be gone [s].
START_TIMEOUT = 10.0
SILENCE = 3.0

# After an interruption, until one waits no longer for the platform to rest [s].
REST_TIMEOUT = 10.0

# How long one listens before one looks up [s].
NAP = 0.02

# How often the line of progress is written [s].
PROGRESS_PERIOD = 0.1

INTERRUPTED = "interrupted"


class NoMachineError(KinematicsError):
    """Nobody offers the actions; the text says what was looked for."""


class StepDriver:
    """Sends the steps of a drive, each when the one before it has ended."""

    def __init__(
        self,
        goals: GoalSender,
        listen: Callable[[float], None],
        progress: ProgressLine,
        interruptions: Callable[[], int],
    ) -> None:
        """Prepare to drive: ``listen`` takes in what comes back, for so long at most [s].

        ``interruptions`` returns how often somebody has interrupted. The first time the platform
        comes to rest; the second time that is not waited for.
        """
        self._goals = goals
        self._listen = listen
        self._progress = progress
        self._interruptions = interruptions
        self._place: Vector3 | None = None
        self._said = -math.inf

    def drive(self, drive: DriveFile) -> list[StepReport]:
        """Drive all steps, and return what became of each.

        Raises:
            NoMachineError: if there is nobody who offers the actions.
        """
        self._find_machine()
        reports: list[StepReport] = []
        count = len(drive.steps)
        for number, step in enumerate(drive.steps, 1):
            what = f"step {number} of {count}"
            if self._interruptions() or not all(report.is_good for report in reports):
                reports.append(StepReport(step, NOT_DRIVEN))
                continue
            reports.append(self._drive(step, what, drive.frame))
            if not reports[-1].is_good:
                self._progress.say(f"{what}: {reports[-1].text}")
        return reports

    def _find_machine(self) -> None:
        end = time.monotonic() + START_TIMEOUT
        while not self._goals.is_ready and not self._interruptions():
            if time.monotonic() > end:
                raise NoMachineError(
                    f"nobody offers the actions of {self._goals.server} after {START_TIMEOUT:g} s: "
                    "is it running, in this domain and this namespace?"
                )
            self._listen(NAP)

    def _drive(self, step: Step, what: str, frame: str) -> StepReport:
        if isinstance(step, MoveStep):
            self._progress.say(f"{what}: move")
            return self._pursue(step, what, self._goals.move_to(step.position, frame, step.speed))
        if isinstance(step, PathStep):
            self._progress.say(f"{what}: path of {len(step.segments)} segments")
            return self._pursue(step, what, self._goals.follow(step.segments, frame))
        self._progress.say(f"{what}: wait for {step.duration:g} s")
        begin = time.monotonic()
        while (left := begin + step.duration - time.monotonic()) > 0.0:
            if self._interruptions():
                return StepReport(step, INTERRUPTED, time=time.monotonic() - begin)
            self._show(f"{what}: {left:.1f} s left")
            self._listen(min(left, NAP))
        return StepReport(step, "succeeded", True, time.monotonic() - begin)

    def _pursue(self, step: Step, what: str, goal: SentGoal) -> StepReport:
        """Wait for the end of a ``goal``, and cancel it when interrupted."""
        begin = heard = time.monotonic()
        give_up = math.inf
        while goal.result is None:
            now = time.monotonic()
            if self._interruptions() and give_up == math.inf:
                self._progress.say("interrupted: the platform comes to rest")
                goal.cancel()
                give_up = now + REST_TIMEOUT
            heard = now if self._goals.is_ready else heard
            if now - heard > SILENCE:
                return StepReport(step, "lost", time=now - begin, text="ik_node is gone")
            if now > give_up or self._interruptions() > 1:
                text = "not waited for: the platform may still move"
                return StepReport(step, INTERRUPTED, time=now - begin, text=text)
            if self._place is None and goal.feedback is not None:
                self._place = _vector(goal.feedback.position)
            if give_up == math.inf:
                self._show(f"{what}: {_progress_of(goal, step)}")
            self._listen(NAP)
        return self._ended(step, goal, time.monotonic() - begin)

    def _ended(self, step: Step, goal: SentGoal, taken: float) -> StepReport:
        result = goal.result
        before, self._place = self._place, _vector(result.position)
        is_path = isinstance(result, FollowPath.Result)
        length = deviation = None
        if is_path:
            length = _driven(step, goal)
            # Of a path that was not driven there is none.
            if not math.isnan(result.largest_deviation):
                deviation = result.largest_deviation
        elif before is not None:
            length = math.dist(before, self._place)
        name = GoalCode(result.code).name.lower().replace("_", " ")
        return StepReport(step, name, goal.has_succeeded, taken, length, deviation, result.text)

    def _show(self, text: str) -> None:
        now = time.monotonic()
        if now - self._said >= PROGRESS_PERIOD:
            self._said = now
            self._progress.show(text)


def _progress_of(goal: SentGoal, step: Step) -> str:
    told = goal.feedback
    if told is None:
        return "sent"
    left = "" if math.isnan(told.time_remaining) else f", {told.time_remaining:.1f} s left"
    if not isinstance(step, PathStep):
        return f"{in_millimetres(told.way_remaining, 1)} to go{left}"
    whole = in_millimetres(told.way + told.way_remaining, 1)
    segment = f"segment {told.segment + 1} of {len(step.segments)}"
    return f"{segment}, {in_millimetres(told.way, 1)} of {whole}{left}"


def _driven(step: Step, goal: SentGoal) -> float | None:
    """Return the length of the way along a path [m]; None if nothing was told about it."""
    told = goal.feedback
    if goal.has_succeeded:
        if isinstance(step, PathStep) and step.path is not None:
            return step.path.length
        return None if told is None else float(told.way + told.way_remaining)
    return None if told is None else float(told.way)


def _vector(point: Point) -> Vector3:
    return point.x, point.y, point.z


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
