"""How calm shaped motions are: what is left of a swing, and when the platform is there for good.

Besides, how much later a stop rests with a shaper than without. The platform has one mode along
each axis. Motions begin at random places, at the default limits.
Nothing here is timed, so nothing depends on the computer.

``python -m benchmarks.bench_calm --count 1000`` measures more motions of each kind than the table
of all benchmarks has.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np

from benchmarks.bench_smoothness import LOWER, UPPER, drive_to_rest
from benchmarks.command_line import numbers
from benchmarks.judge import LIMITS, MACHINE, WORKSPACE
from benchmarks.soak import engine_at, random_path, random_velocity
from benchmarks.table import print_lines
from testing.jerk_on_paths import PERIOD
from testing.swing_behind import left_behind, settled_at
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionEngine, MotionKind, Trajectory, plan_move
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

FREQUENCIES = (8.0, 60.0)  # Hz, of modes at random
JOG_SPEEDS = (0.02, 1.0)  # m/s
JOG_TIMES = (0.02, 0.5)  # s
# Of jogs that change: how many twists there are, and for how long each of them [s].
TWISTS, CHANGE_TIMES = (2, 5), (0.03, 0.2)
# A target swings about a place: how often [1/s], how far [m], and for how long [s].
TARGET_TURNS, TARGET_SIZE, TARGET_TIMES = (0.3, 2.0), 0.05, (0.05, 1.2)
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
    limits = LIMITS if jerk is None else replace(LIMITS, jerk=(jerk,) * 3)
    return plan_move(WORKSPACE, limits, start, end, kind=kind, shaper=shaper)


# When the platform is there for good [s].
settled = partial(settled_at, MACHINE, close=CLOSE)


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
    engine, heights = _before_last(motion, shaper)
    _, command = motion.commands[-1]
    command(engine)
    rest = drive_to_rest(engine, heights)
    return Driven(MACHINE.forward_batch(np.array(heights)), rest)


def _before_last(motion: Motion, shaper: Shaper | None) -> tuple[MotionEngine, list[Vector3]]:
    """Return an engine that is about to be given the last command, and the heights so far [m].

    Raises:
        KinematicsError: if a command is refused.
    """
    engine = engine_at(motion.start, kind=motion.kind)
    engine.set_shaper(shaper)
    heights = [engine.state.heights]
    for number, (time, command) in enumerate(motion.commands):
        while len(heights) <= round(time / PERIOD):
            heights.append(engine.step(PERIOD).heights)
        if number < len(motion.commands) - 1:
            command(engine)
    return engine, heights


# Makes motions at random.
Maker: TypeAlias = Callable[[np.random.Generator], Motion]


def _move(kind: MotionKind) -> Maker:
    def motion(rng: np.random.Generator) -> Motion:
        end = _place(rng)
        return Motion(kind, _place(rng), [(0.0, lambda engine: engine.move_to(end))])

    return motion


def _twist(
    rng: np.random.Generator, begin: float, times: tuple[float, float]
) -> tuple[Commands, float]:
    """Return a twist that is renewed, and when it ends [s]."""
    twist = random_velocity(rng, *JOG_SPEEDS)
    length = rng.uniform(*times)
    renewed = np.arange(0.0, length, TWIST_PERIOD)
    return [(begin + time, lambda engine: engine.jog(twist)) for time in renewed], begin + length


def _jog(rng: np.random.Generator) -> Motion:
    """Return a jog from rest whose twist is renewed, and that is stopped or let go."""
    commands, end = _twist(rng, 0.0, JOG_TIMES)
    let_go = rng.random() < 0.5
    last = (lambda engine: engine.jog((0.0, 0.0, 0.0))) if let_go else MotionEngine.stop
    return Motion(MotionKind.LINEAR, _place(rng), [*commands, (end, last)])


def _stopped(motion: Motion, rng: np.random.Generator) -> Motion:
    """Return a motion with an end that is stopped on its way."""
    last = rng.uniform(0.05, 0.95) * driven(motion).rest
    return motion._replace(commands=[*motion.commands, (last, MotionEngine.stop)])


def _stop(rng: np.random.Generator) -> Motion:
    """Return a move or a jog that is stopped on its way."""
    makers = (_jog, *(_move(kind) for kind in MotionKind))
    motion = makers[rng.integers(len(makers))](rng)
    return _stopped(motion, rng) if len(motion.commands) == 1 else motion


def _path(rng: np.random.Generator) -> Motion:
    start = _place(rng)
    path = random_path(rng, start, PATH_SIZE)
    return Motion(MotionKind.LINEAR, start, [(0.0, lambda engine: engine.follow(path))])


KINDS: dict[str, Maker] = {
    "lines": _move(MotionKind.LINEAR),
    "slider moves": _move(MotionKind.SLIDER),
    "paths": _path,
    "jogs": _jog,
    "stops": _stop,
}


HEAD = ("modes of 8 to 60 Hz", "motions", "ours", "to reach", "reached")


class Left(NamedTuple):
    """What motions of a kind leave behind.

    Attributes:
        kind: in words.
        shaped: swing that is left of modes that are known so well. Shape (n, number of these) [m].
        unshaped: the same of the same modes without a shaper [m].
        refused: how many are possible without a shaper only.
    """

    kind: str
    shaped: FloatArray
    unshaped: FloatArray
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
        found.append([_left_of(calm, plain, true) for calm, (_, true) in zip(shaped, cases)])
    table = np.array(found).reshape(-1, len(KNOWN), 2)
    return Left(kind, table[..., 0], table[..., 1], refused)


def _left_of(calm: Driven, plain: Driven, true: Mode) -> list[float]:
    """Return the swing of the ``true`` mode that is left of two motions [m]."""
    return [left_behind(each.places, PERIOD, true) for each in (calm, plain)]


def figures(kind: str, count: int = COUNT) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a ``kind``: what is left."""
    found = left(kind, count)
    number = str(len(found.shaped))
    if found.refused:
        number += f" ({found.refused} refused with a shaper only)"
    for known, part in zip(KNOWN, found.parts.tolist()):
        reached = "yes" if part <= known.goal else "NO"
        yield f"{kind}: left, {known}", number, f"{part:.1%}", f"{known.goal:.0%}", reached


