"""What one slider does in one step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from tri_glide_kinematics.motion.tracking.velocity_phases import Phase

# Height [m], velocity [m/s] and acceleration [m/s^2] of one slider.
Setpoint = tuple[float, float, float]

# Its limits of velocity [m/s], acceleration [m/s^2] and jerk [m/s^3].
Bounds = tuple[float, float, float]


class SliderWay(NamedTuple):
    """What one slider does in a step.

    Attributes:
        phases: (duration [s], jerk [m/s^3]) one after the other.
        displacement: from the start to the end [m].
        velocity: at the end [m/s].
        acceleration: at the end [m/s^2].
    """

    phases: Sequence[Phase]
    displacement: float
    velocity: float
    acceleration: float


def way_of(velocity: float, acceleration: float, phases: Sequence[Phase]) -> SliderWay:
    """Return the way from a velocity [m/s] and an acceleration [m/s^2] on through ``phases``."""
    displacement = 0.0
    for length, jerk in phases:
        end = acceleration + length * jerk
        displacement += length * (velocity + length * (2.0 * acceleration + end) / 6.0)
        velocity += 0.5 * length * (acceleration + end)
        acceleration = end
    return SliderWay(phases, displacement, velocity, acceleration)


def way_onto(own: Setpoint, wanted: Setpoint, bounds: Bounds, period: float) -> SliderWay | None:
    """Return the mildest step to a height, a velocity and an acceleration, if the limits allow it.

    Three thirds of constant jerk reach all there is.

    Args:
        own: at the start of the step.
        wanted: at its end.
        bounds: of the slider; the velocity is not looked at.
        period: of the step [s].
    """
    height, velocity, acceleration = own
    place, rate, bend = wanted
    _, most, jerk = bounds
    third = period / 3.0
    # What is missing at the end if the slider goes on with the acceleration that it has.
    missing = place - height - period * (velocity + 0.5 * period * acceleration)
    e = 6.0 * missing / (third * third * third)
    f = 2.0 * (rate - velocity - period * acceleration) / (third * third)
    c = (bend - acceleration) / third
    # 19 j1 + 7 j2 + j3 = e, 5 j1 + 3 j2 + j3 = f, j1 + j2 + j3 = c.
    first = (e - 3.0 * f + 2.0 * c) / 6.0
    second = 0.5 * (f - c) - 2.0 * first
    last = c - first - second
    if not (-jerk <= first <= jerk and -jerk <= second <= jerk and -jerk <= last <= jerk):
        return None
    one = acceleration + third * first
    two = one + third * second
    if not (-most <= one <= most and -most <= two <= most and -most <= bend <= most):
        return None
    phases = (third, first), (third, second), (third, last)
    return SliderWay(phases, place - height, rate, bend)


def way_onto_speed(
    velocity: float, acceleration: float, rate: float, bend: float, bounds: Bounds, period: float
) -> SliderWay | None:
    """Return the mildest step to a velocity and an acceleration, if the limits allow it.

    Two halves of constant jerk reach both.

    Args:
        velocity: at the start [m/s].
        acceleration: at the start [m/s^2].
        rate: velocity at the end [m/s].
        bend: acceleration at the end [m/s^2].
        bounds: of the slider; the velocity is not looked at.
        period: of the step [s].
    """
    _, most, jerk = bounds
    half = 0.5 * period
    change = (bend - acceleration) / half
    first = (rate - velocity - acceleration * period) / (half * half) - 0.5 * change
    second = change - first
    middle = acceleration + half * first
    if not (-jerk <= first <= jerk and -jerk <= second <= jerk and -most <= middle <= most):
        return None
    way = way_of(velocity, acceleration, ((half, first), (half, second)))
    return SliderWay(way.phases, way.displacement, rate, bend)
