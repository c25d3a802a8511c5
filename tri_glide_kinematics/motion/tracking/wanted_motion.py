"""How fast the platform may go in a direction, and how the sliders move then."""

from __future__ import annotations

from math import hypot, inf, sqrt
from typing import NamedTuple

from tri_glide_kinematics.motion.tracking.slider_line import SliderLine, slider_line
from tri_glide_kinematics.motion.tracking.velocity_phases import within
from tri_glide_kinematics.motion.tracking.way_ahead import (
    WayAhead,
    approach,
    way_to_rest,
)
from tri_glide_kinematics.motion.trajectory import EDGE_CLEARANCE, SliderLimits
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import Vector3

# What the bends of the slider paths may take of the limits of acceleration and jerk; the rest is
# left to get onto such a path and to keep to it.
FRACTION_OF_BENDS = 0.5

# What they may take of the acceleration at most, where the place is not as it was foreseen.
LARGEST_FRACTION = 0.9

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
    speed = hypot(x, y, z)
    direction = x / speed, y / speed, z / speed
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
