"""Runs a program: step after step. It is told the time, and never waits for anything.

It knows no ROS: a ``ProgramMachine`` takes goals and outputs, and tells what the machine does.
"""

from __future__ import annotations

import math
import secrets
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, Protocol, TypeVar

from tri_glide_kinematics.control import WAS_STOPPED, OperatingState
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.engine import GoalCode
from tri_glide_kinematics.motion.path import FlatPath
from tri_glide_kinematics.programs.kept import LineKeeper, RunState
from tri_glide_kinematics.programs.program import (
    Dwell,
    MoveStep,
    Output,
    PathRun,
    PathStep,
    ProgramStop,
    Step,
    StopKind,
    Work,
)
from tri_glide_kinematics.vectors import Vector3

# Until a machine is found, and until it is taken to be gone [s].
START_TIMEOUT = 10.0
SILENCE = 3.0

# Between two looks whether another ik_node was started meanwhile [s].
IDENTITY_PERIOD = 0.5

# After a stop, until one waits no longer for the platform to rest [s].
REST_TIMEOUT = 10.0

# A path goes on if the way that is driven on it has grown by more than this [m].
PAUSED_WITHIN = 1e-4

# Of the platform on its way to where a program begins or goes on, if nobody has chosen another: it
# may lead past anything [m/s].
APPROACH_SPEED = 0.05

# How often a run is told, and after which time without a look it has ended, as it may be taken for
# lost. ``program_timeout`` of ``ik_node`` is at least the sum of both and a margin [s].
TELL_PERIOD = 0.2
LONGEST_PAUSE = 0.7

# Outputs that a program which ends before its end does not leave on, however it ends.
SWITCHED_OFF = ("spindle", "flood", "mist")

MILLIMETRES = 1000.0  # in a metre

# In these states the machine rests when its speed is 0, and nobody else has it move.
RESTING = (
    OperatingState.IDLE,
    OperatingState.FAULT,
    OperatingState.DISABLED,
    OperatingState.WAITING,
)


@dataclass(frozen=True)
class StepReport:
    """The result of a step.

    Attributes:
        step: that it is about.
        result: in a word or two.
        is_good: whether the next step may begin.
        time: that it took [s]; None if it was not driven.
        length: of the way [m]; None if there is none, or it is not known.
        deviation: largest distance from the path as programmed [m]; None if there is none, or if
            nothing of it was driven.
        text: the whole reason of the result; empty if there is nothing to say.
    """

    step: Step
    result: str
    is_good: bool = False
    time: float | None = None
    length: float | None = None
    deviation: float | None = None
    text: str = ""


NOT_DRIVEN = "not driven"


class GoalProgress(NamedTuple):
    """What is told of a goal while it is driven.

    Attributes:
        position: measured. Shape (3,) [m].
        way_remaining: [m].
        time_remaining: [s]; NaN where it is not known.
        way: driven on the path, if it is one [m].
        segment: of the path, from 0.
    """

    position: Vector3
    way_remaining: float
    time_remaining: float
    way: float = 0.0
    segment: int = 0


class GoalEnd(NamedTuple):
    """How a goal has ended.

    Attributes:
        code: for programs.
        text: for people.
        position: measured at the end. Shape (3,) [m].
        deviation: largest distance from the path as programmed [m]; NaN if nothing of it was
            driven, or it is no path.
    """

    code: GoalCode
    text: str
    position: Vector3
    deviation: float = math.nan


class ProgramGoal(Protocol):
    """A goal that was sent."""

    @property
    def progress(self) -> GoalProgress | None:
        """The newest; None before the first."""

    @property
    def end(self) -> GoalEnd | None:
        """How it ended; None before."""

    def cancel(self) -> None:
        """Ask for a stop; the end comes when the platform rests."""


class MachineNow(NamedTuple):
    """What the machine does.

    Attributes:
        state: None if it is none that is known here.
        stops: a number that changes with each stop.
        speed: of the setpoints [m/s].
        position: of the setpoints. Shape (3,) [m].
        segment: of the path that is followed, from 0.
    """

    state: OperatingState | None
    stops: int
    speed: float
    position: Vector3
    segment: int


