"""How soon a machine rests after a stop, against the sliders' own stop, and at what price.

The sliders' own stop brings each slider to rest as soon as its limits allow, whatever the others
do. No stop is shorter, but the platform leaves its line on it, and it may lead out of the
workspace: only where it stays inside are the two compared. Limits and workspace are judged during
each stop, by differences and by the forward kinematics.
"""

import gc
import math
from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import dataclass, field, replace
from time import thread_time
from typing import NamedTuple

import numpy as np

from benchmarks.judge import CONFIGURED, UNEQUAL, UNEQUAL_LIMITS, WIDE, Findings, Judge, Scenario
from benchmarks.soak import pieces, random_path, random_place, random_velocity
from benchmarks.table import print_lines
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionEngine, MotionKind, MotionPhase, PlatformPath
from tri_glide_kinematics.motion.trajectory import CubicPlan, RuckigPlanner
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

STATES = 500
SEED = 1
PERIOD = 0.002  # s, as of the node
# What of a plan that is made in pieces fits in a cycle, about.
PIECES_IN_CYCLE = 3
LONGEST_CALL = 2e-3  # s of processor time
# Each stop is called for so often, from the same state; the least time is that without others.
CALLS = 3
LARGEST_RATIO = 2.0
TWIST_PERIOD = 0.06  # s between two changes of a twist

# The machine of config/tri_glide.yaml, the same with unequal limits, and one of unequal arms.
MACHINES = (
    Scenario(MotionKind.LINEAR, PERIOD, DEFAULT_GEOMETRY, CONFIGURED),
    Scenario(MotionKind.LINEAR, PERIOD, DEFAULT_GEOMETRY, CONFIGURED, UNEQUAL_LIMITS),
    Scenario(MotionKind.LINEAR, PERIOD, UNEQUAL, WIDE, UNEQUAL_LIMITS),
)


class Drive:
    """A machine that is driven at random until it is to stop."""

    def __init__(self, scenario: Scenario, rng: np.random.Generator) -> None:
        """Start the machine of ``scenario`` at a random place."""
        self.scenario = scenario
        self.rng = rng
        self.workspace = Workspace(TriGlide(scenario.geometry), scenario.workspace)
        self.engine = MotionEngine(
            self.workspace, scenario.limits, kind=scenario.kind, in_pieces=True
        )
        self.engine.start(self.workspace.check_position(self.place()))
        self.heights = [self.engine.state.heights]

    def place(self) -> Vector3:
        """Return a random place of the workspace [m]."""
        return random_place(self.rng, self.workspace, (-0.25, -0.25, -0.1), (0.25, 0.25, 0.6))

    def cycle(self) -> None:
        """Go on for one cycle, with a few pieces of what is being planned."""
        self.heights.append(self.engine.step(PERIOD).heights)
        self.engine.work(pieces(PIECES_IN_CYCLE))

    def run(self, time: float) -> None:
        """Go on for a ``time`` [s]."""
        for _ in range(round(time / PERIOD)):
            self.cycle()

    @property
    def is_at_rest(self) -> bool:
        """Whether nothing moves and nothing is planned."""
        return self.engine.phase is MotionPhase.IDLE and not self.engine.preparing


def _moves(drive: Drive) -> None:
    """Move somewhere, now and then to another place before that is reached."""
    drive.engine.move_to(drive.place())
    drive.run(drive.rng.uniform(0.01, 0.6))
    if drive.rng.random() < 0.25:
        drive.engine.move_to(drive.place())
        drive.run(drive.rng.uniform(0.01, 0.3))


def _jog(drive: Drive, time: float) -> None:
    drive.engine.jog(random_velocity(drive.rng))
    drive.run(time)


def _jog_just_changed(drive: Drive) -> None:
    for _ in range(drive.rng.integers(1, 8)):
        _jog(drive, TWIST_PERIOD)
    _jog(drive, drive.rng.uniform(0.0, TWIST_PERIOD))


