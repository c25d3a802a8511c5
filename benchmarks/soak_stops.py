"""Soak of stops: from the request to rest a machine takes at most twice the soonest stop.

Motions of all kinds, with random limits, bounds and shapers, are stopped at random moments. The
law, for each of them: the braking begins in the cycle after the request, and the machine rests
after at most twice the soonest stop that limits and bounds allow, or 0.2 s if that is more, plus
the length of the shaper. No stop is sooner than that of each slider by itself; where forces are
bounded, the bound at the end of docs/forces_and_speed.md counts, too.

Run it as ``python -m benchmarks.soak_stops --count 100000``; it exits with 1 after a violation.
Each machine has a source of chance of its own: ``--seed S --machine N`` begins with the ``N``th.
"""

import gc
import math
import multiprocessing
import secrets
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import count, islice, product
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from benchmarks.bench_forces import driven_by
from benchmarks.bench_stops import KINDS, MACHINES, PERIOD, Drive, own_stop
from benchmarks.command_line import numbers
from benchmarks.judge import LIMITS
from benchmarks.soak import random_shaper
from benchmarks.soak_bounds import random_bounds
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import (
    AddedBound,
    CannotHoldError,
    ForceLimits,
    MotionKind,
    MotionPhase,
    SliderLimits,
    SliderState,
)
from tri_glide_kinematics.vectors import FloatArray

# Twice the soonest stop, or this [s].
LARGEST_RATIO, ALWAYS_ALLOWED = 2.0, 0.2
# So many of all stops are compared with an optimum, of so many intervals.
COMPARED, INTERVALS = 200, 12
# Where the lower bound of the forces looks: in both directions, as nothing depends on z [m].
GRID = np.linspace(-0.25, 0.25, 7).tolist()
# Sizes of the limits [m/s, m/s^2, m/s^3] and of the platform speed limit [m/s].
SIZES = ((0.003, 3.0), (0.3, 100.0), (5.0, 20000.0))
SPEEDS = (0.0001, 1.0)
# Stops of one machine, one after the other.
STOPS = 20
# A motion is stopped at so many moments, at all but the last in a copy of the process; from one to
# the next it goes on for so long [s].
MOMENTS, PAUSES = 12, (PERIOD, 0.3)
# How often each kind of motion is stopped: following a target takes most of the time.
WEIGHTS = [0.2 if kind.name == "tracking" else 1.0 for kind in KINDS]
CHANCES = np.array(WEIGHTS) / sum(WEIGHTS)
# What takes so many times what is allowed is not driven to its end.
LONGEST = 3.0


class RandomDrive(Drive):
    """A machine with random limits, bounds and shaper."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Start it at a random place."""
        limits = random_limits(rng)
        machine = MACHINES[rng.integers(len(MACHINES))]
        kind = list(MotionKind)[rng.integers(len(MotionKind))]
        super().__init__(replace(machine, limits=limits, kind=kind), rng)
        bounds = random_bounds(rng, self.workspace.machine, SPEEDS, chance=0.5)
        self.scenario = replace(self.scenario, limits=limits.with_added(*bounds))
        self.engine.set_limits(self.scenario.limits)
        self.shaper = random_shaper(rng) if rng.random() < 0.4 else None
        self.engine.set_shaper(self.shaper)
        velocity, acceleration, jerk = limits.table.min(axis=1)
        # Motions that are slower are stopped later.
        self._stretch = max((velocity / acceleration + acceleration / jerk) / 0.15, 1.0)

    def run(self, time: float) -> None:
        """Go on for a ``time`` [s], or longer if the machine is slow: most of that in one step."""
        if time > 0.01:
            time *= self._stretch
        if time > 0.4:
            super().run(0.1)
            self.engine.step(time - 0.2)
            time = 0.1
        super().run(time)


def random_limits(rng: np.random.Generator) -> SliderLimits:
    """Return limits of any size, equal for all sliders or not."""
    sizes = [10.0 ** rng.uniform(*np.log10(each)) for each in SIZES]
    factors = rng.uniform(0.5, 1.5, (3, 3)) if rng.random() < 0.5 else np.ones((3, 3))
    return LIMITS.with_table(np.array(sizes)[:, np.newaxis] * factors)


class Stop(NamedTuple):
    """What one stop has shown.

    Attributes:
        machine: its number in the soak.
        kind: of the motion.
        taken: from the request to rest [s].
        soonest: a lower bound of that [s].
        length: of the shaper [s].
        begun: cycles until the machine braked.
        optimum: the least time that another method finds; NaN if it was not asked or found
            nothing [s].
        what: kind of moves, limits, bounds and shaper.
    """

    machine: int
    kind: str
    taken: float
    soonest: float
    length: float
    begun: int
    optimum: float
    what: str

    def ratio_to(self, soonest: float) -> float:
        """Return the time over what the law allows, if a ``soonest`` stop is known [s]."""
        allowed = max(LARGEST_RATIO * soonest, ALWAYS_ALLOWED) + self.length
        return (self.taken - PERIOD) / allowed

    @property
    def ratio(self) -> float:
        """Time over what the law allows; the request comes within a cycle."""
        return self.ratio_to(self.soonest)


