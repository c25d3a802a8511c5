"""Steps of any length: the same motion comes out, and no limit is broken between its plans."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest
from motion_machine import DT, HOME, MACHINE, engine

from tri_glide_kinematics.motion import (
    CommandStream,
    LimitUse,
    MotionEngine,
    MotionPhase,
    PlatformPath,
    SliderLimits,
)

START = MACHINE.forward(HOME)
RADIUS = 0.04
STIFF = SliderLimits.uniform(1.0, 10.0, 5000.0)
# Times at which two motions are compared are the same but for rounding [s].
SAME_TIME = 1e-9


def circle() -> PlatformPath:
    """Return a circle, which is planned in some 15 windows."""
    x, y, z = START
    begin = PlatformPath.start(START)
    return begin.arc_about((x - RADIUS, y, z), (0.0, 0.0, 1.0), 2.0 * math.pi)


def square() -> PlatformPath:
    """Return a square with rounded corners."""
    x, y, z = START
    corners = [(0.04, 0.0), (0.04, 0.04), (0.0, 0.04), (0.0, 0.0)]
    path = PlatformPath.start(START)
    for along, across in corners:
        path = path.line_to((x + along, y + across, z), tolerance=0.001)
    return path


def lengths(step: float | None):
    """Yield how long each step is [s]: from 0.1 to 50 ms without a ``step``."""
    rng = np.random.default_rng(3)
    while True:
        yield 10.0 ** rng.uniform(-4.0, -1.3) if step is None else step


def driven(moving: MotionEngine, steps, pieces: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Step an engine to its rest; return the length of the step to each row, and the heights."""
    periods, rows = [1.0], [moving.state.heights]
    while moving.phase is not MotionPhase.IDLE or moving.preparing:
        periods.append(next(steps))
        rows.append(moving.step(periods[-1]).heights)
        if pieces:
            moving.work(partial(next, iter((True,) * pieces), False))
        assert len(rows) < 50_000, "never came to rest"
    return np.array(periods), np.array(rows)


def assert_within(periods: np.ndarray, heights: np.ndarray, limits: SliderLimits) -> None:
    """Assert that divided differences, which are means of the derivatives, keep the limits."""
    use = LimitUse.of(CommandStream.from_heights(heights, periods), limits)
    assert use.violations() == []


@pytest.fixture(scope="module")
def fine() -> dict:
    """Return the heights of each path in fine steps."""
    return {path: driven(following(path()), lengths(DT)) for path in (circle, square)}


@pytest.mark.parametrize(
    ("path", "step"), [*((circle, step) for step in (0.02, 0.004, 0.05, 0.3, None)), (square, 0.05)]
)
def test_a_path_is_the_same_motion_whatever_the_steps_are(path, step, fine):
    """Plans are made within ``step``, so each begins where and when the one before says."""
    periods, heights = driven(following(path()), lengths(step))
    assert_within(periods, heights, STIFF)
    times = np.cumsum(periods[1:])
    fine_periods, fine_heights = fine[path]
    at = np.round(times / DT).astype(int)
    common = (np.abs(at * DT - times) < SAME_TIME) & (at < len(fine_heights))
    if step is not None:
        assert common.any()
        np.testing.assert_allclose(heights[1:][common], fine_heights[at[common]], atol=1e-12)
    assert -DT < times[-1] - fine_periods[1:].sum() < periods[-1]


def following(path: PlatformPath, **options) -> MotionEngine:
    """Return an engine that follows a path."""
    moving = engine(limits=STIFF, **options)
    moving.follow(path)
    return moving


@pytest.mark.parametrize("step", [0.02, 0.05, None])
@pytest.mark.parametrize("pieces", [4, 1000])
def test_a_path_in_pieces_keeps_the_limits_whatever_the_steps_are(step, pieces):
    moving = following(circle(), in_pieces=True)
    assert_within(*driven(moving, lengths(step), pieces), STIFF)
    assert math.dist(MACHINE.forward(moving.state.heights), START) < 1e-9


@pytest.mark.parametrize("velocity", [0.8, 0.9, 0.97])
def test_what_is_tried_again_in_a_step_begins_there(velocity):
    """New limits that wait are tried again in a step; the plan is ready only after it."""
    moving = engine(limits=STIFF, heights=MACHINE.inverse((0.0, 0.0, 0.1)), in_pieces=True)
    moving.move_to((0.0, 0.0, 0.45))
    moving.work(lambda: True)
    periods, rows = [1.0], [moving.state.heights]
    while moving.phase is not MotionPhase.IDLE:
        if len(rows) == 9:
            assert max(map(abs, moving.state.velocities)) == pytest.approx(1.0)
            moving.set_limits(SliderLimits.uniform(velocity, 10.0, 5000.0))
            moving.work(lambda: True)
        periods.append(0.02)
        rows.append(moving.step(periods[-1]).heights)
        moving.work(lambda: True)
    assert_within(np.array(periods), np.array(rows), STIFF)
