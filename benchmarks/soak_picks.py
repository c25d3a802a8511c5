"""Soak of transfers: random cycles of pick and place from belts that do what they like.

Belts run evenly, change their speed, stop or turn at once; encoders fall silent, renewals come with
noise, parts leave the reach, machines are stopped at any moment, limits change on the way. Every
setpoint is judged: how far it is below the pick height, by differences of heights how much of the
limits it uses, and how far the platform is from the part that it grips.

Run it as ``python -m benchmarks.soak_picks --cycles 10000``; it exits with 1 after a violation.
Each machine has a source of chance of its own: ``--machine N`` begins with the ``N``th.
"""

from __future__ import annotations

import math
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import count
from typing import NamedTuple

import numpy as np

from benchmarks.command_line import numbers
from benchmarks.judge import LIMITS, UNEQUAL, UNEQUAL_LIMITS, WIDE
from benchmarks.soak import pieces, random_shaper
from benchmarks.soak_bounds import random_bounds
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import CannotHoldError, MotionEngine, MotionPhase
from tri_glide_kinematics.motion.engine import Station
from tri_glide_kinematics.motion.limit_use import CommandStream, LimitUse
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.vectors import BoolArray, FloatArray, Vector3
from tri_glide_kinematics.workspace import Workspace

# Cycles of one machine, one after the other, and how long one may take [s].
CYCLES, LONGEST = 8, 6.0
# So far below the pick height the platform may be [m], and to the side of the belt it is judged.
BELOW, WIDTH = 1e-4, 0.015
# A belt that is not level is judged within this of its part [m]: farther on it may lie higher than
# the platform travels.
NEAR = 0.05
# It is above the part for so long after the dwell, at least [s].
LEAVES = 0.03
PERIODS = (0.001, 0.002, 0.004)  # s
SPEEDS = (0.05, 0.5)  # m/s
# What belts do, and how often.
KINDS = {"even": 4, "ramp": 3, "stops": 1, "turns": 1, "jumps": 0.5, "silent": 1, "rests": 1}


class Belt:
    """A way along a direction over time, of pieces with constant acceleration."""

    def __init__(self, direction: FloatArray, speed: float) -> None:
        """Run at a ``speed`` [m/s]."""
        self.direction = direction
        # Begin, way, speed and acceleration of each piece.
        self._pieces = [(-math.inf, 0.0, speed, 0.0)]
        self._zero = 0.0

    def change(self, begin: float, acceleration: float, duration: float, jump: float = 0.0) -> None:
        """Let the speed change at a time ``begin`` [s], later than all before."""
        way, speed, _ = self.at(begin)
        self._pieces.append((begin, way + jump, speed, acceleration))
        way, speed, _ = self.at(begin + duration)
        self._pieces.append((begin + duration, way, speed, 0.0))

    def at(self, instant: float) -> tuple[float, float, float]:
        """Return way [m], speed [m/s] and acceleration [m/s^2]."""
        begin, way, speed, acceleration = next(
            piece for piece in reversed(self._pieces) if piece[0] <= instant
        )
        t = instant - (0.0 if math.isinf(begin) else begin)
        return way + (speed + 0.5 * acceleration * t) * t, speed + acceleration * t, acceleration


class Part:
    """A part on a belt, and how high it lies."""

    def __init__(self, place: Vector3, belt: Belt, now: float) -> None:
        """Lie at a ``place`` [m] now [s]."""
        self._place, self._belt = np.array(place), belt
        self._begin = belt.at(now)[0]
        size = np.linalg.norm(belt.direction[:2])
        self._level, self._slope = belt.direction[:2] / size, belt.direction[2] / size

    def stop(self, instant: float, dwell: float, noise: FloatArray | float = 0.0) -> Station:
        """Return where it is at an ``instant`` [s], and how it moves."""
        way, speed, acceleration = self._belt.at(instant)
        place = self._place + (way - self._begin) * self._belt.direction + noise
        velocity, change = speed * self._belt.direction, acceleration * self._belt.direction
        return Station(vector(place), dwell, vector(velocity), vector(change))

    def depths(self, places: FloatArray) -> FloatArray:
        """Return how far ``places`` above the belt are below the part's height. Shape (n,) [m]."""
        off = places - self._place
        along = off[:, :2] @ self._level
        across = off[:, :2] @ (-self._level[1], self._level[0])
        depth = self._slope * along - off[:, 2]
        return np.asarray(np.where(np.abs(across) < WIDTH, depth, -math.inf))

    def is_near(self, places: FloatArray, instants: Sequence[float]) -> BoolArray:
        """Return which of ``places`` are judged, at ``instants`` [s]. Shape (n,)."""
        parts = np.array([self.stop(instant, 0.0).position for instant in instants])
        beside = (places - parts)[:, :2] @ self._level
        return np.asarray((np.abs(beside) < NEAR) | (self._slope == 0.0))


