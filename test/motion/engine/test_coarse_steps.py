"""Steps of any length: the same motion comes out, and no limit is broken between its plans."""

from __future__ import annotations

import math

import numpy as np
import pytest
from motion_machine import (
    DT,
    MACHINE,
    START,
    RecordedEngine,
    assert_rests_at,
    beside,
    engine,
    more,
    path_beside,
)

from tri_glide_kinematics.motion import MotionPhase, PlatformPath, SliderLimits

RADIUS = 0.04
STIFF = SliderLimits.uniform(1.0, 10.0, 5000.0)
# Times at which two motions are compared are the same but for rounding [s].
SAME_TIME = 1e-9


def circle() -> PlatformPath:
    """Return a circle, which is planned in some 15 windows."""
    begin = PlatformPath.start(START)
    return begin.arc_about(beside(-RADIUS), (0.0, 0.0, 1.0), 2.0 * math.pi)


def square() -> PlatformPath:
    """Return a square with rounded corners."""
    corners = [(0.0, 0.0), (0.04, 0.0), (0.04, 0.04), (0.0, 0.04), (0.0, 0.0)]
    return path_beside(*corners, tolerance=0.001)


def lengths(step: float | None):
    """Yield how long each step is [s]: from 0.1 to 50 ms without a ``step``."""
    rng = np.random.default_rng(3)
    while True:
        yield 10.0 ** rng.uniform(-4.0, -1.3) if step is None else step


def driven(path: PlatformPath, steps, pieces: int = 0) -> RecordedEngine:
    """Return an engine that has followed a path to its rest."""
    moving = engine(limits=STIFF, in_pieces=pieces > 0)
    moving.follow(path)
    while moving.phase is not MotionPhase.IDLE or moving.preparing:
        moving.step(next(steps))
        if pieces:
            moving.work(more(pieces))
        assert len(moving.states) < 50_000, "never came to rest"
    return moving


@pytest.fixture(scope="module")
def fine() -> dict:
    """Return an engine that has driven each path in fine steps."""
    return {path: driven(path(), lengths(DT)) for path in (circle, square)}


@pytest.mark.parametrize(
    ("path", "step"), [*((circle, step) for step in (0.02, 0.004, 0.05, 0.3, None)), (square, 0.05)]
)
def test_a_path_is_the_same_motion_whatever_the_steps_are(path, step, fine):
    """Plans are made within ``step``, so each begins where and when the one before says."""
    moving = driven(path(), lengths(step))
    assert moving.kept_limits
    times = np.cumsum(moving.periods[1:])
    fine_heights = fine[path].heights_since()
    at = np.round(times / DT).astype(int)
    common = (np.abs(at * DT - times) < SAME_TIME) & (at < len(fine_heights))
    if step is not None:
        assert common.any()
        heights = moving.heights_since(1)
        np.testing.assert_allclose(heights[common], fine_heights[at[common]], atol=1e-12)
    assert -DT < times[-1] - sum(fine[path].periods[1:]) < moving.periods[-1]


@pytest.mark.parametrize("step", [0.02, 0.05, None])
@pytest.mark.parametrize("pieces", [4, 1000])
def test_a_path_in_pieces_keeps_the_limits_whatever_the_steps_are(step, pieces):
    assert_rests_at(driven(circle(), lengths(step), pieces), START)


@pytest.mark.parametrize("velocity", [0.8, 0.9, 0.97])
def test_what_is_tried_again_in_a_step_begins_there(velocity):
    """New limits that wait are tried again in a step; the plan is ready only after it."""
    moving = engine(limits=STIFF, heights=MACHINE.inverse((0.0, 0.0, 0.1)), in_pieces=True)
    moving.move_to((0.0, 0.0, 0.45))
    moving.work(lambda: True)
    while moving.phase is not MotionPhase.IDLE:
        if len(moving.states) == 9:
            assert max(map(abs, moving.state.velocities)) == pytest.approx(1.0)
            moving.set_limits(SliderLimits.uniform(velocity, 10.0, 5000.0))
            moving.work(lambda: True)
        moving.step(0.02)
        moving.work(lambda: True)
    assert moving.kept_limits
