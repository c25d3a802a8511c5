"""The steps of programs and of drive files, and what a program means.

All that differs between the kinds of steps is said by their classes: nobody else asks for the kind.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import Enum
from typing import ClassVar, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.path import PLACE_OF_ANGLE, FlatPath, PlatformPath, SegmentKind
from tri_glide_kinematics.programs.words import ProgramError, Told
from tri_glide_kinematics.vectors import FloatArray, Vector3, three

TURN = 2.0 * math.pi  # rad

# A shorter rest of a segment is driven already [m]: no segment is shorter than 1e-6 m.
LEAST_REST = 2e-6


class StopKind(Enum):
    """Why a program stops."""

    PAUSE = "M0"
    OPTIONAL = "M1"
    TOOL = "M6"
    END = "end"


Answer = TypeVar("Answer")
Answered = TypeVar("Answered", covariant=True)


class StepReader(Protocol[Answered]):
    """Does something for each kind of step; ``Step.read_by`` calls the method of its kind."""

    def move(self, step: MoveStep) -> Answered:
        """Go to a position."""

    def follow(self, step: PathStep | PathRun) -> Answered:
        """Go along a path."""

    def dwell(self, step: Dwell) -> Answered:
        """Rest for a time."""

    def put_out(self, step: Output) -> Answered:
        """Change an output."""

    def stop_for(self, step: ProgramStop) -> Answered:
        """Wait for somebody, or end."""


class Step:
    """One thing that a machine is to do.

    Attributes:
        word: its kind, for people.
        moves: whether the platform moves.
        waits: whether it waits for somebody.
        takes_time: whether it takes any.
    """

    word: ClassVar[str]
    moves: ClassVar[bool] = False
    waits: ClassVar[bool] = False
    takes_time: ClassVar[bool] = True

    @property
    def needed_place(self) -> Vector3 | None:
        """Where the platform has to be before it [m]; None for anywhere."""
        return None

    @property
    def rest(self) -> float:
        """For how long the platform rests [s]."""
        return 0.0

    @property
    def length(self) -> float | None:
        """Length of its path [m]; None if it has none, or if that is not known yet."""
        return None

    @property
    def wanted_tool(self) -> int | None:
        """Number of the tool that it waits for; None if it waits for none."""
        return None

    @property
    def changes(self) -> tuple[Output, ...]:
        """Outputs that it changes, in their order."""
        return ()

    @property
    def runs(self) -> tuple[PathRun, ...]:
        """Itself if it is a path of a program, or nothing."""
        return ()

    def line_at(self, segment: int = 0) -> int:
        """Return the line of a program that says it, or a segment of it; 0 if no program does."""
        return 0

    def from_line(self, line: int) -> tuple[Step, ...]:
        """Return what the ``line`` and all lines behind it say of it."""
        return (self,) if self.line_at() >= line else ()

    def after_first_line(self) -> tuple[Step, ...]:
        """Return what its first line says of it, and then what the other lines do."""
        return (self,)

    def behind_place(self, segment: int, place: Vector3) -> tuple[Step, ...] | None:
        """Return the rest from a ``place`` [m] on a ``segment`` on; None if it cannot be cut."""
        return None

    def read_by(self, reader: StepReader[Answer]) -> Answer:
        """Call the method of ``reader`` for steps of this kind."""
        raise NotImplementedError


@dataclass(frozen=True)
class MoveStep(Step):
    """Go to a position and rest there.

    Attributes:
        position: Shape (3,) [m].
        speed: largest one of the platform, on a straight line; 0 for what the sliders can do, as
            the machine is set [m/s].
    """

    word = "move"
    moves = True

    position: Vector3
    speed: float = 0.0

    def read_by(self, reader: StepReader[Answer]) -> Answer:
        """Call ``move``."""
        return reader.move(self)


@dataclass(frozen=True, eq=False)
class PathStep(Step):
    """Go along lines and arcs without a stop, from where the platform is.

    Attributes:
        segments: as numbers.
        path: the same, from the end of the step before; None if that is not known.
    """

    word = "path"
    moves = True

    segments: FlatPath
    path: PlatformPath | None

    @property
    def length(self) -> float | None:
        """Length of its path [m]; None if its start is not known."""
        return None if self.path is None else self.path.length

    def read_by(self, reader: StepReader[Answer]) -> Answer:
        """Call ``follow``."""
        return reader.follow(self)


@dataclass(frozen=True)
class Output(Step):
    """An output that changes.

    Attributes:
        name: ``spindle`` (value in revolutions, negative for M4), ``flood``, ``mist``, ``fan``,
            ``digital`` (M62 to M65) or ``pin`` (M42).
        number: of several of its name.
        value: from now on.
        line: that says so.
        joint: index of the segment at whose begin it changes; 0 for one that is no part of a path.
    """

    word = "output"
    takes_time = False

    name: str
    number: int
    value: float
    line: int
    joint: int

    @property
    def changes(self) -> tuple[Output, ...]:
        """Itself."""
        return (self,)

    def line_at(self, segment: int = 0) -> int:
        """Return its line."""
        return self.line

    def read_by(self, reader: StepReader[Answer]) -> Answer:
        """Call ``put_out``."""
        return reader.put_out(self)


@dataclass(frozen=True, eq=False)
class PathRun(Step):
    """A path that is driven without a stop, unless its tolerances ask for one.

    Attributes:
        start: where it begins. Shape (3,) [m].
        segments: of the path.
        lines: of the program, one for each segment. Shape (n,).
        rapid: which segments are G0. Shape (n,).
        outputs: that change at inner joints, in their order.
    """

    word = "path"
    moves = True

    start: Vector3
    segments: FlatPath
    lines: NDArray[np.int32]
    rapid: NDArray[np.bool_]
    outputs: tuple[Output, ...]

    @property
    def needed_place(self) -> Vector3:
        """Its start [m]."""
        return self.start

    @property
    def changes(self) -> tuple[Output, ...]:
        """Its outputs."""
        return self.outputs

    @property
    def runs(self) -> tuple[PathRun, ...]:
        """Itself."""
        return (self,)

    def line_at(self, segment: int = 0) -> int:
        """Return the line of a segment."""
        return int(self.lines[segment])

    def from_line(self, line: int) -> tuple[Step, ...]:
        """Return the path from the first segment on that the ``line``, or one behind it, says."""
        segment = int(np.searchsorted(self.lines, line))
        if segment == len(self.lines):
            return ()
        behind = self.behind(segment) if segment else (self,)
        return tuple(each for each in behind if each.line_at() >= line)

    def after_first_line(self) -> tuple[Step, ...]:
        """Return what its first line says of it, and then what the other lines do."""
        others = (self.lines != self.lines[0]).nonzero()[0]
        if not len(others):
            return (self,)
        segment = int(others[0])
        return (self.before(segment), *self.behind(segment))

    def read_by(self, reader: StepReader[Answer]) -> Answer:
        """Call ``follow``."""
        return reader.follow(self)

    def before(self, segment: int) -> PathRun:
        """Return what leads to the start of a ``segment``, at least one."""
        outputs = tuple(each for each in self.outputs if each.joint < segment)
        return self._part(0, segment, self.start, outputs)

    def behind(self, segment: int) -> tuple[Step, ...]:
        """Return what is done from the start of a ``segment`` on, one at least.

        An output that changes right there changes before the platform moves.
        """
        first = (replace(each, joint=0) for each in self.outputs if each.joint == segment)
        return (*first, self._behind(segment))

    def behind_place(self, segment: int, place: Vector3) -> tuple[Step, ...]:
        """Return what is done from a ``place`` [m] on a ``segment`` on; nothing at the very end.

        It begins at the place of the segment as programmed that is nearest. The outputs at the
        start of the segment have changed already.
        """
        start = self.segments.start_of(segment, self.start)
        flat = self.segments.part(segment, len(self.lines))
        begin, numbers, left = _cut(flat, start, place)
        if left < LEAST_REST:
            return self.behind(segment + 1) if segment + 1 < len(self.lines) else ()
        rest = self._behind(segment)
        return (replace(rest, start=begin, segments=replace(flat, numbers=numbers)),)

    def _behind(self, segment: int) -> PathRun:
        """Return the path from the start of a ``segment`` on."""
        start = self.segments.start_of(segment, self.start)
        later = (each for each in self.outputs if each.joint > segment)
        outputs = tuple(replace(each, joint=each.joint - segment) for each in later)
        return self._part(segment, len(self.lines), start, outputs)

    def _part(self, first: int, end: int, start: Vector3, outputs: tuple[Output, ...]) -> PathRun:
        segments = self.segments.part(first, end)
        return PathRun(start, segments, self.lines[first:end], self.rapid[first:end], outputs)


def _cut(flat: FlatPath, start: Vector3, place: Vector3) -> tuple[Vector3, FloatArray, float]:
    """Cut the first segment of a path at the point that is nearest to a ``place`` [m].

    Returns:
        This point [m], the numbers of the path from there on, and what is left of the segment [m].
    """
    numbers = flat.numbers.copy()
    offset = np.subtract(place, start)
    if flat.kinds[0] == SegmentKind.LINE:
        way = numbers[:3] - start
        part = float(np.clip(offset @ way / (way @ way), 0.0, 1.0))
        return (
            three((start + part * way).tolist()),
            numbers,
            (1.0 - part) * float(np.linalg.norm(way)),
        )
    axis = numbers[3:6] / np.linalg.norm(numbers[3:6])
    angle = float(numbers[PLACE_OF_ANGLE])
    rise = float(numbers[PLACE_OF_ANGLE + 1]) if flat.kinds[0] == SegmentKind.HELIX_ABOUT else 0.0
    out = start - numbers[:3]
    out -= (out @ axis) * axis
    aside = np.copysign(1.0, angle) * np.cross(axis, out)
    radial = offset - (offset @ axis) * axis + out
    turned = math.atan2(radial @ aside, radial @ out) % TURN
    # Of several turns the rise tells which; just before the start is no whole turn behind it.
    if rise:
        turned += TURN * round(float(offset @ axis / rise * abs(angle) - turned) / TURN)
    elif turned > 0.5 * (abs(angle) + TURN):
        turned = 0.0
    part = min(max(turned / abs(angle), 0.0), 1.0)
    turned = part * abs(angle)
    begin = start + part * rise * axis - out + math.cos(turned) * out + math.sin(turned) * aside
    numbers[PLACE_OF_ANGLE] = (1.0 - part) * angle
    if rise:
        numbers[PLACE_OF_ANGLE + 1] = (1.0 - part) * rise
    return (
        three(begin.tolist()),
        numbers,
        (1.0 - part) * math.hypot(np.linalg.norm(out) * angle, rise),
    )


@dataclass(frozen=True)
class Dwell(Step):
    """Rest for a time [s].

    Attributes:
        duration: [s].
        line: that says so; 0 in a drive file.
    """

    word = "wait"

    duration: float
    line: int = 0

    @property
    def rest(self) -> float:
        """Its duration [s]."""
        return self.duration

    def line_at(self, segment: int = 0) -> int:
        """Return its line."""
        return self.line

    def read_by(self, reader: StepReader[Answer]) -> Answer:
        """Call ``dwell``."""
        return reader.dwell(self)


@dataclass(frozen=True)
class ProgramStop(Step):
    """Rest until somebody lets it go on, or for good.

    Attributes:
        kind: why.
        line: that says so.
        tool: number of the tool that is wanted; of M6 alone.
    """

    word = "stop"
    waits = True

    kind: StopKind
    line: int
    tool: int = 0

    @property
    def wanted_tool(self) -> int | None:
        """Its tool, if it is M6."""
        return self.tool if self.kind is StopKind.TOOL else None

    def line_at(self, segment: int = 0) -> int:
        """Return its line."""
        return self.line

    def read_by(self, reader: StepReader[Answer]) -> Answer:
        """Call ``stop_for``."""
        return reader.stop_for(self)


class Work:
    """What is driven: a program, or a file of steps.

    Attributes:
        file: where it is from.
        steps: in their order.
        frame: of all places; empty for that of the machine.
        lines: how many there are; 0 if its steps are not those of lines.
        size: of its text [bytes]; 0 without lines.
        sha256: of its text, in hexadecimal digits; empty without lines.
    """

    file: str
    steps: tuple[Step, ...]
    frame: str
    lines: int
    size: int
    sha256: str

    @contextmanager
    def located(self, step: Step) -> Iterator[None]:
        """Let an error about a ``step`` say where that stands, if somebody can look it up."""
        yield


@dataclass(frozen=True, eq=False)
class Program(Work):
    """A program that is understood; its places are in the frame of the machine.

    Attributes:
        file: where it is from.
        steps: in their order.
        told: what is not done, each once.
        lines: how many there are.
        size: of its text [bytes].
        sha256: of its text, in hexadecimal digits.
        guess: in which dialect it was read, and why; empty if nothing was guessed.
    """

    frame = ""

    file: str
    steps: tuple[Step, ...]
    told: tuple[Told, ...]
    lines: int
    size: int
    sha256: str
    guess: str = ""

    @contextmanager
    def located(self, step: Step) -> Iterator[None]:
        """Name the line.

        Raises:
            ProgramError: instead of any other error about the ``step``.
        """
        try:
            yield
        except KinematicsError as error:
            # Errors about a path know the segment.
            line = step.line_at(getattr(error, "segment", 0))
            raise ProgramError(self.file, line, 0, "", str(error)) from error


def from_line(program: Program, line: int) -> Program:
    """Return the rest of a ``program``: what the ``line`` and all lines behind it do.

    What the lines before it have set holds: units, offsets, speeds, tolerances. The outputs that
    they have changed change first, each once, to what it is then; as part of the first line of
    the rest, so that who stops there begins there again. Of the tools that they ask for, the last
    one is told. A line within a path cuts it where its segment begins.

    Raises:
        ProgramError: if there is nothing that the rest could do.
    """
    steps: list[Step] = []
    changed: dict[tuple[str, int], Output] = {}
    tool: Step | None = None
    for step in program.steps:
        for output in step.changes:
            if output.line < line:
                # The one that was changed last comes last.
                changed.pop((output.name, output.number), None)
                changed[output.name, output.number] = output
        if step.wanted_tool is not None and step.line_at() < line:
            tool = step
        steps += step.from_line(line)
    if not steps:
        last = max(step.line_at() for step in program.steps)
        reason = f"nothing is done from here on: line {last} is the last one that does something"
        raise ProgramError(program.file, line, 0, "", reason)
    told = program.told
    if tool is not None:
        reason = f"tool {tool.wanted_tool} has to be in the machine already"
        told = (*told, Told("M6", tool.line_at(), reason))
    first = steps[0].line_at()
    again = (replace(each, line=first, joint=0) for each in changed.values())
    return replace(program, steps=(*again, *steps), told=told)