def vector(values: FloatArray) -> Vector3:
    """Return three numbers."""
    x, y, z = values.tolist()
    return x, y, z


@dataclass
class Findings:
    """What a soak has seen.

    Attributes:
        lowest: the largest depth below a pick height [m].
        use: largest parts of velocity, acceleration and jerk.
        errors: at the grips that were made, by what the belt did and whether views had noise [m].
        outcomes: how many there were of each.
        violations: what is wrong.
        cycles: how many there were.
    """

    lowest: float = -math.inf
    use: FloatArray = field(default_factory=lambda: np.zeros(3))
    errors: dict[str, list[float]] = field(default_factory=dict)
    outcomes: Counter[str] = field(default_factory=Counter)
    violations: list[str] = field(default_factory=list)
    cycles: int = 0


class Asked(NamedTuple):
    """What one cycle asks for.

    Attributes:
        kind: what the belt does.
        part: on it.
        dwell: at the part, and at the place [s].
        period: from one renewal to the next [s].
        noise: of renewals [m].
        silent_at: from then on nothing is renewed [s].
        stop_at: when the machine is stopped [s].
        allowed: error at the arrival [m].
    """

    kind: str
    part: Part
    dwell: float
    period: float
    noise: float
    silent_at: float
    stop_at: float
    allowed: float


