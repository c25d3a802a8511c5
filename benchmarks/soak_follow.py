"""How far a platform goes past the end of a target that does what the sliders cannot do.

Targets go a straight way and end, gently, suddenly or back again, at random: any stroke, direction,
duration and rate of telling; control rates from 250 to 2,000 Hz; with shapers, a speed limit of the
platform and force limits; close to the edge of the workspace; machines of unequal arms and limits.
A plain causal follower gets the same reports. Past the end a platform goes at most 0.1 mm and 2 %
of the stroke more than it. With a shaper the speed of the target times the mean delay is added.

Run it as ``python -m benchmarks.soak_follow --count 300``; it exits with 1 where one goes farther.
"""

import math
import sys
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from benchmarks.command_line import numbers
from benchmarks.judge import LIMITS, UNEQUAL, UNEQUAL_LIMITS, WIDE
from benchmarks.soak import random_place, random_shaper
from benchmarks.soak_bounds import random_bounds
from benchmarks.table import aligned
from testing.plain_follower import (
    dead,
    forth_and_back,
    gentle,
    most_beyond,
    places_of_plain_follower,
)
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionEngine
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.shaping import Shaper
from tri_glide_kinematics.motion.tracking import FOLLOW_HORIZON
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Workspace

# What a platform may go farther than a plain follower: so far [m], and this part of the stroke.
FARTHER, PART = 1e-4, 0.02
RESTED, AFTER = 0.05, 0.5  # s
PERIODS = (0.0005, 0.001, 0.002, 0.004)  # s
STROKES, DURATIONS, TOLD = (0.002, 0.3), (0.03, 1.0), (0.002, 0.1)  # m, s, s
SPEEDS = (0.02, 1.0)  # m/s, of the platform speed limit
STOPPED = (0.1, 0.3, 0.5)  # m/s of a target that stops dead
EDGE = 1e-4  # m

Motion = Callable[[float], tuple[float, float]]
KINDS = ("plain", "unequal", "edge", "shaper", "speed limit", "force limits")


class Case(NamedTuple):
    """A target, and who follows it.

    Attributes:
        motion: way and speed of the target, of a stroke of 1 in a time of 1.
        start: Shape (3,) [m].
        way: stroke with its direction. Shape (3,) [m].
        duration: of the stroke [s].
        told: from one report to the next [s].
        period: of the control [s].
        workspace: with its machine.
        limits: of the sliders.
        shaper: if there is one.
    """

    motion: Motion
    start: FloatArray
    way: FloatArray
    duration: float
    told: float
    period: float
    workspace: Workspace
    limits: SliderLimits
    shaper: Shaper | None = None

    def __str__(self) -> str:
        """Return the target in words."""
        way = ", ".join(f"{1000.0 * each:.1f}" for each in self.way)
        start = ", ".join(f"{each:.3f}" for each in self.start)
        return (
            f"{self.motion.__name__} ({way}) mm from ({start}) in {1000.0 * self.duration:.0f} ms, "
            f"told every {1000.0 * self.told:.0f}, cycle {1000.0 * self.period:g}"
        )

    @property
    def stroke(self) -> float:
        """Length of the way [m]."""
        return float(np.linalg.norm(self.way))


class Beyond(NamedTuple):
    """How far past the end [m].

    Attributes:
        ours: the platform.
        plain: the plain follower.
        allowed: for the platform.
        lag: mean distance from the target while it moves [m].
        plain_lag: likewise of the plain follower.
    """

    ours: float
    plain: float
    allowed: float
    lag: float
    plain_lag: float

    @property
    def ratio(self) -> float:
        """What was gone over what is allowed."""
        return self.ours / self.allowed


def random_case(kind: str, rng: np.random.Generator) -> Case:
    """Return a case of a ``kind`` at random."""
    is_other = kind == "unequal"
    machine = TriGlide(UNEQUAL if is_other else DEFAULT_GEOMETRY)
    workspace, limits = Workspace(machine, WIDE), UNEQUAL_LIMITS if is_other else LIMITS
    if kind.endswith(("limit", "limits")):
        both = random_bounds(rng, machine, SPEEDS, chance=1.0)
        limits = limits.with_added(both[kind == "force limits"])
    shaper = random_shaper(rng) if kind == "shaper" else None
    while True:
        start = np.array(random_place(rng, workspace))
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        stroke = math.exp(rng.uniform(*np.log(STROKES)))
        if kind == "edge":
            x, y, z = direction.tolist()
            stroke = workspace.exit_distance(tuple(start.tolist()), (x, y, z), 0.3) - EDGE
        try:
            workspace.check_position((start + stroke * direction).tolist())
            limits.check_holding(start[np.newaxis])
        except KinematicsError:
            continue
        if stroke > STROKES[0]:
            break
    motion = (gentle, dead, forth_and_back)[rng.integers(3)]
    duration = math.exp(rng.uniform(*np.log(DURATIONS)))
    if motion is dead and rng.random() < 0.5:
        duration = stroke / STOPPED[rng.integers(len(STOPPED))]
    told = math.exp(rng.uniform(*np.log(TOLD)))
    period = PERIODS[rng.integers(len(PERIODS))]
    way = stroke * direction
    return Case(motion, start, way, duration, told, period, workspace, limits, shaper)


