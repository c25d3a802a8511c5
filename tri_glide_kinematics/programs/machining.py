"""What holds while a program is read, line by line, and the steps that come of it.

A ``Machining`` is made of parts: modes, offsets, the feed, outputs, and the writer of the steps.
``codes.py`` says which word of a line changes what of it.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple, NoReturn

import numpy as np

from tri_glide_kinematics.motion.path import LARGEST_PLACE as FAR
from tri_glide_kinematics.motion.path import (
    LARGEST_SPEED,
    LEAST_SPEED,
    MOST_SEGMENTS,
    SHORTEST,
    FlatPath,
    SegmentKind,
)
from tri_glide_kinematics.programs.dialects import CUSTOMS, MILLIMETRE, Customs, Dialect
from tri_glide_kinematics.programs.program import Dwell, Output, PathRun, ProgramStop, Step
from tri_glide_kinematics.programs.settings import NOWHERE, WORK_OFFSETS, ProgramSettings
from tri_glide_kinematics.programs.words import Line, Remarks
from tri_glide_kinematics.vectors import Vector3, three
from tri_glide_kinematics.wording import number_text

AXES = "XYZ"
# Of the centre of an arc.
CENTRES = "IJK"


class Offsets:
    """What is added to a place in the program, by work offsets, G92 and the tool.

    Attributes:
        work: name of the work offset in force.
        shift: their sum. Shape (3,) [m].
    """

    def __init__(self, offsets: Mapping[str, Vector3]) -> None:
        """Begin with G54, and the work ``offsets`` of the settings [m]."""
        self.work = "G54"
        self.shift = [0.0, 0.0, 0.0]
        self._of_work = {name: offsets.get(name, NOWHERE) for name in WORK_OFFSETS}
        self._set_off = self._set_off_before = self._of_tool = NOWHERE
        self._find_shift()

    def select(self, work: str) -> None:
        """Let another work offset hold."""
        self.work = work
        self._find_shift()

    def set_tool(self, offset: Vector3) -> None:
        """Let the offset of another tool hold [m]."""
        self._of_tool = offset
        self._find_shift()

    def set_work(
        self, name: str, values: Mapping[int, float], here: Sequence[float] | None
    ) -> None:
        """Set a work offset for some axes [m]; with ``here``, so that this place has the values."""
        offset = list(self._of_work[name])
        for axis, value in values.items():
            offset[axis] = value
            if here is not None:
                offset[axis] = here[axis] - self._set_off[axis] - self._of_tool[axis] - value
        self._of_work[name] = three(offset)
        self._find_shift()

    def call(self, values: Mapping[int, float], here: Sequence[float]) -> None:
        """Let the place ``here`` have other values for some axes [m] (G92)."""
        set_off, work = list(self._set_off), self._of_work[self.work]
        for axis, value in values.items():
            set_off[axis] = here[axis] - work[axis] - self._of_tool[axis] - value
        self._set_off = self._set_off_before = three(set_off)
        self._find_shift()

    def call_no_more(self, *, for_good: bool) -> None:
        """Let G92 hold no more; ``call_again`` takes it up unless it is ``for_good``."""
        self._set_off = NOWHERE
        if for_good:
            self._set_off_before = NOWHERE
        self._find_shift()

    def call_again(self) -> None:
        """Let G92 hold again."""
        self._set_off = self._set_off_before
        self._find_shift()

    def _find_shift(self) -> None:
        self.shift[:] = map(sum, zip(self._of_work[self.work], self._set_off, self._of_tool))


class StepWriter:
    """Collects the steps of a program, segment by segment.

    Attributes:
        steps: that are complete.
        end: where the last segment ends. Shape (3,) [m].
        count: how many segments the present path has.
    """

    def __init__(self, begin: Vector3) -> None:
        """Begin at a place [m]."""
        self.steps: list[Step] = []
        self.end = list(begin)
        self._begin()

    def _begin(self) -> None:
        self._start = list(self.end)
        self.count = 0
        self._kinds = array("B")
        self._numbers = array("d")
        self._speeds = array("d")
        self._tolerances = array("d")
        self._lines = array("i")
        self._rapid = array("b")
        self._outputs: list[Output] = []

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to do so far."""
        return not (self.steps or self.count or self._outputs)

    def add(
        self,
        kind: int,
        numbers: Sequence[float],
        end: Sequence[float],
        bounds: tuple[float, float],
        line: int,
        rapid: bool,
    ) -> None:
        """Add a segment that ends at ``end`` [m], with tolerance [m] and speed [m/s] as bounds."""
        self.end[:] = end
        self._kinds.append(kind)
        self._numbers.extend(numbers)
        tolerance, speed = bounds
        self._tolerances.append(tolerance)
        self._speeds.append(speed)
        self._lines.append(line)
        self._rapid.append(rapid)
        self.count += 1

    def put_out(self, name: str, number: int, value: float, line: int) -> None:
        """Change an output where the platform is then."""
        self._outputs.append(Output(name, number, value, line, self.count))

    def has_done(self, line: int) -> bool:
        """Return whether the last thing that is done is that of a ``line``."""
        last = self._lines[-1] if self.count else 0
        return line in (last, *(each.line_at() for each in (*self._outputs, *self.steps[-1:])))

    def rest(self, step: Dwell | ProgramStop) -> None:
        """Do a ``step`` at the end of the path so far."""
        self.finish()
        self.steps.append(step)

    def finish(self) -> None:
        """Put the path so far into a step, and the outputs before and after it."""
        count = self.count
        self.steps += (output for output in self._outputs if output.joint == 0)
        if count:
            self.steps.append(self._run(count))
        after = (output for output in self._outputs if output.joint >= count > 0)
        self.steps += (replace(output, joint=0) for output in after)
        self._begin()

    def _run(self, count: int) -> PathRun:
        lines = np.frombuffer(self._lines, np.int32)
        kinds, numbers = np.frombuffer(self._kinds, np.uint8), np.frombuffer(self._numbers)
        bounds = np.frombuffer(self._tolerances), np.frombuffer(self._speeds)
        segments = FlatPath.of(kinds, numbers, *bounds, 0.0)
        inner = tuple(output for output in self._outputs if 0 < output.joint < count)
        return PathRun(
            three(self._start), segments, lines, np.frombuffer(self._rapid, np.bool_), inner
        )