class RunNews(NamedTuple):
    """What is told of a run to all who listen.

    Attributes:
        number: at random; another one for each run.
        file: that is driven.
        line: that is driven, or is next; 0 in a file without lines.
        lines: of the file.
        state: as somebody outside sees it.
        doing: what it does, in words.
        safe_outputs: what outputs change to where the run is told no more.
    """

    number: int
    file: str
    line: int
    lines: int
    state: RunState
    doing: str
    safe_outputs: Sequence[Output]


class ProgramMachine(Protocol):
    """What a run asks for."""

    @property
    def server(self) -> str:
        """Name of the one that takes the goals."""

    @property
    def is_ready(self) -> bool:
        """Whether there is somebody who takes goals."""

    @property
    def now(self) -> MachineNow | None:
        """What the machine does; None before it has told it."""

    @property
    def identities(self) -> frozenset[bytes]:
        """Identifiers of those that tell the state.

        An ``ik_node`` that was killed is seen for a while beside the one that was started anew.
        """

    @property
    def taken_by(self) -> str:
        """Which run somebody else drives now, in words; empty if there is none."""

    @property
    def has_delivered(self) -> bool:
        """Whether all outputs and news have arrived."""

    def tell(self, news: RunNews) -> None:
        """Tell all who listen what the run does: where it is told no more, the machine stops."""

    def move_to(
        self, position: Vector3, frame: str = "", speed: float = 0.0, kind: str = ""
    ) -> ProgramGoal:
        """Go to a ``position`` [m], no faster than a ``speed`` [m/s] that is not 0."""

    def follow(
        self, segments: FlatPath, frame: str = "", outputs: Sequence[Output] = ()
    ) -> ProgramGoal:
        """Go along a path from where the platform is; ``outputs`` change at its joints."""

    def put_out(self, output: Output) -> None:
        """Change an output, now."""


Result = TypeVar("Result")

# Each ``yield`` is the end of one look.
Course = Generator[None, None, Result]


@dataclass
class _Status:
    """What a run does now.

    Attributes:
        state: as somebody outside sees it.
        line: that is driven, or that is next.
        name: of the present step, for people.
        doing: what it does, in words.
        now: the time of the present look [s]; infinite before the first one.
        why_stopped: why the run ends before its end; None if it does not.
        say: gets each thing that is begun, and each failure.
    """

    state: RunState
    line: int
    say: Callable[[str], object]
    name: str = ""
    doing: str = ""
    now: float = math.inf
    why_stopped: str | None = None

    @property
    def is_stopped(self) -> bool:
        """Whether the run ends before its end."""
        return self.why_stopped is not None

    def begin(self, what: str) -> None:
        """Take down and say what is begun."""
        self.doing = what
        self.say(what)


class _Contact:
    """Whether the machine that has got a goal is still there."""

    def __init__(self, machine: ProgramMachine, now: float) -> None:
        self._machine = machine
        self._known = machine.identities
        self._heard = self._looked = now
        self._give_up = math.inf
        # Whether another one has taken its place.
        self.is_another = False

    def lost(self, now: float, is_stopped: bool) -> str:
        """Return why the end of the goal is not waited for any more; empty as long as it is."""
        if is_stopped and self._give_up == math.inf:
            self._give_up = now + REST_TIMEOUT
        if self._machine.is_ready:
            self._heard = now
        if now - self._looked > IDENTITY_PERIOD:
            self._looked, present = now, self._machine.identities
            self.is_another = bool(self._known) and not present <= self._known
            self._known = self._known or present
        if self.is_another:
            return "another ik_node was started"
        if now - self._heard > SILENCE:
            return "ik_node is gone"
        return "the platform may still move" if now > self._give_up else ""


class _Pause:
    """Where the path is paused: segment and place [m]; ``at`` is None while it goes on."""

    def __init__(self) -> None:
        self.at: tuple[int, Vector3] | None = None
        self._way = 0.0

    def look(self, machine: MachineNow | None, progress: GoalProgress | None) -> None:
        """Take in what is told.

        A machine that moves may have left the path for another command: then the way driven on the
        path does not grow any more.
        """
        way = 0.0 if progress is None else progress.way
        if machine is not None and machine.state is OperatingState.PAUSED:
            self.at, self._way = (machine.segment, machine.position), way
        elif way > self._way + PAUSED_WITHIN:
            self.at = None