def _tracking(drive: Drive) -> None:
    """Follow a target that swings about a place, and may jump."""
    rng = drive.rng
    turns = rng.uniform(0.3, 2.0, size=3)
    sizes = rng.uniform(0.0, 0.06, size=3)
    centre = np.array(drive.place())
    time, end = 0.0, rng.uniform(0.05, 1.0)
    while time < end:
        if rng.random() < 0.01:
            centre = np.array(drive.place())
        angles = math.tau * turns * time
        place = centre + sizes * np.sin(angles)
        velocity = math.tau * turns * sizes * np.cos(angles)
        drive.engine.track(place.tolist(), velocity.tolist())
        drive.run(0.01)
        time += 0.01


def _path(drive: Drive, *, with_speed: bool = False) -> None:
    speed = 0.03 * 12.0 ** drive.rng.random() if with_speed else None
    here = TriGlide(drive.scenario.geometry).forward(drive.engine.state.heights)
    path = random_path(drive.rng, here, float(drive.rng.choice((0.02, 0.05, 0.1))))
    if speed is not None:
        speeds = np.full(len(path.segments), speed)
        path = PlatformPath.of_segments(replace(path.segments, speeds=speeds))
    drive.engine.follow(path)
    for _ in range(5000):
        if not drive.engine.preparing:
            break
        drive.cycle()
    drive.run(drive.rng.uniform(0.0, min(drive.engine.remaining, 2.0)))


class Kind(NamedTuple):
    """A way to be in motion, and how soon it has to end.

    Attributes:
        name: in words.
        drive: gets a machine going.
        median: of all ratios, to be reached.
        almost_all: 99 % of all ratios, to be reached.
        motion: kind of moves.
    """

    name: str
    drive: Callable[[Drive], None]
    median: float
    almost_all: float
    motion: MotionKind = MotionKind.LINEAR


KINDS = (
    Kind("slider moves", _moves, 1.05, 1.3, MotionKind.SLIDER),
    Kind("lines", _moves, 1.15, 1.5),
    Kind("jogs, steady", lambda drive: _jog(drive, drive.rng.uniform(0.2, 0.5)), 1.1, 1.5),
    Kind(
        "jogs, just begun",
        lambda drive: _jog(drive, drive.rng.uniform(0.004, TWIST_PERIOD)),
        1.1,
        1.5,
    ),
    Kind("jogs, just changed", _jog_just_changed, 1.1, 1.5),
    Kind("tracking", _tracking, 1.1, 1.5),
    Kind("paths at full speed", _path, 1.3, 2.0),
    Kind("paths with a speed", lambda drive: _path(drive, with_speed=True), 1.3, 2.0),
)


@dataclass
class Stops:
    """What many stops have shown.

    Attributes:
        kind: of the motions that were stopped.
        ratios: time until rest over that of the sliders' own stop, where this stays inside.
        uncounted: how often it did not.
        calls: processor time of the call of each stop, the least of several from one state [s].
        findings: of the judge, over all that was driven.
    """

    kind: Kind
    ratios: list[float] = field(default_factory=list)
    uncounted: int = 0
    calls: list[float] = field(default_factory=list)
    findings: Findings = field(default_factory=Findings)

    @property
    def figures(self) -> tuple[float, float, float]:
        """Median, 99 % and largest of the ratios."""
        median, almost_all, largest = np.percentile(self.ratios, (50.0, 99.0, 100.0))
        return float(median), float(almost_all), float(largest)

    @property
    def is_reached(self) -> bool:
        """Whether all ratios and limits are as they have to be."""
        median, almost_all, largest = self.figures
        return (
            median <= self.kind.median
            and almost_all <= self.kind.almost_all
            and largest <= LARGEST_RATIO
            and not self.findings.violations
        )


def own_stop(drive: Drive) -> tuple[float, bool]:
    """Return how long the sliders' own stop takes [s], and whether it stays in the workspace."""
    state, limits = drive.engine.state, drive.scenario.limits
    bounds = limits.velocity, limits.acceleration, limits.jerk
    plan = CubicPlan(state, RuckigPlanner(3).to_rest(state.velocities, state.accelerations, bounds))
    times = np.arange(0.0, plan.duration + PERIOD, 0.5 * PERIOD)
    try:
        for heights in plan.sample(times).heights.tolist():
            drive.workspace.check_heights(heights)
    except KinematicsError:
        return plan.duration, False
    return plan.duration, True


