"""The command ``drive``: a program in G-code, or a file of moves, paths and waits, is driven.

A program is a file that ends as one of ``PROGRAM_ENDINGS``; all others are files of steps in YAML.
Nothing moves before all of a file is understood and, of a program, proved inside the workspace.

Ctrl-C, or a closed terminal, lets the platform come to rest, on its path if it follows one. Ctrl-C
once more switches the outputs off and ends the command, while the platform may still move.

ROS is loaded to drive only: ``--check`` needs none.
"""

from __future__ import annotations

import argparse
import math
import os
import select
import signal
import sys
import termios
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from tri_glide_kinematics.control import TEACH_SPEED, in_teach_mode
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import PARAMETERS, SETTINGS, find_file
from tri_glide_kinematics.picture_commands import add_file, add_unit
from tri_glide_kinematics.programs import (
    APPROACH_SPEED,
    POINTS_ENDING,
    PROGRAM_ENDINGS,
    START_TIMEOUT,
    Program,
    ProgramCheck,
    ProgramRun,
    RunState,
    StepReport,
    TellPart,
    Work,
    check_program,
    default_kept_file,
    default_zeros_file,
    from_line,
    in_millimetres,
    is_program,
    line_to_go_on_from,
    load_drive,
    load_own_settings,
    load_program,
    load_zeros,
    tell_nobody,
    with_kept_zeros,
)
from tri_glide_kinematics.settings import (
    FORCE_LIMITS,
    IK_NODE,
    Values,
    file_values,
    scaled_limits_of,
    shaper_of,
    workspace_of,
)
from tri_glide_kinematics.wording import number_text
from tri_glide_kinematics.workspace import places_inside

if TYPE_CHECKING:
    from rclpy.node import Node

    from tri_glide_kinematics.ros.goal_sender import ProgramLink

ENDINGS_TEXT = ", ".join(PROGRAM_ENDINGS)

# How long one listens before one looks up [s].
NAP = 0.02

# After a program was checked, what came meanwhile is taken in for this long [s].
CATCHING_UP = 0.1

# Of the way to where a program begins [mm/s].
SLOWEST = 0.01

# How often the line of progress is written [s].
PROGRESS_PERIOD = 0.1


# Back to the start of the line, and nothing of what stood there.
ANEW = "\r\033[K"


class NoMachineError(KinematicsError):
    """Nobody offers the actions; the text says what was looked for."""


class ProgressLine:
    """Says what is being done: on a terminal in one line, elsewhere in a line for each step."""

    def __init__(self, output: TextIO | None = None) -> None:
        """Write to ``output``; by default to what is the standard output then."""
        self._output = output or sys.stdout
        self._is_terminal = self._output.isatty()
        self._is_open = False

    def say(self, text: str) -> None:
        """Write a line that stays."""
        self._write(f"{ANEW if self._is_open else ''}drive: {text}\n")
        self._is_open = False

    def clear(self) -> None:
        """Remove the line that does not stay."""
        if self._is_open:
            self._write(ANEW)
            self._is_open = False

    def show(self, text: str) -> None:
        """Write a line in place of the last one; nothing where that is not possible."""
        if self._is_terminal:
            self._write(f"{ANEW}drive: {text}")
            self._is_open = True

    def _write(self, text: str) -> None:
        self._output.write(text)
        self._output.flush()


def table(reports: Sequence[StepReport]) -> str:
    """Return one line for each step: its number, or for one of a program the line that says it."""
    lines = [report.step.line_at() for report in reports]
    head = ("line" if any(lines) else "step", "", "result", "time", "length", "mean speed")
    numbers = [line or number for number, line in enumerate(lines, 1)]
    rows = [(*head, "largest deviation"), *map(_row, numbers, reports)]
    return "\n".join(
        f"{number:>4}  {kind:6}  {result:11}{time:>10}{length:>13}{speed:>14}{deviation:>19}"
        for number, kind, result, time, length, speed, deviation in rows
    )