def stops(seed: int, compared: int = 0, first: int = 0) -> Iterator[Stop]:
    """Yield stops without end, each ``compared``th of them with an optimum.

    One that takes too long for the lower bound of a stop with added bounds has it, too.

    Args:
        seed: of the source of chance, with the number of each machine.
        compared: each so many stops, one is compared with an optimum.
        first: number of the machine that comes first.
    """
    number = 0
    for machine in count(first):
        rng = np.random.default_rng((seed, machine))
        try:
            drive = RandomDrive(rng)
        except CannotHoldError:
            continue
        for _ in range(STOPS):
            kind = KINDS[rng.choice(len(KINDS), p=CHANCES)]
            try:
                kind.drive(drive)
            except KinematicsError:
                continue
            for moment in range(MOMENTS):
                if rests(drive) or drive.engine.phase is MotionPhase.STOPPING:
                    break
                number += 1
                is_compared = bool(compared) and number % compared == 0
                stop = partial(stopped, drive, machine, kind.name, is_compared)
                if moment == MOMENTS - 1:
                    yield stop()
                else:
                    yield in_a_copy(stop)
                    drive.run(math.exp(rng.uniform(*np.log(PAUSES))))
            if not rests(drive):
                break


def in_a_copy(stop: Callable[[], Stop]) -> Stop:
    """Return what a ``stop`` shows in a copy of this process, in which the motion goes on."""
    fork = multiprocessing.get_context("fork")
    receiver, sender = fork.Pipe(duplex=False)
    process = fork.Process(target=lambda: sender.send(stop()))
    process.start()
    sender.close()
    try:
        return receiver.recv()
    finally:
        process.join()
        receiver.close()


def rests(drive: Drive) -> bool:
    """Return whether nothing moves, and nothing is to."""
    return drive.engine.phase is MotionPhase.IDLE


def stopped(drive: RandomDrive, machine: int, kind: str, is_compared: bool = False) -> Stop:
    """Stop a ``machine`` with this number."""
    engine, limits, shaper = drive.engine, drive.scenario.limits, drive.shaper
    own, _ = own_stop(drive)
    soonest = max([own, *(by_forces(each, engine.state, limits) for each in limits.added)])
    state = engine.state
    length = shaper.duration if shaper is not None else 0.0
    longest = LONGEST * (max(LARGEST_RATIO * soonest, ALWAYS_ALLOWED) + length)
    earlier = engine._holder.held.plan
    engine.stop()
    holder, taken, begun = engine._holder, 0.0, 0
    while not rests(drive) and taken < longest:
        if not holder.held.waits(holder.time) and not engine.preparing:
            # Nothing comes any more but rest.
            taken += engine.remaining
            engine.step(engine.remaining + 1e-9)
            break
        begun += holder.held.plan is earlier
        drive.cycle()
        taken += PERIOD
    bounds = ", ".join(f"{type(each).__name__} {each.platform_speed:.4g}" for each in limits.added)
    what = f"{drive.scenario.kind.value}, {limits.table.tolist()}, {bounds}, shaper {length:.3f} s"
    stop = Stop(machine, kind, taken, soonest, length, begun, math.nan, what)
    if is_compared or (stop.ratio > 1.0 and limits.added):
        return stop._replace(optimum=optimum(drive, state, own))
    return stop


def by_forces(bound: AddedBound, state: SliderState, limits: SliderLimits) -> float:
    """Return the lower bound at the end of docs/forces_and_speed.md; 0 without force limits [s]."""
    if not isinstance(bound, ForceLimits):
        return 0.0
    forces, masses = bound.forces, bound.forces.masses
    friction = np.add(masses.coulomb, np.multiply(masses.viscous, limits.velocity))
    hardest = 0.0
    for x, y in product(GRID, GRID):
        try:
            heights = bound.machine.inverse((x, y, 0.0))
        except KinematicsError:
            continue
        weight = np.array(forces.bias(heights, (0.0, 0.0, 0.0)))
        most = friction + np.maximum(bound.down + weight, bound.up - weight)
        inverse = np.linalg.inv(np.array(forces.mass_matrix(heights)))
        for signs in product((-1.0, 1.0), repeat=2):
            force = most * (1.0, *signs)
            hardest = max(hardest, float(force @ inverse @ force))
    matrix, rates = np.array(forces.mass_matrix(state.heights)), np.array(state.velocities)
    return math.sqrt(float(rates @ matrix @ rates) / hardest)


