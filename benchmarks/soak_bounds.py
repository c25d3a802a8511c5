"""Adversarial soak of the added bounds: a platform speed limit and force limits in all motion.

The commands are those of ``soak_motion``, in mid-motion and in floods, with shapers, scales, stops,
pauses and restarts; besides, the speed limit, the force limits, masses and payload change. Each
setpoint is judged: the speed of the platform by its velocity and by the difference of two places,
the forces by the motion of the setpoint. A change may count for the setpoint before it, too.

Run it as ``python -m benchmarks.soak_bounds --steps 500000``; it exits with 1 after a violation.
"""

from __future__ import annotations

import sys
from collections import Counter
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from benchmarks.command_line import numbers
from benchmarks.judge import SCENARIOS, Findings, Scenario
from benchmarks.soak_motion import Adversary
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.motion import (
    AddedBound,
    CannotHoldError,
    ForceLimits,
    PlatformSpeedLimit,
    SliderState,
)
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import Vector3

PERIOD = 0.001  # s
# Steps between two commands, in the mean.
PAUSE = 60
BOUNDED = 0.9  # of all changes set a bound of a kind
SPEEDS = (0.01, 1.0)  # m/s
UPWARDS, DOWNWARDS = (30.0, 60.0), (15.0, 60.0)  # N
TOLERANCE = 1e-6


class BoundAdversary(Adversary):
    """Commands an engine at random, and changes its added bounds."""

    def _set_limits(self) -> None:
        sliders = self.engine._holder.newest_limits.sliders
        bounds = random_bounds(self._rng, self.workspace.machine)
        self.engine.set_limits(sliders.with_added(*bounds))


def random_bounds(
    rng: np.random.Generator,
    machine: TriGlide,
    speeds: tuple[float, float] = SPEEDS,
    chance: float = BOUNDED,
) -> list[AddedBound]:
    """Return bounds for a ``machine``, each with a ``chance``; speed limits of these sizes."""
    added: list[AddedBound] = []
    if rng.random() < chance:
        low, high = np.log10(speeds)
        added.append(PlatformSpeedLimit(machine, float(10.0 ** rng.uniform(low, high))))
    if rng.random() < chance:
        masses = Masses.uniform(
            1.0,
            float(rng.uniform(0.0, 0.3)),
            1.0,
            payload=float(rng.choice((0.0, 0.5))),
            coulomb=float(rng.choice((0.0, 2.0))),
            viscous=float(rng.choice((0.0, 5.0))),
        )
        up, down = float(rng.uniform(*UPWARDS)), float(rng.uniform(*DOWNWARDS))
        added.append(ForceLimits(SliderForces(machine, masses), (up,) * 3, (down,) * 3))
    return added


class Use(NamedTuple):
    """The largest parts of the bounds that were used.

    Attributes:
        speed: of the platform, by its velocity.
        difference: of the platform, by two places.
        force: of the sliders.
    """

    speed: float = 0.0
    difference: float = 0.0
    force: float = 0.0

    def joined(self, other: Use) -> Use:
        """Return the larger of each."""
        return Use(*(max(each) for each in zip(self, other)))


def soaked(scenario: Scenario, seed: int, steps: int) -> tuple[Use, Counter[str]]:
    """Return the largest use in so many ``steps``, and how many each phase had."""
    rng = np.random.default_rng(seed)
    adversary = BoundAdversary(scenario, rng, Findings())
    engine, machine = adversary.engine, adversary.workspace.machine
    use, phases = Use(), Counter[str]()
    before, place = engine.limits.added, None
    with suppress(CannotHoldError):
        adversary._set_limits()
    for _ in range(steps):
        if rng.random() * PAUSE < 1.0:
            adversary.act()
        if adversary.restarted:
            adversary.restarted = False
            before, place = engine.limits.added, None
        if scenario.in_pieces:
            engine.work(lambda: rng.random() < 0.5)
        state = engine.step(PERIOD)
        added = engine.limits.added
        use = use.joined(_used(state, place, (before, added)))
        before, place = added, machine.forward(state.heights)
        phases[engine.phase.value] += 1
    return use, phases


def _used(
    state: SliderState, place: Vector3 | None, either: tuple[tuple[AddedBound, ...], ...]
) -> Use:
    """Return what a setpoint uses of the bounds, of either of two sets of them."""
    uses = []
    for added in either:
        use = Use()
        for bound in added:
            if isinstance(bound, PlatformSpeedLimit):
                now, velocity = bound.machine.forward_velocity(state.heights, state.velocities)
                way = 0.0 if place is None else float(np.linalg.norm(np.subtract(now, place)))
                speed = float(np.linalg.norm(velocity)) / bound.speed
                use = use.joined(Use(speed, way / PERIOD / bound.speed))
            elif isinstance(bound, ForceLimits):
                force = np.array(bound.forces.forces(*state))
                parts = np.maximum(force / np.array(bound.up), -force / np.array(bound.down))
                use = use.joined(Use(force=float(parts.max())))
        uses.append(use)
    return Use(*(min(each) for each in zip(*uses)))


def main() -> int:
    """Soak each kind of motion, and print what was found.

    Returns:
        Exit code: 1 after a violation.
    """
    steps = 500_000, "of all scenarios together"
    arguments = numbers(__doc__, steps=steps, seed=(1, "of the random commands"))
    total = Use()
    for number, scenario in enumerate(SCENARIOS):
        each = arguments.steps // len(SCENARIOS)
        use, phases = soaked(scenario, arguments.seed + number, each)
        pieces = "in pieces" if scenario.in_pieces else "at once"
        print(f"{scenario.kind.value}, {pieces}: {use}, {dict(phases)}", flush=True)
        total = total.joined(use)
    print(f"largest parts of the bounds: {total} (tolerance {TOLERANCE:g})")
    return int(max(total) > 1.0 + TOLERANCE)


if __name__ == "__main__":
    sys.exit(main())
