"""How much sooner a machine is there that uses its forces, and how near to the optimum that is.

The carriages are as heavy as the platform. Motions are straight, between random places, by the
timing of paths, by line moves and by slider moves. They are compared with the same motions under
the best constant acceleration limit with which the forces hold everywhere, and with an optimum that
is found in another way: jerks that are constant in equal times, by sequential quadratic programming
on samples of velocities, accelerations, jerks and forces.

Nothing here is timed, so nothing depends on the computer.
``python -m benchmarks.bench_forces --count 200`` measures more motions than the table of all
benchmarks has.
"""

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from scipy.optimize import minimize

from benchmarks.bench_smoothness import LOWER, UPPER
from benchmarks.command_line import numbers
from benchmarks.judge import MACHINE, WORKSPACE
from benchmarks.table import print_lines
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.motion import (
    ForceLimits,
    MotionKind,
    PlatformPath,
    SliderLimits,
    Trajectory,
    plan_move,
    time_path,
)
from tri_glide_kinematics.vectors import FloatArray

SEED = 5
COUNT = 40
OPTIMA = 20
LEAST = 0.03  # m, of a motion
FORCE = 50.0  # N
FORCES = SliderForces(MACHINE, Masses.uniform(1.0, 0.05, 1.0))
BOUND = ForceLimits(FORCES, (FORCE,) * 3, (FORCE,) * 3)
VELOCITY, JERK = 3.0, 5000.0  # m/s, m/s^3
# An acceleration limit that bounds nothing [m/s^2].
AMPLE = 500.0
INTERVALS = 48
# Samples of each interval of the optimum.
SAMPLES = 3

Made = Callable[[SliderLimits, FloatArray, FloatArray], Trajectory]


def along_path(limits: SliderLimits, start: FloatArray, end: FloatArray) -> Trajectory:
    """Return the motion along a path of one line."""
    path = PlatformPath.start(start.tolist()).line_to(end.tolist())
    return time_path(path, WORKSPACE, limits)


def moved(kind: MotionKind) -> Made:
    """Return what makes moves of a ``kind``."""
    return lambda limits, start, end: plan_move(
        WORKSPACE, limits, start.tolist(), end.tolist(), kind=kind
    )


MOTIONS: tuple[tuple[str, Made], ...] = (
    ("paths of one line", along_path),
    ("line moves", moved(MotionKind.LINEAR)),
    ("slider moves", moved(MotionKind.SLIDER)),
)


def constant_acceleration() -> float:
    """Return the largest acceleration of all sliders with which the forces hold everywhere.

    Velocities are left out, which makes it a little larger than it may be.
    """
    places = np.array(list(product(*(np.linspace(*ends, 7) for ends in zip(LOWER, UPPER)))))
    heights, still = MACHINE.inverse_batch(places), np.zeros((len(places), 3))
    held = FORCES.forces_batch(heights, still, still)
    accelerated = [
        FORCES.forces_batch(heights, still, np.tile(unit, (len(places), 1))) - held
        for unit in np.eye(3)
    ]
    return float(((FORCE - np.abs(held)) / np.abs(accelerated).sum(axis=0)).min())


