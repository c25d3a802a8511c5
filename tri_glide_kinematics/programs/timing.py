"""The whole motion of a program or a drive file, from one call."""

from __future__ import annotations

from dataclasses import dataclass

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.limits import AT_REST, SliderLimits, SliderState
from tri_glide_kinematics.motion.moves import MotionKind, plan_move
from tri_glide_kinematics.motion.path import FlatPath, PlatformPath, SegmentKind
from tri_glide_kinematics.motion.path_timing import time_path
from tri_glide_kinematics.motion.shaping import Shaping
from tri_glide_kinematics.motion.trajectory import CubicPlan, SequencePlan, Trajectory
from tri_glide_kinematics.programs.check import at_its_line
from tri_glide_kinematics.programs.drive_files import DriveFile, MoveStep, PathStep, Step, WaitStep
from tri_glide_kinematics.programs.program import Dwell, PathRun, Program, ProgramStep
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace


class NoMotionError(KinematicsError):
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
    steps: tuple[Step | ProgramStep, ...]
    begins: tuple[float, ...]


def time_steps(
    work: Program | DriveFile,
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
    timing = _Timing(workspace, limits, kind, shaper)
    begins = [0.0]
    for step in work.steps:
        try:
            timing.add(step)
        except NoMotionError:
            raise
        except KinematicsError as error:
            if isinstance(work, Program) and isinstance(step, PathRun):
                raise at_its_line(work, step, error) from error
            raise
        begins.append(timing.duration)
    if not timing.plans:
        file = f"{work.file}: " if isinstance(work, Program) else ""
        raise NoMotionError(f"{file}nothing in it moves")
    return TimedSteps(SequencePlan(timing.plans), work.steps, tuple(begins))


class _Timing:
    """Puts one plan behind the other."""

    def __init__(
        self,
        workspace: Workspace,
        limits: SliderLimits,
        kind: MotionKind,
        shaper: Shaping | None,
    ) -> None:
        self._workspace = workspace
        self._limits = limits
        self._kind = kind
        self._shaper = shaper
        self._here: Vector3 | None = None
        self._rest_before = 0.0
        self.plans: list[Trajectory] = []
        self.duration = 0.0

    def add(self, step: Step | ProgramStep) -> None:
        """Put the motion of a step behind the others, if it has one."""
        if isinstance(step, (Dwell, WaitStep)):
            self._rest(step.duration)
        elif isinstance(step, PathRun):
            self._follow(step.segments, step.start)
        elif isinstance(step, PathStep):
            if self._here is None:
                raise NoMotionError(
                    "it begins with a path from where the platform is, which is not known here: "
                    "put a move before it"
                )
            self._follow(step.segments, self._here)
        elif isinstance(step, MoveStep):
            self._move(step)

    def _rest(self, duration: float) -> None:
        if self.plans:
            last = self.plans[-1]
            self._add(_rest(last.at(last.duration), duration))
        else:
            # Where it rests is known when it moves.
            self._rest_before += duration
            self.duration += duration

    def _follow(self, segments: FlatPath, start: Vector3) -> None:
        self._along(at_once(segments.path_from(start)))

    def _along(self, path: PlatformPath) -> None:
        self._add(time_path(path, self._workspace, self._limits, self._shaper))
        self._here = path.end

    def _move(self, step: MoveStep) -> None:
        here, self._here = self._here, step.position
        if here is None or here == step.position:
            self._workspace.check_position(step.position)
            return
        if step.speed > 0.0:
            line = FlatPath.of((SegmentKind.LINE,), step.position, (0.0,), (step.speed,), 0.0)
            self._follow(line, here)
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
