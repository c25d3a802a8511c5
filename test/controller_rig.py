"""A controller with the real engine and a clock of our own: no process, no waiting."""

from functools import partial

# What tests of controllers need, too, they find here.
from testing.controllers import (  # noqa: F401
    IN_POSITION,
    LOWER,
    MEASURED_TIMEOUT,
    PERIOD,
    TARGET_TIMEOUT,
    TWIST_TIMEOUT,
    UPPER,
    controller_of,
    supervisor,
)
from tri_glide_kinematics.motion import MotionEngine, MotionKind, SliderLimits
from tri_glide_kinematics.motion.limit_use import CommandStream, LimitUse
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

HOME = (0.6, 0.6, 0.6)
MACHINE = TriGlide(DEFAULT_GEOMETRY)
LIMITS = SliderLimits.uniform(1.0, 10.0, 200.0)
TARGET = (0.05, 0.03, 0.3)


def engine(kind=MotionKind.SLIDER, in_pieces=False):
    workspace = Workspace(MACHINE, WorkspaceLimits(LOWER, UPPER, 0.005, 6.0))
    return MotionEngine(workspace, LIMITS, kind=kind, in_pieces=in_pieces)


class Rig:
    """A controller with a machine that follows perfectly, or is told not to."""

    def __init__(
        self, start_disabled=False, start=HOME, kind=MotionKind.SLIDER, *, in_pieces=False
    ):
        self.now = 100.0
        self.statuses = []
        self.refusals = []
        self.measures = True
        self.pieces = 1  # of planning in a cycle, after the setpoint
        self.offset = 0.0  # m, of the first slider from its command
        self.heights = start
        self.engine = engine(kind, in_pieces)
        self.controller = controller_of(
            self.engine,
            self.statuses.append,
            lambda text, refusal: self.refusals.append(text),
            start_disabled=start_disabled,
        )

    @property
    def measured(self):
        return (self.heights[0] + self.offset, *self.heights[1:])

    @property
    def changes(self):
        return [(status.state, status.reason.text) for status in self.statuses]

    def cycle(self, count=1):
        setpoint = None
        for _ in range(count):
            self.now += PERIOD
            setpoint = self.controller.cycle(self.now, lambda: False)
            if setpoint is not None:
                self.heights = setpoint.heights
            if self.measures:
                self.controller.measured(self.measured, self.now)
            self.controller.plan(partial(next, iter([True] * (self.pieces - 1)), False))
        return setpoint

    def cycle_until(self, state, most=5000):
        for _ in range(most):
            if self.controller.state is state:
                return
            self.cycle()
        raise AssertionError(f"{state} did not come, it is {self.controller.state}")

    def jog(self, velocity=(0.0, 0.0, 0.05)):
        self.controller.jog(velocity, self.now)

    @property
    def states(self):
        return [state for state, _ in self.changes]


def violations_of(heights):
    """Return how setpoints pass the limits of the sliders, by differences."""
    return LimitUse.of(CommandStream.from_heights(heights, PERIOD), LIMITS).violations()


def ended(rig, goal, most=5000):
    """Return the outcome of a goal, which comes in a number of cycles."""
    for _ in range(most):
        if goal.outcome is not None:
            return goal.outcome
        rig.cycle()
    raise AssertionError(f"no end of {goal} in {most} cycles")
