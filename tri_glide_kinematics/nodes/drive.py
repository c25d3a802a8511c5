"""The command ``drive``: a program in G-code, or a file of moves, paths and waits, is driven.

A program is a file that ends in .gcode, .nc, .ngc or .tap; all others are files of steps in YAML.
Nothing moves before all of a file is understood and, of a program, proved inside the workspace.

Ctrl-C lets the platform come to rest, on its path if it follows one; once more ends the command at
once, while the platform may still move.
"""

from __future__ import annotations

import argparse
import math
import select
import sys
import termios
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import rclpy
from geometry_msgs.msg import Point
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from tri_glide_interfaces.action import FollowPath
from tri_glide_interfaces.msg import Output as OutputMessage
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.engine import GoalCode
from tri_glide_kinematics.picture_commands import find_file
from tri_glide_kinematics.programs import (
    NOT_DRIVEN,
    DriveFile,
    Dwell,
    MoveStep,
    Output,
    PathRun,
    PathStep,
    Program,
    ProgramCheck,
    ProgramError,
    ProgramStep,
    ProgramStop,
    ProgressLine,
    Step,
    StepReport,
    StopKind,
    WaitStep,
    check_program,
    in_millimetres,
    is_whole,
    line_of,
    load_drive,
    load_program,
    load_settings,
    table,
)
from tri_glide_kinematics.ros.goal_sender import GoalSender, SentGoal
from tri_glide_kinematics.ros.messages import LATEST_OUTPUTS
from tri_glide_kinematics.ros.parameters import (
    IK_NODE,
    Values,
    file_values,
    limits_of,
    machine_of,
    workspace_limits_of,
)
from tri_glide_kinematics.ros.starting import EndSignals, choose_transport, shut_down
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

# How the names of programs in G-code end.
PROGRAM_ENDINGS = (".gcode", ".nc", ".ngc", ".tap")

