"""The motion engine: one step of each kind of motion, and the plan of a whole move."""

from collections.abc import Callable, Iterator
from dataclasses import replace

from ruckig import InputParameter, OutputParameter, Ruckig, Trajectory

from benchmarks.harness import Figure, Work, compare, pinned_to_one_core
from benchmarks.judge import LIMITS, MACHINE
from benchmarks.soak import engine_at
from tri_glide_kinematics.motion import MotionEngine, MotionKind, SliderLimits
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind
from tri_glide_kinematics.vectors import Vector3

START: Vector3 = (-0.06, -0.05, 0.22)  # m
END: Vector3 = (0.07, 0.05, 0.28)  # m
# So slow that a motion outlasts the whole measurement: what is timed are steps under way.
SLOW_LIMITS = SliderLimits.uniform(0.001, 10.0, 200.0)
PERIOD = 2e-5  # s

STEP = "Ruckig.update and pass_to_input"
GOALS = {MotionKind.SLIDER: 2.0, MotionKind.LINEAR: 4.0}
SHAPER = Shaper.of(ShaperKind.EI, Mode(15.0, 0.03))
# How much longer a step with a shaper may take [s].
SHAPED = 3e-6


def figures() -> Iterator[Figure]:
    """Measure one row after the other."""
    with pinned_to_one_core():
        for kind, goal in GOALS.items():
            engine = engine_at(START, SLOW_LIMITS, kind)
            engine.move_to(END)
            yield compare(
                f"motion engine, one step, {kind.value} motion",
                STEP,
                Work(engine.step, PERIOD),
                Work(_bare_step()),
                goal,
            )
            shaped = engine_at(START, SLOW_LIMITS, kind)
            shaped.set_shaper(SHAPER)
            shaped.move_to(END)
            row = compare(
                f"motion engine, one step, {kind.value} motion, EI for a mode of 15 Hz",
                "the same without a shaper",
                Work(shaped.step, PERIOD),
                Work(engine.step, PERIOD),
            )
            yield replace(row, more=SHAPED)
        for kind in GOALS:
            engine = engine_at(START, LIMITS, kind)
            yield compare(
                f"motion engine, a whole move planned and checked, {kind.value} motion",
                "Ruckig.calculate",
                Work(_restarted_move(engine)),
                Work(_bare_plan()),
            )


def _restarted_move(engine: MotionEngine) -> Callable[[], None]:
    """Return the planning of a move from rest."""
    heights = MACHINE.inverse(START)

    def move() -> None:
        engine.start(heights)
        engine.move_to(END)

    return move


def _bare_input(limits: SliderLimits) -> InputParameter:
    given = InputParameter(3)
    given.current_position = list(MACHINE.inverse(START))
    given.target_position = list(MACHINE.inverse(END))
    given.max_velocity = list(limits.velocity)
    given.max_acceleration = list(limits.acceleration)
    given.max_jerk = list(limits.jerk)
    return given


def _bare_step() -> Callable[[], None]:
    """Return one step of the same motion by ruckig alone."""
    generator, result = Ruckig(3, PERIOD), OutputParameter(3)
    given = _bare_input(SLOW_LIMITS)
    update, pass_to_input = generator.update, result.pass_to_input

    def step() -> None:
        update(given, result)
        pass_to_input(given)

    return step


def _bare_plan() -> Callable[[], None]:
    """Return the planning of the same move by ruckig alone."""
    generator, trajectory = Ruckig(3, PERIOD), Trajectory(3)
    given = _bare_input(LIMITS)

    def plan() -> None:
        generator.calculate(given, trajectory)

    return plan
