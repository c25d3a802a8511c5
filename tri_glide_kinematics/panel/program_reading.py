"""A program before it runs: understood, drawn and proved by a process of its own.

Python would let nothing else happen on the page meanwhile, not even Stop.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import at_once, blocks
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.path import Segments, clearances
from tri_glide_kinematics.motion.shaping import Shaping
from tri_glide_kinematics.programs import (
    PathRun,
    Program,
    ProgramCheck,
    ProgramError,
    ProgramSettings,
    TellPart,
    check_program,
    load_program,
    tell_nobody,
)
from tri_glide_kinematics.vectors import FloatArray, Vector3, three
from tri_glide_kinematics.workspace import Workspace

# Looks of a piece of the path. A piece that joins two paths is not drawn.
CUT, RAPID, OUTSIDE, NOTHING = range(4)

# A piece that is drawn is no longer, so that what is outside is seen to begin there [m], and an arc
# turns by no more on it [rad].
LONGEST_PIECE = 0.005
CHORD_ANGLE = np.deg2rad(5.0)
# There are no more of them before they are thinned out.
MOST_PIECES = 1_000_000

# No more pieces are drawn: a browser without a graphics card draws them still at some rate.
MOST_DRAWN = 20_000
# A point this near to the line between its neighbours can be left out, to begin with [m].
UNSEEN = 1e-5

LONGEST_REASON = 500  # characters
UNPRINTABLE = "\N{REPLACEMENT CHARACTER}"

# The process tells as often how far it is [s]. Reading is such a part of its work, and what comes
# before and behind the look for places outside are such parts of the drawing, about.
TELL_PERIOD = 0.2
READING = 0.6
BEFORE, BEHIND = 0.2, 0.7
# So many places are looked at before it is told again.
ROWS = 50_000

# Reading takes less of the processor than the nodes that share the computer.
NICENESS = 5
SCRIPT = "from tri_glide_kinematics.panel.program_reading import main; main()"


# A mark differs when another file has taken the place, or its contents have changed.
Mark = tuple[int, ...]


def mark_of(file: Path) -> Mark:
    """Return the mark of a ``file``; empty if there is none."""
    try:
        found = file.stat()
    except OSError:
        return ()
    return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


class Reading(NamedTuple):
    """What is asked for.

    Attributes:
        file: of the program.
        settings: what it does not say itself.
        workspace: of the machine.
        limits: of its sliders.
        shaper: of the machine; None without one.
        is_check: whether to prove it, and not to draw it.
        mark: of the file that is meant, by ``mark_of``.
    """

    file: Path
    settings: ProgramSettings
    workspace: Workspace
    limits: SliderLimits
    shaper: Shaping | None
    is_check: bool
    mark: Mark


@dataclass(frozen=True, eq=False)
class ReadProgram:
    """A program that is understood, and how it is drawn.

    Attributes:
        program: what it means.
        line_starts: where in its file each line begins, and the end. Shape (lines + 1,).
        points: ends of the pieces that are drawn. Shape (n, 2, 3) [m].
        looks: of each piece: CUT, RAPID or OUTSIDE. Shape (n,).
        outside: the first line that leads outside the workspace; 0 for none.
        lines: the first line and the last of each step, which both ascend. Shape (2, steps).
        lower, upper: corners of the box around the path. Shapes (3,) [m].
    """

    program: Program
    line_starts: NDArray[np.int64]
    points: NDArray[np.float32]
    looks: NDArray[np.uint8]
    outside: int
    lines: NDArray[np.int64]
    lower: Vector3
    upper: Vector3

    def steps_at(self, line: int) -> range:
        """Return the indices of the steps that a ``line`` belongs to."""
        first = int(np.searchsorted(self.lines[1], line))
        return range(first, int(np.searchsorted(self.lines[0], line, "right")))


@dataclass(frozen=True)
class NotRead:
    """A program that is not understood, or not inside.

    Attributes:
        reason: with the line.
        line: 0 if it is about the whole file.
    """

    reason: str
    line: int = 0


Answer = ReadProgram | ProgramCheck | NotRead


class ReadingProcess:
    """A process that reads a program.

    Attributes:
        answer: None until it is there.
        part: of the work that is done, from 0 to 1, about.
        begun_at: by the monotonic clock [s].
    """

    def __init__(self, reading: Reading) -> None:
        """Start it."""
        self.answer: Answer | None = None
        self.part = 0.0
        self.begun_at = time.monotonic()
        # Ctrl-C is for the node, which ends it.
        self._process = subprocess.Popen(
            [sys.executable, "-c", SCRIPT],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            start_new_session=True,
        )
        Thread(target=self._communicate, args=(reading,), daemon=True).start()

    def end(self) -> None:
        """End it: nobody wants to know any more."""
        self._process.kill()

    def _communicate(self, reading: Reading) -> None:
        process = self._process
        # It may be killed at any time.
        with process, suppress(OSError, EOFError, pickle.UnpicklingError):
            assert process.stdin is not None
            assert process.stdout is not None
            pickle.dump(reading, process.stdin)
            process.stdin.close()
            while isinstance(told := pickle.load(process.stdout), float):
                self.part = told
            self.answer = told
        if self.answer is None:
            code = process.returncode
            self.answer = NotRead(f"{reading.file.name}: nothing came of it (exit code {code})")


def main() -> None:
    """Read what is asked for from the standard input; write parts and the answer to the output."""
    os.nice(NICENESS)
    reading: Reading = pickle.load(sys.stdin.buffer)
    told_at = time.monotonic()

    def tell_part(part: float) -> None:
        nonlocal told_at
        if time.monotonic() - told_at > TELL_PERIOD:
            told_at = time.monotonic()
            pickle.dump(part, sys.stdout.buffer)
            sys.stdout.buffer.flush()

    pickle.dump(answer_to(reading, tell_part), sys.stdout.buffer)


def answer_to(reading: Reading, tell_part: TellPart = tell_nobody) -> Answer:
    """Read a program, and draw or prove it; ``tell_part`` gets which part of that is done."""
    reading_part = 0.2 if reading.is_check else READING

    def tell_rest(part: float) -> None:
        tell_part(reading_part + (1.0 - reading_part) * part)

    try:
        # The file is on the disk before anybody relies on it.
        with reading.file.open("rb") as stream:
            os.fsync(stream.fileno())
            data = stream.read()
        program = load_program(
            reading.file, reading.settings, tell_part=lambda part: tell_part(reading_part * part)
        )
        if mark_of(reading.file) != reading.mark:
            return NotRead(f"{reading.file.name} was changed while it was read")
        if reading.is_check:
            return check_program(
                *(program, reading.workspace, reading.limits, reading.shaper), tell_rest
            )
        return drawn(program, data, reading.workspace, tell_rest)
    except OSError as error:
        return NotRead(f"{reading.file.name} cannot be read: {error.strerror or error}")
    except ProgramError as error:
        return NotRead(shown_text(str(error), reading.file), error.line)
    except KinematicsError as error:
        return NotRead(shown_text(str(error), reading.file))


def shown_text(text: str, file: Path) -> str:
    """Return a ``text`` about a ``file`` as a page can show it, whatever stands in that file."""
    text = text.replace(str(file), file.name)
    shown = "".join(each if each.isprintable() else UNPRINTABLE for each in text[:LONGEST_REASON])
    return shown if len(text) <= LONGEST_REASON else f"{shown}..."


def drawn(
    program: Program, data: bytes, workspace: Workspace, tell_part: TellPart = tell_nobody
) -> ReadProgram:
    """Return a ``program`` that stands in a file as ``data``, and how it is drawn."""
    whole, done = sum(len(run.segments) for step in program.steps for run in step.runs), 0
    places = [np.zeros((0, 3))]
    looks: list[NDArray[np.uint8]] = []
    outside = 0
    for step in program.steps:
        for run in step.runs:
            segments = at_once(run.segments.path_from(run.start)).segments
            points, segment = polyline_of(segments)
            inside = np.empty(len(points), dtype=np.bool_)
            for rows in blocks(len(points), ROWS):
                inside[rows] = clearances(workspace, points[rows]).inside
                part = (done + len(segment[: rows.stop]) / len(segment) * len(run.segments)) / whole
                tell_part(BEFORE + (BEHIND - BEFORE) * part)
            done += len(run.segments)
            is_out = ~(inside[:-1] & inside[1:])
            if is_out.any() and not outside:
                outside = int(run.lines[segment[is_out.argmax()]])
            look = np.where(is_out, OUTSIDE, np.where(run.rapid[segment], RAPID, CUT))
            places.append(points)
            looks += [np.full(1 if looks else 0, NOTHING, dtype=np.uint8), look.astype(np.uint8)]
    points = np.concatenate(places)
    look = np.concatenate(looks) if looks else np.zeros(0, dtype=np.uint8)
    kept = thinned_out(points, look, lambda part: tell_part(BEHIND + (1.0 - BEHIND) * part))
    look = look[kept[:-1]]
    pieces = np.stack((points[kept[:-1]], points[kept[1:]]), axis=1)[look != NOTHING]
    low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else np.zeros((2, 3))
    return ReadProgram(
        program,
        line_starts(data),
        pieces.astype(np.float32),
        look[look != NOTHING],
        outside,
        np.array([[step.line_at(segment) for step in program.steps] for segment in (0, -1)]),
        three(low),
        three(high),
    )


def polyline_of(segments: Segments) -> tuple[FloatArray, NDArray[np.intp]]:
    """Return points on ``segments``, and on which of them each piece from one to the next lies.

    Returns:
        Points, shape (n + 1, 3) [m], and indices of segments, shape (n,).
    """
    lengths = segments.lengths
    longest = max(LONGEST_PIECE, lengths.sum() / MOST_PIECES)
    counts = np.ceil(np.maximum(lengths / longest, segments.curvatures * lengths / CHORD_ANGLE))
    counts = np.maximum(counts, 1.0).astype(np.intp)
    segment = np.repeat(np.arange(len(lengths)), counts)
    number = np.arange(len(segment)) - np.repeat(np.cumsum(counts) - counts, counts)
    way = (number * (lengths / counts)[segment])[:, np.newaxis]
    curvature = segments.curvatures[segment][:, np.newaxis]
    rise, tangent = segments.rises[segment], segments.tangents[segment]
    is_arc = curvature > 0.0
    bend = np.where(is_arc, curvature, 1.0)
    ahead = np.where(is_arc, np.sin(curvature * way) / bend, way)
    aside = np.where(is_arc, 2.0 * np.sin(0.5 * curvature * way) ** 2 / bend, 0.0)
    places = segments.points[segment] + way * rise
    places += ahead * (tangent - rise) + aside * segments.normals[segment]
    return np.concatenate((places, segments.points[-1:])), segment


def thinned_out(
    points: FloatArray, looks: NDArray[np.uint8], tell_part: TellPart = tell_nobody
) -> NDArray[np.intp]:
    """Return which points to draw, both ends among them, so that there are few enough.

    Those that are nearest to the line between their neighbours are left out first; those at which
    the look changes stay.

    Args:
        points: Shape (n + 1, 3) [m].
        looks: of the pieces between them. Shape (n,).
        tell_part: gets which part is done, about.
    """
    kept = np.arange(len(points))
    changes = np.ones(len(points), dtype=np.bool_)
    changes[1:-1] = looks[1:] != looks[:-1]
    unseen = UNSEEN
    while len(kept) - changes.sum() > MOST_DRAWN:
        tell_part(MOST_DRAWN / len(kept))
        before = len(kept)
        # Of two neighbours one stays, so that what is left out is near to what is drawn.
        for first in (1, 2):
            places = points[kept]
            here = np.arange(first, len(kept) - 1, 2)
            chord = places[here + 1] - places[here - 1]
            offset = places[here] - places[here - 1]
            square = np.maximum(np.einsum("ij,ij->i", chord, chord), 1e-30)
            part = np.clip(np.einsum("ij,ij->i", offset, chord) / square, 0.0, 1.0)
            distance = np.linalg.norm(offset - part[:, np.newaxis] * chord, axis=1)
            kept = np.delete(kept, here[(distance < unseen) & ~changes[kept[here]]])
        if len(kept) > 0.9 * before:
            unseen *= 2.0
    return kept


def line_starts(data: bytes) -> NDArray[np.int64]:
    """Return where in a file each line begins, and its end. Shape (lines + 1,)."""
    codes = np.frombuffer(data, np.uint8)
    after = np.append(codes[1:], 0)
    ends = (codes == ord("\n")) | ((codes == ord("\r")) & (after != ord("\n")))
    starts = np.concatenate(([0], np.flatnonzero(ends) + 1))
    return np.append(starts, len(data)) if starts[-1] < len(data) else starts


def points_of_line(run: PathRun, line: int) -> FloatArray:
    """Return the polyline that a ``line`` of a path drives. Shape (n, 3) [m]; empty for none."""
    low, high = np.searchsorted(run.lines, (line, line + 1)).tolist()
    if low == high:
        return np.empty((0, 3))
    start = run.segments.start_of(low, run.start)
    return polyline_of(at_once(run.segments.part(low, high).path_from(start)).segments)[0]
