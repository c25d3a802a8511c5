"""The proof of a whole program before it is driven: inside the workspace, and how long it takes."""

from __future__ import annotations

from dataclasses import dataclass

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible, at_once
from tri_glide_kinematics.motion.errors import CutBendError, PathTimingError
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.path import PathPlaceError, SegmentError
from tri_glide_kinematics.motion.path_timing import PathPlanner
from tri_glide_kinematics.motion.shaping import Shaping
from tri_glide_kinematics.programs.program import PathRun, Program, Step
from tri_glide_kinematics.programs.words import ProgramError
from tri_glide_kinematics.workspace import Workspace


@dataclass(frozen=True)
class ProgramCheck:
    """A program that keeps inside the workspace from its begin to its end.

    Attributes:
        duration: without the time for which it waits for somebody [s].
        durations: of each step. Shape (n,) [s].
        length: of the way driven [m].
        is_shaped: whether there is a shaper; the durations leave out what it takes in bends.
    """

    duration: float
    durations: tuple[float, ...]
    length: float
    is_shaped: bool = False


def check_program(
    program: Program,
    workspace: Workspace,
    limits: SliderLimits,
    shaper: Shaping | None = None,
) -> ProgramCheck:
    """Prove that all of a program is inside the workspace, and find out how long it takes.

    It is timed as a ``MotionEngine`` drives it, path by path. With a ``shaper`` the path is the one
    that is driven with it, and at each stop it has its time to become empty; it is left out that
    the platform is slower in bends for its sake.

    Raises:
        ProgramError: if a place of it is not inside, or no motion keeps the limits; it names the
            line.
    """
    durations = []
    length = 0.0
    for step in program.steps:
        duration = step.rest
        for run in step.runs:
            try:
                duration, way = at_once(_timed(run, workspace, limits, shaper))
            except KinematicsError as error:
                raise at_its_line(program, run, error) from error
            length += way
        durations.append(duration)
    return ProgramCheck(sum(durations), tuple(durations), length, shaper is not None)


def _timed(
    run: PathRun, workspace: Workspace, limits: SliderLimits, shaper: Shaping | None
) -> Interruptible[tuple[float, float]]:
    """Return how long a path takes [s], and how long its way is [m]."""
    path = yield from run.segments.path_from(run.start)
    planner = PathPlanner(workspace)
    heights = yield from planner.begun(path, limits, shaper)
    duration = yield from planner.duration(heights, limits)
    driven = heights.driven
    if shaper is not None:
        duration += (len(driven.stops) - 1) * shaper.covering(driven.places()).duration
    return duration, driven.arc_length.total


def at_its_line(program: Program, step: Step, error: KinematicsError) -> ProgramError:
    """Return an ``error`` about a step as one about a line of the program."""
    segment = 0
    if isinstance(error, (CutBendError, PathPlaceError, PathTimingError, SegmentError)):
        segment = error.segment
    return ProgramError(program.file, step.line_at(segment), 0, "", str(error))
