"""How long linear moves take that begin in mid-motion: against random ways, and a bent one.

The platform is under way along a line when a new target comes, at a random time. Its new motion is
compared with

- the optimum of copp-py, which limits jerks as well, where the motion goes on along the new line.
- the best of many random ways to join a line to that target, which are free in how fast the blend
  decays, how far it leads, how much of the limits the line has while it lasts and after it, and
  when the line begins; each is verified as plans are.
- ruckig's way between the two states, on which the platform follows no line, and which may leave
  the workspace.
"""

import math
from collections.abc import Iterator, Sequence
from time import thread_time
from typing import NamedTuple

import numpy as np

from benchmarks.judge import LIMITS, MACHINE
from benchmarks.linear_moves import WORKSPACE, random_moves
from benchmarks.table import print_lines
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion import Trajectory
from tri_glide_kinematics.motion.limits import AT_REST, SliderState
from tri_glide_kinematics.motion.moves import (
    NORM,
    Entry,
    LinearMotion,
    MotionKind,
    MotionPlanner,
    parametrise,
)
from tri_glide_kinematics.motion.moves.line_entry import _divided
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.trajectory import (
    CubicPlan,
    LinePlan,
    PathHeights,
    Phases,
    RuckigPlanner,
    StraightLine,
    TimeScaling,
    cut_to,
    evaluate,
    knots,
    lasting,
    shortest_piece,
    total_duration,
    with_knots_of,
)
from tri_glide_kinematics.vectors import Vector3

# Of the best of 1,000 random ways.
LARGEST_MEDIAN = 1.1
LARGEST_MOST = 1.3

ONE, THREE = RuckigPlanner(1), RuckigPlanner(3)
PIECES = 48
SEED = 1
TURNS = 250
# Random ways take two milliseconds each, so fewer turns have them.
TURNS_WITH_WAYS = 40
WAYS = 300

HEAD = ("a linear move begun in motion", "median", "90 %", "99 %", "largest", "to reach", "reached")
GOAL = f"{LARGEST_MEDIAN:g} in the median, {LARGEST_MOST:g} at 99 %"


class Turn(NamedTuple):
    """A motion that is under way, and where it is to lead now.

    Attributes:
        state: of the sliders.
        target: of the platform [m].
        along: whether the platform goes on in its direction.
    """

    state: SliderState
    target: Vector3
    along: bool


def random_turns(count: int, seed: int, along: float = 0.25) -> Iterator[Turn]:
    """Yield motions that turn, and a part of them that go on ``along`` their line."""
    rng = np.random.default_rng(seed)
    motion = LinearMotion(MACHINE)
    moves = random_moves(10 * count, seed)
    while count:
        start, end = next(moves)
        line = StraightLine.between(MACHINE.geometry, start.tolist(), end.tolist())
        plan = motion.from_rest(line, LIMITS)
        state = plan.at(float(rng.uniform(0.05, 0.95)) * plan.duration)
        is_along = bool(rng.random() < along)
        here = np.array(MACHINE.forward(state.heights))
        if is_along:
            target = here + rng.uniform(0.3, 1.5) * (end - here)
        else:
            target = next(moves)[1]
        try:
            WORKSPACE.check_segment(here, target)
            planned(Turn(state, tuple(target.tolist()), is_along))
        except KinematicsError:
            continue
        count -= 1
        yield Turn(state, tuple(target.tolist()), is_along)


def _plan(turn: Turn) -> Trajectory:
    """Return the planner's motion."""
    planner = MotionPlanner(WORKSPACE, MotionKind.LINEAR)
    return at_once(planner.move(turn.state, turn.target, LIMITS, WORKSPACE, moving=True))


def planned(turn: Turn) -> float:
    """Return how long the planner's motion takes [s]."""
    return _plan(turn).duration


def planned_over_optimum(turn: Turn) -> float | None:
    """Return the time of the planner's motion over the least along its line.

    It is None where a motion beside the line has to end, and where copp-py finds none or is not
    installed.
    """
    try:
        from benchmarks.references.path_optimum import least_time_onwards
    except ImportError:
        return None
    plan = _plan(turn)
    if not isinstance(plan, LinePlan) or plan.blend is not None:
        return None
    path = PlatformPath.start(plan.line.start).line_to(turn.target)
    curve = PathHeights(path.driven, MACHINE.geometry)
    least = least_time_onwards(curve, plan.scaling, LIMITS)
    return plan.duration / least if math.isfinite(least) else None


def bent(turn: Turn) -> float:
    """Return how long ruckig's way takes, which is not straight [s]."""
    velocity, acceleration, jerk = LIMITS.table.tolist()
    limits = velocity, acceleration, jerk
    phases = THREE.to_rest_at(MACHINE.inverse(turn.target), *turn.state, limits)
    return max(map(total_duration, phases))


