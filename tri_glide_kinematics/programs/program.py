"""What a program means: paths, dwells, outputs and stops, one after the other."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.motion.path import PLACE_OF_ANGLE, FlatPath, SegmentKind
from tri_glide_kinematics.programs.words import ProgramError
from tri_glide_kinematics.vectors import FloatArray, Vector3

TURN = 2.0 * math.pi

# A shorter rest of a segment is driven already [m]: no segment is shorter than 1e-6 m.
LEAST_REST = 2e-6


class StopKind(Enum):
    """Why a program stops."""

    PAUSE = "M0"
    OPTIONAL = "M1"
    TOOL = "M6"
    END = "end"


class Output(NamedTuple):
    """An output that changes.

    Attributes:
        name: ``spindle`` (value in revolutions, negative for M4), ``flood``, ``mist``, ``fan``,
            ``digital`` (M62 to M65) or ``pin`` (M42).
        number: of several of its name.
        value: from now on.
        line: that says so.
        joint: index of the segment at whose begin it changes; 0 for one that is no part of a path.
    """

    name: str
    number: int
    value: float
    line: int
    joint: int


@dataclass(frozen=True, eq=False)
class PathRun:
    """A path that is driven without a stop, unless its tolerances ask for one.

    Attributes:
        start: where it begins. Shape (3,) [m].
        segments: of the path.
        lines: of the program, one for each segment. Shape (n,).
        rapid: which segments are G0. Shape (n,).
        outputs: that change at inner joints, in their order.
    """

    start: Vector3
    segments: FlatPath
    lines: NDArray[np.int32]
    rapid: NDArray[np.bool_]
    outputs: tuple[Output, ...]

    def before(self, segment: int) -> PathRun:
        """Return what leads to the start of a ``segment``, at least one."""
        outputs = tuple(each for each in self.outputs if each.joint < segment)
        return self._part(0, segment, self.start, outputs)

    def behind(self, segment: int) -> tuple[ProgramStep, ...]:
        """Return what is done from the start of a ``segment`` on, one at least.

        An output that changes right there changes before the platform moves.
        """
        start = self.segments.start_of(segment, self.start)
        moved = [
            each._replace(joint=each.joint - segment)
            for each in self.outputs
            if each.joint >= segment
        ]
        first = [each for each in moved if not each.joint]
        inner = tuple(each for each in moved if each.joint)
        return (*first, self._part(segment, len(self.lines), start, inner))

    def behind_place(self, segment: int, place: Vector3) -> tuple[ProgramStep, ...]:
        """Return what is done from a ``place`` [m] on a ``segment`` on; nothing at the very end.

        It begins at the place of the segment as programmed that is nearest. The outputs at the
        start of the segment have changed already.
        """
        start = self.segments.start_of(segment, self.start)
        flat = self.segments.part(segment, len(self.lines))
        begin, numbers, left = _cut(flat, start, place)
        if left < LEAST_REST:
            return self.behind(segment + 1) if segment + 1 < len(self.lines) else ()
        *_, rest = self.behind(segment)
        assert isinstance(rest, PathRun)
        return (replace(rest, start=begin, segments=replace(flat, numbers=numbers)),)

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
        return _vector(start + part * way), numbers, (1.0 - part) * float(np.linalg.norm(way))
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
    return _vector(begin), numbers, (1.0 - part) * math.hypot(np.linalg.norm(out) * angle, rise)


def _vector(values: FloatArray) -> Vector3:
    x, y, z = map(float, values)
    return x, y, z


class Dwell(NamedTuple):
    """Rest for a time [s].

    Attributes:
        duration: [s].
        line: that says so.
    """

    duration: float
    line: int


class ProgramStop(NamedTuple):
    """Rest until somebody lets it go on, or for good.

    Attributes:
        kind: why.
        line: that says so.
        tool: number of the tool that is wanted; of M6 alone.
    """

    kind: StopKind
    line: int
    tool: int = 0


class Told(NamedTuple):
    """Something that a program says and that is not done.

    Attributes:
        word: a letter or a command.
        line: the first that says it.
        reason: why it is not done.
    """

    word: str
    line: int
    reason: str


ProgramStep = PathRun | Dwell | Output | ProgramStop


@dataclass(frozen=True, eq=False)
class Program:
    """A program that is understood.

    Attributes:
        file: where it is from.
        steps: in their order.
        told: what is not done, each once.
        lines: how many there are.
        size: of its text [bytes].
        sha256: of its text, in hexadecimal digits.
    """

    file: str
    steps: tuple[ProgramStep, ...]
    told: tuple[Told, ...]
    lines: int
    size: int
    sha256: str


def from_line(program: Program, line: int) -> Program:
    """Return the rest of a ``program``: what the ``line`` and all lines behind it do.

    What the lines before it have set holds: units, offsets, speeds, tolerances. The outputs that
    they have changed change first, each once, to what it is then; as part of the first line of
    the rest, so that who stops there begins there again. Of the tools that they ask for, the last
    one is told. A line within a path cuts it where its segment begins.

    Raises:
        ProgramError: if there is nothing that the rest could do.
    """
    steps: list[ProgramStep] = []
    changed: dict[tuple[str, int], Output] = {}
    tool: ProgramStop | None = None
    for step in program.steps:
        outputs = step.outputs if isinstance(step, PathRun) else (step,)
        for output in outputs:
            if isinstance(output, Output) and output.line < line:
                # The one that was changed last comes last.
                changed.pop(output[:2], None)
                changed[output[:2]] = output._replace(joint=0)
        if isinstance(step, PathRun):
            segment = int(np.searchsorted(step.lines, line))
            if segment < len(step.lines):
                behind = step.behind(segment) if segment else (step,)
                steps += (each for each in behind if line_of(each) >= line)
        elif step.line >= line:
            steps.append(step)
        elif isinstance(step, ProgramStop) and step.kind is StopKind.TOOL:
            tool = step
    if not steps:
        last = max(map(line_of, program.steps))
        reason = f"nothing is done from here on: line {last} is the last one that does something"
        raise ProgramError(program.file, line, 0, "", reason)
    told = program.told
    if tool is not None:
        reason = f"tool {tool.tool} has to be in the machine already"
        told = (*told, Told("M6", tool.line, reason))
    first = line_of(steps[0])
    again = (each._replace(line=first) for each in changed.values())
    return replace(program, steps=(*again, *steps), told=told)


def line_of(step: object, segment: int = 0) -> int:
    """Return the line of a program that says a step, or a segment of it; 0 if no program does."""
    if isinstance(step, PathRun):
        return int(step.lines[segment])
    return step.line if isinstance(step, (Dwell, Output, ProgramStop)) else 0
