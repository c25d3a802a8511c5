r"""A straight motion of the platform: how the sliders move in it, so how fast it may be.

With the rise $s_i = h_i - z$ of arm i and the velocity $(u_x, u_y, u_z)$ the rise changes by
$r_i = \dot h_i - u_z$ per second, and as $s_i^2 + |F_i|^2$ is the square of the arm's length,

$$\ddot h_i = -\frac{u_x^2 + u_y^2 + r_i^2}{s_i}, \quad \dddot h_i = -\frac{3 r_i \ddot h_i}{s_i}.$$

The edge of the workspace ahead bounds the speed, too. On a distance $d$ from the edge the platform
comes to rest with an acceleration $a$ that builds up with a jerk $j$ if its speed is at most

$$F(d) = \sqrt{c^2 + 2 a d} - c, \quad c = a^2/2j.$$

A platform that keeps to $F$ slows down by $a F/(F + c)$, which is nowhere more than $a$ and fades
out towards the edge. So it comes to rest there without a jerk.
"""

from __future__ import annotations

from math import dist, hypot, inf, sqrt
from typing import NamedTuple

from tri_glide_kinematics.motion.limits import EDGE_CLEARANCE, SliderLimits
from tri_glide_kinematics.motion.tracking.slider_way import within
from tri_glide_kinematics.tri_glide import NoPoseError, TriGlide
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import vector_text
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


class SliderLine(NamedTuple):
    """Sliders while the platform passes a place at a steady velocity.

    Attributes:
        heights: at the place. Shape (3,) [m].
        rates: of the heights. Shape (3,) [m/s].
        accelerations: Shape (3,) [m/s^2].
        jerks: Shape (3,) [m/s^3].
    """

    heights: Vector3
    rates: Vector3
    accelerations: Vector3
    jerks: Vector3


def slider_line(machine: TriGlide, position: Vector3, velocity: Vector3) -> SliderLine:
    """Return the motion of the sliders for a platform on a straight line.

    Args:
        machine: the kinematics.
        position: of the platform. Shape (3,) [m].
        velocity: of the platform. Shape (3,) [m/s].

    Raises:
        KinematicsError: if the machine has no pose there, or a number is not finite.
    """
    heights, rates = machine.inverse_velocity(position, velocity)
    (h1, h2, h3), (w1, w2, w3), z = heights, rates, position[2]
    dx, dy, dz = velocity
    level = dx * dx + dy * dy
    s1, s2, s3 = h1 - z, h2 - z, h3 - z
    if not (s1 > 0.0 and s2 > 0.0 and s3 > 0.0):
        # However far up or down a place is, the heights lie above it; but not by what they are
        # rounded to.
        place = vector_text(position, 3)
        raise NoPoseError(f"the place {place} m is too far away to tell the sliders", heights)
    r1, r2, r3 = w1 - dz, w2 - dz, w3 - dz
    a1, a2, a3 = -(level + r1 * r1) / s1, -(level + r2 * r2) / s2, -(level + r3 * r3) / s3
    return SliderLine(
        heights,
        rates,
        (a1, a2, a3),
        (-3.0 * r1 * a1 / s1, -3.0 * r2 * a2 / s2, -3.0 * r3 * a3 / s3),
    )


# What the bends of the slider paths may take of the limits of acceleration and jerk; the rest is
# left to get onto such a path and to keep to it.
FRACTION_OF_BENDS = 0.5

# What they may take of the acceleration at most, where the place is not as it was foreseen.
LARGEST_FRACTION = 0.9

# What of a largest speed of the platform it takes: a step leads along the line only nearly.
FRACTION_OF_SPEED = 0.999

# A slider that hardly moves with the platform bounds it hardly, and by a finite number.
TINY = 1e-9


class WantedMotion(NamedTuple):
    """A motion of the platform along a direction that the sliders can keep up.

    Attributes:
        direction: unit vector. Shape (3,).
        speed: along it [m/s].
        slope: how the speed changes [m/s^2].
        line: the sliders at a speed of 1 m/s.
    """

    direction: Vector3
    speed: float
    slope: float
    line: SliderLine

    def rates(self) -> Vector3:
        """Return the velocities of the sliders. Shape (3,) [m/s]."""
        w1, w2, w3 = self.line.rates
        return self.speed * w1, self.speed * w2, self.speed * w3

    def accelerations(self, limits: SliderLimits) -> Vector3:
        """Return those of the sliders, cut to a part of their ``limits``. Shape (3,) [m/s^2]."""
        squared, slope = self.speed * self.speed, self.slope
        (w1, w2, w3), (b1, b2, b3) = self.line.rates, self.line.accelerations
        most1, most2, most3 = limits.acceleration
        return (
            within(squared * b1 + slope * w1, LARGEST_FRACTION * most1),
            within(squared * b2 + slope * w2, LARGEST_FRACTION * most2),
            within(squared * b3 + slope * w3, LARGEST_FRACTION * most3),
        )


def wanted_motion(
    machine: TriGlide,
    ahead: WayAhead,
    position: Vector3,
    velocity: Vector3,
    limits: SliderLimits,
) -> WantedMotion:
    """Return the motion of the platform with a velocity, or with the most of it.

    The limits and the edge of the workspace reduce the size of the velocity, never its direction.

    Args:
        machine: the kinematics.
        ahead: knows how far the edge is.
        position: of the platform. Shape (3,) [m].
        velocity: of the platform, not zero. Shape (3,) [m/s].
        limits: of the sliders.

    Raises:
        KinematicsError: if the machine has no pose there, or a number is not finite.
    """
    x, y, z = velocity
    size = hypot(x, y, z)
    direction = x / size, y / size, z / size
    speed = min(size, FRACTION_OF_SPEED * limits.platform_speed)
    line = slider_line(machine, position, direction)
    slowest = -1
    braking = building_up = inf
    for i, (rate, bend, twist) in enumerate(zip(*line[1:])):
        size, bend, twist = abs(rate) + TINY, -bend, abs(twist)
        most, jerk = FRACTION_OF_BENDS * limits.acceleration[i], FRACTION_OF_BENDS * limits.jerk[i]
        # What all sliders can do along the direction is what the least of them can.
        braking, building_up = min(braking, most / size), min(building_up, jerk / size)
        if speed * speed * bend > most:
            speed, slowest = sqrt(most / bend), -1
        if speed * speed * speed * twist > jerk:
            speed, slowest = (jerk / twist) ** (1.0 / 3.0), -1
        # An acceleration in the direction of motion has to be taken back before the limit.
        reserve = (speed * speed * bend) ** 2 / (2.0 * limits.jerk[i])
        room = max(limits.velocity[i] - reserve, 0.5 * limits.velocity[i])
        if speed * size > room:
            speed, slowest = room / size, i
    # Where one slider's limit holds the platform back, its speed changes with the place.
    slope = 0.0
    if slowest >= 0:
        slope = -speed * speed * line.accelerations[slowest] / line.rates[slowest]
    needed = way_to_rest(speed, braking, building_up) + EDGE_CLEARANCE
    held_back = approach(ahead.distance(position, direction, needed), braking, building_up)
    if held_back.speed < speed:
        speed, slope = held_back
    return WantedMotion(direction, speed, slope, line)
