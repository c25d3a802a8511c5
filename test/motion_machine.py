"""An engine for the default machine, and what its tests look at."""

import math
import random
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from strategies import DEFAULT_LIMITS

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import (
    CommandStream,
    LimitUse,
    MotionEngine,
    MotionKind,
    MotionPhase,
    PlatformPath,
    SliderLimits,
    SliderState,
)
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind, Shaping
from tri_glide_kinematics.motion.trajectory import ruckig_planner
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.workspace import Cylinder, Workspace, WorkspaceLimits

# How long a step takes, and one where that would be too coarse [s].
DT, FINE = 0.002, 0.001
LIMITS = SliderLimits.uniform(1.0, 10.0, 200.0)
MACHINE = TriGlide(DEFAULT_GEOMETRY)
WORKSPACE = Workspace(MACHINE, DEFAULT_LIMITS)
BOX = {"box_lower": (-0.1, -0.12, 0.05), "box_upper": (0.11, 0.1, 0.4)}
# Such as are smaller, each for another reason.
WORKSPACES = {
    name: Workspace(MACHINE, replace(DEFAULT_LIMITS, **change))
    for name, change in {
        "travel": {"lower_heights": (0.45,) * 3, "upper_heights": (0.75,) * 3},
        "conditioning": {"max_condition_number": 3.0},
        "box": BOX,
        "cylinder": {"cylinder": Cylinder(0.01, -0.02, 0.11, 0.1, 0.45)},
    }.items()
}
HOME = (0.6, 0.6, 0.6)
START = MACHINE.forward(HOME)

# Where tests move to [m].
TARGET = (0.1, 0.05, 0.35)
OTHER = (-0.08, 0.06, 0.25)

# For a mode of a belt-driven machine.
SHAPER = Shaper.of(ShaperKind.EI, Mode(15.0, 0.03))

KINDS = tuple(MotionKind)
each_kind = pytest.mark.parametrize("kind", KINDS)
# With plans within commands, and in pieces.
each_mode = pytest.mark.parametrize("in_pieces", [False, True])

# Of planning in a step, about a millisecond.
PIECES = 20


# Ruckig 0.9.2, of the ROS index, plans no longer motions [s].
LONGEST_OF_OLD_RUCKIG = 7600.0


def skip_if_too_long_for_ruckig(duration: float) -> None:
    """Leave out what lasts for some ``duration`` [s], if this ruckig plans nothing so long."""
    is_old = ruckig_planner.ruckig.__name__ == "tri_glide_ruckig"
    if is_old and duration > LONGEST_OF_OLD_RUCKIG:
        pytest.skip(f"ruckig 0.9.2 plans no motion longer than {LONGEST_OF_OLD_RUCKIG} s")


class RecordedEngine(MotionEngine):
    """An engine that keeps where it was since its start.

    Attributes:
        states: the setpoints, the first of them before the first step.
        periods: how long each step was; of the first setpoint it means nothing [s].
        first_limits: those it was made with.
        period: how long the steps are that :func:`run` makes [s].
    """

    period = DT

    def __init__(self, workspace: Workspace, limits: SliderLimits, **options) -> None:
        super().__init__(workspace, limits, **options)
        self.first_limits = limits

    def start(self, heights) -> None:
        super().start(heights)
        self.states = [self.state]
        self.periods = [DT]

    def step(self, dt: float) -> SliderState:
        state = super().step(dt)
        self.states.append(state)
        self.periods.append(dt)
        return state

    def heights_since(self, first: int = 0) -> FloatArray:
        """Return the heights from that setpoint on. Shape (n, 3) [m]."""
        return np.array([state.heights for state in self.states[first:]])

    def places_since(self, first: int = 0) -> FloatArray:
        """Return where the platform was from that setpoint on. Shape (n, 3) [m]."""
        return self.machine.forward_batch(self.heights_since(first))

    def limit_use(self, limits: SliderLimits, first: int = 0) -> LimitUse:
        """Compare the differences of all from that setpoint on with ``limits``."""
        stream = CommandStream.from_heights(self.heights_since(first), self.periods[first:])
        return LimitUse.of(stream, limits)

    @property
    def kept_limits(self) -> bool:
        """Whether all setpoints kept the limits it was made with, by their differences."""
        return self.limit_use(self.first_limits).is_within


def engine(
    kind: MotionKind = MotionKind.SLIDER,
    limits: SliderLimits = LIMITS,
    workspace_limits: WorkspaceLimits = DEFAULT_LIMITS,
    heights=HOME,
    period: float = DT,
    shaper: Shaping | None = None,
    **options,
) -> RecordedEngine:
    """Return an engine that rests at ``heights``, with a ``shaper`` in force."""
    started = RecordedEngine(Workspace(MACHINE, workspace_limits), limits, kind=kind, **options)
    started.period = period
    started.start(heights)
    started.set_shaper(shaper)
    return started