class _StepDriver:
    """Drives one step after the other; a course ends with the report of its step.

    Attributes:
        goal: that is driven; None between two.
        pause: of the path that is driven, or was driven last.
        waits_at: stop of the program at which it waits.
        is_elsewhere: whether the platform may be elsewhere than where the program has left it.
        is_out_of_hand: whether it is of no use to wait until the platform rests.
    """

    def __init__(
        self, machine: ProgramMachine, frame: str, status: _Status, approach: float
    ) -> None:
        self._machine = machine
        self._frame = frame
        self._status = status
        self._approach = approach
        self._place: Vector3 | None = None
        self.goal: ProgramGoal | None = None
        self.pause = _Pause()
        self.waits_at: ProgramStop | None = None
        self.is_elsewhere = True
        self.is_out_of_hand = False
        self._is_told_to_go_on = False

    def drive(self, step: Step, place: Vector3 | None) -> Course[StepReport]:
        """Drive a ``step``; the platform has to be at a ``place`` [m] before."""
        self.pause = _Pause()
        if self.is_elsewhere:
            # Outputs, too, change where the program has them change.
            if place is not None:
                speed = f"{1000.0 * self._approach:g} mm/s"
                self._status.begin(f"{self._status.name}: to the start of the path at {speed}")
                way = self._machine.move_to(place, self._frame, self._approach, "linear")
                report = yield from self._pursue(step, way)
                if not report.is_good:
                    return report
            if self._status.is_stopped:
                return StepReport(step, "stopped", text=self._status.why_stopped or "")
            self.is_elsewhere = False
        return (yield from step.read_by(self))

    def wait(self, why: str) -> Course[None]:
        """Wait for somebody who lets it go on, or stops it."""
        status = self._status
        status.doing = why
        self._is_told_to_go_on = False
        if not status.is_stopped:
            status.state = RunState.WAITING
        while not self._is_told_to_go_on and not status.is_stopped:
            yield
        if not status.is_stopped:
            status.state = RunState.RUNNING
        # Meanwhile somebody may have moved the platform.
        self.is_elsewhere = True

    def go_on(self) -> bool:
        """End the waiting for somebody; return whether it did wait."""
        self._is_told_to_go_on = self._status.state is RunState.WAITING
        return self._is_told_to_go_on

    # The work of each kind of step

    def move(self, step: MoveStep) -> Course[StepReport]:
        """Go to a position."""
        self._status.begin(f"{self._status.name}: move")
        return self._pursue(step, self._machine.move_to(step.position, self._frame, step.speed))

    def follow(self, step: PathStep | PathRun) -> Course[StepReport]:
        """Go along a path."""
        count = len(step.segments)
        self._status.begin(f"{self._status.name}: path of {count} segment{'s' * (count > 1)}")
        goal = self._machine.follow(step.segments, self._frame, step.changes)
        return self._pursue(step, goal, count)

    def put_out(self, step: Output) -> Course[StepReport]:
        """Change an output."""
        yield from ()
        what = f"output {step.name} {step.number} is {step.value:g}"
        self._status.begin(f"{self._status.name}: {what}")
        self._machine.put_out(step)
        return StepReport(step, "succeeded", True)

    def stop_for(self, step: ProgramStop) -> Course[StepReport]:
        """Wait at a stop of the program; at its end, for nothing."""
        name, begin = self._status.name, self._status.now
        if step.kind is StopKind.END:
            self._status.begin(f"{name}: end of the program")
            return StepReport(step, "succeeded", True)
        wanted = f", tool {step.tool}" if step.kind is StopKind.TOOL else ""
        self.waits_at = step
        yield from self.wait(f"{name}: {step.kind.value}{wanted}")
        self.waits_at = None
        return self._waited(step, begin)

    def dwell(self, step: Dwell) -> Course[StepReport]:
        """Let time pass."""
        status, begin = self._status, self._status.now
        status.begin(f"{status.name}: wait for {step.duration:g} s")
        while status.now < begin + step.duration and not status.is_stopped:
            left = begin + step.duration - status.now
            status.doing = f"{status.name}: {left:.1f} s left"
            yield
        return self._waited(step, begin)

    def _waited(self, step: Step, begin: float) -> StepReport:
        taken, why = self._status.now - begin, self._status.why_stopped
        if why is None:
            return StepReport(step, "succeeded", True, taken)
        return StepReport(step, "stopped", time=taken, text=why)

    def _pursue(self, step: Step, goal: ProgramGoal, segments: int = 0) -> Course[StepReport]:
        """Wait for the end of a ``goal`` that is sent for a ``step``, along so many segments."""
        status, begin = self._status, self._status.now
        contact = _Contact(self._machine, begin)
        self.goal = goal
        while goal.end is None:
            self.pause.look(self._machine.now, goal.progress)
            lost = contact.lost(status.now, status.is_stopped)
            if lost:
                if contact.is_another:
                    # Should the one that has the goal be there still, it shall stop.
                    goal.cancel()
                self.goal = None
                self.is_out_of_hand = True
                return StepReport(step, "lost", time=status.now - begin, text=lost)
            if goal.progress is not None:
                self._take_progress(step, goal.progress, segments)
            yield
        self.goal = None
        return self._ended(step, goal, goal.end, segments, status.now - begin)

    def _take_progress(self, step: Step, told: GoalProgress, segments: int) -> None:
        """Say how far a goal is."""
        if self._place is None:
            self._place = told.position
        status, remaining = self._status, told.way_remaining
        left = "" if math.isnan(told.time_remaining) else f", {told.time_remaining:.1f} s left"
        if not segments:
            status.doing = f"{status.name}: {in_millimetres(remaining, 1)} to go{left}"
            return
        where = f"segment {told.segment + 1} of {segments}"
        line = step.line_at(told.segment)
        if line:
            status.line, where = line, f"now line {line}"
        driven = f"{in_millimetres(told.way, 1)} of {in_millimetres(told.way + remaining, 1)}"
        status.doing = f"{status.name}: {where}, {driven}{left}"

    def _ended(
        self, step: Step, goal: ProgramGoal, end: GoalEnd, segments: int, taken: float
    ) -> StepReport:
        """Return the report of a goal that has ended, along so many segments."""
        before, self._place = self._place, end.position
        is_good, told, text = end.code is GoalCode.SUCCEEDED, goal.progress, end.text
        length = None
        if not segments:
            length = None if before is None else math.dist(before, end.position)
        elif is_good:
            self._status.line = step.line_at(-1)
            length = step.length
            if length is None and told is not None:
                length = told.way + told.way_remaining
        elif told is not None:
            length = told.way
            if step.line_at():
                text = f"at line {self._status.line}: {text}"
        deviation = None if math.isnan(end.deviation) else end.deviation
        # A node that ends its goal because it ends itself tells no more whether the platform moves.
        self.is_out_of_hand = end.code is GoalCode.SHUTDOWN
        return StepReport(step, _name(end.code), is_good, taken, length, deviation, text)


