"""The law of pieces: no piece of planning takes long, whatever bounds are added.

Moves, paths, jogs, moving targets and stops come at random, with shapers, force limits and platform
speed limits down to 1e-5 m/s. Each episode is driven several times in the same way, and of each
piece the shortest processor time of its thread counts. The longest piece of the episodes without an
added bound says how fast the computer is: with added bounds none may be longer by more than a part.
The work of a whole plan is told as well, and so is the longest step of the engine.

``python -m benchmarks.soak_pieces --episodes 10`` exits with 1 if a piece is longer. With ``--moves
10000`` it plans so many random moves instead, however much work they take, and tells how many of
them the most work of a plan refuses: it exits with 1 if that is more than one of a thousand.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from time import thread_time
from typing import NamedTuple

import numpy as np

from benchmarks.command_line import numbers
from benchmarks.judge import LIMITS, UNEQUAL, UNEQUAL_LIMITS, WIDE
from benchmarks.soak import pieces, random_path, random_place, random_shaper
from testing.pieces import timed
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import (
    AddedBound,
    CannotHoldError,
    ForceLimits,
    MotionEngine,
    PlatformSpeedLimit,
)
from tri_glide_kinematics.motion.engine import replacing
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

# Of moves that are planned however much work they take, the most work refuses no larger part. So
# many pieces are more than any move takes.
MOST_REFUSED = 0.001
UNBOUNDED = 100_000

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
    engine, workspace = resting(case, rng)
    cost = Cost([], [], [])
    with timing(cost):
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
    return cost


def move(seed: int) -> Cost:
    """Plan one move from rest or in the middle of another one; all of it is chosen by the seed."""
    rng = np.random.default_rng(seed)
    kinds = list(MotionKind)
    command = kinds[int(rng.integers(len(kinds)))].value
    speed = SPEEDS[int(rng.integers(len(SPEEDS)))]
    case = Case(command, speed, *(rng.random(2) < 0.5).tolist())
    engine, workspace = resting(case, rng)
    if rng.random() < 0.5:
        _plan(engine, random_place(rng, workspace))
        # Slow ones take hours: most of that in one step.
        engine.step(PERIOD + rng.random() * engine.remaining)
        engine.step(PERIOD)
    cost = Cost([], [], [])
    with timing(cost):
        refusal = _plan(engine, random_place(rng, workspace))
    return cost if refusal is None else cost._replace(refused=[type(refusal).__name__])


def _plan(engine: MotionEngine, place: tuple[float, float, float]) -> KinematicsError | None:
    """Plan a move; return why it is refused, if it is."""
    try:
        engine.move_to(place)
        while engine.preparing:
            engine.work(pieces(1))
    except KinematicsError as error:
        return error
    return engine.take_refusal()


def resting(case: Case, rng: np.random.Generator) -> tuple[MotionEngine, Workspace]:
    """Return an engine that rests somewhere, and its workspace."""
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
    while not engine.started:
        with suppress(CannotHoldError):
            engine.start(workspace.check_position(random_place(rng, workspace)))
    while case.shaped and engine.shaper is None:
        engine.set_shaper(random_shaper(rng))
    return engine, workspace


def _total(cost: Cost) -> float:
    return sum(map(sum, cost.plans))


@contextmanager
def timing(cost: Cost) -> Iterator[None]:
    """Let each plan that is begun add the processor time of its pieces to a ``cost``."""
    begin_at = replacing.Preparation._begin_at

    def begun(making: replacing.Preparation, start: float) -> None:
        begin_at(making, start)
        cost.plans.append([])
        making._computation = timed(making._computation, cost.plans[-1])

    replacing.Preparation._begin_at = begun  # type: ignore[method-assign, assignment]
    try:
        yield
    finally:
        replacing.Preparation._begin_at = begin_at  # type: ignore[method-assign]


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


def plan_moves(count: int, seed: int) -> int:
    """Plan random moves, and print how much work they take.

    Returns:
        Exit code: 1 if the most work of a plan refuses too many of them.
    """
    most, replacing.MOST_PIECES = replacing.MOST_PIECES, UNBOUNDED
    costs = [move(seed * count + number) for number in range(count)]
    planned = sorted((each for each in costs if not each.refused), key=lambda each: each.most[1])
    took = np.array([each.most for each in planned])
    refused = int((took[:, 1] > most).sum())
    for number in {0, refused, *(int(part * count) for part in (0.001, 0.01, 0.1, 0.5))}:
        work, taken = planned[-1 - number].most
        print(f"but for {number} of them a move takes {taken:.0f} pieces ({1e3 * work:.0f} ms)")
    print(f"{len(planned)} moves are planned, of which {refused} take more than {most} pieces")
    return int(refused > MOST_REFUSED * len(planned))


def main() -> int:
    """Drive all cases, and print what each kind took.

    Returns:
        Exit code: 1 if a piece with added bounds is too long.
    """
    arguments = numbers(
        __doc__,
        episodes=(10, "of each case"),
        moves=(0, "random moves to plan instead"),
        seed=(1, "of the random commands"),
        replays=(REPLAYS, "of each episode"),
    )
    if arguments.moves:
        return plan_moves(arguments.moves, arguments.seed)
    longest = {False: 0.0, True: 0.0}
    for case in cases():
        costs = [
            replayed(case, arguments.seed * 1000 + number, arguments.replays)
            for number in range(arguments.episodes)
        ]
        piece, step = max(each.longest for each in costs), max(max(each.steps) for each in costs)
        work, taken = max(each.most for each in costs)
        longest[case.is_bounded] = max(longest[case.is_bounded], piece)
        bounds = f"{case.speed or '-':>6} {'forces' * case.forces:6} {'shaped' * case.shaped:6}"
        print(
            f"{case.command:6} {bounds} piece {1e3 * piece:8.2f} ms, step {1e3 * step:6.2f} ms, "
            f"plan {1e3 * work:8.1f} ms in {taken} pieces, "
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
