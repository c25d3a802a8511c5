"""Ways of a transfer in the frame of its stations: up, across, and down, as any path is driven."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.path_timing import PathPlanner
from tri_glide_kinematics.motion.shaped import LimitBounds, Planned
from tri_glide_kinematics.motion.trajectory import PathHeights, PathPlan, TimeScaling
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

# Ways that differ by less are the same; a platform that is beside its station by less is above it
# [m].
SAME_WAY = 1e-6
BESIDE = 1e-5

# A place that moves by z is met higher or lower, and so the platform would be too low on the way.
# That is higher by as much and by this factor: renewals may tell that the place is elsewhere.
SPARE_HEIGHT = 1.5

# A corner is rounded by this part of the height above a station at most.
PART_OF_HEIGHT = 0.4

# Part of the time upright above a station in which the frame goes over.
PART_UPRIGHT = 0.4

# Number of instants at which it is looked when a leg leads upright.
LOOKS = 200

# Parts of the limits of velocity, acceleration and jerk that the motion in a frame that moves is
# planned with: what is left is for the frame, whose motion may change on the way; and more of them
# where it does so already.
LEFT_TO_BASE = (0.96, 0.96, 0.92)
LEFT_IN_CHANGE = (0.9, 0.85, 0.78)

# A frame whose motion has changed is caught up with for so long at least [s], and with these parts
# of the limits of velocity, acceleration and jerk, as the rest is in use.
CATCHING_UP = 0.06
PARTS_FOR_MORE = (0.8, 0.4, 0.4)


@dataclass(frozen=True, eq=False)
class Ways:
    """Makes ways inside one workspace.

    Attributes:
        workspace: where the platform may be, and of which machine.
        height: of the platform between stations, by z; stations may be higher [m].
        tolerance: how far the platform may be from a corner of its way [m].
    """

    workspace: Workspace
    height: float
    tolerance: float

    def between(self, start: Vector3, end: Vector3) -> PlatformPath:
        """Return the way up from a ``start``, across, and down to an ``end`` [m]."""
        (x, y, z), (u, v, w) = start, end
        top = self.top(start, end)
        if math.dist(start, end) < SAME_WAY:
            # It is there. A plan leads along some way, be it one that nobody sees.
            points = [(x, y, z + 10.0 * SAME_WAY), end]
        elif math.dist((x, y), (u, v)) < SAME_WAY:
            points = [end]
        else:
            points = [(x, y, top), (u, v, top), end]
        path, last = PlatformPath.start(start), start
        for number, point in enumerate(points):
            if math.dist(point, last) < SAME_WAY:
                continue
            # The tolerance is that of the corner at its end.
            height = abs(top - (z if number == 0 else w))
            path = path.line_to(point, min(self.tolerance, PART_OF_HEIGHT * height))
            last = point
        return path

    def top(self, start: Vector3, end: Vector3) -> float:
        """Return how high the way from a ``start`` to an ``end`` is between both [m]."""
        return max(self.height, start[2], end[2])

    def spare(self, start: Vector3, end: Vector3, height: float) -> float:
        """Return by how much a way is above a ``height``, infinite if it has no top [m]."""
        leads_across = math.dist(start[:2], end[:2]) >= SAME_WAY
        return self.top(start, end) - height if leads_across else math.inf

    def up(self, start: Vector3) -> PlatformPath:
        """Return the way up from a ``start`` [m]."""
        x, y, z = start
        return PlatformPath.start(start).line_to((x, y, max(self.height, z + SAME_WAY * 10.0)))

    def timed(self, path: PlatformPath, limits: SliderLimits) -> Interruptible[PathPlan]:
        """Return the motion along a ``path``, from rest to rest, as one plan."""
        planner = PathPlanner(self.workspace)
        driven = yield from path.driven_in_pieces()
        heights = PathHeights(driven, self.workspace.machine.geometry)
        whole = yield from planner.to_the_end(heights, Planned(limits))
        parts = [part for part, _ in whole.parts(0.0)]
        first = parts[0]
        assert isinstance(first, PathPlan)
        scaling = TimeScaling.joined([part.scaling for part in parts if isinstance(part, PathPlan)])
        return PathPlan(first.heights, scaling)

    def guess(self, start: Vector3, end: Vector3, limits: SliderLimits) -> float:
        """Return how long it takes, about, from a ``start`` to an ``end`` [s]."""
        top = self.top(start, end)
        way = math.dist(start[:2], end[:2]) + 2.0 * top - start[2] - end[2]
        velocity, acceleration, jerk = limits.table.min(axis=1).tolist()
        return float(1.1 * (way / velocity + velocity / acceleration + acceleration / jerk))


def upright(base: PathPlan) -> tuple[float, float]:
    """Return from when on a motion is above its end, and when it leaves its start [s].

    It is upright for some time then. The frame goes over in a part of that, too, as it is still
    where it was, nearly: it begins, and ends, without acceleration.
    """
    times = np.linspace(0.0, base.duration, LOOKS)
    ways, _, _ = base.scaling.evaluate(times)
    places = base.heights.place_series(ways, np.zeros(LOOKS)).values[0, :2]
    at_start = np.hypot(*(places - places[:, :1])) < BESIDE
    at_end = np.hypot(*(places - places[:, -1:])) < BESIDE
    leaves = LOOKS if at_start.all() else int(np.argmin(at_start))
    arrives = 0 if at_end.all() else LOOKS - int(np.argmin(at_end[::-1]))
    if leaves >= arrives:
        # All of it is upright.
        return float(0.75 * base.duration), float(0.25 * base.duration)
    moves = float(times[int(np.argmax(ways > ways[0]))])
    left, met = float(times[max(leaves - 1, 0)]), float(times[min(arrives, LOOKS - 1)])
    return met + PART_UPRIGHT * (base.duration - met), left - PART_UPRIGHT * (left - moves)


def time_for(way: float, speed: float, limits: SliderLimits) -> float:
    """Return how long it takes to go a ``way`` [m] and to change by a ``speed`` [m/s].

    Those are the largest velocity, acceleration and jerk of a quintic from rest to rest, and of a
    speed that changes with the cube of the time, as the platform were a slider.
    """
    velocity, acceleration, jerk = PARTS_FOR_MORE * limits.table.min(axis=1)
    return float(
        max(
            1.875 * way / velocity,
            1.5 * speed / acceleration + math.sqrt(5.774 * way / acceleration),
            math.sqrt(6.0 * speed / jerk) + math.cbrt(60.0 * way / jerk),
            CATCHING_UP,
        )
    )


def slowdown(use: LimitBounds, limits: SliderLimits) -> float:
    """Return by which factor a motion has to be slower that makes this ``use`` of the limits."""
    velocity, acceleration, jerk = use.use.max(axis=1).tolist()
    factors = [velocity, math.sqrt(acceleration), math.cbrt(jerk)]
    factors += [
        part ** (1.0 / bound.order) for bound, part in zip(limits.added, use.added.tolist())
    ]
    return max(1.0, *factors)