class _News:
    """What is told of a run, and the outputs that it does not leave on."""

    def __init__(self, machine: ProgramMachine, work: Work, status: _Status) -> None:
        self._machine = machine
        self._status = status
        self._number, self._file = secrets.randbits(64), str(Path(work.file).absolute())
        self._lines = work.lines
        changes = (output for step in work.steps for output in step.changes)
        used = sorted({(each.name, each.number) for each in changes if each.name in SWITCHED_OFF})
        self.safe_outputs = [Output(*each, 0.0, 0, 0) for each in used]
        self._tell_at = -math.inf

    def look(self) -> None:
        """Tell what the run does, if it is time."""
        if self._status.now >= self._tell_at:
            self._tell_at = self._status.now + TELL_PERIOD
            self._tell(self._status.state)

    def tell_end(self) -> None:
        """Tell that the run has ended, and nothing any more."""
        self._tell_at = math.inf
        self._tell(RunState.ENDED)

    def _tell(self, state: RunState) -> None:
        status = self._status
        about = self._number, self._file, status.line, self._lines
        self._machine.tell(RunNews(*about, state, status.doing, self.safe_outputs))

    def switch_off(self) -> None:
        """Switch off what the program does not leave on."""
        for output in self.safe_outputs:
            self._status.begin(f"output {output.name} {output.number} is 0")
            self._machine.put_out(output)


