"""Adversarial soak of the motion engine: random commands without end, every setpoint checked.

Poses, twists, paths, stops, changed limits, speed scales and shapers, bad input and restarts come
at random, in mid-motion and in floods. What comes out is checked by finite differences of the
heights alone, as a drive sees it: velocity, acceleration and jerk of each slider, its travel, and
by the forward kinematics the place of the platform. From an engine that is idle nothing moves.

After that come the 10,000 moves of ``linear_moves`` and the 10,000 jogs of ``edge_jogs``.

Run it as ``python -m benchmarks.soak_motion --steps 5000000``; it exits with 1 after a violation.
"""

import math
import sys
from collections.abc import Callable

import numpy as np

from benchmarks import edge_jogs, linear_moves
from benchmarks.judge import COARSE, SCENARIOS, Findings, Judge, Scenario
from benchmarks.soak import (
    RandomActions,
    random_path,
    random_pauses,
    random_place,
    random_shaper,
    soak_all,
    some_pieces,
)
from tri_glide_kinematics.motion import MotionEngine, MotionPhase, PlatformPath, SliderLimits
from tri_glide_kinematics.motion.limit_use import LIMIT_TOLERANCE
from tri_glide_kinematics.motion.limits import QUANTITIES
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

# Steps between two checks of what was recorded.
BATCH = 50_000

# Sliders of an engine that is idle move no more than the rounding of their heights [m].
STILL = 1e-12


