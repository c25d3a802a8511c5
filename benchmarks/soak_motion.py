"""Adversarial soak of the motion engine: random commands without end, every setpoint checked.

Poses, twists, stops, changed limits and speed scales, bad input and restarts come at random, in
mid-motion and in floods. What comes out is checked by finite differences of the heights alone, as
a drive sees it: velocity, acceleration and jerk of each slider, its travel, and by the forward
kinematics the place of the platform.

After that come the 10,000 moves of ``linear_moves`` and the 10,000 jogs of ``edge_jogs``.

Run it as ``python -m benchmarks.soak_motion --steps 5000000``; it exits with 1 after a violation.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from benchmarks import edge_jogs, linear_moves
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.engine import MotionEngine, MotionKind, SliderLimits
from tri_glide_kinematics.tri_glide.geometry import DEFAULT_GEOMETRY
from tri_glide_kinematics.tri_glide.kinematics import TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace.workspace import Cylinder, Workspace, WorkspaceLimits

QUANTITIES = ("velocity", "acceleration", "jerk")

# Relative tolerances of their finite differences. That of the jerk is larger, as the rounding of
# the heights is divided by dt^3.
TOLERANCES = np.array((1e-6, 1e-6, 1e-3))

# Travel is checked exactly by the engine, the rest of the workspace to its stated tolerance [m].
TRAVEL_TOLERANCE = 1e-8
PLACE_TOLERANCE = 6e-5

# Steps between two checks of what was recorded.
BATCH = 50_000

BASE_LIMITS = SliderLimits.uniform(1.0, 10.0, 200.0)
UNEQUAL = TriGlideGeometry(
    ((0.01, 0.21), (-0.18, -0.09), (0.165, -0.11)),
    (0.40, 0.42, 0.385),
)
WIDE = WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 20.0)
NARROW = WorkspaceLimits(
    (0.35, 0.3, 0.32),
    (0.85, 0.9, 0.88),
    0.01,
    6.0,
    box_lower=(-0.12, -0.15, 0.0),
    box_upper=(0.15, 0.12, 0.5),
    cylinder=Cylinder(0.01, 0.0, 0.14, -0.5, 1.0),
)


@dataclass(frozen=True)
class Scenario:
    """A machine, its limits and how it is driven.

    Attributes:
        kind: of moves.
        dt: of each step [s].
        geometry: of the machine.
        workspace: limits of the place.
        limits: of the sliders, before they are changed.
    """

    kind: MotionKind
    dt: float
    geometry: TriGlideGeometry = DEFAULT_GEOMETRY
    workspace: WorkspaceLimits = WIDE
    limits: SliderLimits = BASE_LIMITS


UNEQUAL_LIMITS = SliderLimits((1.0, 0.6, 0.8), (10.0, 12.0, 6.0), (200.0, 150.0, 300.0))
SCENARIOS = (
    Scenario(MotionKind.SLIDER, 0.001),
    Scenario(MotionKind.LINEAR, 0.001),
    Scenario(MotionKind.SLIDER, 0.002, DEFAULT_GEOMETRY, NARROW),
    Scenario(MotionKind.LINEAR, 0.002, DEFAULT_GEOMETRY, NARROW),
    Scenario(MotionKind.SLIDER, 0.001, UNEQUAL, WIDE, UNEQUAL_LIMITS),
    Scenario(MotionKind.LINEAR, 0.002, UNEQUAL, WIDE, UNEQUAL_LIMITS),
)


@dataclass
class Findings:
    """What a soak has seen.

    Attributes:
        steps: number of setpoints.
        commands: how many of each kind were accepted.
        refusals: how many were refused, by the name of the error.
        peaks: largest finite differences as a part of their limits: velocity, acceleration, jerk.
        travel: largest overrun of slider travel; negative if never reached [m].
        place: largest overrun of the other limits of the workspace [m].
        idle: part of the steps in which nothing moved.
        violations: descriptions of the first few.
        plans: how many were made, where this is counted.
        slowest: longest call of a command or step [s].
    """

    steps: int = 0
    commands: Counter[str] = field(default_factory=Counter)
    refusals: Counter[str] = field(default_factory=Counter)
    peaks: FloatArray = field(default_factory=lambda: np.zeros(3))
    travel: float = -math.inf
    place: float = -math.inf
    still: int = 0
    violations: list[str] = field(default_factory=list)
    plans: int = 0

    def violated(self, text: str) -> None:
        """Note a violation."""
        if len(self.violations) < 20:
            self.violations.append(text)


class Judge:
    """Checks recorded heights by differences, from batch to batch without a gap."""

    def __init__(
        self, scenario: Scenario, findings: Findings, *, starts_inside: bool = True
    ) -> None:
        """Judge the setpoints of a ``scenario`` and note what is found in ``findings``.

        Args:
            scenario: machine and limits.
            findings: to be added to.
            starts_inside: whether each start is inside the workspace, which then must not be left.
        """
        self._scenario = scenario
        self._starts_inside = starts_inside
        self._machine = TriGlide(scenario.geometry)
        self._findings = findings
        self._heights = np.empty((0, 3))
        self._bounds = np.empty((0, 3, 3))
        self._streak = np.empty(0, dtype=np.int64)

    def add(self, heights: FloatArray, bounds: FloatArray, streak: NDArray[np.int64]) -> None:
        """Check setpoints that follow those added before.

        Args:
            heights: Shape (n, 3) [m].
            bounds: of velocity, acceleration and jerk in the step that led to each.
                Shape (n, 3, 3).
            streak: number of steps since the last start, 0 for the setpoint of the start itself.
                Shape (n,).
        """
        fresh = len(self._heights)
        heights = np.concatenate((self._heights, heights))
        bounds = np.concatenate((self._bounds, bounds))
        streak = np.concatenate((self._streak, streak))
        difference = heights
        allowed = np.zeros_like(bounds)
        for order, quantity in enumerate(QUANTITIES, start=1):
            difference = np.diff(difference, axis=0) / self._scenario.dt
            # A difference of this order spans so many steps, each under the limits of its time.
            allowed = np.stack(
                [bounds[order - back : len(bounds) - back, order - 1] for back in range(order)]
            ).max(axis=0)
            spans = streak[order:] >= order
            new = np.arange(order, len(heights)) >= fresh
            ratios = np.where((spans & new)[:, np.newaxis], np.abs(difference) / allowed, 0.0)
            worst = float(ratios.max(initial=0.0))
            self._findings.peaks[order - 1] = max(self._findings.peaks[order - 1], worst)
            if worst > 1.0 + TOLERANCES[order - 1]:
                row, slider = np.unravel_index(int(ratios.argmax()), ratios.shape)
                self._findings.violated(
                    f"{quantity} of slider {slider + 1} is {worst:.9f} of its limit after step "
                    f"{self._findings.steps + row + order - fresh} of {self._scenario}"
                )
        if self._starts_inside:
            self._check_places(heights[fresh:])
        self._findings.steps += len(heights) - fresh
        self._findings.still += int((np.diff(heights[fresh:], axis=0) == 0.0).all(axis=1).sum())
        self._heights, self._bounds, self._streak = heights[-3:], bounds[-3:], streak[-3:]

    def _check_places(self, heights: FloatArray) -> None:
        limits, geometry = self._scenario.workspace, self._scenario.geometry
        travel = np.maximum(
            np.array(limits.lower_heights) - heights, heights - np.array(limits.upper_heights)
        ).max()
        positions = self._machine.forward_batch(heights)
        x, y, z = positions.T
        across = np.array(geometry.anchors) - positions[:, np.newaxis, :2]
        distances = np.hypot(across[..., 0], across[..., 1])
        lengths = np.array(geometry.arm_lengths)
        overruns = [distances - lengths + limits.reach_margin]
        if limits.box_lower is not None:
            overruns.append(np.array(limits.box_lower) - positions)
        if limits.box_upper is not None:
            overruns.append(positions - np.array(limits.box_upper))
        if limits.cylinder is not None:
            cylinder = limits.cylinder
            radii = np.hypot(x - cylinder.center_x, y - cylinder.center_y)
            overruns.append((radii - cylinder.radius)[:, np.newaxis])
            overruns.append(np.stack((cylinder.z_min - z, z - cylinder.z_max), axis=1))
        place = max(float(overrun.max()) for overrun in overruns)
        # A place outside the condition number counts if a place beside it, nearer to the middle
        # of the machine by the tolerance, is outside too.
        inwards = positions * np.array((1.0, 1.0, 0.0))
        sizes = np.maximum(np.hypot(x, y), PLACE_TOLERANCE)
        inside = positions - inwards * (PLACE_TOLERANCE / sizes)[:, np.newaxis]
        conditions = np.minimum(self._conditions(positions), self._conditions(inside))
        findings = self._findings
        findings.travel = max(findings.travel, float(travel))
        findings.place = max(findings.place, place)
        if not travel <= TRAVEL_TOLERANCE:
            findings.violated(f"slider travel passed by {travel:.3g} m in {self._scenario}")
        if not place <= PLACE_TOLERANCE:
            findings.violated(f"workspace left by {place:.3g} m in {self._scenario}")
        if not conditions.max() <= limits.max_condition_number * (1.0 + 1e-6):
            findings.violated(f"condition number {conditions.max():.6f} in {self._scenario}")

    def _conditions(self, positions: FloatArray) -> FloatArray:
        """Return condition numbers, of the few places only where they may be large."""
        geometry, limits = self._scenario.geometry, self._scenario.workspace
        across = np.array(geometry.anchors) - positions[:, np.newaxis, :2]
        squares = np.square(np.array(geometry.arm_lengths)) - np.square(across).sum(axis=-1)
        matrices = np.ones((len(positions), 3, 3))
        matrices[..., :2] = across / np.sqrt(squares)[..., np.newaxis]
        # The Frobenius norm and the determinant bound the condition number from above.
        norms = np.sqrt(np.square(matrices).sum(axis=(1, 2)))
        bounds = 2.0 * (norms / math.sqrt(3.0)) ** 3 / np.abs(np.linalg.det(matrices))
        conditions = np.ones(len(positions))
        near = bounds > limits.max_condition_number
        if near.any():
            conditions[near] = np.linalg.cond(matrices[near])
        return conditions


class Adversary:
    """Commands an engine at random."""

    def __init__(self, scenario: Scenario, rng: np.random.Generator, findings: Findings) -> None:
        """Prepare an engine for the ``scenario``."""
        self._scenario = scenario
        self._rng = rng
        self._findings = findings
        self.workspace = Workspace(TriGlide(scenario.geometry), scenario.workspace)
        self.engine = MotionEngine(self.workspace, scenario.limits, kind=scenario.kind)
        self._twist = np.zeros(3)
        self._actions: tuple[tuple[float, Callable[[], object]], ...] = (
            (0.30, self._move),
            (0.06, self._move_nearby),
            (0.14, self._jog),
            (0.16, self._jog_onwards),
            (0.08, self._jog_again),
            (0.08, self._stop),
            (0.05, self._set_limits),
            (0.05, self._set_scale),
            (0.06, self._nonsense),
            (0.02, self._restart),
        )
        self._chances = np.cumsum([chance for chance, _ in self._actions])
        self._chances /= self._chances[-1]
        self.restarted = True
        self._restart()

    def act(self) -> None:
        """Give one command."""
        index = int(np.searchsorted(self._chances, self._rng.random()))
        action = self._actions[index][1]
        try:
            action()
        except KinematicsError as error:
            self._findings.refusals[type(error).__name__] += 1
        else:
            self._findings.commands[action.__name__.strip("_")] += 1

    def place(self) -> Sequence[float]:
        """Return a random place inside the workspace."""
        lower, upper = (-0.3, -0.3, -0.2), (0.3, 0.3, 0.8)
        while True:
            place = self._rng.uniform(lower, upper).tolist()
            try:
                self.workspace.check_position(place)
            except KinematicsError:
                continue
            return [float(value) for value in place]

    def _move(self) -> None:
        self.engine.move_to(self.place())

    def _move_nearby(self) -> None:
        here = self._scenario_machine().forward(self.engine.state.heights)
        size = 10.0 ** self._rng.uniform(-9.0, -1.5)
        self.engine.move_to((np.array(here) + size * self._rng.normal(size=3)).tolist())

    def _scenario_machine(self) -> TriGlide:
        return self.workspace.machine

    def _jog(self) -> None:
        direction = self._rng.normal(size=3)
        if self._rng.random() < 0.4:
            direction[self._rng.integers(3)] = 0.0
        speed = 10.0 ** self._rng.uniform(-3.0, 0.3)
        self._twist = direction / np.linalg.norm(direction) * speed
        self.engine.jog(self._twist.tolist())

    def _jog_onwards(self) -> None:
        change = 10.0 ** self._rng.uniform(-6.0, -0.5) * np.linalg.norm(self._twist)
        self._twist = self._twist + change * self._rng.normal(size=3)
        self.engine.jog(self._twist.tolist())

    def _jog_again(self) -> None:
        self.engine.jog(self._twist.tolist())

    def _stop(self) -> None:
        self.engine.stop()

    def _set_limits(self) -> None:
        base = self._scenario.limits
        factors = 10.0 ** self._rng.uniform(-0.7, 0.3, size=(3, 3))
        self.engine.set_limits(
            SliderLimits(
                *(
                    tuple(np.array(values) * row)
                    for values, row in zip((base.velocity, base.acceleration, base.jerk), factors)
                )
            )
        )

    def _set_scale(self) -> None:
        self.engine.set_speed_scale(float(self._rng.uniform(0.05, 1.0)))

    def _nonsense(self) -> None:
        engine, bad = self.engine, float(self._rng.choice((math.nan, math.inf, -math.inf)))
        calls: tuple[Callable[[], object], ...] = (
            lambda: engine.move_to((0.0, bad, 0.3)),
            lambda: engine.move_to((9.0, 0.0, 0.3)),
            lambda: engine.move_to((0.0, 0.3)),
            lambda: engine.jog((bad, 0.0, 0.0)),
            lambda: engine.jog((0.1, 0.0, 0.0, 0.0)),
            lambda: engine.set_speed_scale(bad),
            lambda: engine.set_speed_scale(0.0),
            lambda: engine.start((0.5, bad, 0.5)),
            lambda: engine.step(bad),
            lambda: engine.step(0.0),
        )
        calls[self._rng.integers(len(calls))]()
        self._findings.violated("bad input was accepted")

    def _restart(self) -> None:
        """Start anew at a random place: where the sliders came to rest without the engine."""
        self.engine.start(self.workspace.check_position(self.place()))
        self.restarted = True


def soak(scenario: Scenario, steps: int, seed: int, findings: Findings) -> None:
    """Drive an engine for a number of ``steps`` and check all of them."""
    rng = np.random.default_rng(seed)
    adversary = Adversary(scenario, rng, findings)
    engine, judge = adversary.engine, Judge(scenario, findings)
    done = streak = 0
    while done < steps:
        count = min(BATCH, steps - done)
        heights = np.empty((count, 3))
        bounds = np.empty((count, 3, 3))
        streaks = np.empty(count, dtype=np.int64)
        pauses = iter(random_pauses(rng, count))
        pause = next(pauses)
        known: tuple[SliderLimits, float] | None = None
        bound = np.empty((3, 3))
        for row in range(count):
            pause -= 1
            if pause <= 0:
                pause = next(pauses)
                adversary.act()
            if adversary.restarted:
                adversary.restarted = False
                streak = 0
                heights[row] = engine.state.heights
            else:
                streak += 1
                heights[row] = engine.step(scenario.dt).heights
            if known is None or known[0] is not engine.limits or known[1] != engine.speed_scale:
                known = engine.limits, engine.speed_scale
                effective = known[0].with_velocity_scaled(known[1])
                bound = np.array((effective.velocity, effective.acceleration, effective.jerk))
            bounds[row] = bound
            streaks[row] = streak
        judge.add(heights, bounds, streaks)
        done += count


def random_pauses(rng: np.random.Generator, count: int) -> list[int]:
    """Return numbers of steps between commands: calm, busy, and now and then a flood."""
    pauses: list[int] = []
    while sum(pauses) <= count:
        mood = rng.random()
        if mood < 0.5:
            pauses += rng.geometric(1.0 / 300.0, size=5).tolist()
        elif mood < 0.9:
            pauses += rng.geometric(1.0 / 30.0, size=15).tolist()
        else:
            pauses += [1] * int(rng.integers(5, 40))
    return [*pauses, count]


def main(arguments: Sequence[str] | None = None) -> int:
    """Soak all scenarios and print what was found."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=5_000_000, help="setpoints to check in all")
    parser.add_argument("--seed", type=int, default=1, help="of the random commands")
    options = parser.parse_args(arguments)
    findings = Findings()
    began = time.monotonic()
    for number, scenario in enumerate(SCENARIOS):
        share = options.steps // len(SCENARIOS) + (number < options.steps % len(SCENARIOS))
        soak(scenario, share, options.seed * 1000 + number, findings)
        print(
            f"{findings.steps:>9} steps, {sum(findings.commands.values())} commands, "
            f"{time.monotonic() - began:.0f} s",
            flush=True,
        )
    print("accepted:", dict(findings.commands.most_common()))
    print("refused: ", dict(findings.refusals.most_common()))
    print(f"at rest in {findings.still / findings.steps:.1%} of the steps")
    for quantity, peak, tolerance in zip(QUANTITIES, findings.peaks, TOLERANCES):
        print(f"largest {quantity:12} {peak:.9f} of its limit (tolerance {tolerance:g})")
    print(f"farthest beyond slider travel {findings.travel:.3g} m")
    print(f"farthest beyond the rest of the workspace {findings.place:.3g} m")
    for violation in findings.violations:
        print("VIOLATION:", violation)
    print("linear moves:", flush=True)
    moves = linear_moves.main([])
    print("jogs into the edge:", flush=True)
    jogs = edge_jogs.main([])
    return 1 if findings.violations or moves or jogs else 0


if __name__ == "__main__":
    sys.exit(main())
