"""How calm shaped moves are: what is left of a swing, and when the platform is there for good.

The platform has one mode along each axis. Moves go between random places, at the default limits.
Nothing here is timed, so nothing depends on the computer.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from benchmarks.bench_smoothness import LOWER, MACHINE, UPPER, WORKSPACE
from benchmarks.judge import LIMITS
from benchmarks.table import aligned
from testing.swing_behind import left_after, settled_at
from tri_glide_kinematics.motion import MotionKind, SliderLimits, Trajectory, plan_move
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind
from tri_glide_kinematics.vectors import Vector3

SEED = 11
MOVES = 200
# Of every so many moves the best jerk limit is looked for, too: it takes as long as all the rest.
EVERY = 10
MODE = Mode(15.0, 0.03)
OFF = 0.15
CLOSE = 50e-6  # m
JERKS = np.geomspace(10.0, 400.0, 20)  # m/s^3
# Modes at random, of which EI leaves little up to 20 % beside its own frequency.
FREQUENCIES, MOST_DAMPING, BESIDE = (8.0, 60.0), 0.05, 0.2


class Calm(NamedTuple):
    """How calm the moves of a kind are.

    Attributes:
        kind: in words.
        sooner: time until the platform is there for good, over the unshaped one; ZV, median.
        sooner_beside: the same where the mode is 15 % off, with EI.
        over_best_jerk: as ``sooner``, over the best of 20 jerk limits without a shaper.
        left: what is left of random modes by EI, as part of the unshaped swing; root mean square.
    """

    kind: str
    sooner: float
    sooner_beside: float
    over_best_jerk: float
    left: float


def measured(kind: MotionKind, count: int = MOVES) -> Calm:
    """Measure so many moves of a ``kind``."""
    rng = np.random.default_rng(SEED)
    exact, robust = (Shaper.of(kind, MODE) for kind in (ShaperKind.ZV, ShaperKind.EI))
    sooner, beside, over_best, left, unshaped = [], [], [], [], []
    for number in range(count):
        ends: list[Vector3] = [tuple(rng.uniform(LOWER, UPPER).tolist()) for _ in range(2)]
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
        frequency, damping = rng.uniform(*FREQUENCIES), rng.uniform(0.0, MOST_DAMPING)
        true = Mode(frequency * rng.uniform(1.0 - BESIDE, 1.0 + BESIDE), damping)
        calm = moved(kind, ends, Shaper.of(ShaperKind.EI, Mode(frequency, damping)))
        left.append(left_after(MACHINE, calm, true))
        unshaped.append(left_after(MACHINE, plain, true))
    part = np.sqrt(np.mean(np.square(left)) / np.mean(np.square(unshaped)))
    there, off, best = (float(np.median(values)) for values in (sooner, beside, over_best))
    return Calm(f"{kind.value} moves", there, off, best, float(part))


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


def run() -> None:
    """Measure both kinds of moves and print a table."""
    head = (
        "mode at 15 Hz, damping 0.03",
        "ZV: there for good, over unshaped (median)",
        "EI, mode 15 % off: the same",
        "ZV: over the best of 20 jerk limits",
        "EI: left of modes of 8 to 60 Hz, up to 20 % off (RMS)",
    )
    rows = [measured(kind) for kind in MotionKind]
    print(aligned([head, *((row.kind, *(f"{x:.3f}" for x in row[1:])) for row in rows)]))


if __name__ == "__main__":
    run()
