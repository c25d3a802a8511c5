"""What comes of a program before it is driven: whether it stays inside, and how long it takes."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible, at_once
from tri_glide_kinematics.keys import FileError
from tri_glide_kinematics.motion.limits import AT_REST, SliderLimits, SliderState
from tri_glide_kinematics.motion.moves import MotionKind
from tri_glide_kinematics.motion.path import FlatPath, SegmentKind
from tri_glide_kinematics.motion.path_timing import PathPlanner, plan_move, time_path
from tri_glide_kinematics.motion.shaping import Shaping
from tri_glide_kinematics.motion.trajectory import CubicPlan, SequencePlan, Trajectory
from tri_glide_kinematics.programs.program import (
    Dwell,
    MoveStep,
    Output,
    PathRun,
    PathStep,
    Program,
    ProgramStop,
    Step,
    Work,
)
from tri_glide_kinematics.programs.words import TellPart, tell_nobody
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.workspace import Workspace

# A path has about so many pieces of work, and so many more for each of its segments.
_PIECES = 1_300
_PIECES_OF_SEGMENT = 0.065
# F holds where the platform takes less than so many times the time by F.
AS_ASKED = 1.1


@dataclass(frozen=True, eq=False)
class TimedWay:
    """When the platform is where on a path, at an override of 100 %.

    Attributes:
        to_go: way that is left at the knots, descending to 0. Shape (n + 1,) [m].
        times: from knot to knot. Shape (n,) [s].
        feed: the least of that by F; 0 where none holds. Shape (n,) [s].
        rapid: the least of that where no F holds, at the largest velocity limit. Shape (n,) [s].
    """

    to_go: FloatArray
    times: FloatArray
    feed: FloatArray
    rapid: FloatArray

    def left(self, to_go: float, feed_scale: float, rapid_scale: float) -> float:
        """Return how long the rest takes of which so much is ``to_go`` [m], with scales [s]."""
        if feed_scale < 1.0:
            each = np.maximum(self.times, self.feed / feed_scale)
        else:
            # Where it gets faster and slower, another F changes little.
            each = np.where(self.times < AS_ASKED * self.feed, self.feed / feed_scale, self.times)
        if rapid_scale < 1.0:
            each = np.maximum(each, self.rapid / rapid_scale)
        left = np.append(0.0, np.cumsum(each[::-1]))
        return float(np.interp(to_go, self.to_go[::-1], left))


@dataclass(frozen=True)
class ProgramCheck:
    """A program that keeps inside the workspace from its begin to its end.

    Attributes:
        duration: without the time for which it waits for somebody [s].
        durations: of each step. Shape (n,) [s].
        length: of the way driven [m].
        timed: the motion of each step that is a path; None for the others.
        is_shaped: whether there is a shaper; the durations leave out what it takes in bends.
    """

    duration: float
    durations: tuple[float, ...]
    length: float
    timed: tuple[TimedWay | None, ...]
    is_shaped: bool = False


def check_program(
    program: Work,
    workspace: Workspace,
    limits: SliderLimits,
    shaper: Shaping | None = None,
    tell_part: TellPart = tell_nobody,
) -> ProgramCheck:
    """Prove that all of a program is inside the workspace, and find out how long it takes.

    It is timed as a ``MotionEngine`` drives it, path by path. With a ``shaper`` the path is the one
    that is driven with it, and at each stop it has its time to become empty; it is left out that
    the platform is slower in bends for its sake. ``tell_part`` gets which part is done, about.

    Raises:
        ProgramError: if a place of it is not inside, or no motion keeps the limits; it names the
            line.
    """
    durations: list[float] = []
    timed: list[TimedWay | None] = []
    length, done = 0.0, 0
    segments = sum(len(run.segments) for step in program.steps for run in step.runs)
    for step in program.steps:
        duration, way = step.rest, None
        for run in step.runs:
            with program.located(run):
                work = _timed(run, workspace, limits, shaper)
                way = _watched(work, (done, len(run.segments), segments), tell_part)
            duration = float(way.times.sum())
            length += float(way.to_go[0])
            done += len(run.segments)
        durations.append(duration)
        timed.append(way)
    total = sum(durations)
    return ProgramCheck(total, tuple(durations), length, tuple(timed), shaper is not None)


def _watched(
    work: Interruptible[TimedWay], share: tuple[int, int, int], tell_part: TellPart
) -> TimedWay:
    """Return the result of a ``work`` along a path, of which nobody knows how much it will be.

    The ``share`` of the path: segments before it, its own, and those of the whole program.
    """
    done, count, whole = share
    likely = _PIECES + _PIECES_OF_SEGMENT * count
    for pieces in itertools.count(1):
        try:
            next(work)
        except StopIteration as end:
            result: TimedWay = end.value
            break
        tell_part((done + count * math.tanh(1.5 * pieces / likely)) / whole)
    return result


def _timed(
    run: PathRun, workspace: Workspace, limits: SliderLimits, shaper: Shaping | None
) -> Interruptible[TimedWay]:
    """Return when the platform is where on a path."""
    path = yield from run.segments.path_from(run.start)
    planner = PathPlanner(workspace)
    heights = yield from planner.begun(path, limits, shaper)
    places, times = yield from planner.timed(heights, limits)
    driven = heights.driven
    if shaper is not None:
        stops = np.searchsorted(driven.stops[1:], places, "right")
        times = times + stops * shaper.covering(driven.places()).duration
    ways = driven.ways(places)
    asked = driven.speed_limits(0.5 * (places[1:] + places[:-1]))
    steps = np.diff(ways)
    rapid = np.where(np.isinf(asked), steps / max(limits.velocity), 0.0)
    return TimedWay(driven.arc_length.total - ways, np.diff(times), steps / asked, rapid)


class NoMotionError(FileError):
    """A file has no motion, or one that begins nobody knows where."""


@dataclass(frozen=True, eq=False)
class TimedSteps:
    """The motion of all steps, one after the other; nobody is waited for.

    Attributes:
        trajectory: of all of it.
        steps: in their order.
        begins: of each step, and the end of the last. Shape (n + 1,) [s].
    """

    trajectory: Trajectory
    steps: tuple[Step, ...]
    begins: tuple[float, ...]


def time_steps(
    work: Work,
    workspace: Workspace,
    limits: SliderLimits,
    *,
    kind: MotionKind = MotionKind.SLIDER,
    shaper: Shaping | None = None,
) -> TimedSteps:
    """Return the motion of a program, of points, or of a drive file.

    It is the motion of a ``MotionEngine`` without the time for which a machine settles, or waits
    for somebody: outputs and stops take no time.

    Args:
        work: what is driven. A drive file begins where its first move ends.
        workspace: where the platform may be, and of which machine.
        limits: of the sliders.
        kind: of the moves of a drive file that have no speed.
        shaper: for the modes of vibration that the motion is to leave alone; None without one.

    Raises:
        NoMotionError: if nothing moves, or a drive file begins with a path.
        ProgramError: if a place of a program is outside the workspace, or no motion keeps the
            limits; it names the line.
        KinematicsError: likewise for a drive file.
    """
    timing = _Timing(work.file, workspace, limits, kind, shaper)
    begins = [0.0]
    for step in work.steps:
        with work.located(step):
            step.read_by(timing)
        begins.append(timing.duration)
    if not timing.plans:
        raise NoMotionError(work.file, "", "nothing in it moves")
    return TimedSteps(SequencePlan(timing.plans), work.steps, tuple(begins))


class _Timing:
    """Puts one plan behind the other."""

    def __init__(
        self,
        file: str,
        workspace: Workspace,
        limits: SliderLimits,
        kind: MotionKind,
        shaper: Shaping | None,
    ) -> None:
        self._file = file
        self._workspace = workspace
        self._limits = limits
        self._kind = kind
        self._shaper = shaper
        self._here: Vector3 | None = None
        self._rest_before = 0.0
        self.plans: list[Trajectory] = []
        self.duration = 0.0

    def dwell(self, step: Dwell) -> None:
        """Put a rest behind the others."""
        if self.plans:
            last = self.plans[-1]
            self._add(_rest(last.at(last.duration), step.duration))
        else:
            # The place of this rest is known only when the machine moves.
            self._rest_before += step.duration
            self.duration += step.duration

    def put_out(self, step: Output) -> None:
        """Outputs take no time."""

    def stop_for(self, step: ProgramStop) -> None:
        """Nobody is waited for."""

    def follow(self, step: PathStep | PathRun) -> None:
        """Put the motion along a path behind the others."""
        start = step.needed_place or self._here
        if start is None:
            reason = "it begins with a path from where the platform is, which is not known here"
            raise NoMotionError(self._file, "", f"{reason}: put a move before it")
        self._along(step.segments, start)

    def _along(self, segments: FlatPath, start: Vector3) -> None:
        path = at_once(segments.path_from(start))
        self._add(time_path(path, self._workspace, self._limits, self._shaper))
        self._here = path.end

    def move(self, step: MoveStep) -> None:
        """Put a move behind the others."""
        here, self._here = self._here, step.position
        if here is None or here == step.position:
            self._workspace.check_position(step.position)
            return
        if step.speed > 0.0:
            line = FlatPath.of((SegmentKind.LINE,), step.position, (0.0,), (step.speed,), 0.0)
            self._along(line, here)
            return
        kind, shaper = self._kind, self._shaper
        self._add(
            plan_move(self._workspace, self._limits, here, step.position, kind=kind, shaper=shaper)
        )

    def _add(self, plan: Trajectory) -> None:
        if not self.plans:
            self.plans.append(_rest(plan.at(0.0), self._rest_before))
        self.plans.append(plan)
        self.duration += plan.duration


def _rest(state: SliderState, duration: float) -> Trajectory:
    """Return a rest where a ``state`` is, for a time [s]."""
    at_rest = SliderState(state.heights, AT_REST, AT_REST)
    return CubicPlan(at_rest, (((duration, 0.0),),) * 3 if duration > 0.0 else ((),) * 3)


# How long a program still takes: by its check, the overrides, and what was driven so far.

# What was driven counts against what was told of it with so much time that was as told [s].
AS_TOLD = 5.0
# Where so many times the time that passes is gained, something was skipped, or waited for.
MOST_GAINED = 4.0


class Scales(NamedTuple):
    """By what the speeds of a program are multiplied.

    Attributes:
        feed: of F.
        rapid: of the largest velocity, where no F holds; 1 is for no such bound.
    """

    feed: float = 1.0
    rapid: float = 1.0


class TimeLeft:
    """The time that is left of a program."""

    def __init__(self, program: Program, check: ProgramCheck) -> None:
        """Take a ``program`` that was checked."""
        self._steps, self._check = program.steps, check
        self._ends = np.array([step.line_at(-1) for step in program.steps])
        self._begins = np.array([step.line_at() for step in program.steps])
        # When it was looked at, with which scales, and what was left then; and how long the
        # platform was driven since the first look, in fact and as told [s].
        self._last: tuple[float, Scales, float] | None = None
        self._driven = self._told = 0.0

    def at(self, line: int, way: float, scales: Scales) -> float:
        """Return how long it takes from a ``line`` on, waiting for nobody [s].

        ``way`` is what is left of the present path [m]; NaN if that is not known.
        """
        first = int(np.searchsorted(self._ends, line))
        last = int(np.searchsorted(self._begins, line, "right"))
        left = float(self._behind(scales)[max(first, last)])
        for index in range(first, last):
            timed = self._check.timed[index]
            if timed is None:
                left += self._check.durations[index]
                continue
            to_go = float(timed.to_go[0])
            if math.isfinite(way):
                to_go = min(way, to_go)
            else:
                (run,) = self._steps[index].runs
                behind = len(run.lines) - int(np.searchsorted(run.lines, line))
                to_go *= behind / len(run.lines)
            left += timed.left(to_go, *scales)
        return left

    @lru_cache(maxsize=2)  # noqa: B019
    def _behind(self, scales: Scales) -> FloatArray:
        """Return how long each step and all behind it take, and 0 at the end. Shape (n + 1,)."""
        each = [
            duration if timed is None else timed.left(float(timed.to_go[0]), *scales)
            for timed, duration in zip(self._check.timed, self._check.durations)
        ]
        return np.append(np.cumsum(each[::-1])[::-1], 0.0)

    def look(self, now: float, line: int, way: float, scales: Scales) -> float:
        """Return the same, corrected by how long it has taken so far; called again and again.

        Args:
            now: of any clock [s].
            line: that is driven.
            way: as for ``at``.
            scales: in force.
        """
        left = self.at(line, way, scales)
        if self._last is not None and self._last[1] == scales:
            passed, gained = now - self._last[0], self._last[2] - left
            # A platform that is paused, or on its way to the start, gains nothing.
            if 0.0 < gained < MOST_GAINED * passed:
                self._driven += passed
                self._told += gained
        self._last = now, scales, left
        return left * (self._driven + AS_TOLD) / (self._told + AS_TOLD)