def driven_by(
    jerks: FloatArray, step: float, begin: Sequence[FloatArray] | FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return ways, velocities and accelerations at the begin and the end of each step.

    Args:
        jerks: constant in each step. Shape (n,) or (n, 3).
        step: length of each [s].
        begin: way, velocity and acceleration at the begin.
    """

    def joined(first: FloatArray, changes: FloatArray) -> FloatArray:
        return first + np.concatenate((np.zeros_like(changes[:1]), np.cumsum(changes, axis=0)))

    way, velocity, acceleration = begin
    a = joined(acceleration, jerks * step)
    v = joined(velocity, step * (a[:-1] + 0.5 * step * jerks))
    return joined(way, step * (v[:-1] + step * (0.5 * a[:-1] + step * jerks / 6.0))), v, a


def optimum(start: FloatArray, end: FloatArray, guess: Trajectory) -> float:
    """Return the least time along a straight line that another method finds [s].

    Args:
        start: of the platform. Shape (3,) [m].
        end: likewise.
        guess: a motion along the line.
    """
    way = float(np.linalg.norm(end - start))
    direction = (end - start) / way
    edges = np.arange(INTERVALS + 1) / INTERVALS
    inside = (np.arange(INTERVALS * SAMPLES + 1)) / (INTERVALS * SAMPLES)
    owner = np.minimum((inside * INTERVALS).astype(int), INTERVALS - 1)
    since = inside - edges[owner]

    def motion(numbers: FloatArray) -> tuple[FloatArray, ...]:
        time, jerks = numbers[-1], numbers[:-1] * (way / numbers[-1] ** 3)
        ways, speeds, accelerations = driven_by(jerks, time / INTERVALS, np.zeros(3))
        t, jerk = since * time, jerks[owner]
        a, v = accelerations[owner], speeds[owner]
        return (
            ways[owner] + t * (v + t * (0.5 * a + t * jerk / 6.0)),
            v + t * (a + 0.5 * t * jerk),
            a + t * jerk,
            jerk,
            np.array((ways[-1] / way - 1.0, speeds[-1] * time / way, accelerations[-1])),
        )

    def room(numbers: FloatArray) -> FloatArray:
        ways, speeds, accelerations, jerks, _ = motion(numbers)
        places = start + ways[:, np.newaxis] * direction
        heights = MACHINE.inverse_batch(places)
        # Derivatives of the heights by the way.
        arms = places[:, np.newaxis, :2] - np.array(MACHINE.geometry.anchors)
        rises = heights - places[:, 2:]
        across = direction[:2] @ direction[:2]
        first = -(arms @ direction[:2]) / rises
        second = (-across - first * first) / rises
        third = -3.0 * first * second / rises
        first = first + direction[2]
        s1, s2, s3 = (each[:, np.newaxis] for each in (speeds, accelerations, jerks))
        velocity = first * s1
        acceleration = first * s2 + second * s1 * s1
        jerk = first * s3 + 3.0 * second * s1 * s2 + third * s1**3
        forces = FORCES.forces_batch(heights, velocity, acceleration)
        parts = np.array((velocity / VELOCITY, jerk / JERK, forces / FORCE))
        return np.concatenate((1.0 - parts, 1.0 + parts)).ravel()

    seen = np.array([guess.platform_at(MACHINE, time) for time in edges * guess.duration])
    jerks = np.diff(seen[:, 6:] @ direction) * (INTERVALS * guess.duration**2 / way)
    first = np.append(jerks, guess.duration)
    found = minimize(
        lambda numbers: numbers[-1],
        first,
        method="SLSQP",
        constraints=(
            {"type": "ineq", "fun": room},
            {"type": "eq", "fun": lambda numbers: motion(numbers)[-1]},
        ),
        options={"maxiter": 100, "ftol": 1e-6},
    )
    kept = room(found.x).min() > -1e-5 and np.abs(motion(found.x)[-1]).max() < 1e-5
    return float(found.x[-1]) if kept else np.nan


def run(count: int = COUNT, optima: int = OPTIMA) -> bool:
    """Measure so many motions of each kind and so many optima; the table is always complete."""
    acceleration = constant_acceleration()
    print(f"\nbest constant acceleration limit: {acceleration:.2f} m/s^2 for {FORCE:g} N")
    base = SliderLimits.uniform(VELOCITY, acceleration, JERK)
    using = SliderLimits.uniform(VELOCITY, AMPLE, JERK).with_added(BOUND)
    rng = np.random.default_rng(SEED)
    ends: list[FloatArray] = []
    while len(ends) < count:
        both = rng.uniform(LOWER, UPPER, (2, 3))
        if np.linalg.norm(both[1] - both[0]) > LEAST:
            ends.append(both)
    best = [optimum(start, end, along_path(using, start, end)) for start, end in ends[:optima]]
    rows = [("motions", "over the constant limit: median (10 to 90 %)", "over an optimum: median")]
    for kind, made in MOTIONS:
        durations = np.array([made(using, *both).duration for both in ends])
        constant = np.array([made(base, *both).duration for both in ends])
        low, median, high = np.percentile(durations / constant, (10.0, 50.0, 90.0))
        over = durations[:optima] / best
        known = over[np.isfinite(over)]
        optimal = f"{np.median(known):.3f} ({len(known)} motions)" if len(known) else "-"
        rows.append((kind, f"{median:.3f} ({low:.3f} to {high:.3f})", optimal))
    return print_lines(rows)


if __name__ == "__main__":
    found = numbers(
        __doc__, count=(COUNT, "motions of each kind"), optima=(OPTIMA, "motions with an optimum")
    )
    run(found.count, found.optima)