class ProgramRun:
    """Runs one program, or the rest of one (``from_line``), or one file of steps.

    ``look`` is called again and again until the state is ENDED.

    Attributes:
        single_block: whether it waits before each line that does something; it may be changed
            while the program runs.
        reports: what became of each step, or with ``single_block`` of each line.
    """

    def __init__(
        self,
        machine: ProgramMachine,
        program: Work,
        *,
        single_block: bool = False,
        kept: Path | None = None,
        approach: float = APPROACH_SPEED,
        say: Callable[[str], object] = lambda text: None,
    ) -> None:
        """Prepare to run a ``program``; nothing moves before ``look`` is called.

        Args:
            machine: that drives.
            program: what is driven.
            single_block: whether it waits before each line but the first.
            kept: file that says how far a program in G-code came; None for no such file.
            approach: speed of the way to where the program begins or goes on [m/s].
            say: gets each thing that is begun, and each failure, in words.
        """
        self.single_block = single_block
        self.reports: list[StepReport] = []
        self._machine = machine
        self._status = _Status(RunState.RUNNING, program.steps[0].line_at(), say)
        self._driver = _StepDriver(machine, program.frame, self._status, approach)
        self._keeper: LineKeeper | None = None
        if kept is not None and program.lines:
            self._keeper = LineKeeper(kept, program, say)
        self._rest = deque(program.steps)
        self._count = len(program.steps)
        # When they change the run ends.
        self._stops = None if machine.now is None else machine.now.stops
        self._news = _News(machine, program, self._status)
        self._course = self._run()

    @property
    def state(self) -> RunState:
        """What it does now."""
        return self._status.state

    @property
    def line(self) -> int:
        """The line that is driven, or that is next; 0 for a file of steps."""
        return self._status.line

    @property
    def doing(self) -> str:
        """What it does, in words."""
        return self._status.doing

    @property
    def waits_at(self) -> ProgramStop | None:
        """The stop of the program at which it is WAITING; None between two lines."""
        return self._driver.waits_at

    @property
    def was_stopped(self) -> bool:
        """Whether somebody has stopped it, and it has come to rest."""
        lost = any(each.result == "lost" for each in self.reports)
        return self.state is RunState.ENDED and self._status.is_stopped and not lost

    @property
    def is_whole(self) -> bool:
        """Whether all of it has been driven as it should."""
        return self.state is RunState.ENDED and all(each.is_good for each in self.reports)

    def is_delivered(self, now: float) -> bool:
        """Return whether all that was told has arrived, for what ends with the run, at a time [s].

        It is not waited for longer than for a machine that is gone.
        """
        is_late = now > self._status.now + SILENCE
        return self.state is RunState.ENDED and (self._machine.has_delivered or is_late)

    def look(self, now: float) -> None:
        """Do what is to be done at a time [s], without waiting for anything."""
        last, self._status.now = self._status.now, now
        if last < now - LONGEST_PAUSE:
            self.stop(f"nothing drove it for {now - last:.1f} s, so the machine stops")
        self._look_for_stop()
        self._news.look()
        next(self._course, None)
        if self._keeper is not None:
            self._keeper.keep(self.line, self.state, self.is_whole, now)

    def go_on(self) -> bool:
        """End the waiting for somebody; return whether it did wait."""
        return self._driver.go_on()

    def stop(self, why: str = "stopped") -> None:
        """Let the platform come to rest, on its path if it follows one, and end the run."""
        if self.state is RunState.ENDED or self._status.is_stopped:
            return
        self._status.why_stopped = why
        self._status.state = RunState.STOPPING
        if self._driver.goal is not None:
            self._driver.goal.cancel()

    def let_go(self) -> None:
        """Stop, and switch off at once: nobody waits until the platform rests.

        No end is told: should the stop not arrive, ``ik_node`` takes the run for lost.
        """
        self.stop("interrupted")
        self._news.switch_off()

    def _look_for_stop(self) -> None:
        """End the run where the machine was stopped, between two motions too."""
        machine = self._machine.now
        if machine is None:
            return
        if self._stops is None:
            self._stops = machine.stops
        elif machine.stops != self._stops:
            self.stop(WAS_STOPPED)

    def _run(self) -> Iterator[None]:
        """Run the program to its end, or to where it fails or is stopped."""
        status = self._status
        yield from self._find()
        is_good = has_begun = not self.reports
        if status.why_stopped is not None:
            # No step will say so.
            status.say(status.why_stopped)
        while is_good and not status.is_stopped and self._rest:
            step = self._take()
            line = step.line_at()
            status.line = line
            status.name = (
                f"line {line}" if line else f"step {len(self.reports) + 1} of {self._count}"
            )
            moving = (each for each in (step, *self._rest) if each.moves)
            place = next((each.needed_place for each in moving), None)
            try:
                self.reports.append((yield from self._driver.drive(step, place)))
            except (KinematicsError, OSError) as error:
                # The run ends as it does where a motion fails.
                self.reports.append(StepReport(step, "lost", text=str(error)))
                if self._driver.goal is not None:
                    self._driver.goal.cancel()
            yield from self._return(step)
            is_good = self.reports[-1].is_good
            if not is_good and self.reports[-1].text:
                status.say(f"{status.name}: {self.reports[-1].text}")
            is_next = self._rest and self._rest[0].line_at() > line
            if is_good and self.single_block and is_next and not step.waits:
                status.line = self._rest[0].line_at()
                yield from self._driver.wait(f"line {status.line} is next")
        self.reports += (StepReport(step, NOT_DRIVEN) for step in self._rest)
        try:
            if has_begun and (not is_good or status.is_stopped):
                yield from self._switch_off()
            self._news.tell_end()
        finally:
            # Nothing goes on, be it told or not.
            status.state = RunState.ENDED

    def _find(self) -> Iterator[None]:
        """Wait until there is a machine, which nobody else may drive a program on."""
        status = self._status
        end = status.now + START_TIMEOUT
        while not self._machine.is_ready and not status.is_stopped:
            if status.now > end:
                text = (
                    f"nobody offers the actions of {self._machine.server} after "
                    f"{START_TIMEOUT:g} s: is it running, in this domain and this namespace?"
                )
                status.say(text)
                self.reports.append(StepReport(self._rest.popleft(), "lost", text=text))
                return
            yield
        if self._machine.taken_by:
            text = f"nothing begun: {self._machine.taken_by}"
            status.say(text)
            self.reports.append(StepReport(self._rest.popleft(), "refused", text=text))

    def _take(self) -> Step:
        """Return what is driven next: a step, or with single blocks what one line says of it."""
        step = self._rest.popleft()
        if self.single_block:
            step, *others = step.after_first_line()
            self._put_back(others)
        return step

    def _put_back(self, steps: Sequence[Step]) -> None:
        """Let other steps be the next ones."""
        self._rest.extendleft(reversed(steps))
        self._count += len(steps)

    def _return(self, step: Step) -> Iterator[None]:
        """Wait if the platform was moved away while a path was paused; then it goes on from there.

        ``ik_node`` knows nothing of a path any more that somebody has replaced.
        """
        paused, report = self._driver.pause.at, self.reports[-1]
        if paused is None or self._status.is_stopped or report.result != SUPERSEDED:
            return
        rest = step.behind_place(*paused)
        if rest is None:
            return
        self._status.line = step.line_at(paused[0])
        self._put_back(rest)
        yield from self._driver.wait(f"line {self.line}: moved while the path was paused")
        if not self._status.is_stopped:
            self.reports[-1] = replace(report, is_good=True)

    def _switch_off(self) -> Iterator[None]:
        """Tell that spindle and coolant are off, when the platform rests."""
        end = self._status.now + REST_TIMEOUT
        while self._news.safe_outputs and not self._rests and self._status.now < end:
            yield
        self._news.switch_off()

    @property
    def _rests(self) -> bool:
        """Whether the platform rests, as far as is known."""
        machine = self._machine.now
        if machine is None or self._driver.is_out_of_hand:
            return True
        return machine.state in RESTING and not machine.speed > 0.0


def _name(code: GoalCode) -> str:
    return code.name.lower().replace("_", " ")


SUPERSEDED = _name(GoalCode.SUPERSEDED)


def in_millimetres(value: float | None, digits: int, unit: str = "mm") -> str:
    """Return a length [m] or a speed [m/s] as text; a dash for none."""
    return "-" if value is None else f"{MILLIMETRES * value:.{digits}f} {unit}"