def _row(number: int, report: StepReport) -> tuple[str, ...]:
    speed = report.length / report.time if report.length and report.time else None
    return (
        str(number),
        report.step.word,
        report.result,
        "-" if report.time is None else f"{report.time:.2f} s",
        in_millimetres(report.length, 1),
        in_millimetres(speed, 1, "mm/s"),
        in_millimetres(report.deviation, 3),
    )


def check_on_machine(
    program: Program,
    values: Values,
    *,
    is_teaching: bool = False,
    tell_part: TellPart = tell_nobody,
) -> ProgramCheck:
    """Prove a program on the machine that the parameters of ``ik_node`` describe.

    ``is_teaching`` is whether its teach mode is switched on; ``tell_part`` gets which part is done.

    Raises:
        KinematicsError: if a place of the program is not inside the workspace, or the parameters
            describe no machine.
    """
    workspace = workspace_of(values)
    machine = workspace.machine
    limits = scaled_limits_of(values, machine)
    limits.check_holding(places_inside(machine, workspace.limits))
    if is_teaching:
        limits = in_teach_mode(limits, machine)
    return check_program(program, workspace, limits, shaper_of(values), tell_part)


def _tell_check(
    program: Program, values: Values, line: int = 1, *, is_teaching: bool = False
) -> None:
    """Prove a program, or its rest from a ``line`` on, and print what is known about it.

    Raises:
        KinematicsError: as for ``check_on_machine``.
    """
    progress, percents = ProgressLine(), [0]

    def tell_part(part: float) -> None:
        if int(100.0 * part) > percents[-1]:
            percents.append(int(100.0 * part))
            progress.show(f"checks {program.file}: {percents[-1]} %")

    try:
        check = check_on_machine(program, values, is_teaching=is_teaching, tell_part=tell_part)
    finally:
        progress.clear()
    for told in program.told:
        print(f"drive: {program.file}: line {told.line}: {told.word} is not done: {told.reason}")
    begin = f", from line {line} on" if line > 1 else ""
    shaper = ", without the time that the shaper takes in bends" if check.is_shaped else ""
    print(
        f"drive: {program.file}: {program.lines} lines{begin}, inside the workspace: "
        f"{check.duration:.2f} s, {in_millimetres(check.length, 1)}{shaper}",
        flush=True,
    )
    speeds = (values["platform_speed_limit"] or math.inf, TEACH_SPEED if is_teaching else math.inf)
    if min(speeds) < math.inf:
        speed = in_millimetres(min(speeds), 0, "mm/s")
        why = "in the teach mode" if min(speeds) < speeds[0] else "by platform_speed_limit"
        print(f"drive: the platform moves at {speed} at most, {why}", flush=True)
    forces = [entry.name for entry in FORCE_LIMITS if any(values[entry.name])]
    if forces:
        print(f"drive: the forces keep {' and '.join(forces)}", flush=True)