class Picker:
    """A machine with random limits that picks at random."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Start it."""
        self.rng = rng
        is_unequal = rng.random() < 0.3
        self.machine = TriGlide(UNEQUAL if is_unequal else DEFAULT_GEOMETRY)
        self.workspace = Workspace(self.machine, WIDE)
        limits = UNEQUAL_LIMITS if is_unequal else LIMITS
        if rng.random() < 0.3:
            bounds = random_bounds(rng, self.machine, (0.4, 2.0), 0.6)
            limits = limits.with_added(*bounds)
        self.limits = limits
        self.in_pieces = bool(rng.random() < 0.6)
        self.dt = float(rng.choice(PERIODS))
        self.engine = MotionEngine(self.workspace, limits, in_pieces=self.in_pieces)
        if rng.random() < 0.25:
            self.engine.set_shaper(random_shaper(rng))
        self.engine.start(self.machine.inverse(self.place()))

    def place(self) -> Vector3:
        """Return a place that can be reached [m]."""
        while True:
            angle, radius = self.rng.uniform(0.0, 2.0 * math.pi), 0.17 * self.rng.random() ** 0.5
            x, y, z = radius * math.cos(angle), radius * math.sin(angle), self.rng.uniform(0.2, 0.3)
            try:
                self.workspace.check_position((x, y, z))
            except KinematicsError:
                continue
            return x, y, z

    def asked(self) -> Asked:
        """Return what the next cycle asks for."""
        rng, now = self.rng, self.engine.elapsed
        chances = np.array(list(KINDS.values())) / sum(KINDS.values())
        kind = str(rng.choice(list(KINDS), p=chances))
        angle, tilt = rng.uniform(0.0, 2.0 * math.pi), 0.0
        if rng.random() < 0.2:
            tilt = rng.uniform(-0.15, 0.15)
        level = math.cos(tilt)
        direction = np.array((level * math.cos(angle), level * math.sin(angle), math.sin(tilt)))
        speed = 0.0 if kind == "rests" else float(rng.uniform(*SPEEDS))
        belt, begin = Belt(direction, speed), now + rng.uniform(0.0, 1.5)
        if kind == "ramp":
            belt.change(begin, 0.2 * rng.choice((-1.0, 1.0)), rng.uniform(0.1, 2.0))
        elif kind in ("stops", "turns"):
            duration = rng.uniform(0.001, 0.3)
            factor = rng.uniform(1.2, 2.0) if kind == "turns" else 1.0
            belt.change(begin, -factor * speed / duration, duration)
        elif kind == "jumps":
            belt.change(begin, 0.0, 0.01, rng.uniform(-0.05, 0.05))
        # Most parts are in the reach when they are gripped.
        place = np.array(self.place()) - rng.uniform(0.4, 0.9) * speed * direction
        part = Part(vector(place), belt, now)
        never = math.inf
        return Asked(
            kind,
            part,
            float(rng.choice((0.0, 0.02, 0.05, 0.1))),
            rng.uniform(0.01, 0.04),
            float(rng.choice((0.0, 0.0, 5e-5, 3e-4))),
            begin if kind == "silent" else never,
            now + rng.uniform(0.0, 1.6) if rng.random() < 0.15 else never,
            float(rng.choice((2e-4, 1e-3, 3e-3))),
        )

    def work(self) -> None:
        """Let a random number of pieces be planned."""
        if self.in_pieces:
            self.engine.work(pieces(int(self.rng.integers(4, 40))))

    def cycle(self, findings: Findings, name: str) -> None:
        """Pick a part, place it, and judge all of it."""
        asked, engine, rng = self.asked(), self.engine, self.rng
        begun, last, number = engine.elapsed, engine.elapsed, engine.plan_number
        home = engine.platform[0]
        place = home if rng.random() < 0.5 else self.place()
        stations = [asked.part.stop(begun, asked.dwell), Station(place, asked.dwell)]
        # A belt may lead upwards.
        levels = [asked.part.stop(begun + later, 0.0).position[2] for later in (0.0, 1.5)]
        height = max(home[2], place[2], *levels) + rng.uniform(0.01, 0.04)
        tolerance = float(rng.choice((0.001, 0.005, 0.01)))
        lifts = bool(rng.random() < 0.3)
        try:
            engine.transfer(
                stations, height, tolerance=tolerance, lifts=lifts, allowed=asked.allowed
            )
        except KinematicsError as error:
            findings.outcomes[f"refused: {type(error).__name__}"] += 1
            engine.step(self.dt)
            return
        lowered_at = begun + rng.uniform(0.0, 1.5) if rng.random() < 0.1 else math.inf
        heights, bounds, errors = [engine.state.heights], [self.bound()], []
        outcome, stopped, left = "", math.nan, math.inf
        while engine.elapsed - begun < LONGEST:
            self.work()
            heights.append(engine.step(self.dt).heights)
            bounds.append(self.bound())
            now, progress = engine.elapsed, engine.transfer_progress
            refusal = engine.take_refusal()
            if refusal is not None:
                outcome = outcome or f"refused later: {type(refusal).__name__}"
            if progress is not None and engine.plan_number > number:
                arrival = progress.arrivals[0]
                if arrival < -asked.dwell - LEAVES:
                    left = min(left, len(heights))
                if progress.gives_up is not None:
                    outcome = outcome or "given up"
                elif -asked.dwell <= arrival <= 1e-9:
                    there = asked.part.stop(now, 0.0).position
                    errors.append(math.dist(engine.platform[0], there))
                if arrival > -asked.dwell and now - last >= asked.period and now < asked.silent_at:
                    engine.renew(
                        0, asked.part.stop(now, asked.dwell, asked.noise * rng.normal(size=3))
                    )
                    last = now
            if now >= lowered_at:
                lowered_at = math.inf
                table = self.limits.table * rng.uniform(0.5, 1.0, (3, 1))
                engine.set_limits(self.limits.with_table(table))
            if now >= asked.stop_at and math.isnan(stopped):
                stopped = now
                outcome = outcome or "stopped"
                engine.stop()
            if engine.phase is MotionPhase.IDLE and not engine.preparing:
                break
        else:
            findings.violations.append(f"{name}: does not come to rest")
        outcome = outcome or "placed"
        findings.outcomes[outcome] += 1
        self.judge(findings, name, asked, begun, np.array(heights), np.array(bounds), left)
        if errors and outcome == "placed":
            what = f"{asked.kind}{', noise' if asked.noise else ''}"
            findings.errors.setdefault(what, []).append(max(errors))
        engine.set_limits(self.limits)
        while engine.limits_pending:
            engine.step(self.dt)
            self.work()

    def bound(self) -> FloatArray:
        """Return the limits in force. Shape (3, 3)."""
        return self.engine.limits.table

    def judge(
        self,
        findings: Findings,
        name: str,
        asked: Asked,
        begun: float,
        heights: FloatArray,
        bounds: FloatArray,
        left: float,
    ) -> None:
        """Judge setpoints from ``begun`` [s] on; by the row ``left`` it has left the part."""
        use = LimitUse.of(CommandStream.from_heights(heights, self.dt), bounds)
        findings.use = np.maximum(findings.use, use.largest)
        findings.violations += [f"{name}: {text}" for text in use.violations()]
        heights = heights[: int(min(left, len(heights)))]
        places = self.machine.forward_batch(heights)
        instants = [begun + row * self.dt for row in range(len(places))]
        depths = asked.part.depths(places)
        # Where it begins below the belt it has not been above yet.
        is_judged = np.maximum.accumulate(depths < 0.0) & asked.part.is_near(places, instants)
        depths[~is_judged] = -math.inf
        lowest = float(depths.max())
        findings.lowest = max(findings.lowest, lowest)
        if lowest > BELOW:
            row = int(depths.argmax())
            findings.violations.append(
                f"{name} ({asked.kind}): {1e3 * lowest:.3f} mm too low in row {row}"
            )


