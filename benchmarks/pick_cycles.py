"""The cycle of 25/305/25 mm: how near the optimum it is, and what a belt that moves costs."""

from __future__ import annotations

import math
from collections.abc import Iterable

from benchmarks.bench_paths import optimum
from benchmarks.judge import LIMITS, MACHINE
from benchmarks.table import Row
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.motion.tracking import MovingTarget
from tri_glide_kinematics.motion.trajectory import PathPlan
from tri_glide_kinematics.motion.transfer import Station, TransferPlan, TransferPlanner
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

# Up, across, down [m], and the dwell at the part and at the place [s].
UP, ACROSS, DWELL = 0.025, 0.305, 0.05
TOLERANCES = (0.005, 0.01)  # m
LOW = 0.25  # m
SPEEDS = (0.05, 0.1, 0.2, 0.3)  # m/s
LARGEST_RATIO, LEAST_PART = 1.05, 0.9
REACH = Workspace(MACHINE, WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 10.0))


def rows() -> Iterable[Row]:
    """Yield the time of the resting cycle, and the cycles a minute on belts that move."""
    yield from _optimum_rows()
    for axis in (0, 1):
        for along in (0, 1):
            yield from _belt_rows(axis, along)


def ends(axis: int) -> tuple[Vector3, Vector3]:
    """Return where the part and the place are: as far from each other along an ``axis`` [m]."""
    half = 0.5 * ACROSS
    return (
        ((-half, 0.0, LOW), (half, 0.0, LOW))
        if axis == 0
        else ((0.0, half, LOW), (0.0, -half, LOW))
    )


def cycle(part: Station, place: Vector3, tolerance: float) -> TransferPlan:
    """Return the plan from a ``place`` to a ``part`` and back, with a dwell at each."""
    planner = TransferPlanner(REACH, LOW + UP, tolerance)
    stations = [part, Station(place)]
    return at_once(planner.planned(place, stations, 0.0, LIMITS, wait=DWELL, lifts=False))


def _optimum_rows() -> Iterable[Row]:
    least_time = optimum()
    for axis, tolerance in ((axis, tolerance) for axis in (0, 1) for tolerance in TOLERANCES):
        part, place = ends(axis)
        planner = TransferPlanner(REACH, LOW + UP, tolerance)
        plan = at_once(planner.planned(place, [Station(part)], 0.0, LIMITS, lifts=False))
        leg = plan.legs[0].plan
        assert isinstance(leg, PathPlan)
        what = (
            f"25/305/25 mm along {'xy'[axis]} at rest, corners rounded by {1e3 * tolerance:g} mm "
            f"({1e3 * plan.duration:.0f} ms), over {{}} on the same path"
        )
        if least_time is None:
            yield Row(what.format("TOPP3"), "copp-py is missing")
        else:
            ratio = plan.duration / least_time(leg.heights, leg.scaling, LIMITS)
            yield Row.at_most(what.format("copp-py's TOPP3"), ratio, LARGEST_RATIO, ".4f")


def _belt_rows(axis: int, along: int) -> Iterable[Row]:
    """Yield what belts ``along`` an axis leave of the cycles between ends along an ``axis``."""
    part, place = ends(axis)
    tolerance = TOLERANCES[0]
    for speed in SPEEDS:
        ratios = []
        for sign in (-1.0, 1.0):
            velocity = [0.0, 0.0, 0.0]
            velocity[along] = sign * speed
            met, moving = _met_in_the_middle(part, place, (*velocity,), tolerance)
            if moving is None:
                continue
            resting = cycle(Station(met, DWELL), place, tolerance)
            ratios.append(resting.duration / moving.duration)
        what = f"cycles along {'xy'[axis]} from a belt along {'xy'[along]}, {speed:g} m/s"
        if not ratios:
            yield Row(f"{what}, over those with parts at rest", "out of reach")
            continue
        least = min(ratios)
        each = " and ".join(f"{ratio:.3f}" for ratio in ratios)
        goal = f"at least {LEAST_PART:g}"
        yield Row(
            f"{what}, both ways, over those with parts at rest", each, goal, least >= LEAST_PART
        )


def _met_in_the_middle(
    part: Vector3, place: Vector3, velocity: tuple[float, ...], tolerance: float
) -> tuple[Vector3, TransferPlan | None]:
    """Return where the part is in the middle of the dwell, which is at ``part``, and the plan."""
    vx, vy, vz = velocity
    time = DWELL + 0.6
    for _ in range(6):
        start = MovingTarget(part, (vx, vy, vz)).after(-time).position
        try:
            plan = cycle(Station(start, DWELL, (vx, vy, vz)), place, tolerance)
        except KinematicsError:
            return part, None
        time, before = plan.arrival(0) + 0.5 * DWELL, time
        if math.isclose(time, before, abs_tol=1e-3):
            break
    return part, plan