class _Terminal:
    """Drives one file: says what is done, and hears Enter and Ctrl-C."""

    def __init__(self, node: Node) -> None:
        from tri_glide_kinematics.ros.loop import OtherTurns

        self._node = node
        self._turns = OtherTurns(node)
        self._progress = ProgressLine()
        self._said = -math.inf

    def listen(self) -> None:
        """Take in what comes back."""
        self._turns.spin_once(NAP)

    def parameters(self) -> Values:
        """Return the parameters of the machine.

        Raises:
            NoMachineError: if nobody tells them.
        """
        from rclpy.parameter import parameter_value_to_python
        from rclpy.parameter_client import AsyncParameterClient

        client = AsyncParameterClient(self._node, "ik_node")
        self._wait_for(client.services_are_ready, "parameters")
        answer = client.get_parameters([entry.name for entry in IK_NODE])
        self._wait_for(answer.done, "parameters")
        told = map(parameter_value_to_python, answer.result().values)
        return {entry.name: entry.checked(value) for entry, value in zip(IK_NODE, told)}

    def is_teaching(self, link: ProgramLink) -> bool:
        """Return whether the teach mode is switched on.

        Raises:
            NoMachineError: if nobody tells it.
        """
        self._wait_for(lambda: link.machine, "state")
        return link.machine is not None and bool(link.machine.teach_mode)

    def _wait_for(self, condition: Callable[[], object], what: str) -> None:
        """Wait until ``ik_node`` has told ``what`` is asked for.

        Raises:
            NoMachineError: if it does not.
        """
        end = time.monotonic() + START_TIMEOUT
        while not condition():
            if time.monotonic() > end:
                server = self._node.get_namespace().rstrip("/") + "/ik_node"
                raise NoMachineError(
                    f"nobody tells the {what} of {server} after {START_TIMEOUT:g} s: is it "
                    "running, in this domain and this namespace?"
                )
            self.listen()

    def catch_up(self) -> None:
        """Take in what has come meanwhile."""
        end = time.monotonic() + CATCHING_UP
        while time.monotonic() < end:
            self.listen()

    def drive(self, run: ProgramRun, came: Sequence[int], behind: object) -> None:
        """Look after a ``run`` to its end; ``came`` has the signals that have come.

        The first one lets the platform come to rest; the second one is not waited for. Without a
        terminal it goes on ``behind`` a stop, if there is one that somebody has let it pass.
        """
        is_asked = False
        while run.state is not RunState.ENDED and len(came) < 2:
            run.look(time.monotonic())
            if came and run.state in (RunState.RUNNING, RunState.WAITING):
                self.say("interrupted: the platform comes to rest")
                run.stop("interrupted")
            if run.state is RunState.WAITING:
                is_asked = is_asked or self._ask(run, behind)
                if is_asked and select.select([sys.stdin], [], [], 0.0)[0]:
                    is_asked = False
                    if sys.stdin.readline():
                        run.go_on()
                    else:
                        run.stop("the input has ended")
            elif run.state is RunState.RUNNING:
                self._show(run.doing)
            self.listen()
        if run.state is not RunState.ENDED:
            run.let_go()
            self.catch_up()
        while run.state is RunState.ENDED and not run.is_delivered(time.monotonic()):
            self.listen()

    def say(self, text: str) -> None:
        """Say something that stays."""
        self._write(self._progress.say, text)

    def _write(self, write: Callable[[str], None], text: str) -> None:
        try:
            write(text)
        except OSError:
            # Nobody reads it any more, as if the terminal were closed.
            os.kill(os.getpid(), signal.SIGHUP)

    def _ask(self, run: ProgramRun, behind: object) -> bool:
        """Ask for Enter; return whether there is anybody who could press it."""
        if not sys.stdin.isatty():
            if run.waits_at is not None and run.waits_at == behind:
                run.go_on()
                return False
            what = run.waits_at.kind.value if run.waits_at else "a single block"
            run.stop(f"{what} waits for Enter, and there is no terminal: the program stops here")
            return False
        # An Enter of before was not meant for this stop.
        termios.tcflush(sys.stdin, termios.TCIFLUSH)
        self.say(f"{run.doing}: press Enter to go on")
        return True

    def _show(self, text: str) -> None:
        now = time.monotonic()
        if now - self._said >= PROGRESS_PERIOD:
            self._said = now
            self._write(self._progress.show, text)


def _begin(options: argparse.Namespace) -> int:
    """Return the line where a program begins, as somebody has chosen it."""
    return int(vars(options)["from"])


def _check(work: Work, options: argparse.Namespace) -> None:
    """Tell what is known of a file without a machine.

    Raises:
        KinematicsError: if it cannot be driven on the machine of the parameters.
    """
    if not isinstance(work, Program):
        count = len(work.steps)
        print(f"drive: {work.file} has {count} step{'' if count == 1 else 's'}")
        return
    parameters = find_file(options.parameters or Path(PARAMETERS))
    values, line = file_values(str(parameters), "/ik_node", IK_NODE), _begin(options)
    _tell_check(from_line(work, line), values, line)


