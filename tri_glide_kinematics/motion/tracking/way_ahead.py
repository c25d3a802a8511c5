r"""How far the edge of the workspace is ahead, and how fast it may be approached.

On a distance $d$ from the edge the platform comes to rest with an acceleration $a$ that builds up
with a jerk $j$ if its speed is at most

$$F(d) = \sqrt{c^2 + 2 a d} - c, \quad c = a^2/2j.$$

A platform that keeps to $F$ slows down by $a F/(F + c)$, which is nowhere more than $a$ and fades
out towards the edge. So it comes to rest there without a jerk.
"""

from __future__ import annotations

from math import dist, hypot, inf, sqrt
from typing import NamedTuple

from tri_glide_kinematics.motion.limits import EDGE_CLEARANCE
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

# Nearer than this it is there [m].
ARRIVED = 1e-7

# The way to the edge is looked up anew when the platform is so far beside the line to it [m].
SAME_LINE = 1e-5

# Likewise where no edge is near: beside the line, and how far the direction may turn (cosine).
SAME_VICINITY = 5e-3
SAME_DIRECTION = 0.98

# How much farther than needed is looked, so as not to look in each cycle [m].
FARTHER = 0.02


class Approach(NamedTuple):
    """How a platform moves on towards the edge.

    Attributes:
        speed: at most [m/s].
        slowdown: acceleration at that speed, at most 0 [m/s^2].
    """

    speed: float
    slowdown: float


def approach(distance: float, acceleration: float, jerk: float) -> Approach:
    """Return how fast the platform may be at a ``distance`` [m] from where it is to rest.

    Args:
        distance: to the edge [m].
        acceleration: with which to slow down [m/s^2].
        jerk: with which that is built up [m/s^3].
    """
    way = distance - EDGE_CLEARANCE
    if way < ARRIVED:
        return Approach(0.0, 0.0)
    if way == inf:
        return Approach(inf, 0.0)
    c = acceleration * acceleration / (2.0 * jerk)
    speed = sqrt(c * c + 2.0 * acceleration * way) - c
    return Approach(speed, -acceleration * speed / (speed + c))


def way_to_rest(speed: float, acceleration: float, jerk: float) -> float:
    """Return the distance from the edge at which a platform has to begin to slow down [m]."""
    return 0.5 * speed * speed / acceleration + 0.5 * speed * acceleration / jerk


class WayAhead:
    """The distance to the edge along a line, looked up once for a while."""

    def __init__(self, workspace: Workspace) -> None:
        """Prepare for a ``workspace``."""
        self._workspace = workspace
        self._start: Vector3 = (0.0, 0.0, 0.0)
        self._direction: Vector3 = (0.0, 0.0, 0.0)
        self._distance = -inf
        self._farthest = -inf

    def distance(self, place: Vector3, direction: Vector3, needed: float) -> float:
        """Return how far the edge is.

        Args:
            place: of the platform. Shape (3,) [m].
            direction: unit vector. Shape (3,).
            needed: an edge that is farther away is of no interest [m].

        Returns:
            Distance [m]; infinite if it is more than ``needed``.
        """
        (x, y, z), (ux, uy, uz) = place, direction
        (sx, sy, sz), (dx, dy, dz) = self._start, self._direction
        progress = (x - sx) * dx + (y - sy) * dy + (z - sz) * dz
        beside = dist(place, (sx + progress * dx, sy + progress * dy, sz + progress * dz))
        left = self._distance - progress
        same = ux * dx + uy * dy + uz * dz
        if self._distance == self._farthest and left > needed + beside:
            known = beside < SAME_VICINITY and same > SAME_DIRECTION
        else:
            turned = hypot(ux - dx, uy - dy, uz - dz)
            # However near the edge is, another direction may lead away from it.
            near = beside + (abs(left) + FARTHER) * turned < SAME_LINE
            known = self._distance < self._farthest and near
        if not known:
            self._farthest = needed + FARTHER
            self._start, self._direction = place, direction
            self._distance = left = self._workspace.exit_distance(place, direction, self._farthest)
        return left if left <= needed else inf
