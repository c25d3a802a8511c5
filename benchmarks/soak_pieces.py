"""The law of pieces: no piece of planning takes long, whatever bounds are added.

Moves, paths, jogs, moving targets and stops come at random, with shapers, force limits and platform
speed limits down to 1e-5 m/s. Each episode is driven several times in the same way, and of each
piece the shortest processor time of its thread counts. The longest piece of the episodes without an
added bound says how fast the computer is: with added bounds none may be longer by more than a part.
The work of a whole plan is told as well, and so is the longest step of the engine.

Run it as ``python -m benchmarks.soak_pieces --episodes 10``; it exits with 1 if a piece is longer.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable, Iterator
from time import thread_time
from typing import NamedTuple

import numpy as np

from benchmarks.command_line import numbers
from benchmarks.judge import LIMITS, UNEQUAL, UNEQUAL_LIMITS, WIDE
from benchmarks.random_paths import random_path
from benchmarks.soak import random_place, random_shaper
from testing.pieces import timed
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import AddedBound, ForceLimits, MotionEngine, PlatformSpeedLimit
from tri_glide_kinematics.motion.engine import preparation
from tri_glide_kinematics.motion.moves import MotionKind
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import Workspace

PERIOD = 0.001  # s
CYCLES = 400
# Cycles between two commands, in the mean.
PAUSE = 80
PIECES_IN_CYCLE = 3
REPLAYS = 3

# So much longer than without an added bound the longest piece may be.
LONGER = 1.2

COMMANDS = ("linear", "slider", "path", "jog", "track")
SPEEDS = (None, 1.0, 0.1, 0.02, 0.01, 0.005, 0.001, 1e-4, 1e-5)  # m/s
FORCES = 60.0, 40.0  # N


class Case(NamedTuple):
    """What is asked for, and what bounds it.

    Attributes:
        command: its kind; it comes more often than the others.
        speed: limit of the platform's speed [m/s]; None without.
        forces: whether they are limited.
        shaped: whether there is a shaper.
    """

    command: str
    speed: float | None
    forces: bool
    shaped: bool

    @property
    def is_bounded(self) -> bool:
        """Whether a bound is added."""
        return self.forces or self.speed is not None


class Cost(NamedTuple):
    """Processor time of an episode [s].

    Attributes:
        plans: of the pieces of each plan.
        steps: of each step of the engine, without pieces of planning.
        refused: names of errors.
    """

    plans: list[list[float]]
    steps: list[float]
    refused: list[str]

    @property
    def longest(self) -> float:
        """The longest piece [s]."""
        return max(itertools.chain.from_iterable(self.plans), default=0.0)

    @property
    def most(self) -> tuple[float, int]:
        """The most that a plan took [s], and its number of pieces."""
        return max(((sum(each), len(each)) for each in self.plans), default=(0.0, 0))

    def least(self, other: Cost) -> Cost:
        """Return what the shorter of two replays took, piece by piece."""
        return Cost(
            [[min(pair) for pair in zip(*plans)] for plans in zip(self.plans, other.plans)],
            [min(pair) for pair in zip(self.steps, other.steps)],
            self.refused,
        )


def cases() -> Iterator[Case]:
    """Yield all combinations."""
    yield from map(Case._make, itertools.product(COMMANDS, SPEEDS, (False, True), (False, True)))


def episode(case: Case, seed: int) -> Cost:
    """Drive an engine as ``case`` says; what comes when is chosen by the ``seed``."""
    rng = np.random.default_rng(seed)
    is_unequal = rng.random() < 0.5
    machine = TriGlide(UNEQUAL if is_unequal else DEFAULT_GEOMETRY)
    workspace = Workspace(machine, WIDE)
    added: list[AddedBound] = []
    if case.speed is not None:
        added.append(PlatformSpeedLimit(machine, case.speed))
    if case.forces:
        masses = Masses.uniform(1.0, float(rng.uniform(0.05, 0.3)), 1.0, coulomb=1.0, viscous=2.0)
        up, down = FORCES
        added.append(ForceLimits(SliderForces(machine, masses), (up,) * 3, (down,) * 3))
    limits = (UNEQUAL_LIMITS if is_unequal else LIMITS).with_added(*added)
    kind = MotionKind.SLIDER if case.command == "slider" else MotionKind.LINEAR
    engine = MotionEngine(workspace, limits, kind=kind, in_pieces=True)
    engine.start(workspace.check_position(random_place(rng, workspace)))
    while case.shaped and engine.shaper is None:
        engine.set_shaper(random_shaper(rng))
    cost = Cost([], [], [])
    timing = _timing(cost)
    with_begin = preparation.Preparation._begin_at
    preparation.Preparation._begin_at = timing  # type: ignore[method-assign, assignment]
    try:
        for cycle in range(CYCLES):
            if cycle == 0 or rng.random() * PAUSE < 1.0:
                try:
                    _command(engine, workspace, case.command, rng, cycle)
                except KinematicsError as error:
                    cost.refused.append(type(error).__name__)
            engine.work(pieces(PIECES_IN_CYCLE))
            before = _total(cost)
            begin = thread_time()
            engine.step(PERIOD)
            took = thread_time() - begin
            cost.steps.append(took - (_total(cost) - before))
            refusal = engine.take_refusal()
            if refusal is not None:
                cost.refused.append(type(refusal).__name__)
    finally:
        preparation.Preparation._begin_at = with_begin  # type: ignore[method-assign]
    return cost


def pieces(count: int) -> Callable[[], bool]:
    """Return what says so often that planning may go on."""
    left = iter(range(count - 1))
    return lambda: next(left, None) is not None


def _total(cost: Cost) -> float:
    return sum(map(sum, cost.plans))


def _timing(cost: Cost) -> Callable[[preparation.Preparation, float], None]:
    begin_at = preparation.Preparation._begin_at

    def begun(making: preparation.Preparation, start: float) -> None:
        begin_at(making, start)
        cost.plans.append([])
        making._computation = timed(making._computation, cost.plans[-1])

    return begun


def _command(
    engine: MotionEngine, workspace: Workspace, kind: str, rng: np.random.Generator, cycle: int
) -> None:
    """Give a command: mostly of one ``kind``."""
    chance = rng.random()
    if cycle and chance < 0.25:
        engine.stop()
        return
    if cycle and chance < 0.45:
        kind = COMMANDS[int(rng.integers(len(COMMANDS)))]
    place = random_place(rng, workspace)
    if kind == "path":
        here = workspace.machine.forward(engine.state.heights)
        engine.follow(random_path(rng, here, 10.0 ** rng.uniform(-2.5, -1.3)))
    elif kind == "jog":
        engine.jog((rng.normal(size=3) * 10.0 ** rng.uniform(-2.0, 0.0)).tolist())
    elif kind == "track":
        near = np.array(workspace.machine.forward(engine.state.heights))
        target = near + 10.0 ** rng.uniform(-4.0, -1.5) * rng.normal(size=3)
        engine.track(target.tolist(), (0.1 * rng.normal(size=3)).tolist())
    else:
        engine.move_to(place)


def replayed(case: Case, seed: int, replays: int) -> Cost:
    """Return the least that some replays of an episode took, piece by piece."""
    cost = episode(case, seed)
    for _ in range(replays - 1):
        cost = cost.least(episode(case, seed))
    return cost


def main() -> int:
    """Drive all cases, and print what each kind took.

    Returns:
        Exit code: 1 if a piece with added bounds is too long.
    """
    arguments = numbers(
        __doc__,
        episodes=(10, "of each case"),
        seed=(1, "of the random commands"),
        replays=(REPLAYS, "of each episode"),
    )
    longest = {False: 0.0, True: 0.0}
    for case in cases():
        costs = [
            replayed(case, arguments.seed * 1000 + number, arguments.replays)
            for number in range(arguments.episodes)
        ]
        piece, step = max(each.longest for each in costs), max(max(each.steps) for each in costs)
        work, pieces = max(each.most for each in costs)
        longest[case.is_bounded] = max(longest[case.is_bounded], piece)
        bounds = f"{case.speed or '-':>6} {'forces' * case.forces:6} {'shaped' * case.shaped:6}"
        print(
            f"{case.command:6} {bounds} piece {1e3 * piece:8.2f} ms, step {1e3 * step:6.2f} ms, "
            f"plan {1e3 * work:8.1f} ms in {pieces} pieces, "
            f"{sum(len(each.refused) for each in costs)} refused",
            flush=True,
        )
    print(
        f"longest piece {1e3 * longest[False]:.2f} ms without added bounds, "
        f"{1e3 * longest[True]:.2f} ms with them"
    )
    return int(longest[True] > LONGER * longest[False])


if __name__ == "__main__":
    sys.exit(main())