def _drive(work: Work, options: argparse.Namespace) -> int:
    """Drive the content of a file, and return the exit code.

    A program is proved before anything moves; of a drive file, ``ik_node`` proves each step when it
    is its turn.
    """
    import rclpy
    from rclpy.node import Node
    from rclpy.signals import SignalHandlerOptions

    from tri_glide_kinematics.ros.goal_sender import ProgramLink
    from tri_glide_kinematics.ros.starting import EndSignals, choose_transport, shut_down

    choose_transport()
    # Signals are handled here alone: rclpy's handlers would end all talk with the machine before it
    # is told to stop. While nothing has moved, they end the process.
    rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = Node("drive")
        terminal, link = _Terminal(node), ProgramLink(node)
        kept: Path | None = None
        if isinstance(work, Program):
            kept = options.progress or default_kept_file(node.get_namespace())
            line = line_to_go_on_from(kept, work) if options.go_on else _begin(options)
            work = from_line(work, line)
            values, is_teaching = terminal.parameters(), terminal.is_teaching(link)
        # From here on a stop ends it, also while it is checked.
        run = ProgramRun(
            link,
            work,
            single_block=options.single_block,
            kept=kept,
            approach=0.001 * options.approach,
            say=terminal.say,
        )
        if isinstance(work, Program):
            _tell_check(work, values, line, is_teaching=is_teaching)
        terminal.catch_up()
        # They are counted: the second one ends the command, not the process.
        signals = EndSignals()
        signals.call(lambda: None)
        # A user who goes on where the program ended at a stop lets it pass.
        first = next((step for step in work.steps if step.takes_time), None)
        terminal.drive(run, signals.came, first if options.go_on else None)
        signals.ignore()
    finally:
        shut_down()
    print(f"\n{table(run.reports)}\n", flush=True)
    if signals.came:
        where = f" at line {run.line}" if run.line else ""
        print(f"drive: interrupted{where}")
        if run.state is not RunState.ENDED:
            print("drive: not waited for: the platform may still move")
        return 128 + signals.came[0]
    return 0 if run.is_whole else 1


def _namespace(words: Sequence[str]) -> str:
    """Return the namespace that the ``words`` of a command line give to the node."""
    given = [word.partition("__ns:=")[2] for word in words if "__ns:=" in word]
    return given[-1] if given else ""


def _zeros_text(file: Path) -> str:
    """Return which work zeros of a ``file`` hold, for the first line; empty for none."""
    zeros = [
        f"{name} at ({', '.join(number_text(1000.0 * each, 7) for each in zero)}) mm"
        for name, zero in load_zeros(file).items()
    ]
    return f", but {', '.join(zeros)}, the work zero of {file}" if zeros else ""


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line; its name is that of the program."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
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
    add_file(
        parser,
        "--settings",
        f"what a program does not say: dialect, offsets, tools, home (default: {SETTINGS})",
    )
    add_file(
        parser,
        "--parameters",
        "parameters of the machine that --check takes, which needs no running ik_node "
        f"(default: {PARAMETERS}); a program that is driven is checked with those of ik_node",
    )
    parser.add_argument(
        "--optional-stops", action="store_true", help="M1 waits for Enter, as M0 and M6 do"
    )
    add_unit(parser)
    begin = parser.add_mutually_exclusive_group()
    begin.add_argument(
        "--from",
        type=int,
        default=1,
        metavar="LINE",
        help="begin at this line of a program; what the lines before it have set holds",
    )
    begin.add_argument(
        "--go-on",
        action="store_true",
        help="begin at the line that was driven when the program was last driven and not ended",
    )
    parser.add_argument(
        "--single-block",
        action="store_true",
        help="wait for Enter before each line of a program that does something",
    )
    parser.add_argument(
        "--approach",
        type=float,
        default=1000.0 * APPROACH_SPEED,
        metavar="MM_PER_S",
        help="speed of the way to where a program begins or goes on (default: %(default)g)",
    )
    add_file(
        parser,
        "--progress",
        "where it is kept how far a program came (default: a file for each machine in "
        "tri_glide_kinematics/ in $XDG_STATE_HOME, ~/.local/state)",
    )
    add_file(
        parser,
        "--work-zero",
        "where the work zeros are kept that the panel has set; they take the place of the offsets "
        "of the settings with their names (default: a file for each machine, as of --progress)",
    )
    return parser


