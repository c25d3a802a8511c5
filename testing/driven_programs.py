"""Programs driven by a controller with its engine; the path and the outputs are judged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from testing import path_samples
from testing.controllers import LOWER, PERIOD, UPPER, controller_of
from testing.program_writer import PLANES, Piece, WrittenProgram
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import MotionEngine, MotionKind, SliderLimits
from tri_glide_kinematics.motion.engine import Follow, PathOutputs
from tri_glide_kinematics.motion.limit_use import CommandStream, LimitUse
from tri_glide_kinematics.motion.shaping import Shaper
from tri_glide_kinematics.programs import Output, PathRun, read_program
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

LIMITS = SliderLimits.uniform(1.0, 10.0, 200.0)
MACHINE = TriGlide(DEFAULT_GEOMETRY)
WORKSPACE = Workspace(MACHINE, WorkspaceLimits(LOWER, UPPER, 0.005, 6.0))

# Where the setpoint is nearest to the place of an output is looked for in so many cycles around.
AROUND = 60
# Of setpoints that are equally near but for rounding the first counts [m].
SAME = 1e-12
# The distance from the path as programmed is found for each of so many setpoints.
EACH = 4


@dataclass
class DrivenProgram:
    """What was found when a program was driven.

    Attributes:
        runs: paths that were driven.
        refused: paths that were refused, as they leave the workspace.
        cycles: setpoints.
        outputs: that were told on the way.
        missing: outputs that should have been told and were not, or in another order.
        farthest: by how many cycles an output was told too early or too late at most.
        distance: largest one from the path as programmed, in parts of the tolerance.
        use: largest velocity, acceleration and jerk by differences, in parts of the limits.
    """

    runs: int = 0
    refused: int = 0
    cycles: int = 0
    outputs: int = 0
    missing: int = 0
    farthest: int = 0
    distance: float = 0.0
    use: float = 0.0

    def add(self, other: DrivenProgram) -> None:
        """Take in what was found of another program."""
        for name in ("runs", "refused", "cycles", "outputs", "missing"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        for name in ("farthest", "distance", "use"):
            setattr(self, name, max(getattr(self, name), getattr(other, name)))


def drive_program(
    written: WrittenProgram, rng: np.random.Generator, shaper: Shaper | None = None
) -> DrivenProgram:
    """Drive each path of a program, with the speed override changed at random meanwhile."""
    found = DrivenProgram()
    pieces = iter([_sample(each) for each in written.meant if isinstance(each, Piece)])
    steps = read_program(written.text, written.settings).steps
    for run in (run for step in steps for run in step.runs):
        own = [next(pieces) for _ in range(len(run.segments))]
        try:
            _drive_run(run, own, rng, shaper, found)
        except KinematicsError:
            found.refused += 1
    return found


def _sample(piece: Piece) -> path_samples.Piece:
    """Return a piece of a program as one whose distances are known."""
    if not piece.plane:
        return path_samples.Piece(piece.start, piece.end, piece.tolerance)
    along = PLANES[piece.plane][2]
    rise = float(piece.end[along] - piece.start[along])
    bounds = piece.start, piece.end, piece.tolerance
    return path_samples.Piece(*bounds, piece.centre, np.eye(3)[along], piece.angle, rise)


def _drive_run(
    run: PathRun,
    pieces: list[path_samples.Piece],
    rng: np.random.Generator,
    shaper: Shaper | None,
    found: DrivenProgram,
) -> None:
    path = at_once(run.segments.path_from(run.start))
    engine = MotionEngine(WORKSPACE, LIMITS, kind=MotionKind.LINEAR, in_pieces=True)
    engine.set_shaper(shaper)
    refusals: list[str] = []
    controller = controller_of(engine, on_refusal=lambda text, refusal: refusals.append(text))
    now = 0.0
    controller.measured(WORKSPACE.check_position(run.start), now)
    # One at each joint besides those of the program.
    more = [Output("pin", joint, 1.0, 0, joint) for joint in range(1, len(run.segments))]
    expected = sorted([*run.outputs, *more], key=lambda each: each.joint)
    outputs = PathOutputs([each.joint for each in expected], expected, len(run.segments))
    goal = controller.pursue(Follow(path, outputs=outputs))
    heights, told = [], []
    scale = 1.0
    while goal.outcome is None:
        now += PERIOD
        setpoint = controller.cycle(now, lambda: True)
        assert setpoint is not None
        heights.append(setpoint.heights)
        told += [(len(heights) - 1, output) for output in controller.passed_outputs]
        controller.passed_outputs.clear()
        controller.measured(setpoint.heights, now)
        controller.plan(lambda: True)
        if rng.random() < 0.005:
            scale = float(rng.choice((0.5, 0.8, 1.0, 1.5, 2.0)))
            controller.set_limits(LIMITS, 1.0, scale)
    if refusals:
        found.refused += 1
        return
    found.runs += 1
    found.cycles += len(heights)
    places = MACHINE.forward_batch(np.array(heights))
    stream = CommandStream.from_heights(np.array(heights), PERIOD)
    found.use = max(found.use, float(np.max(LimitUse.of(stream, LIMITS).largest)))
    part = path_samples.largest_part(path, pieces, places[::EACH])
    found.distance = max(found.distance, part)
    found.missing += [output for _, output in told] != expected
    found.outputs += len(told)
    driven = engine.driven_path
    assert driven is not None
    for cycle, output in told:
        there = driven.derivatives(driven.joints[[output.joint]], 0)[0, 0]
        found.farthest = max(found.farthest, abs(_nearest(places, there, cycle) - cycle))


def _nearest(places: FloatArray, there: FloatArray, cycle: int) -> int:
    """Return the first cycle, of some around, in which the platform is nearest to a place."""
    first = max(cycle - AROUND, 0)
    away = np.linalg.norm(places[first : cycle + AROUND] - there, axis=1)
    return first + int((away <= away.min() + SAME).argmax())
