"""Setpoints of an engine as a recording has them, with stamps that are late now and then."""

from collections.abc import Callable
from functools import cache

import numpy as np
from motion_machine import SHAPER, WORKSPACE

from tri_glide_kinematics.motion import (
    MotionEngine,
    MotionKind,
    PlatformPath,
    SliderLimits,
)
from tri_glide_kinematics.recordings import Recording
from tri_glide_kinematics.vectors import FloatArray

LIMITS = SliderLimits((0.5, 0.4, 0.5), (6.0, 5.0, 6.0), (200.0, 150.0, 200.0))
HOME = (0.6, 0.6, 0.6)
SPANS = np.array((0.08, 0.08, 0.06))
MIDDLE = np.array((0.0, 0.0, 0.25))


def stamps_of(count: int, period: float, rng: np.random.Generator) -> FloatArray:
    """Return stamps that are late by some hundredths of a millisecond, and by 0.6 ms at times."""
    late = rng.exponential(2e-5, count) + 6e-4 * (rng.random(count) < 0.01)
    stamps = np.maximum.accumulate(period * np.arange(count) + late)
    return np.round(stamps - stamps[0] + 1e-6 * np.arange(count) / count, 9)


@cache
def record(
    drive: Callable[[MotionEngine, np.random.Generator], float],
    seed: int,
    period: float,
    *,
    kind: MotionKind = MotionKind.SLIDER,
    is_shaped: bool = False,
    limits: SliderLimits = LIMITS,
) -> Recording:
    """Return what an engine puts out.

    Args:
        drive: gives it a command, and returns how long that is waited for [s]; some in a row.
        seed: of all numbers at random.
        period: of the setpoints [s].
        kind: of moves.
        is_shaped: whether it has a shaper.
        limits: in force.
    """
    rng = np.random.default_rng(seed)
    engine = MotionEngine(WORKSPACE, limits, kind=kind)
    engine.start(HOME)
    engine.set_shaper(SHAPER if is_shaped else None)
    states = [engine.state]
    for _ in range(3):
        for _ in range(round(drive(engine, rng) / period)):
            states.append(engine.step(period))
            engine.work(lambda: True)
    heights = np.array([state.heights for state in states])
    velocities = np.array([state.velocities for state in states])
    return Recording(stamps_of(len(states), period, rng), heights, velocities)


def _place(rng: np.random.Generator) -> FloatArray:
    return np.asarray(MIDDLE + SPANS * rng.uniform(-1.0, 1.0, 3))


def moves(engine: MotionEngine, rng: np.random.Generator) -> float:
    """Go somewhere; sometimes while still going elsewhere."""
    engine.move_to(_place(rng))
    return float(rng.uniform(0.1, 0.6))


def stops(engine: MotionEngine, rng: np.random.Generator) -> float:
    """Go somewhere, or stop."""
    if rng.random() < 0.5:
        engine.stop()
        return 0.3
    return moves(engine, rng)


def jogs(engine: MotionEngine, rng: np.random.Generator) -> float:
    """Change the wanted velocity."""
    engine.jog(rng.uniform(-0.1, 0.1, 3))
    return float(rng.uniform(0.05, 0.2))


def paths(engine: MotionEngine, rng: np.random.Generator) -> float:
    """Follow a path with rounded corners."""
    if engine.remaining == 0.0:
        start = np.array(WORKSPACE.machine.forward(engine.state.heights))
        points = [start, *(_place(rng) for _ in range(4))]
        engine.follow(PlatformPath.through(points, 2e-3))
    return 0.8


def upright(engine: MotionEngine, rng: np.random.Generator) -> float:
    """Go up or down, so far that each limit is reached."""
    z = WORKSPACE.machine.forward(engine.state.heights)[2]
    engine.move_to((0.0, 0.0, 0.35 if z < 0.25 else 0.15))
    return 0.9


DRIVES = (moves, stops, jogs, paths, upright)