def random_way(turn: Turn, rng: np.random.Generator, shortest: float) -> float:
    """Return how long a random way takes that joins a line to the target [s].

    Raises:
        KinematicsError: if it breaks a limit or leaves the workspace, or is not the ``shortest``.
    """
    state, geometry = turn.state, MACHINE.geometry
    part = rng.uniform(0.1, 1.0)
    of_jerk = min(part * rng.uniform(0.7, 1.4), 1.0)
    velocity, acceleration, jerk = LIMITS.table
    reduced = velocity.tolist(), (part * acceleration).tolist(), (of_jerk * jerk).tolist()
    heights = state.heights
    begin = MACHINE.forward(heights)
    # All of the speed along the line, some of it, or none, as where the platform turns back.
    kept = rng.choice((1.0, rng.uniform(0.0, 1.1), 0.0), p=(0.6, 0.2, 0.2))
    farther = rng.choice((1.0, rng.normal(1.0, 0.3)))
    for _ in range(3):
        line = StraightLine.between(geometry, begin, turn.target)
        speed, acceleration_along, residual = _divided(state, line, LIMITS)
        if residual is None:
            break
        speed, acceleration_along = kept * speed, kept * acceleration_along
        slopes, bends = np.array(line.start_slopes), np.array(line.start_bends)
        rates = np.array(state.velocities) - speed * slopes
        changes = np.array(state.accelerations) - acceleration_along * slopes - speed**2 * bends
        residual = SliderState(AT_REST, tuple(rates.tolist()), tuple(changes.tolist()))
        phases = THREE.to_rest(residual.velocities, residual.accelerations, reduced)
        decay = CubicPlan(residual, phases)
        offset = farther * np.array(decay.at(decay.duration).heights)
        begin = MACHINE.forward((np.array(heights) + offset).tolist())
    WORKSPACE.check_segment(line.start, turn.target)
    blend = None
    if residual is not None:
        offsets = tuple((np.array(heights) - line.start_heights).tolist())
        beside = residual._replace(heights=offsets)
        phases = THREE.to_rest_at(AT_REST, *beside, reduced, together=False)
        blend = CubicPlan(beside, phases)
    entry = Entry(line, speed, acceleration_along, blend)
    plan = LinePlan(line, _random_scaling(entry, 1.0 - part, rng), blend)
    if not plan.duration < shortest:
        raise KinematicsError("another one is shorter")
    plan.check_limits(LIMITS)
    plan.check_inside(WORKSPACE, LIMITS)
    return plan.duration


def _random_scaling(entry: Entry, left: float, rng: np.random.Generator) -> TimeScaling:
    """Return a time scaling with random parts of the limits while the blend lasts, and after it."""
    parametrisation = parametrise(entry.line, LIMITS, NORM)
    target, (_, accelerations, jerks) = parametrisation.total, parametrisation.least
    initial = parametrisation.start(entry.speed, entry.acceleration)
    until = entry.blend.duration * rng.uniform(0.5, 1.0) if entry.blend is not None else 0.0
    phases: Phases = []
    state = initial
    if until > 0.0:
        wait = until * rng.uniform() if entry.speed == 0.0 else 0.0
        first = _onwards(
            state, target, rng.uniform(0.5, 1.3) * left + 0.02, accelerations, jerks, rng
        )
        phases = cut_to([(wait, 0.0), *first] if wait else first, until)
        ends = evaluate(phases, initial, np.array([total_duration(phases)]))
        state = float(ends.values[0]), float(ends.rates[0]), float(ends.accelerations[0])
    last = _onwards(state, target, rng.uniform(0.85, 1.02), accelerations, jerks, rng)
    phases = lasting([*phases, *last], entry.blend)
    shortest = shortest_piece(target, accelerations)
    times = with_knots_of(knots(phases, PIECES, shortest), entry.blend, shortest)
    scaling = parametrisation.time_scaling(evaluate(phases, initial, np.array(times)))
    return scaling.with_ends((0.0, entry.speed, entry.acceleration), entry.line.length)


def _onwards(
    state: Sequence[float],
    target: float,
    part: float,
    acceleration: float,
    jerk: float,
    rng: np.random.Generator,
) -> Phases:
    """Return phases that lead to rest at a ``target`` with about a ``part`` of the limits."""
    limits = (
        [float(rng.uniform(0.9, 1.01))],
        [part * acceleration],
        [part * rng.uniform(0.7, 1.1) * jerk],
    )
    value, rate, change = state
    (phases,) = ONE.to_rest_at([target], [value], [rate], [change], limits)
    return phases


def best_of_random_ways(turn: Turn, count: int, rng: np.random.Generator) -> float:
    """Return the least time that any of so many random ways takes [s]."""
    best = math.inf
    for _ in range(count):
        try:
            best = random_way(turn, rng, best)
        except (KinematicsError, ValueError):
            continue
    return best


def rows() -> Iterator[tuple[str, ...]]:
    """Yield one line of the table after the other."""
    turns = list(random_turns(TURNS, SEED))
    begin = thread_time()
    durations = np.array([planned(turn) for turn in turns])
    cost = (thread_time() - begin) / len(turns)
    yield (f"processor time of its plan, {TURNS}", f"mean {1e3 * cost:.1f} ms", *["-"] * 5)
    yield _row(
        f"time over ruckig's bent way, {TURNS}",
        durations / np.array([bent(turn) for turn in turns]),
        has_goal=False,
    )
    optimal = [ratio for turn in turns if (ratio := planned_over_optimum(turn)) is not None]
    if optimal:
        yield _row(f"time along the new line over copp-py's TOPP3, {len(optimal)}", optimal)
    rng = np.random.default_rng(SEED)
    few = turns[:TURNS_WITH_WAYS]
    best = np.array([best_of_random_ways(turn, WAYS, rng) for turn in few])
    name = f"time over the best of {WAYS} random ways, {len(few)}"
    yield _row(name, durations[: len(few)] / best)


def _row(name: str, ratios: Sequence[float], *, has_goal: bool = True) -> tuple[str, ...]:
    """Return one line of the table."""
    quantiles = np.quantile(ratios, (0.5, 0.9, 0.99, 1.0)).tolist()
    reached = quantiles[0] <= LARGEST_MEDIAN and quantiles[2] <= LARGEST_MOST
    judged = (GOAL, "yes" if reached else "NO") if has_goal else ("-", "-")
    return (name, *(f"{value:.3f}" for value in quantiles), *judged)


def run() -> bool:
    """Measure and print the table; it is always complete."""
    return print_lines([HEAD, *rows()])