def _stopped_jog(twists: tuple[int, int], times: tuple[float, float]) -> Maker:
    """Return what makes jogs with so many twists, each for a time [s], and a stop."""

    def motion(rng: np.random.Generator) -> Motion:
        commands: list[tuple[float, Callable[[MotionEngine], None]]] = []
        end = 0.0
        for _ in range(rng.integers(*twists, endpoint=True)):
            more, end = _twist(rng, end, times)
            commands += more
        return Motion(MotionKind.LINEAR, _place(rng), [*commands, (end, MotionEngine.stop)])

    return motion


def _stopped_target(rng: np.random.Generator) -> Motion:
    """Return a target that swings about the start and is reported, until a stop."""
    start = _place(rng)
    rates, sizes = math.tau * rng.uniform(*TARGET_TURNS, size=3), rng.uniform(size=3) * TARGET_SIZE
    end = rng.uniform(*TARGET_TIMES)

    def report(time: float) -> Callable[[MotionEngine], None]:
        place = (start + sizes * np.sin(rates * time)).tolist()
        velocity = (rates * sizes * np.cos(rates * time)).tolist()
        return lambda engine: engine.track(place, velocity)

    reports = [(time, report(time)) for time in np.arange(0.0, end, TWIST_PERIOD).tolist()]
    return Motion(MotionKind.LINEAR, start, [*reports, (end, MotionEngine.stop)])


def _stopped_of(kind: str) -> Maker:
    return lambda rng: _stopped(KINDS[kind](rng), rng)


STOPS: dict[str, Maker] = {
    **{kind: _stopped_of(kind) for kind in ("lines", "slider moves", "paths")},
    "jogs": _stopped_jog((1, 1), JOG_TIMES),
    "jogs that change": _stopped_jog(TWISTS, CHANGE_TIMES),
    "moving targets": _stopped_target,
}

HEAD_OF_STOPS = (
    "stop of",
    "stops",
    f"at most {LATER:.0%} later",
    "median, 90 %, largest",
)


def stop_times(motion: Motion, shaper: Shaper) -> tuple[float, float]:
    """Stop a ``motion`` with a shaper and without.

    Returns:
        Times from the stop until nothing moves [s]: with the shaper, less the time of this; and
        without one, from the state and the plan that are held with it.

    Raises:
        KinematicsError: if a command is refused.
    """
    engine, _ = _before_last(motion, shaper)
    same = _without_shaper(engine, motion)
    engine.stop()
    same.stop()
    shaped = drive_to_rest(engine, []) - shaper.duration
    return shaped, drive_to_rest(same, [])


def _without_shaper(engine: MotionEngine, motion: Motion) -> MotionEngine:
    """Return an engine that holds the same plan and has no shaper."""
    same = engine_at(motion.start, kind=motion.kind)
    held = engine._holder.held
    limits = replace(held.limits, shaper=None, planned=None)
    same._holder.hold(replace(held, limits=limits, pending=None), engine._holder.time)
    same._execution.plans.tracks = engine._execution.plans.tracks
    return same


def stopped(kind: str, count: int = COUNT) -> FloatArray:
    """Stop so many motions of a ``kind``; those that are refused, or at rest, are left out.

    Returns:
        How much later each rests than from the same state without a shaper, as part of the stop
        there. Shape (n,).
    """
    rng = np.random.default_rng(SEED)
    later: list[float] = []
    for _ in range(count):
        try:
            motion = STOPS[kind](rng)
            shaper, _ = KNOWN[rng.integers(len(KNOWN))].drawn(rng)
            shaped, plain = stop_times(motion, shaper)
        except KinematicsError:
            continue
        if plain > 0.0:
            later.append(shaped / plain - 1.0)
    return np.array(later)


def row_of_stops(kind: str, count: int = COUNT) -> tuple[str, ...]:
    """Return the row of the stops of a ``kind``."""
    later = stopped(kind, count)
    within = np.mean(later <= LATER)
    median, most, largest = np.percentile(later, (50.0, 90.0, 100.0))
    return kind, str(len(later)), f"{within:.0%}", f"{median:.1%}, {most:.1%}, {largest:.1%}"


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
    print_lines(table)
    print_lines([HEAD, *(line for kind in KINDS for line in figures(kind, count))])
    return print_lines([HEAD_OF_STOPS, *(row_of_stops(kind, count) for kind in STOPS)])


if __name__ == "__main__":
    run(numbers(__doc__, count=(COUNT, "motions of each kind")).count)
