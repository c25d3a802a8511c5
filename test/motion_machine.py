"""An engine for the default machine, and what its tests look at."""

from __future__ import annotations

import numpy as np
import pytest
from strategies import DEFAULT_LIMITS

from tri_glide_kinematics.motion import (
    CommandStream,
    LimitUse,
    MotionEngine,
    MotionKind,
    MotionPhase,
    SliderLimits,
)
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind
from tri_glide_kinematics.motion.trajectory import ruckig_planner
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

DT = 0.001
LIMITS = SliderLimits.uniform(1.0, 10.0, 200.0)
MACHINE = TriGlide(DEFAULT_GEOMETRY)
WORKSPACE = Workspace(MACHINE, DEFAULT_LIMITS)
HOME = (0.6, 0.6, 0.6)

# Where tests move to [m].
TARGET = (0.1, 0.05, 0.35)
OTHER = (-0.08, 0.06, 0.25)

# For a mode of a belt-driven machine.
SHAPER = Shaper.of(ShaperKind.EI, Mode(15.0, 0.03))

KINDS = tuple(MotionKind)
each_kind = pytest.mark.parametrize("kind", KINDS)


# Ruckig 0.9.2, of the ROS index, plans no longer motions [s].
LONGEST_OF_OLD_RUCKIG = 7600.0


def skip_if_too_long_for_ruckig(duration: float) -> None:
    """Leave out what lasts for some ``duration`` [s], if this ruckig plans nothing so long."""
    is_old = ruckig_planner.Ruckig.__module__ == "tri_glide_ruckig"
    if is_old and duration > LONGEST_OF_OLD_RUCKIG:
        pytest.skip(f"ruckig 0.9.2 plans no motion longer than {LONGEST_OF_OLD_RUCKIG} s")


def engine(
    kind: MotionKind = MotionKind.SLIDER,
    limits: SliderLimits = LIMITS,
    workspace_limits: WorkspaceLimits = DEFAULT_LIMITS,
    heights=HOME,
    **options,
) -> MotionEngine:
    """Return an engine that rests at ``heights``."""
    started = MotionEngine(Workspace(MACHINE, workspace_limits), limits, kind=kind, **options)
    started.start(heights)
    return started


def run(moving: MotionEngine, seconds: float) -> FloatArray:
    """Step an engine; return the heights, the first of them before the first step."""
    rows = [moving.state.heights]
    rows += [moving.step(DT).heights for _ in range(round(seconds / DT))]
    return np.array(rows)


def run_to_rest(moving: MotionEngine, longest: float = 60.0) -> FloatArray:
    """Step an engine until it is idle; return the heights."""
    rows = [moving.state.heights]
    while moving.phase is not MotionPhase.IDLE:
        rows.append(moving.step(DT).heights)
        assert len(rows) < longest / DT, "never came to rest"
    return np.array(rows)


def driven(moving: MotionEngine, most: int = 5000) -> FloatArray:
    """Return the heights until the engine is idle; what it prepares is made in each step."""
    heights = [moving.state.heights]
    for _ in range(most):
        if moving.phase is MotionPhase.IDLE:
            return np.array(heights)
        heights.append(moving.step(DT).heights)
        moving.work(lambda: True)
    raise AssertionError("it does not come to rest")


def assert_keeps(heights, limits: SliderLimits = LIMITS) -> None:
    """Judge a stream at 1 kHz by its differences."""
    stream = CommandStream.from_heights(heights, DT)
    seen = (stream.velocities, stream.accelerations, stream.jerks)
    for values, bound, slack in zip(seen, limits.table, (1e-6, 1e-6, 1e-3)):
        assert (np.abs(values).max(axis=0) <= bound * (1.0 + slack)).all()


def limit_use(heights: FloatArray, limits: SliderLimits = LIMITS) -> LimitUse:
    """Compare the differences of ``heights`` with ``limits``."""
    return LimitUse.of(CommandStream.from_heights(heights, DT), limits)


def peaks(heights: FloatArray) -> FloatArray:
    """Return the largest velocity, acceleration and jerk of any slider, by differences."""
    return limit_use(heights, SliderLimits.uniform(1.0, 1.0, 1.0)).largest


def within(heights: FloatArray, limits: SliderLimits = LIMITS) -> bool:
    """Return whether all sliders keep their limits, by differences."""
    return limit_use(heights, limits).is_within


def place(moving: MotionEngine) -> FloatArray:
    """Return where the platform is [m]."""
    return np.array(MACHINE.forward(moving.state.heights))


def platform_velocity(moving: MotionEngine) -> FloatArray:
    """Return the velocity of the platform [m/s]."""
    state = moving.state
    return np.array(MACHINE.forward_velocity(state.heights, state.velocities)[1])