def more(pieces: float) -> Callable[[], bool]:
    """Return what lets so many more pieces of work be done; as many as there are by inf."""
    if pieces == math.inf:
        return lambda: True
    left = iter(range(int(pieces)))
    return lambda: next(left, None) is not None


def run(moving: RecordedEngine, seconds: float, pieces: float = PIECES) -> FloatArray:
    """Step an engine, with some planning in each step; return the heights from before that on."""
    first = len(moving.states) - 1
    for _ in range(round(seconds / moving.period)):
        moving.step(moving.period)
        if pieces:
            moving.work(more(pieces - 1))
    return moving.heights_since(first)


def under_way(
    target, seconds: float, *of_engine, pieces: float = PIECES, **options
) -> RecordedEngine:
    """Return an engine that has been on its way to a ``target`` for some ``seconds``."""
    moving = engine(*of_engine, **options)
    moving.move_to(target)
    run(moving, seconds, pieces)
    return moving


def run_to_rest(
    moving: RecordedEngine, longest: float = 60.0, pieces: float = PIECES
) -> FloatArray:
    """Step an engine until it is idle, or paused; return the heights from before that on."""
    first = len(moving.states) - 1
    while moving.preparing or moving.phase not in (MotionPhase.IDLE, MotionPhase.PAUSED):
        run(moving, moving.period, pieces)
        assert (len(moving.states) - first) * moving.period < longest, "never came to rest"
    return moving.heights_since(first)


def stormed(moving: RecordedEngine, seconds: float, seed: int, shapers) -> list:
    """Step an engine with commands at random; return the shaper in force before and after each."""
    rng = random.Random(seed)
    commands = (
        lambda: moving.move_to(
            [rng.uniform(*pair) for pair in ((-0.1, 0.1), (-0.1, 0.1), (0.2, 0.36))]
        ),
        lambda: moving.jog([rng.uniform(-0.4, 0.4) for _ in range(3)]),
        moving.stop,
        lambda: moving.set_speed_scale(rng.choice((0.2, 0.6, 1.0))),
        lambda: moving.set_shaper(rng.choice(shapers)),
    )
    found = [moving.shaper]
    for _ in range(round(seconds / moving.period)):
        if rng.random() < 12.0 * moving.period:
            with suppress(KinematicsError):
                rng.choices(commands, (5, 3, 2, 1, 1))[0]()
        run(moving, moving.period, pieces=21)
        found.append(moving.shaper)
    return found


def assert_rests_at(moving: RecordedEngine, target, near: float = 1e-9) -> None:
    """Judge a motion that has ended: where it did, and whether all of it kept the limits."""
    assert moving.phase is MotionPhase.IDLE
    assert place(moving) == pytest.approx(np.array(target), rel=0.0, abs=near)
    assert moving.kept_limits


def beside(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Vector3:
    """Return a place beside the start [m]."""
    return START[0] + x, START[1] + y, START[2] + z


def distance_from_polyline(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Return how far each of the points is from the lines between the corners [m]."""
    begins, ways = corners[:-1], np.diff(corners, axis=0)
    offsets = points[:, np.newaxis] - begins
    parts = np.clip((offsets * ways).sum(axis=2) / (ways * ways).sum(axis=1), 0.0, 1.0)
    return np.linalg.norm(offsets - parts[..., np.newaxis] * ways, axis=2).min(axis=1)


def path_beside(*offsets, tolerance: float = 0.0, speed: float | None = None) -> PlatformPath:
    """Return a polyline through places beside the start."""
    return PlatformPath.through([beside(*offset) for offset in offsets], tolerance, speed)


def limit_use(heights: FloatArray, limits: SliderLimits = LIMITS) -> LimitUse:
    """Compare the differences of ``heights`` with ``limits``."""
    return LimitUse.of(CommandStream.from_heights(heights, DT), limits)


def peaks(heights: FloatArray) -> FloatArray:
    """Return the largest velocity, acceleration and jerk of any slider, by differences."""
    return limit_use(heights, SliderLimits.uniform(1.0, 1.0, 1.0)).largest


def within(heights: FloatArray, limits: SliderLimits = LIMITS) -> bool:
    """Return whether all sliders keep their limits, by differences."""
    return limit_use(heights, limits).is_within


def speeds(heights: FloatArray) -> FloatArray:
    """Return the speed of the platform in each step. Shape (n - 1,) [m/s]."""
    return np.linalg.norm(np.diff(MACHINE.forward_batch(heights), axis=0), axis=1) / DT


def place(moving: MotionEngine) -> FloatArray:
    """Return where the platform is [m]."""
    return np.array(MACHINE.forward(moving.state.heights))


def platform_velocity(moving: MotionEngine) -> FloatArray:
    """Return the velocity of the platform [m/s]."""
    state = moving.state
    return np.array(MACHINE.forward_velocity(state.heights, state.velocities)[1])
