"""How smooth the setpoints are: of each kind of motion, the jerk of the sliders at 1 kHz.

The jerk is that of the third differences of the commanded heights, from rest to rest. Three figures
tell of it, each for all sliders of a motion or for the one that is worst:

- the part of its energy above 100 Hz, of all motions of a kind together;
- its sign changes, of what is more than 1 % of its limit;
- its total variation, as part of its limit: a move at the limit takes 8 for each slider, up and
  down four times.

A second table is of what is followed (``followed.py``). Nothing here is timed, so nothing depends
on the computer.
"""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from benchmarks import followed
from benchmarks.judge import LIMITS
from benchmarks.soak import engine_at, random_path
from benchmarks.table import print_lines
from testing.jerk_on_paths import FAST, PERIOD, chatter_of, circle, polyline, square
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import (
    CommandStream,
    MotionEngine,
    MotionKind,
    MotionPhase,
    PlatformPath,
)
from tri_glide_kinematics.vectors import FloatArray, Vector3

MIDDLE = (0.0, 0.0, 0.3)
# Where moves begin and end [m].
LOWER, UPPER = (-0.1, -0.1, 0.22), (0.1, 0.1, 0.36)
SEED = 1
MOVES = 60
JOGS, JOG_SPEED, TWIST_PERIOD = 20, 0.3, 0.01  # m/s, s
PATHS = 12
PATH_SIZE = 0.04  # m
TARGETS = 8
TARGET_PERIOD = 0.01  # s between two reports of a target
TARGET_TIME = 2.0  # s
MOST_STEPS = 60_000


class Smoothness(NamedTuple):
    """What is told of the motions of one kind.

    Attributes:
        kind: in words.
        motions: how many.
        fast: part of the energy of the jerk above 100 Hz.
        turns: sign changes, of the slider that has the most of them in each motion. Shape (n,).
        variation: total variation of the jerk as part of its limit, likewise. Shape (n,).
    """

    kind: str
    motions: int
    fast: float
    turns: FloatArray
    variation: FloatArray


HEAD = (
    "setpoints at 1 kHz",
    "motions",
    f"energy of the jerk above {FAST:g} Hz",
    "sign changes, median (largest)",
    "total variation over the limit, median (largest)",
)


def run() -> bool:
    """Measure and print the table; it is always complete."""
    lines = [
        (
            row.kind,
            str(row.motions),
            f"{100.0 * row.fast:.2f} %",
            f"{np.median(row.turns):g} ({row.turns.max():g})",
            f"{np.median(row.variation):.1f} ({row.variation.max():.1f})",
        )
        for row in rows()
    ]
    whole = print_lines([HEAD, *lines])
    return print_lines([followed.HEAD, *followed.rows()]) and whole


def rows() -> Iterator[Smoothness]:
    """Yield what is told of each kind of motion."""
    for kind, motions in KINDS.items():
        yield smoothness(kind, list(motions(np.random.default_rng(SEED))))


def smoothness(kind: str, motions: list[FloatArray]) -> Smoothness:
    """Return what is told of the heights of ``motions``, each of shape (n, 3) [m]."""
    fast, energy, turns, variation = 0.0, 0.0, [], []
    limit = np.array(LIMITS.jerk)[:, np.newaxis]
    for heights in motions:
        jerks = CommandStream.from_heights(heights, PERIOD).jerks.T
        found = chatter_of(jerks, LIMITS)
        size = float(np.square(jerks).sum())
        fast, energy = fast + found.fast * size, energy + size
        turns.append(found.turns)
        variation.append(float((np.abs(np.diff(jerks)) / limit).sum(axis=1).max()))
    return Smoothness(kind, len(motions), fast / energy, np.array(turns), np.array(variation))


def to_rest(engine: MotionEngine, heights: list[Vector3]) -> FloatArray:
    """Step until the engine is at rest, and return all heights, with rest before and after."""
    drive_to_rest(engine, heights)
    # Differences of the first rows have too few before them.
    return np.array([*[heights[0]] * 3, *heights, *[heights[-1]] * 3])


