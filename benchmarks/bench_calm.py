"""How calm shaped motions are: what is left of a swing, and when the platform is there for good.

The platform has one mode along each axis. Motions begin at random places, at the default limits.
Nothing here is timed, so nothing depends on the computer.

``python -m benchmarks.bench_calm --count 1000`` measures more motions of each kind than the table
of all benchmarks has.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from benchmarks.bench_smoothness import LOWER, MACHINE, MOST_STEPS, UPPER, WORKSPACE, started
from benchmarks.judge import LIMITS
from benchmarks.random_paths import random_path
from benchmarks.table import aligned
from testing.swing_behind import left_behind, settled_at
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import (
    MotionEngine,
    MotionKind,
    MotionPhase,
    SliderLimits,
    Trajectory,
    plan_move,
)
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind
from tri_glide_kinematics.vectors import FloatArray, Vector3

SEED = 11
COUNT = 60
# Of every so many moves the best jerk limit is looked for, too: it takes as long as all the rest.
EVERY = 10
MODE = Mode(15.0, 0.03)
OFF = 0.15
CLOSE = 50e-6  # m
JERKS = np.geomspace(10.0, 400.0, 20)  # m/s^3

PERIOD = 0.001  # s, of the engine
FREQUENCIES = (8.0, 60.0)  # Hz, of modes at random
JOG_SPEEDS = (0.02, 1.0)  # m/s
JOG_TIMES = (0.02, 0.5)  # s
TWIST_PERIOD = 0.02  # s
PATH_SIZE = 0.03  # m
# How much longer a stop may take with a shaper, besides the time of this, as part of the stop.
LATER = 0.05


class Calm(NamedTuple):
    """When the moves of a kind are there for good.

    Attributes:
        kind: in words.
        sooner: time until the platform is there for good, over the unshaped one; ZV, median.
        sooner_beside: the same where the mode is 15 % off, with EI.
        over_best_jerk: as ``sooner``, over the best of 20 jerk limits without a shaper.
    """

    kind: str
    sooner: float
    sooner_beside: float
    over_best_jerk: float


def measured(kind: MotionKind, count: int = COUNT) -> Calm:
    """Measure so many moves of a ``kind``."""
    rng = np.random.default_rng(SEED)
    exact, robust = (Shaper.of(kind, MODE) for kind in (ShaperKind.ZV, ShaperKind.EI))
    sooner, beside, over_best = [], [], []
    for number in range(count):
        ends = [_place(rng) for _ in range(2)]
        plain = moved(kind, ends)
        done = settled(moved(kind, ends, exact), MODE)
        sooner.append(done / settled(plain, MODE))
        true = Mode(MODE.frequency * (1.0 + OFF * rng.choice((-1.0, 1.0))), MODE.damping)
        beside.append(settled(moved(kind, ends, robust), true) / settled(plain, true))
        if number % EVERY == 0:
            slow = (
                moved(kind, ends, jerk=jerk) for jerk in JERKS.tolist() if jerk <= LIMITS.jerk[0]
            )
            over_best.append(done / min(settled(motion, MODE) for motion in slow))
    there, off, best = (float(np.median(values)) for values in (sooner, beside, over_best))
    return Calm(f"{kind.value} moves", there, off, best)


def _place(rng: np.random.Generator) -> Vector3:
    """Return a random place [m]."""
    x, y, z = rng.uniform(LOWER, UPPER).tolist()
    return x, y, z


def moved(
    kind: MotionKind, ends: list[Vector3], shaper: Shaper | None = None, jerk: float | None = None
) -> Trajectory:
    """Return the move between two ``ends`` [m]; without a ``jerk`` limit, at the default one."""
    start, end = ends
    limits = LIMITS
    if jerk is not None:
        limits = SliderLimits(LIMITS.velocity, LIMITS.acceleration, (jerk,) * 3)
    return plan_move(WORKSPACE, limits, start, end, kind=kind, shaper=shaper)


def settled(motion: Trajectory, mode: Mode) -> float:
    """Return when the platform is there for good [s]."""
    return settled_at(MACHINE, motion, mode, CLOSE)


class Knowledge(NamedTuple):
    """How well modes are known that are shaped for, and what may be left of their swing.

    Attributes:
        kind: of the shaper.
        beside: how far the frequency of a mode is from the shaper's, at most, as part of it.
        damping: largest; the shaper's is that of the mode.
        goal: what may be left, as part of the unshaped swing; root mean square.
    """

    kind: ShaperKind
    beside: float
    damping: float
    goal: float

    def __str__(self) -> str:
        """Return it in words."""
        kind = self.kind.value.upper()
        return f"{kind}, up to {self.beside:.0%} off, damping up to {self.damping:g}"

    def drawn(self, rng: np.random.Generator) -> tuple[Shaper, Mode]:
        """Return a shaper at random, and the mode that there is."""
        frequency, damping = rng.uniform(*FREQUENCIES), rng.uniform(0.0, self.damping)
        true = Mode(frequency * rng.uniform(1.0 - self.beside, 1.0 + self.beside), damping)
        return Shaper.of(self.kind, Mode(frequency, damping)), true


KNOWN = (
    Knowledge(ShaperKind.EI, 0.2, 0.05, 0.05),
    Knowledge(ShaperKind.EI, 0.2, 0.15, 0.07),
    Knowledge(ShaperKind.ZV, 0.05, 0.05, 0.10),
)

# What is done with an engine, and when [s].
Commands: TypeAlias = Sequence[tuple[float, Callable[[MotionEngine], None]]]


class Motion(NamedTuple):
    """Commands that an engine is given, whether it has a shaper or not.

    Attributes:
        kind: of its moves.
        start: where it rests before [m].
        commands: ascending, the first at 0.
    """

    kind: MotionKind
    start: Vector3
    commands: Commands


class Driven(NamedTuple):
    """What an engine has made of a motion.

    Attributes:
        places: of the platform, from rest to rest. Shape (n, 3) [m].
        rest: time from the last command until nothing moves [s].
    """

    places: FloatArray
    rest: float


def driven(motion: Motion, shaper: Shaper | None = None) -> Driven:
    """Drive a ``motion`` until it rests.

    Raises:
        KinematicsError: if a command is refused.
        RuntimeError: if it does not come to rest.
    """
    engine = started(motion.kind, motion.start)
    engine.set_shaper(shaper)
    heights = [engine.state.heights]
    for time, command in motion.commands:
        while len(heights) <= round(time / PERIOD):
            heights.append(engine.step(PERIOD).heights)
        command(engine)
    last, rest = len(heights), 0.0
    while engine.phase is not MotionPhase.IDLE:
        rest = (len(heights) - last) * PERIOD + engine.time_to_rest
        heights.append(engine.step(PERIOD).heights)
        if len(heights) > MOST_STEPS:
            raise RuntimeError(f"no rest after {MOST_STEPS} steps")
    return Driven(MACHINE.forward_batch(np.array(heights)), rest)


def _move(kind: MotionKind) -> Callable[[np.random.Generator], Motion]:
    def motion(rng: np.random.Generator) -> Motion:
        end = _place(rng)
        return Motion(kind, _place(rng), [(0.0, lambda engine: engine.move_to(end))])

    return motion


def _jog(rng: np.random.Generator) -> Motion:
    """Return a jog from rest whose twist is renewed, and that is stopped or let go."""
    velocity = rng.normal(size=3)
    velocity *= np.exp(rng.uniform(*np.log(JOG_SPEEDS))) / np.linalg.norm(velocity)
    end = rng.uniform(*JOG_TIMES)
    twist = velocity.tolist()
    commands = [
        (time, lambda engine: engine.jog(twist)) for time in np.arange(0.0, end, TWIST_PERIOD)
    ]
    let_go = rng.random() < 0.5
    last = (lambda engine: engine.jog((0.0, 0.0, 0.0))) if let_go else MotionEngine.stop
    return Motion(MotionKind.LINEAR, _place(rng), [*commands, (end, last)])


def _stop(rng: np.random.Generator) -> Motion:
    """Return a move or a jog that is stopped on its way."""
    makers = (_jog, *(_move(kind) for kind in MotionKind))
    motion = makers[rng.integers(len(makers))](rng)
    if len(motion.commands) == 1:
        last = rng.uniform(0.05, 0.95) * driven(motion).rest
        motion = motion._replace(commands=[*motion.commands, (last, MotionEngine.stop)])
    return motion


def _path(rng: np.random.Generator) -> Motion:
    start = _place(rng)
    path = random_path(rng, start, PATH_SIZE)
    return Motion(MotionKind.LINEAR, start, [(0.0, lambda engine: engine.follow(path))])


KINDS: dict[str, Callable[[np.random.Generator], Motion]] = {
    "lines": _move(MotionKind.LINEAR),
    "slider moves": _move(MotionKind.SLIDER),
    "paths": _path,
    "jogs": _jog,
    "stops": _stop,
}


# Motions that end with a stop.
STOPPED = ("jogs", "stops")

HEAD = ("modes of 8 to 60 Hz", "motions", "ours", "to reach", "reached")


class Left(NamedTuple):
    """What motions of a kind leave behind.

    Attributes:
        kind: in words.
        shaped: swing that is left of modes that are known so well. Shape (n, number of these) [m].
        unshaped: the same of the same modes without a shaper [m].
        later: how much later than without a shaper the motion rests after the last command, less
            the shaper's time, as part of the time without. Of the same shape.
        refused: how many are possible without a shaper only.
    """

    kind: str
    shaped: FloatArray
    unshaped: FloatArray
    later: FloatArray
    refused: int

    @property
    def parts(self) -> FloatArray:
        """What is left, as part of the unshaped swing; root mean square, by what is known. (3,)."""
        squares = (np.square(values).sum(axis=0) for values in (self.shaped, self.unshaped))
        return np.sqrt(np.divide(*squares))


def left(kind: str, count: int = COUNT) -> Left:
    """Measure so many motions of a ``kind``; those that are refused are left out."""
    rng = np.random.default_rng(SEED)
    found, refused = [], 0
    for motion in (KINDS[kind](rng) for _ in range(count)):
        cases = [known.drawn(rng) for known in KNOWN]
        try:
            plain = driven(motion)
        except KinematicsError:
            # A path may lead out of the workspace, and a jog may come to its edge.
            continue
        if not plain.rest > 0.0:
            continue
        try:
            shaped = [driven(motion, shaper) for shaper, _ in cases]
        except KinematicsError:
            refused += 1
            continue
        found.append(
            [
                (
                    left_behind(calm.places, PERIOD, true),
                    left_behind(plain.places, PERIOD, true),
                    (calm.rest - plain.rest - shaper.duration) / plain.rest,
                )
                for calm, (shaper, true) in zip(shaped, cases)
            ]
        )
    table = np.array(found).reshape(-1, len(KNOWN), 3)
    shaped_ones, unshaped, later = np.moveaxis(table, -1, 0)
    return Left(kind, shaped_ones, unshaped, later, refused)


def figures(kind: str, count: int = COUNT) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a ``kind``: what is left, and how much later a stop rests."""
    found = left(kind, count)
    number = str(len(found.shaped))
    if found.refused:
        number += f" ({found.refused} refused with a shaper only)"
    for known, part in zip(KNOWN, found.parts.tolist()):
        reached = "yes" if part <= known.goal else "NO"
        yield f"{kind}: left, {known}", number, f"{part:.1%}", f"{known.goal:.0%}", reached
    if kind in STOPPED:
        later = found.later.ravel()
        median, most, almost_all, largest = np.percentile(later, (50.0, 90.0, 99.0, 100.0))
        text = f"{median:.1%}, {most:.1%}, {almost_all:.1%}, {largest:.1%}"
        reached = "yes" if largest <= LATER else "NO"
        what = f"{kind}: rests later, besides the shaper's time (median, 90 %, 99 %, largest)"
        yield what, str(len(later)), text, f"{LATER:.0%} of the stop", reached


def run(count: int = COUNT) -> bool:
    """Measure so many motions of each kind and print the tables; they are always complete."""
    head = (
        "mode at 15 Hz, damping 0.03",
        "ZV: there for good, over unshaped (median)",
        "EI, mode 15 % off: the same",
        "ZV: over the best of 20 jerk limits",
    )
    rows = [measured(kind, count) for kind in MotionKind]
    table = [head, *((row.kind, *(f"{x:.3f}" for x in row[1:])) for row in rows)]
    print("\n" + aligned(table), flush=True)
    lines = [line for kind in KINDS for line in figures(kind, count)]
    print("\n" + aligned([HEAD, *lines]), flush=True)
    return True


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure as many motions as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=COUNT, help="motions of each kind")
    return 0 if run(parser.parse_args(arguments).count) else 1


if __name__ == "__main__":
    sys.exit(main())
