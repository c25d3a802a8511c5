"""Runs a program in an ``ik_node``: step after step, and it never waits for anything."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from geometry_msgs.msg import Point
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from tri_glide_interfaces.action import FollowPath
from tri_glide_interfaces.msg import MachineState
from tri_glide_interfaces.msg import Output as OutputMessage
from tri_glide_kinematics.control import WAS_STOPPED
from tri_glide_kinematics.motion.engine import GoalCode
from tri_glide_kinematics.programs import (
    NOT_DRIVEN,
    DriveFile,
    Dwell,
    KeptLine,
    MoveStep,
    Output,
    PathRun,
    PathStep,
    Program,
    ProgramStep,
    ProgramStop,
    RunState,
    Step,
    StepReport,
    StopKind,
    WaitStep,
    in_millimetres,
    line_of,
)
from tri_glide_kinematics.ros.goal_sender import GoalSender, SentGoal, output_message
from tri_glide_kinematics.ros.messages import LATEST_OUTPUTS
from tri_glide_kinematics.vectors import Vector3

# Until ik_node is found, and until it is taken to be gone [s].
START_TIMEOUT = 10.0
SILENCE = 3.0

# Between two looks whether another ik_node was started meanwhile [s].
IDENTITY_PERIOD = 0.5

# After a stop, until one waits no longer for the platform to rest [s].
REST_TIMEOUT = 10.0

# So often it is kept how far the program came, and a little oftener than once a second [s].
KEEP_PERIOD = 0.8

# Who begins to listen later is told the latest ones.
LATEST = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

# A path goes on if the way that is driven on it has grown by more than this [m].
PAUSED_WITHIN = 1e-4

# What a program that ends before its end does not leave on.
SWITCHED_OFF = ("spindle", "flood", "mist")

# In these states the machine rests when its speed is 0, and nobody else has it move.
RESTING = (MachineState.IDLE, MachineState.FAULT, MachineState.DISABLED, MachineState.WAITING)

# Whoever ends a goal like this tells no more whether the platform moves.
NOT_OURS = (GoalCode.SHUTDOWN,)


class ProgramLink:
    """What a node needs to run programs, made once: goals, outputs, and the state of the machine.

    Attributes:
        goals: to send.
        outputs: publishes those that change while the platform rests.
        machine: its newest state; None before the first.
    """

    def __init__(self, node: Node) -> None:
        """Run programs as a part of ``node``."""
        self.goals = GoalSender(node)
        self.outputs = node.create_publisher(OutputMessage, "outputs", LATEST_OUTPUTS)
        self.machine: MachineState | None = None
        self._node = node
        node.create_subscription(MachineState, "ik_node/machine_state", self._take, LATEST)

    @property
    def identities(self) -> frozenset[bytes]:
        """Identifiers of those that publish the state.

        An ``ik_node`` that was killed is seen for a while beside the one that was started anew.
        """
        publishers = self._node.get_publishers_info_by_topic("ik_node/machine_state")
        return frozenset(bytes(each.endpoint_gid) for each in publishers)

    def _take(self, message: MachineState) -> None:
        self.machine = message


class ProgramRun:
    """Runs one program, or the rest of one (``from_line``), or one file of steps.

    ``look`` is called again and again, where the node spins, until the state is ENDED.

    Attributes:
        single_block: whether it waits before each line that does something; it may be changed
            while the program runs.
        state: what it does now.
        waits_at: the stop of the program at which it is WAITING; None between two lines.
        line: that is being driven, or that is next; 0 for a file of steps.
        doing: what it does, in words.
        reports: what became of each step, or with ``single_block`` of each line.
    """

    def __init__(
        self,
        link: ProgramLink,
        program: Program | DriveFile,
        *,
        single_block: bool = False,
        kept: Path | None = None,
        say: Callable[[str], object] = lambda text: None,
    ) -> None:
        """Prepare to run a ``program``; nothing moves before ``look`` is called.

        Args:
            link: to the machine.
            program: what is driven.
            single_block: whether it waits before each line but the first.
            kept: file that says how far a program in G-code came; None for no such file.
            say: gets each thing that is begun, and each failure, in words.
        """
        self.single_block = single_block
        self.state = RunState.RUNNING
        self.waits_at: ProgramStop | None = None
        self.line = line_of(program.steps[0])
        self.doing = ""
        self.reports: list[StepReport] = []
        self._link = link
        self._program = program
        self._frame = program.frame if isinstance(program, DriveFile) else ""
        self._kept = kept if isinstance(program, Program) else None
        self._say = say
        self._rest: deque[Step | ProgramStep] = deque(program.steps)
        self._count = len(program.steps)
        self._is_told_to_go_on = False
        self._stopped_why: str | None = None
        # When they change the run ends.
        self._stops = None if link.machine is None else link.machine.stops
        self._goal: SentGoal | None = None
        self._place: Vector3 | None = None
        # Segment of the path that is paused, and where.
        self._paused_at: tuple[int, Vector3] | None = None
        self._paused_way = 0.0
        # Whether the platform may be elsewhere than where the program has left it.
        self._is_elsewhere = True
        # Whether it is of no use to wait until the platform rests.
        self._is_out_of_hand = False
        self._kept_at = -math.inf
        self._kept_last: KeptLine | None = None
        self._switched = sorted(
            {
                output.name
                for step in program.steps
                for output in (step.outputs if isinstance(step, PathRun) else (step,))
                if isinstance(output, Output) and output.name in SWITCHED_OFF
            }
        )
        self._course = self._run()

    @property
    def is_whole(self) -> bool:
        """Whether all of it has been driven as it should."""
        return self.state is RunState.ENDED and all(each.is_good for each in self.reports)

    def look(self) -> None:
        """Do what is to be done now, without waiting for anything."""
        self._look_for_stop()
        next(self._course, None)
        self._keep()

    def go_on(self) -> None:
        """End the waiting for somebody, if there is one."""
        self._is_told_to_go_on = self.state is RunState.WAITING

    def stop(self, why: str = "stopped") -> None:
        """Let the platform come to rest, on its path if it follows one, and end the run."""
        if self.state is RunState.ENDED or self._stopped_why is not None:
            return
        self._stopped_why = why
        self.state = RunState.STOPPING
        if self._goal is not None:
            self._goal.cancel()

    def let_go(self) -> None:
        """Stop, and switch off at once: nobody waits until the platform rests."""
        self.stop("interrupted")
        self._tell_off()

    def _look_for_stop(self) -> None:
        """End the run where ``ik_node`` was stopped, between two motions too."""
        machine = self._link.machine
        if machine is None or self._stopped_why is not None:
            return
        if self._stops is None:
            self._stops = machine.stops
        elif machine.stops != self._stops and self.state is not RunState.ENDED:
            self.stop(WAS_STOPPED)

    # The course of a run: each ``yield`` is the end of one look.

    def _run(self) -> Iterator[None]:
        """Run the program to its end, or to where it fails or is stopped."""
        yield from self._find()
        is_good = not self.reports
        if self._stopped_why is not None:
            # No step will say so.
            self._say(self._stopped_why)
        while is_good and self._stopped_why is None and self._rest:
            piece = self._take()
            self._paused_at = None
            name = self._name_of(piece)
            yield from self._do(piece)
            yield from self._return(piece)
            is_good = self.reports[-1].is_good
            if not is_good and self.reports[-1].text:
                self._say(f"{name}: {self.reports[-1].text}")
            is_next = self._rest and line_of(self._rest[0]) > line_of(piece)
            if is_good and self.single_block and is_next and not isinstance(piece, ProgramStop):
                self.line = line_of(self._rest[0])
                yield from self._wait(f"line {self.line} is next")
        is_good = is_good and self._stopped_why is None
        self.reports += (StepReport(step, NOT_DRIVEN) for step in self._rest)
        if not is_good:
            yield from self._switch_off()
        # What was put out last has to arrive before a process ends.
        begin = time.monotonic()
        while time.monotonic() < begin + SILENCE:
            if self._link.outputs.wait_for_all_acked(Duration()):
                break
            yield
        self.state = RunState.ENDED

    def _return(self, piece: Step | ProgramStep) -> Iterator[None]:
        """Wait if the platform was moved away while a path was paused; then it goes on from there.

        ``ik_node`` knows nothing of a path any more that somebody has replaced.
        """
        paused_at, report = self._paused_at, self.reports[-1]
        if paused_at is None or not isinstance(piece, PathRun) or self._stopped_why is not None:
            return
        if report.result != SUPERSEDED:
            return
        segment, place = paused_at
        self.line = line_of(piece, segment)
        rest = piece.behind_place(segment, place)
        self._rest.extendleft(reversed(rest))
        self._count += len(rest)
        yield from self._wait(f"line {self.line}: moved while the path was paused")
        if self._stopped_why is None:
            self.reports[-1] = replace(report, is_good=True)

    def _find(self) -> Iterator[None]:
        """Wait until there is a machine."""
        end = time.monotonic() + START_TIMEOUT
        while not self._link.goals.is_ready and self._stopped_why is None:
            if time.monotonic() > end:
                text = (
                    f"nobody offers the actions of {self._link.goals.server} after "
                    f"{START_TIMEOUT:g} s: is it running, in this domain and this namespace?"
                )
                self._say(text)
                self.reports.append(StepReport(self._rest.popleft(), "lost", text=text))
                return
            yield

    def _take(self) -> Step | ProgramStep:
        """Return what is driven next: a step, or with single blocks what one line says of it."""
        step = self._rest.popleft()
        if not isinstance(step, PathRun) or not self.single_block:
            return step
        begins = (step.lines != step.lines[0]).nonzero()[0]
        if not len(begins):
            return step
        segment = int(begins[0])
        self._rest.extendleft(reversed(step.behind(segment)))
        self._count += 1
        return step.before(segment)

    def _name_of(self, step: Step | ProgramStep) -> str:
        line = line_of(step)
        return f"line {line}" if line else f"step {len(self.reports) + 1} of {self._count}"

    def _begin(self, what: str) -> None:
        self.doing = what
        self._say(what)

    def _do(self, piece: Step | ProgramStep) -> Iterator[None]:
        """Drive one piece, and report it."""
        name = self._name_of(piece)
        self.line = line_of(piece)
        if self._is_elsewhere:
            # Outputs, too, change where the program has them change.
            yield from self._go_back(piece, name)
        if self._is_elsewhere:
            return
        if isinstance(piece, MoveStep):
            self._begin(f"{name}: move")
            goal = self._link.goals.move_to(piece.position, self._frame, piece.speed)
            yield from self._pursue(piece, goal)
        elif isinstance(piece, (PathStep, PathRun)):
            count = len(piece.segments)
            self._begin(f"{name}: path of {count} segment{'s' * (count > 1)}")
            outputs = piece.outputs if isinstance(piece, PathRun) else ()
            goal = self._link.goals.follow(piece.segments, self._frame, outputs)
            yield from self._pursue(piece, goal)
        elif isinstance(piece, Output):
            self._begin(f"{name}: output {piece.name} {piece.number} is {piece.value:g}")
            self._link.outputs.publish(output_message(piece))
            self.reports.append(StepReport(piece, "succeeded", True))
        elif isinstance(piece, ProgramStop):
            yield from self._stop_for(piece, name)
        else:
            yield from self._pass_time(piece, name)

    def _go_back(self, piece: Step | ProgramStep, name: str) -> Iterator[None]:
        """Go to where the program is to go on, if it leads anywhere; report it if that fails."""
        paths = (each for each in (piece, *self._rest) if isinstance(each, PathRun))
        path = next(paths, None)
        if path is not None:
            self._begin(f"{name}: to the start of the path")
            way = self._link.goals.move_to(path.start, self._frame, kind="linear")
            yield from self._pursue(piece, way)
            if not self.reports[-1].is_good:
                return
            self.reports.pop()
        self._is_elsewhere = False
        if self._stopped_why is not None:
            self._is_elsewhere = True
            self.reports.append(StepReport(piece, "stopped", text=self._stopped_why))

    def _wait(self, why: str) -> Iterator[None]:
        """Wait for somebody who lets it go on, or stops it."""
        self.doing = why
        self._is_told_to_go_on = False
        if self._stopped_why is None:
            self.state = RunState.WAITING
        while not self._is_told_to_go_on and self._stopped_why is None:
            yield
        if self._stopped_why is None:
            self.state = RunState.RUNNING
        # Meanwhile somebody may have moved the platform.
        self._is_elsewhere = True

    def _stop_for(self, stop: ProgramStop, name: str) -> Iterator[None]:
        """Wait at a stop of the program; at its end, for nothing."""
        if stop.kind is StopKind.END:
            self._begin(f"{name}: end of the program")
            self.reports.append(StepReport(stop, "succeeded", True))
            return
        wanted = f", tool {stop.tool}" if stop.kind is StopKind.TOOL else ""
        begin = time.monotonic()
        self.waits_at = stop
        yield from self._wait(f"{name}: {stop.kind.value}{wanted}")
        self.waits_at = None
        self._report_time(stop, begin)

    def _pass_time(self, step: WaitStep | Dwell, name: str) -> Iterator[None]:
        self._begin(f"{name}: wait for {step.duration:g} s")
        begin = time.monotonic()
        while time.monotonic() < begin + step.duration and self._stopped_why is None:
            left = begin + step.duration - time.monotonic()
            self.doing = f"{name}: {left:.1f} s left"
            yield
        self._report_time(step, begin)

    def _report_time(self, step: WaitStep | Dwell | ProgramStop, begin: float) -> None:
        taken, why = time.monotonic() - begin, self._stopped_why
        if why is None:
            self.reports.append(StepReport(step, "succeeded", True, taken))
        else:
            self.reports.append(StepReport(step, "stopped", time=taken, text=why))

    def _pursue(self, step: Step | ProgramStep, goal: SentGoal) -> Iterator[None]:
        """Wait for the end of a ``goal``, and report the ``step`` that it is for."""
        name = self._name_of(step)
        begin = heard = time.monotonic()
        give_up = math.inf
        known, looked = self._link.identities, begin
        is_another = False
        self._goal = goal
        while goal.result is None:
            self._look_for_pause(goal.feedback)
            now = time.monotonic()
            if self._stopped_why is not None and give_up == math.inf:
                give_up = now + REST_TIMEOUT
            heard = now if self._link.goals.is_ready else heard
            if now - looked > IDENTITY_PERIOD:
                looked, present = now, self._link.identities
                is_another = bool(known) and not present <= known
                known = known or present
            if is_another or now - heard > SILENCE or now > give_up:
                self._is_out_of_hand = True
                text = "the platform may still move"
                if is_another:
                    # Should the one that has the goal be there still, it shall stop.
                    goal.cancel()
                    text = "another ik_node was started"
                elif now - heard > SILENCE:
                    text = "ik_node is gone"
                self.reports.append(StepReport(step, "lost", time=now - begin, text=text))
                break
            if goal.feedback is not None:
                self._take_progress(step, goal.feedback, name)
            yield
        else:
            self.reports.append(self._ended(step, goal, time.monotonic() - begin))
        self._goal = None

    def _look_for_pause(self, told: Any) -> None:
        """Remember where the path is paused, until it goes on; ``told`` is the newest feedback.

        A machine that moves may have left the path for another command: then the way driven on the
        path does not grow any more.
        """
        machine = self._link.machine
        way = float(told.way) if isinstance(told, FollowPath.Feedback) else 0.0
        if machine is not None and machine.state == MachineState.PAUSED:
            self._paused_at, self._paused_way = (machine.segment, _vector(machine.position)), way
        elif way > self._paused_way + PAUSED_WITHIN:
            self._paused_at = None

    def _take_progress(self, step: Step | ProgramStep, told: Any, name: str) -> None:
        """Take in what was told about a goal."""
        if self._place is None:
            self._place = _vector(told.position)
        left = "" if math.isnan(told.time_remaining) else f", {told.time_remaining:.1f} s left"
        is_path = isinstance(told, FollowPath.Feedback)
        if not is_path or not isinstance(step, (PathStep, PathRun)):
            self.doing = f"{name}: {in_millimetres(told.way_remaining, 1)} to go{left}"
            return
        whole = in_millimetres(told.way + told.way_remaining, 1)
        segment = f"segment {told.segment + 1} of {len(step.segments)}"
        if isinstance(step, PathRun):
            self.line = line_of(step, told.segment)
            segment = f"now line {self.line}"
        self.doing = f"{name}: {segment}, {in_millimetres(told.way, 1)} of {whole}{left}"

    def _ended(self, step: Step | ProgramStep, goal: SentGoal, taken: float) -> StepReport:
        result = goal.result
        before, self._place = self._place, _vector(result.position)
        is_path = isinstance(result, FollowPath.Result)
        length = deviation = None
        text = result.text
        if is_path and isinstance(step, (PathStep, PathRun)):
            length = _driven(step, goal)
            # Of a path that was not driven there is none.
            if not math.isnan(result.largest_deviation):
                deviation = result.largest_deviation
            if isinstance(step, PathRun):
                if goal.has_succeeded:
                    self.line = line_of(step, -1)
                elif goal.feedback is not None:
                    text = f"at line {self.line}: {text}"
        elif before is not None:
            length = math.dist(before, self._place)
        self._is_out_of_hand = result.code in NOT_OURS
        return StepReport(
            step, _name(result.code), goal.has_succeeded, taken, length, deviation, text
        )

    def _switch_off(self) -> Iterator[None]:
        """Tell that spindle and coolant are off, when the platform rests."""
        end = time.monotonic() + REST_TIMEOUT
        while self._switched and not self._rests and time.monotonic() < end:
            yield
        self._tell_off()

    def _tell_off(self) -> None:
        for name in self._switched:
            self._begin(f"output {name} 0 is 0")
            self._link.outputs.publish(OutputMessage(name=name))

    @property
    def _rests(self) -> bool:
        """Whether the platform rests, as far as is known."""
        machine = self._link.machine
        if machine is None or self._is_out_of_hand:
            return True
        return machine.state in RESTING and not machine.speed > 0.0

    # What is kept

    def _keep(self) -> None:
        """Keep on disk how far the program came, now and then."""
        if self._kept is None or not isinstance(self._program, Program):
            return
        now = time.monotonic()
        is_new = self._kept_last is None or self._kept_last.state is not self.state
        if not is_new and now < self._kept_at + KEEP_PERIOD:
            return
        self._kept_at = now
        told = KeptLine.of(self._program, self.line, self.state, self.is_whole)
        if told == self._kept_last:
            return
        self._kept_last = told
        try:
            told.write(self._kept)
        except OSError as error:
            self._say(f"how far the program comes is not kept: {error}")
            self._kept = None


def _driven(step: PathStep | PathRun, goal: SentGoal) -> float | None:
    """Return the length of the way along a path [m]; None if nothing was told about it."""
    told = goal.feedback
    if goal.has_succeeded:
        if isinstance(step, PathStep) and step.path is not None:
            return step.path.length
        return None if told is None else float(told.way + told.way_remaining)
    return None if told is None else float(told.way)


def _name(code: int) -> str:
    return GoalCode(code).name.lower().replace("_", " ")


SUPERSEDED = _name(GoalCode.SUPERSEDED)


def _vector(point: Point) -> Vector3:
    return point.x, point.y, point.z