# Files in config/ that are taken where none is named.
PARAMETERS = Path("tri_glide.yaml")
SETTINGS = Path("program_settings.yaml")

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
    """Sends the steps of a file, each when the one before it has ended."""

    def __init__(
        self,
        node: Node,
        listen: Callable[[float], None],
        progress: ProgressLine,
        interruptions: Callable[[], int],
    ) -> None:
        """Prepare to drive as a part of ``node``.

        ``listen`` takes in what comes back, for so long at most [s].

        ``interruptions`` returns how often somebody has interrupted. The first time the platform
        comes to rest; the second time that is not waited for.
        """
        self._node = node
        self._goals = GoalSender(node)
        self._outputs = node.create_publisher(OutputMessage, "outputs", LATEST_OUTPUTS)
        self._listen = listen
        self._progress = progress
        self._interruptions = interruptions
        self._place: Vector3 | None = None
        self._said = -math.inf
        # Whether the platform may be elsewhere than where a program has left it.
        self._is_elsewhere = True

    def parameters(self) -> Values:
        """Return the parameters of the machine.

        Raises:
            NoMachineError: if nobody tells them.
        """
        client = AsyncParameterClient(self._node, "ik_node")
        self._wait(client.services_are_ready, "tells the parameters")
        answer = client.get_parameters([entry.name for entry in IK_NODE])
        self._wait(answer.done, "tells the parameters")
        told = map(parameter_value_to_python, answer.result().values)
        return {entry.name: entry.checked(value) for entry, value in zip(IK_NODE, told)}

    def drive(self, steps: Sequence[Step | ProgramStep], frame: str = "") -> list[StepReport]:
        """Drive all steps, and return what became of each.

        Places are in a ``frame``; in that of the machine, if none is named.

        Raises:
            NoMachineError: if there is nobody who offers the actions.
        """
        self._wait(lambda: self._goals.is_ready, "offers the actions")
        reports: list[StepReport] = []
        for number, step in enumerate(steps, 1):
            line = line_of(step)
            what = f"line {line}" if line else f"step {number} of {len(steps)}"
            if self._interruptions() or not all(report.is_good for report in reports):
                reports.append(StepReport(step, NOT_DRIVEN))
                continue
            reports.append(self._drive(step, what, frame))
            if not reports[-1].is_good:
                self._progress.say(f"{what}: {reports[-1].text}")
        # What was put out last has to arrive before the command ends.
        self._outputs.wait_for_all_acked(Duration(seconds=SILENCE))
        return reports

    def _wait(self, is_there: Callable[[], bool], what: str) -> None:
        end = time.monotonic() + START_TIMEOUT
        while not is_there() and not self._interruptions():
            if time.monotonic() > end:
                raise NoMachineError(
                    f"nobody {what} of {self._goals.server} after {START_TIMEOUT:g} s: "
                    "is it running, in this domain and this namespace?"
                )
            self._listen(NAP)

    def _drive(self, step: Step | ProgramStep, what: str, frame: str) -> StepReport:
        if isinstance(step, MoveStep):
            self._progress.say(f"{what}: move")
            return self._pursue(step, what, self._goals.move_to(step.position, frame, step.speed))
        if isinstance(step, PathStep):
            self._progress.say(f"{what}: path of {len(step.segments)} segments")
            return self._pursue(step, what, self._goals.follow(step.segments, frame))
        if isinstance(step, PathRun):
            return self._run(step, what, frame)
        if isinstance(step, Output):
            self._progress.say(f"{what}: output {step.name} {step.number} is {step.value:g}")
            number, value = step.number, float(step.value)
            self._outputs.publish(OutputMessage(name=step.name, number=number, value=value))
            return StepReport(step, "succeeded", True)
        if isinstance(step, ProgramStop):
            return self._stop(step, what)
        return self._rest(step, what)

    def _run(self, run: PathRun, what: str, frame: str) -> StepReport:
        """Follow a path of a program, from where it begins."""
        if self._is_elsewhere:
            self._progress.say(f"{what}: to the begin of the path")
            way = self._goals.move_to(run.start, frame, kind="linear")
            report = self._pursue(run, what, way)
            if not report.is_good:
                return report
            self._is_elsewhere = False
        if self._interruptions():
            return StepReport(run, INTERRUPTED)
        self._progress.say(f"{what}: path of {len(run.segments)} segments")
        return self._pursue(run, what, self._goals.follow(run.segments, frame))

    def _stop(self, stop: ProgramStop, what: str) -> StepReport:
        """Wait until somebody presses Enter; at the end of a program, for nothing."""
        if stop.kind is StopKind.END:
            self._progress.say(f"{what}: end of the program")
            return StepReport(stop, "succeeded", True)
        name = stop.kind.value
        if not sys.stdin.isatty():
            text = f"{name} waits for Enter, and there is no terminal: the program stops here"
            return StepReport(stop, "stopped", text=text)
        wanted = f", tool {stop.tool}" if stop.kind is StopKind.TOOL else ""
        # An Enter of before was not meant for this stop.
        termios.tcflush(sys.stdin, termios.TCIFLUSH)
        self._progress.say(f"{what}: {name}{wanted}: press Enter to go on")
        begin = time.monotonic()
        while not self._interruptions():
            self._listen(NAP)
            if select.select([sys.stdin], [], [], 0.0)[0]:
                taken = time.monotonic() - begin
                # Meanwhile somebody may have moved the platform.
                self._is_elsewhere = True
                if sys.stdin.readline():
                    return StepReport(stop, "succeeded", True, taken)
                return StepReport(stop, "stopped", time=taken, text="the input has ended")
        return StepReport(stop, INTERRUPTED, time=time.monotonic() - begin)

    def _rest(self, step: WaitStep | Dwell, what: str) -> StepReport:
        self._progress.say(f"{what}: wait for {step.duration:g} s")
        begin = time.monotonic()
        while (left := begin + step.duration - time.monotonic()) > 0.0:
            if self._interruptions():
                return StepReport(step, INTERRUPTED, time=time.monotonic() - begin)
            self._show(f"{what}: {left:.1f} s left")
            self._listen(min(left, NAP))
        return StepReport(step, "succeeded", True, time.monotonic() - begin)

    def _pursue(self, step: Step | PathRun, what: str, goal: SentGoal) -> StepReport:
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

    def _ended(self, step: Step | PathRun, goal: SentGoal, taken: float) -> StepReport:
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
        text = result.text
        if isinstance(step, PathRun) and is_path and goal.feedback is not None:
            text = f"at line {line_of(step, goal.feedback.segment)}: {text}"
        return StepReport(step, name, goal.has_succeeded, taken, length, deviation, text)

    def _show(self, text: str) -> None:
        now = time.monotonic()
        if now - self._said >= PROGRESS_PERIOD:
            self._said = now
            self._progress.show(text)


def _progress_of(goal: SentGoal, step: Step | PathRun) -> str:
    told = goal.feedback
    if told is None:
        return "sent"
    left = "" if math.isnan(told.time_remaining) else f", {told.time_remaining:.1f} s left"
    is_path = isinstance(told, FollowPath.Feedback)
    if not is_path or not isinstance(step, (PathStep, PathRun)):
        return f"{in_millimetres(told.way_remaining, 1)} to go{left}"
    whole = in_millimetres(told.way + told.way_remaining, 1)
    segment = f"segment {told.segment + 1} of {len(step.segments)}"
    if line := line_of(step, told.segment):
        segment = f"now line {line}"
    return f"{segment}, {in_millimetres(told.way, 1)} of {whole}{left}"


def _driven(step: Step | PathRun, goal: SentGoal) -> float | None:
    """Return the length of the way along a path [m]; None if nothing was told about it."""
    told = goal.feedback
    if goal.has_succeeded:
        if isinstance(step, PathStep) and step.path is not None:
            return step.path.length
        return None if told is None else float(told.way + told.way_remaining)
    return None if told is None else float(told.way)


def _vector(point: Point) -> Vector3:
    return point.x, point.y, point.z