class Adversary:
    """Commands an engine at random."""

    def __init__(self, scenario: Scenario, rng: np.random.Generator, findings: Findings) -> None:
        """Prepare an engine for the ``scenario``."""
        self._scenario = scenario
        self._rng = rng
        self._findings = findings
        self.workspace = Workspace(TriGlide(scenario.geometry), scenario.workspace)
        self.engine = MotionEngine(
            self.workspace, scenario.limits, kind=scenario.kind, in_pieces=scenario.in_pieces
        )
        self._twist = np.zeros(3)
        self._target, self._target_velocity = np.zeros(3), np.zeros(3)
        self._path_end: Vector3 = (0.0, 0.0, 0.0)
        # Where each coarse step makes a whole plan, the proof of shaped slow ones takes too long.
        actions: tuple[tuple[float, Callable[[], object]], ...] = (
            (0.30, self._move),
            (0.06, self._move_nearby),
            (0.14, self._jog),
            (0.16, self._jog_onwards),
            (0.08, self._jog_again),
            (0.10, self._track),
            (0.10, self._track_onwards),
            (0.08, self.engine.stop),
            (0.12, self._follow),
            (0.0, self._extend),
            (0.10, self.engine.pause),
            (0.06, self.engine.resume),
            (0.05, self._set_limits),
            (0.05, self._set_scale),
            (0.06 * (scenario not in COARSE or scenario.in_pieces), self._set_shaper),
            (0.06, self._nonsense),
            (0.02, self._restart),
        )
        self._random_actions = RandomActions(actions, rng, findings)
        self.restarted = True
        self._restart()

    def act(self) -> None:
        """Give one command."""
        self._random_actions.attempt(self._random_actions.drawn())

    def _move(self) -> None:
        self.engine.move_to(random_place(self._rng, self.workspace))

    def _move_nearby(self) -> None:
        here = self.workspace.machine.forward(self.engine.state.heights)
        size = 10.0 ** self._rng.uniform(-9.0, -1.5)
        self.engine.move_to((np.array(here) + size * self._rng.normal(size=3)).tolist())

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

    def _track(self) -> None:
        """Follow a target anywhere in the workspace, which so may have jumped, or one nearby."""
        self._target = np.array(random_place(self._rng, self.workspace))
        if self._rng.random() < 0.5:
            here = np.array(self.workspace.machine.forward(self.engine.state.heights))
            self._target = here + 10.0 ** self._rng.uniform(-6.0, -2.0) * self._rng.normal(size=3)
        size = 10.0 ** self._rng.uniform(-3.0, 0.3)
        self._target_velocity = size * self._rng.normal(size=3)
        self.engine.track(self._target.tolist(), self._target_velocity.tolist())

    def _track_onwards(self) -> None:
        """Let some time of the target pass, and its velocity change."""
        self._target = self._target + float(self._rng.uniform(0.0, 0.05)) * self._target_velocity
        change = 10.0 ** self._rng.uniform(-6.0, -0.5) * np.linalg.norm(self._target_velocity)
        self._target_velocity = self._target_velocity + change * self._rng.normal(size=3)
        self.engine.track(self._target.tolist(), self._target_velocity.tolist())

    def _follow(self) -> None:
        """Follow a path from the present place, or from one nearby, if it is no place of rest."""
        here = self.workspace.machine.forward(self.engine.state.heights)
        self._follow_along(here, self.engine.follow)

    def _extend(self) -> None:
        self._follow_along(self._path_end, self.engine.extend)

    def _follow_along(self, start: Vector3, ask: Callable[[PlatformPath], None]) -> None:
        path = random_path(self._rng, start, 10.0 ** self._rng.uniform(-4.0, -1.0))
        ask(path)
        self._path_end = path.end

    def _set_limits(self) -> None:
        factors = 10.0 ** self._rng.uniform(-0.7, 0.3, size=(3, 3))
        base = self._scenario.limits
        self.engine.set_limits(base.with_table(base.table * factors))

    def _set_scale(self) -> None:
        self.engine.set_speed_scale(float(self._rng.uniform(0.05, 1.0)))

    def _set_shaper(self) -> None:
        """Ask for another shaper: it is in force from the next rest on, if none comes before."""
        self.engine.set_shaper(random_shaper(self._rng))

    def _nonsense(self) -> None:
        engine, bad = self.engine, float(self._rng.choice((math.nan, math.inf, -math.inf)))
        calls: tuple[Callable[[], object], ...] = (
            lambda: engine.move_to((0.0, bad, 0.3)),
            lambda: engine.move_to((9.0, 0.0, 0.3)),
            lambda: engine.move_to((0.0, 0.3)),
            lambda: engine.jog((bad, 0.0, 0.0)),
            lambda: engine.track((0.0, 0.0, 0.3), (bad, 0.0, 0.0)),
            lambda: engine.track((bad, 0.0, 0.3), (0.0, 0.0, 0.0)),
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
        place = random_place(self._rng, self.workspace)
        self.engine.start(self.workspace.check_position(place))
        self.restarted = True


def soak(scenario: Scenario, steps: int, seed: int, findings: Findings) -> None:
    """Drive an engine for a number of ``steps`` and check all of them."""
    rng = np.random.default_rng(seed)
    adversary = Adversary(scenario, rng, findings)
    engine, judge = adversary.engine, Judge(scenario, findings)
    done = streak = 0
    bound = earlier = np.zeros((3, 3))
    while done < steps:
        count = min(BATCH, steps - done)
        heights = np.empty((count, 3))
        bounds = np.empty((count, 3, 3))
        periods = np.empty(count)
        streaks = np.empty(count, dtype=np.int64)
        pauses = iter(random_pauses(rng, count, scenario.dt))
        pause = next(pauses)
        known: tuple[SliderLimits, float] | None = None
        for row in range(count):
            pause -= 1
            at_rest = None
            if engine.phase is MotionPhase.IDLE and not engine.preparing and not engine.tracks:
                at_rest = engine.state.heights
            if pause <= 0:
                pause = next(pauses)
                adversary.act()
                at_rest = None
            periods[row] = scenario.step(rng)
            if adversary.restarted:
                adversary.restarted = False
                streak = 0
                heights[row] = engine.state.heights
            else:
                streak += 1
                heights[row] = engine.step(float(periods[row])).heights
            if at_rest is not None and math.dist(heights[row], at_rest) > STILL:
                findings.violated(f"idle, and then in motion in {scenario}")
            if known is None or known[0] is not engine.limits or known[1] != engine.speed_scale:
                known = engine.limits, engine.speed_scale
                effective = known[0].with_velocity_scaled(known[1])
                bound = effective.table
            # New limits may come into force inside a step, if steps are of any length.
            bounds[row] = np.maximum(bound, earlier) if scenario.irregular else bound
            earlier = bound
            streaks[row] = streak
            if engine.preparing:
                engine.work(some_pieces(rng))
        judge.add(heights, bounds, streaks, periods)
        done += count


def main() -> int:
    """Soak all scenarios and print what was found."""
    findings = soak_all(soak, __doc__, 5_000_000, (*SCENARIOS, *COARSE))
    print(f"at rest in {findings.still / findings.steps:.1%} of the steps")
    for (quantity, _), peak in zip(QUANTITIES, findings.peaks):
        print(f"largest {quantity:12} {peak:.9f} of its limit (tolerance {LIMIT_TOLERANCE:g})")
    print(f"farthest beyond slider travel {findings.travel:.3g} m")
    print(f"farthest beyond the rest of the workspace {findings.place:.3g} m")
    print("linear moves:", flush=True)
    moves = linear_moves.tell(10_000, seed=1)
    jogs = edge_jogs.measure(10_000, seed=1)
    print("jogs into the edge:", jogs)
    return 1 if findings.violations or moves or not edge_jogs.is_met(jogs) else 0


if __name__ == "__main__":
    sys.exit(main())