def machines(seed: int, first: int) -> Iterator[tuple[int, Picker]]:
    """Yield machines and their numbers, without end."""
    for number in count(first):
        try:
            yield number, Picker(np.random.default_rng((seed, number)))
        except CannotHoldError:
            continue


def soak(cycles: int, seed: int, first: int, findings: Findings) -> None:
    """Drive so many ``cycles``; what is wrong is printed as soon as it is known."""
    begun = time.monotonic()
    for number, picker in machines(seed, first):
        for each in range(CYCLES):
            if findings.cycles == cycles:
                return
            told = len(findings.violations)
            picker.cycle(findings, f"machine {number}, cycle {each}")
            for text in findings.violations[told:]:
                print("VIOLATION:", text, flush=True)
            findings.cycles += 1
            if findings.cycles % 100 == 0:
                lowest = f"lowest {1e3 * findings.lowest:.6f} mm"
                spent = f"{time.monotonic() - begun:.0f} s"
                print(f"{findings.cycles:>6} cycles, {lowest}, {spent}", flush=True)


def main() -> int:
    """Drive, and print what was found.

    Returns:
        Exit code: 1 after a violation.
    """
    options = numbers(
        __doc__,
        cycles=(200, "of pick and place"),
        seed=(1, "of machines and belts"),
        machine=(0, "number of the first"),
    )
    print(f"seed {options.seed}")
    findings = Findings()
    with suppress(KeyboardInterrupt):
        soak(options.cycles, options.seed, options.machine, findings)
    print(f"{findings.cycles} cycles")
    print(f"lowest place below the pick height: {1e3 * findings.lowest:.6f} mm")
    print("largest parts of velocity, acceleration and jerk:", findings.use.round(7).tolist())
    for kind, errors in sorted(findings.errors.items()):
        median, most = 1e3 * np.median(errors), 1e3 * max(errors)
        print(
            f"error at {len(errors)} grips, {kind}: median {median:.4f} mm, largest {most:.4f} mm"
        )
    print("outcomes:", dict(findings.outcomes.most_common()))
    print(f"{len(findings.violations)} violations")
    return int(bool(findings.violations))


if __name__ == "__main__":
    sys.exit(main())