def drive_to_rest(engine: MotionEngine, heights: list[Vector3]) -> float:
    """Drive until nothing moves, add the ``heights`` [m], and return how long that takes [s].

    Raises:
        RuntimeError: if it does not come to rest.
    """
    last, rest = len(heights), 0.0
    while engine.phase is not MotionPhase.IDLE:
        rest = (len(heights) - last) * PERIOD + engine.time_to_rest
        heights.append(engine.step(PERIOD).heights)
        if len(heights) > MOST_STEPS:
            raise RuntimeError(f"no rest after {MOST_STEPS} steps")
    return rest


def _moves(kind: MotionKind) -> Callable[[np.random.Generator], Iterator[FloatArray]]:
    def motions(rng: np.random.Generator) -> Iterator[FloatArray]:
        engine = engine_at(MIDDLE, kind=kind)
        for target in rng.uniform(LOWER, UPPER, (MOVES, 3)):
            heights = [engine.state.heights]
            engine.move_to(target.tolist())
            yield to_rest(engine, heights)

    return motions


def _jogs(rng: np.random.Generator) -> Iterator[FloatArray]:
    """Yield jogs whose twist turns steadily, or changes now and then, until it ends."""
    for number in range(JOGS):
        engine = engine_at(MIDDLE, kind=MotionKind.LINEAR)
        heights = [engine.state.heights]
        velocity = rng.normal(size=3)
        turn = rng.uniform(-3.0, 3.0)
        for _ in range(rng.integers(20, 60)):
            if number % 2:
                x, y, z = velocity
                c, s = math.cos(turn * TWIST_PERIOD), math.sin(turn * TWIST_PERIOD)
                velocity = np.array((c * x - s * y, s * x + c * y, z))
            elif rng.random() < 0.1:
                velocity = rng.normal(size=3)
            speed = JOG_SPEED / float(np.linalg.norm(velocity))
            engine.jog((speed * velocity).tolist())
            for _ in range(round(TWIST_PERIOD / PERIOD)):
                heights.append(engine.step(PERIOD).heights)
        engine.jog((0.0, 0.0, 0.0))
        yield to_rest(engine, heights)


def _targets(rng: np.random.Generator) -> Iterator[FloatArray]:
    """Yield how a target on a circle is caught up with and followed, until the machine stops."""
    for _ in range(TARGETS):
        target = followed.on_circle(rng.uniform(0.01, 0.05), rng.uniform(0.3, 1.0))
        engine = engine_at(MIDDLE, kind=MotionKind.LINEAR)
        heights = [engine.state.heights]
        for report in range(round(TARGET_TIME / TARGET_PERIOD)):
            engine.track(*target(report * TARGET_PERIOD))
            for _ in range(round(TARGET_PERIOD / PERIOD)):
                heights.append(engine.step(PERIOD).heights)
        engine.stop()
        yield to_rest(engine, heights)


def _paths(rng: np.random.Generator) -> Iterator[FloatArray]:
    """Yield circles, squares, polylines and random paths, each at full speed."""
    paths: list[PlatformPath] = [
        *(circle(radius) for radius in (0.02, 0.05)),
        *(square(side) for side in (0.04, 0.1)),
        *(polyline(seed) for seed in range(PATHS // 2)),
    ]
    while len(paths) < PATHS + 4:
        paths.append(random_path(rng, MIDDLE, PATH_SIZE))
    for path in paths:
        x, y, z = path.position(0.0).tolist()
        engine = engine_at((x, y, z), kind=MotionKind.LINEAR)
        heights = [engine.state.heights]
        try:
            engine.follow(path)
        except KinematicsError:
            # A random path may lead out of the workspace.
            continue
        yield to_rest(engine, heights)


KINDS = {
    "lines": _moves(MotionKind.LINEAR),
    "slider moves": _moves(MotionKind.SLIDER),
    "jogs": _jogs,
    "tracking of a target on a circle": _targets,
    "paths": _paths,
}