def optimum(drive: Drive, state: SliderState, own: float) -> float:
    """Return the soonest stop that sequential quadratic programming finds; NaN without one [s].

    The jerks of all sliders are constant in equal times. The workspace is left out.

    Args:
        drive: with the limits and the machine.
        state: in motion, from which it stops.
        own: how long the stop of each slider by itself takes [s].
    """
    limits, machine = drive.scenario.limits, drive.workspace.machine
    begin = [np.array(each) for each in state]
    largest = limits.table[2]

    def motion(numbers: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        step = own * numbers[-1] / INTERVALS
        jerks = numbers[:-1].reshape(INTERVALS, 3) * largest
        return *driven_by(jerks, step, begin), step

    def room(numbers: FloatArray) -> FloatArray:
        heights, v, a, step = motion(numbers)
        parts = [v[1:] / limits.table[0], a[1:] / limits.table[1]]
        rooms = [1.0 - numbers[:-1], 1.0 + numbers[:-1]]
        for bound in limits.added:
            if isinstance(bound, ForceLimits):
                asked = bound.forces.forces_batch(heights, v, a)[1:]
                rooms += [(1.0 - asked / bound.up).ravel(), (1.0 + asked / bound.down).ravel()]
            else:
                speeds = np.linalg.norm(np.diff(machine.forward_batch(heights), axis=0), axis=1)
                rooms.append(1.0 - speeds / step / bound.platform_speed)
        for part in parts:
            rooms += [(1.0 - part).ravel(), (1.0 + part).ravel()]
        return np.nan_to_num(np.concatenate(rooms), nan=-1.0)

    def end(numbers: FloatArray) -> FloatArray:
        _, v, a, _ = motion(numbers)
        return np.concatenate((v[-1] / limits.table[0], a[-1] / limits.table[1]))

    best = math.inf
    for guess in (1.0, 2.0):
        found = minimize(
            lambda numbers: numbers[-1],
            np.append(np.zeros(3 * INTERVALS), guess),
            method="SLSQP",
            bounds=[*[(-1.0, 1.0)] * (3 * INTERVALS), (0.1, 20.0)],
            constraints=({"type": "ineq", "fun": room}, {"type": "eq", "fun": end}),
            options={"maxiter": 100, "ftol": 1e-5},
        )
        if room(found.x).min() > -1e-3 and np.abs(end(found.x)).max() < 1e-3:
            best = min(best, own * float(found.x[-1]))
    return best if best < math.inf else math.nan


class Found(NamedTuple):
    """What a soak has shown.

    Attributes:
        stops: all of them.
        violations: those beyond the law.
    """

    stops: list[Stop]
    violations: list[Stop]


def soak(found_stops: Iterator[Stop], many: int) -> Found:
    """Stop so ``many`` motions; what breaks the law is printed as soon as it is known."""
    found = Found([], [])
    for stop in islice(found_stops, many):
        found.stops.append(stop)
        soonest = stop.soonest if math.isnan(stop.optimum) else max(stop.soonest, stop.optimum)
        if stop.ratio_to(soonest) > 1.0:
            found.violations.append(stop)
            print(f"VIOLATION after {len(found.stops)} stops: {stop}", flush=True)
    return found


def main() -> int:
    """Stop so many motions, and print what was found.

    Returns:
        Exit code: 1 after a violation.
    """
    arguments = numbers(
        __doc__,
        count=(100_000, "of stops"),
        seed=(secrets.randbits(32), "of machines and stops"),
        machine=(0, "number of the first"),
    )
    seed = arguments.seed
    print(f"seed {seed}", flush=True)
    compared = max(arguments.count // COMPARED, 1)
    # What is there before is not copied for each stop.
    gc.freeze()
    found = soak(stops(seed, compared, arguments.machine), arguments.count)
    for kind in KINDS:
        ratios = [stop.ratio for stop in found.stops if stop.kind == kind.name]
        if ratios:
            print(f"{kind.name:20} {len(ratios):6} stops, largest {max(ratios):.3f} of the law")
    begun = Counter(stop.begun for stop in found.stops)
    print(f"cycles until it brakes: {dict(sorted(begun.items()))}")
    best = [stop.taken / stop.optimum for stop in found.stops if stop.optimum > 0.0]
    if best:
        print(f"{len(best)} times over the optimum: median {np.median(best):.2f}")
    print(f"{len(found.violations)} of {len(found.stops)} stops break the law")
    return int(bool(found.violations))


if __name__ == "__main__":
    sys.exit(main())