def _refuse_mistakes(parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> None:
    """End the process where an option would mean nothing, or a number is out of bounds."""

    def refuse(names: Iterable[str], reason: str) -> None:
        for name in names:
            parser.error(f"--{name.replace('_', '-')} {reason}")

    given = {name for name, value in vars(arguments).items() if value != parser.get_default(name)}
    file, begin, approach = arguments.file, _begin(arguments), arguments.approach
    if not is_program(file):
        reason = f"is for programs and points: their names end in {ENDINGS_TEXT}"
        refuse(given - {"file", "check"}, reason)
    elif file.suffix.lower() != POINTS_ENDING:
        refuse(given & {"unit"}, f"is for points: their names end in {POINTS_ENDING}")
    if begin < 1:
        refuse(("from",), f"is {begin}, must be at least 1, the first line")
    if not SLOWEST <= approach < math.inf:
        refuse(("approach",), f"is {approach:g}, must be at least {SLOWEST:g} mm/s")
    if arguments.check:
        of_driving = {"go_on", "single_block", "progress", "approach"}
        refuse(given & of_driving, "is not for --check, which drives nothing")
    else:
        reason = "is for --check: what is driven has the parameters of ik_node"
        refuse(given & {"parameters"}, reason)


def _loaded(arguments: argparse.Namespace) -> Work:
    """Return what is to be driven; of a program, say with what it is read.

    Raises:
        KinematicsError: if it cannot be read, or something in it has no meaning.
    """
    file = find_file(arguments.file)
    if not is_program(file):
        return load_drive(file)
    settings_file = find_file(arguments.settings or Path(SETTINGS))
    zeros_file = arguments.work_zero or default_zeros_file(_namespace(sys.argv))
    zeros = _zeros_text(zeros_file)
    print(f"drive: {file} with the settings of {settings_file}{zeros}", flush=True)
    if settings_file != (packaged := find_file(Path(SETTINGS))):
        print(f"drive: what they do not name is as in {packaged}", flush=True)
    settings = with_kept_zeros(load_own_settings(settings_file), zeros_file)
    settings = replace(settings, optional_stop=arguments.optional_stops)
    program = load_program(file, settings, arguments.unit)
    if program.guess:
        print(f"drive: {file}: {program.guess}", flush=True)
    return program


def main() -> int:
    """Drive a file from the command line; the exit code is 0 if all of it has been driven."""
    words = sys.argv
    if "--ros-args" in words:
        # Without ROS they are unknown arguments like others.
        with suppress(ModuleNotFoundError):
            from rclpy.utilities import remove_ros_args

            words = remove_ros_args(words)
    parser = make_parser()
    arguments = parser.parse_args(words[1:])

    _refuse_mistakes(parser, arguments)
    try:
        work = _loaded(arguments)
        if not arguments.check:
            return _drive(work, arguments)
        _check(work, arguments)
        return 0
    except KinematicsError as error:
        print(f"drive: error: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        # Nobody reads any more; what is still to be written would fail again when Python ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except ModuleNotFoundError as error:
        print(
            f"drive: error: the Python module {error.name!r} is missing; without ROS 2 there is "
            "--check",
            file=sys.stderr,
        )
        return 1


if __name__ == "__main__":
    sys.exit(main())