class Spindle:
    """The spindle and the coolant: what goes off where a program ends."""

    def __init__(self, writer: StepWriter) -> None:
        """Put out into the steps of a ``writer``."""
        self._writer = writer
        self._direction = self._speed = 0.0
        self._coolant: set[str] = set()

    def turn(self, direction: float, line: int) -> None:
        """Turn forwards (1), backwards (-1), or not at all (0), as a ``line`` says."""
        self._direction = direction
        self._writer.put_out("spindle", 0, direction * self._speed + 0.0, line)

    def set_speed(self, speed: float) -> None:
        """Turn with a ``speed``, in revolutions, from the next ``turn`` on."""
        self._speed = speed

    def go_on_turning(self, line: int) -> None:
        """Go on turning, with another speed."""
        if self._direction:
            self.turn(self._direction, line)

    def cool(self, name: str, is_on: float, line: int) -> None:
        """Switch a coolant."""
        self._writer.put_out(name, 0, is_on, line)
        (self._coolant.add if is_on else self._coolant.discard)(name)

    def go_off(self, line: int) -> None:
        """Put out nothing any more, as a ``line`` ends the program."""
        if self._direction:
            self._writer.put_out("spindle", 0, 0.0, line)
        for name in sorted(self._coolant):
            self._writer.put_out(name, 0, 0.0, line)


class Feed:
    """The speed that F asks for, of which a part is driven (M220).

    Attributes:
        asked: by F; 0 before the first [m/s].
        part: of it that is driven.
        speed: their product [m/s].
    """

    def __init__(self, asked: float) -> None:
        """Begin with what is ``asked`` for [m/s]."""
        self.part = 1.0
        self.asked = self.speed = asked

    def ask(self, speed: float) -> None:
        """Let another F hold [m/s]."""
        self.asked = speed
        self.speed = speed * self.part

    def drive_part(self, part: float) -> None:
        """Let another part of F be driven."""
        self.part = part
        self.speed = self.asked * part


class Motion(NamedTuple):
    """A way to move, which holds until another one is named: G0 to G3, and drilling cycles.

    Attributes:
        name: of its command.
        drive: carries out a line that moves so.
        letters: of which a line has one at least, if it moves so.
        is_cycle: whether holes are drilled.
    """

    name: str
    drive: Callable[[Machining, Line], None]
    letters: str = AXES
    is_cycle: bool = False


@dataclass(slots=True)
class Modes:
    """What holds until another command of the same group changes it.

    Attributes:
        motion: how the platform moves to a place; None if nothing says so.
        unit: of lengths [m].
        plane: axes of the plane of arcs, and the axis across it.
        absolute: whether places are counted from the zero, not from where the platform is.
        absolute_centres: whether those of arcs are, not from the start of the arc.
        returns: whether a drilling cycle goes back behind each hole to where it began.
        tolerance: largest deviation from the path [m].
        tool: number of the tool that is in the machine.
        tool_wanted: of the one that M6 asks for.
    """

    tolerance: float
    motion: Motion | None = None
    unit: float = MILLIMETRE
    plane: tuple[int, int, int] = (0, 1, 2)
    absolute: bool = True
    absolute_centres: bool = False
    returns: bool = True
    tool: int = 0
    tool_wanted: int = 0


@dataclass
class Holes:
    """What drilling cycles keep from one line to the next.

    Attributes:
        numbers: that still hold, by their letters [m], [s].
        above: height where the cycles began [m].
    """

    numbers: dict[str, float] = field(default_factory=dict)
    above: float = 0.0