def driven(case: Case, horizon: float = FOLLOW_HORIZON) -> Beyond:
    """Return how far past the end a case leads, with a ``horizon`` [s]."""
    motion, start, way, duration, told, period, workspace, limits, shaper = case
    machine = workspace.machine
    whole = RESTED + 2.0 * duration + AFTER
    reports = []
    for number in range(round(whole / told)):
        part, speed = motion((number * told - RESTED) / duration)
        reports.append((number * told, start + part * way, speed / duration * way))
    engine = MotionEngine(workspace, limits, in_pieces=True)
    x, y, z = start.tolist()
    engine.start(machine.inverse((x, y, z)))
    engine.set_shaper(shaper)
    engine.set_follow_horizon(horizon)
    waiting, rows = list(reports), []
    for cycle in range(round(whole / period)):
        while waiting and waiting[0][0] <= cycle * period + 1e-9:
            time, position, velocity = waiting.pop(0)
            engine.track(position.tolist(), velocity.tolist(), cycle * period - time)
        rows.append(engine.step(period).heights)
        engine.work(lambda: True)
    places = machine.forward_batch(np.array(rows))
    speed, most, jerk = limits.table.min(axis=1).tolist()
    left = [each.acceleration(machine.inverse((x, y, z))) for each in limits.added]
    bounds = (min(speed, limits.platform_speed), min([most, *left]), jerk)
    plain = places_of_plain_follower(reports, whole, period, bounds)
    times = (period * np.arange(1, len(places) + 1) - RESTED) / duration
    targets = start + np.array([motion(time)[0] for time in times])[:, np.newaxis] * way
    lag, plain_lag = (
        float(np.linalg.norm((each - targets)[(times > 0.0) & (times < 1.0)], axis=1).mean())
        for each in (places, plain)
    )
    allowed = max(most_beyond(plain, start, way), 0.0) + FARTHER + PART * case.stroke
    if shaper is not None:
        allowed += shaper.delay * max(float(np.linalg.norm(each[2])) for each in reports)
    ours = max(most_beyond(places, start, way), 0.0)
    return Beyond(ours, max(most_beyond(plain, start, way), 0.0), allowed, lag, plain_lag)


def main() -> int:
    """Drive cases of all kinds; return 1 if the platform went too far in one."""
    options = numbers(
        __doc__,
        count=(300, "of each kind"),
        seed=(1, "of these"),
        horizon=(FOLLOW_HORIZON, "of following [s]"),
        show=(3, "how many of the farthest are told"),
    )
    lines, farthest = [], []
    for kind in KINDS:
        rng = np.random.default_rng((options.seed, *kind.encode()))
        cases = [random_case(kind, rng) for _ in range(options.count)]
        found = [(driven(case, options.horizon), case) for case in cases]
        found.sort(key=lambda each: -each[0].ratio)
        farthest += [(kind, *each) for each in found[: options.show]]
        too_far = sum(beyond.ratio > 1.0 for beyond, _ in found)
        lags = np.median([beyond.lag / max(beyond.plain_lag, 1e-6) for beyond, _ in found])
        lines.append(
            (kind, str(len(found)), str(too_far), f"{found[0][0].ratio:.2f}", f"{lags:.2f}")
        )
    head = ("target", "count", "too far", "farthest over allowed", "lag over plain, median")
    print(aligned([head, *lines]))
    for kind, beyond, case in farthest:
        ours, plain, allowed = (1000.0 * each for each in beyond[:3])
        print(f"{kind}: {ours:.2f} mm (plain {plain:.2f}, allowed {allowed:.2f}): {case}")
    return int(any(line[2] != "0" for line in lines))


if __name__ == "__main__":
    sys.exit(main())