def is_program(file: Path) -> bool:
    """Return whether a file is a program in G-code, by the end of its name."""
    return file.suffix.lower() in PROGRAM_ENDINGS


def load_drivable(file: Path, settings_file: Path, optional_stops: bool = False) -> Program:
    """Read a program that can be driven as a whole.

    Args:
        file: with the program.
        settings_file: with what it does not say.
        optional_stops: whether M1 stops, whatever the settings say.

    Raises:
        SettingsError: if the settings cannot be read.
        ProgramError: if something in it is not understood, or an output changes on the way.
    """
    settings = replace(load_settings(settings_file), optional_stop=optional_stops)
    program = load_program(file, settings)
    for step in program.steps:
        if isinstance(step, PathRun) and step.outputs:
            first = step.outputs[0]
            reason = (
                f"the output {first.name} changes on a path, and this command changes outputs at "
                "rest only: stop before it, with G4 P0 on a line of its own"
            )
            raise ProgramError(file, first.line, 0, "", reason)
    return program


def check_on_machine(program: Program, values: Values) -> ProgramCheck:
    """Prove a program on the machine that the parameters of ``ik_node`` describe.

    Raises:
        KinematicsError: if a place of the program is not inside the workspace, or the parameters
            describe no machine.
    """
    workspace = Workspace(machine_of(values), workspace_limits_of(values))
    limits = limits_of(values).with_velocity_scaled(values["speed_scale"])
    return check_program(program, workspace, limits)


def _tell_check(program: Program, check: ProgramCheck) -> None:
    """Print what is known about a program before it is driven."""
    for told in program.told:
        print(f"drive: {program.file}: line {told.line}: {told.word} is not done: {told.reason}")
    print(
        f"drive: {program.file}: {program.lines} lines, inside the workspace: "
        f"{check.duration:.2f} s, {in_millimetres(check.length, 1)}",
        flush=True,
    )


def _drive(work: Program | DriveFile) -> int:
    """Drive the content of a file, and return the exit code."""
    choose_transport()
    # Signals are handled here alone: rclpy's handlers would end all talk with the machine before it
    # is told to stop. While nothing has moved, they end the process.
    rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = Node("drive")
        came: list[int] = []
        driver = StepDriver(
            node,
            lambda longest: rclpy.spin_once(node, timeout_sec=longest),
            ProgressLine(),
            lambda: len(came),
        )
        frame = ""
        if isinstance(work, Program):
            _tell_check(work, check_on_machine(work, driver.parameters()))
        else:
            frame = work.frame
        # They are counted: the second one ends the command, not the process.
        signals = EndSignals()
        signals.call(lambda: None)
        came = signals.came
        reports = driver.drive(work.steps, frame)
    finally:
        shut_down()
    print(f"\n{table(reports)}\n")
    if came:
        print("drive: interrupted")
        return 128 + came[0]
    return 0 if is_whole(reports) else 1


def main() -> int:
    """Drive a file from the command line; the exit code is 0 if all of it has been driven."""
    parser = argparse.ArgumentParser(
        prog="drive", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "file",
        type=Path,
        help="program or YAML file; those of config/ are found by their name alone",
    )
    parser.add_argument(
        "--check",
        action="store_true",
        help="check the file and drive nothing; of a program, tell its duration and length",
    )
    parser.add_argument(
        "--settings",
        type=Path,
        metavar="FILE",
        help=f"what a program does not say: dialect, offsets, tools, home (default: {SETTINGS})",
    )
    parser.add_argument(
        "--parameters",
        type=Path,
        metavar="FILE",
        help="parameters of the machine that --check takes, which needs no running ik_node "
        f"(default: {PARAMETERS}); a program that is driven is checked with those of ik_node",
    )
    parser.add_argument(
        "--optional-stops", action="store_true", help="M1 waits for Enter, as M0 and M6 do"
    )
    arguments = parser.parse_args(remove_ros_args(sys.argv)[1:])
    of_programs = arguments.settings or arguments.parameters or arguments.optional_stops
    if of_programs and not is_program(arguments.file):
        parser.error(
            "--settings, --parameters and --optional-stops are for programs: their names end in "
            + ", ".join(PROGRAM_ENDINGS)
        )
    if arguments.parameters and not arguments.check:
        parser.error("--parameters is for --check: what is driven has the parameters of ik_node")
    try:
        file = find_file(arguments.file)
        work: Program | DriveFile
        if is_program(file):
            settings = find_file(arguments.settings or SETTINGS)
            print(f"drive: {file} with the settings of {settings}", flush=True)
            work = load_drivable(file, settings, arguments.optional_stops)
        else:
            work = load_drive(file)
        if not arguments.check:
            return _drive(work)
        if isinstance(work, Program):
            parameters = find_file(arguments.parameters or PARAMETERS)
            values = file_values(str(parameters), "/ik_node", IK_NODE)
            _tell_check(work, check_on_machine(work, values))
        else:
            print(f"drive: {file} has {len(work.steps)} steps")
        return 0
    except KinematicsError as error:
        print(f"drive: error: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