class Machining:
    """What holds at a line of a program, and the steps that the lines before it say.

    Attributes:
        settings: what the program does not say.
        dialect: that it is written in.
        customs: of the dialect.
        remarks: what is to be said of the present line.
        modes, feed, offsets, holes: what holds.
        writer, spindle: what is done.
        here: place that the platform is sent to; the last segment ends hardly elsewhere [m].
        has_ended: whether nothing behind this line is read.
    """

    def __init__(self, settings: ProgramSettings, dialect: Dialect, remarks: Remarks) -> None:
        """Begin as the ``settings`` say."""
        self.settings = settings
        self.dialect = dialect
        self.customs: Customs = CUSTOMS[dialect]
        self.remarks = remarks
        self.modes = Modes(settings.tolerance)
        self.feed = Feed(self.customs.first_feed if settings.feed is None else settings.feed)
        self.offsets = Offsets(settings.offsets)
        self.holes = Holes()
        self.writer = StepWriter(settings.begin)
        self.spindle = Spindle(self.writer)
        self.here = list(settings.begin)
        self.has_ended = False
        # Line that switches the motors off, 0 for none, and the largest number of segments of a
        # path.
        self._motors_off, self._most = 0, MOST_SEGMENTS

    def switch_motors(self, *, on: bool) -> None:
        """Take in that the motors are switched: without them, nothing moves."""
        if not on:
            self.writer.finish()
        self._motors_off, self._most = (0, MOST_SEGMENTS) if on else (self.remarks.line, 0)

    def check_speed(self, index: int, speed: float) -> None:
        """Check a ``speed`` [m/s] that the word with this index says."""
        if not LEAST_SPEED <= speed <= LARGEST_SPEED:
            bound, side = (LEAST_SPEED, "least") if speed < LEAST_SPEED else (LARGEST_SPEED, "most")
            told, limit = (number_text(each / MILLIMETRE, 6, 0.0) for each in (speed, bound))
            reason = f"the speed {told} mm/s must be at {side} {limit} mm/s"
            self.remarks.fail(index, reason)

    def choose(self, motion: Motion | None) -> None:
        """Let another ``motion`` hold."""
        before = self.modes.motion
        if motion is not before:
            self.holes.numbers = {}
            if before is None or not before.is_cycle:
                self.holes.above = self.here[2]
        self.modes.motion = motion

    # Ways of the platform

    def take_target(self, line: Line, *, of_machine: bool = False) -> None:
        """Take in where the axes of a ``line`` lead; ``of_machine``, whatever offsets hold."""
        shift = NOWHERE if of_machine else self.offsets.shift
        for axis, letter in enumerate(AXES):
            value = line.take(letter)
            if value is not None:
                self.step(axis, value, shift if of_machine or self.modes.absolute else self.here)

    def step(self, axis: int, value: float, before: Sequence[float]) -> None:
        """Send the platform to a ``value`` along an axis, from a place ``before`` [m]."""
        self.here[axis] = before[axis] + value * self.modes.unit

    def go(self, *, rapid: bool = True, at_full_speed: bool = False) -> None:
        """Add the line to where the platform is sent, if it has a length."""
        if math.dist(self.here, self.writer.end) >= SHORTEST:
            self.add_line(rapid, at_full_speed)

    def add_line(self, rapid: bool, at_full_speed: bool) -> None:
        """Add the line from the end of the last segment to where the platform is sent."""
        here = self.here
        x, y, z = here
        if self.writer.count >= self._most:
            self._begin_another_path()
        if not (-FAR < x < FAR and -FAR < y < FAR and -FAR < z < FAR):
            self._fail_far()
        bounds = self.modes.tolerance, 0.0 if at_full_speed else self.speed()
        self.writer.add(0, here, here, bounds, self.remarks.line, rapid)

    def add_arc(self, centre: Sequence[float], angle: float, rise: float) -> None:
        """Add an arc about the third axis of the plane.

        Args:
            centre: at the height of the start. Shape (3,) [m].
            angle: of all of it [rad].
            rise: along the axis [m].
        """
        if not max(map(abs, (*centre, *self.here, rise))) < FAR:
            self._fail_far()
        axis = [0.0, 0.0, 0.0]
        axis[self.modes.plane[2]] = 1.0
        numbers, kind = [*centre, *axis, angle], SegmentKind.ARC_ABOUT
        if rise:
            numbers.append(rise)
            kind = SegmentKind.HELIX_ABOUT
        if self.writer.count >= self._most:
            self._begin_another_path()
        bounds = self.modes.tolerance, self.speed()
        self.writer.add(kind, numbers, self.here, bounds, self.remarks.line, False)

    def speed(self) -> float:
        """Return the speed that F asks for [m/s]."""
        if self.feed.speed == 0.0:
            per = "mm/s" if self.customs.feed_time == 1.0 else "mm/min"
            reason = f"no F says how fast this is: write one, such as F600 ({per}), before it"
            self.remarks.fail_at(AXES + CENTRES, reason)
        return self.feed.speed

    def _begin_another_path(self) -> None:
        """Stop there, as this path can have no more segments."""
        if self._motors_off:
            reason = f"the motors are off since line {self._motors_off}: write G28 before it"
            self.remarks.fail(-1, reason)
        reason = f"the platform stops there: a path has {MOST_SEGMENTS} segments"
        self.remarks.tell("stop", reason)
        self.writer.finish()

    def _fail_far(self) -> NoReturn:
        self.remarks.fail(-1, f"it leads farther than {FAR:g} m: are its units right?")