def states(kind: Kind, count: int, seed: int = SEED) -> Iterator[Drive]:
    """Yield machines in motion of a ``kind``, about to be stopped."""
    rng = np.random.default_rng((seed, *kind.name.encode()))
    while count:
        scenario = replace(MACHINES[count % len(MACHINES)], kind=kind.motion)
        drive = Drive(scenario, rng)
        try:
            kind.drive(drive)
        except KinematicsError:
            continue
        if drive.engine.phase in (MotionPhase.IDLE, MotionPhase.STOPPING):
            continue
        if max(map(abs, drive.engine.state.velocities)) < 1e-4:
            continue
        count -= 1
        yield drive


def stopped(drive: Drive) -> tuple[float, float]:
    """Stop a machine; return the time until it rests, and the processor time of the call [s]."""
    engine = drive.engine
    call = min(_timed_stop(_copied(engine)) for _ in range(CALLS - 1))
    call = min(call, _timed_stop(engine))
    elapsed = 0.0
    while not drive.is_at_rest:
        until_rest = elapsed + engine.remaining
        drive.cycle()
        elapsed += PERIOD
    return until_rest, call


def _copied(engine: MotionEngine) -> MotionEngine:
    """Return an engine in the same state, which holds its own plan from now on."""
    holder, execution = engine._holder, engine._execution
    same = (
        engine._workspace,
        engine.machine,
        holder.motion,
        holder.shaped,
        execution.replanning,
        execution.tracking.tracker,
        execution.plans.preparation,
        execution._path_measuring,
    )
    return deepcopy(engine, {id(each): each for each in same})


def _timed_stop(engine: MotionEngine) -> float:
    """Return the processor time of the call of a stop [s]."""
    begin = thread_time()
    engine.stop()
    return thread_time() - begin


def measure(kind: Kind, count: int, seed: int = SEED) -> Stops:
    """Stop ``count`` motions of a ``kind`` at random moments."""
    found = Stops(kind)
    gc.disable()
    try:
        for drive in states(kind, count, seed):
            own, inside = own_stop(drive)
            until_rest, call = stopped(drive)
            found.calls.append(call)
            if inside:
                found.ratios.append(until_rest / own)
            else:
                found.uncounted += 1
            _judge(drive, found.findings)
            gc.collect(0)
    finally:
        gc.enable()
    return found


def _judge(drive: Drive, findings: Findings) -> None:
    """Judge all that was driven, and some rest behind it."""
    heights = np.array([*drive.heights, *[drive.heights[-1]] * 3])
    table = np.broadcast_to(drive.scenario.limits.table, (len(heights), 3, 3))
    Judge(drive.scenario, findings).add(heights, table, np.arange(len(heights)))


def rows() -> Iterator[tuple[str, ...]]:
    """Yield one line of the table for each kind of motion."""
    for kind in KINDS:
        found = measure(kind, STATES)
        median, almost_all, largest = found.figures
        slowest = float(np.max(found.calls))
        yield (
            kind.name,
            f"{len(found.ratios)} of {STATES}",
            f"{median:.3f}, {almost_all:.2f}, {largest:.2f}",
            f"{kind.median:g}, {kind.almost_all:g}, {LARGEST_RATIO:g}",
            f"{1e3 * float(np.median(found.calls)):.2f}, {1e3 * slowest:.2f} ms",
            f"{1e3 * LONGEST_CALL:g} ms",
            "yes" if found.is_reached and slowest <= LONGEST_CALL else "NO",
        )
        for violation in found.findings.violations[:3]:
            print(violation)


HEAD = (
    "stop of",
    "own stop inside",
    "time over own stop (median, 99 %, largest)",
    "to reach",
    "processor time of the call (median, largest)",
    "to reach",
    "reached",
)


def run() -> bool:
    """Measure and print the table; it is always complete."""
    return print_lines([HEAD, *rows()])
