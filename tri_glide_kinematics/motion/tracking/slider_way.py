r"""The ways of sliders in phases of constant jerk: through a step, or to rest.

The shortest change of a velocity has a jerk of one size $J$, so the acceleration goes to a peak and
back to zero in a straight line each, with a steady part at the peak if a limit cuts it. From
velocity $v$ and acceleration $a$ to zero, in the direction in which the peak $b$ is positive,

$$v + \frac{b^2 - a^2}{2J} + \frac{b^2}{2J} = 0, \quad b = \sqrt{a^2/2 - J v}.$$

The direction is that against $v + a|a|/2J$, the velocity that is left if the acceleration is taken
back at once: the slider passes no velocity beyond the larger of this and its own.

The **mildest way** to what is followed is there after a horizon $T$, with the least integral of the
squared jerk. Seen from a frame that moves with what is followed, from height $x$, velocity $v$ and
acceleration $a$, or without the height, its jerk begins with

$$-\frac{60 x + 36 v T + 9 a T^2}{T^3}, \quad -\frac{6 v + 4 a T}{T^2}.$$

Of each such way only the first step is taken, with its mean jerk; the next one looks as far ahead.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import NamedTuple

from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.trajectory import Phases, cut_to


def to_zero(
    velocity: float, acceleration: float, lowest: float, highest: float, jerk: float
) -> Phases:
    """Return the phases that end with neither velocity nor acceleration, as soon as possible.

    Seen from a frame that moves, this is the way to the velocity of the frame.

    Args:
        velocity: at the start [m/s].
        acceleration: at the start; beyond its limits by rounding at most [m/s^2].
        lowest: limit of the acceleration, below zero [m/s^2].
        highest: limit of the acceleration, above zero [m/s^2].
        jerk: its limit in both directions [m/s^3].

    Returns:
        (duration [s], jerk [m/s^3]) of three phases; each may take no time.
    """
    if stopping_velocity(velocity, acceleration, jerk) > 0.0:
        velocity, acceleration, top, signed = -velocity, -acceleration, -lowest, -jerk
    else:
        top, signed = highest, jerk
    # A rounding error above the limit is kept, never added to.
    top = max(top, acceleration)
    squared = 0.5 * acceleration * acceleration - jerk * velocity
    steady = 0.0
    if squared > top * top:
        peak = top
        half_squares = top * top - 0.5 * acceleration * acceleration
        steady = max(-(velocity + half_squares / jerk) / top, 0.0)
    else:
        peak = sqrt(max(squared, 0.0))
    rise = max((peak - acceleration) / jerk, 0.0)
    return (rise, signed), (steady, 0.0), (peak / jerk, -signed)


def stopping_velocity(velocity: float, acceleration: float, jerk: float) -> float:
    """Return the velocity that is left when the acceleration is taken back at once [m/s]."""
    return velocity + acceleration * abs(acceleration) / (2.0 * jerk)


def within(value: float, bound: float) -> float:
    """Return the number from ``-bound`` to ``bound`` that is nearest to ``value``."""
    return bound if value > bound else -bound if value < -bound else value


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

    phases: Phases
    displacement: float
    velocity: float
    acceleration: float


def way_of(velocity: float, acceleration: float, phases: Phases) -> SliderWay:
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


# A step may be on what is followed at once if its jerk is no more than this part of the limit.
HARDLY_A_JERK = 1e-3

# A horizon that is shorter than so many steps is none: a step is so long already. Steps that are
# prepared have one of so many steps.
FEWEST_STEPS = 3.0


def is_hardly_a_jerk(way: SliderWay, limit: float) -> bool:
    """Return whether the jerks of a ``way`` are as good as none, with such a ``limit`` [m/s^3]."""
    most = HARDLY_A_JERK * limit
    return all(-most <= jerk <= most for _, jerk in way.phases)


def mildest_way_onto(
    own: Setpoint,
    wanted: Setpoint,
    bounds: Bounds,
    period: float,
    horizon: float,
    twist: float = 0.0,
) -> SliderWay | None:
    """Return the first step of the mildest way onto what moves, if the limits allow it.

    Args:
        own: at the start of the step.
        wanted: what moves, at the end of the step.
        bounds: of the slider; the velocity is not looked at.
        period: of the step [s].
        horizon: after which it is to be there [s]; one of less than ``FEWEST_STEPS`` is the step.
        twist: jerk of what moves [m/s^3].
    """
    if horizon < FEWEST_STEPS * period:
        return way_onto(own, wanted, bounds, period)
    x, v, a = _seen_from(wanted, own, period, twist)
    v, a, part = horizon * v, horizon * horizon * a, period / horizon
    mean = (
        -(60.0 * x + 36.0 * v + 9.0 * a)
        + part * (180.0 * x + 96.0 * v + 18.0 * a)
        - part * part * (120.0 * x + 60.0 * v + 10.0 * a)
    ) / (horizon * horizon * horizon)
    if abs(mean) <= HARDLY_A_JERK * bounds[2]:
        onto = way_onto(own, wanted, bounds, period)
        if onto and is_hardly_a_jerk(onto, bounds[2]):
            return onto
    return _steady(own[1], own[2], mean + twist, bounds, period)


def is_near(own: Setpoint, wanted: Setpoint, jerk: float, period: float, horizon: float) -> bool:
    """Return whether none of height, velocity and acceleration asks for a ``jerk`` [m/s^3].

    Args:
        own: at the start of a step.
        wanted: what moves, at the end of the step.
        jerk: of the mildest way onto it.
        period: of the step [s].
        horizon: after which it is to be there [s].
    """
    x, v, a = map(abs, _seen_from(wanted, own, period))
    v, a = horizon * v, horizon * horizon * a
    return 60.0 * x + 36.0 * v + 9.0 * a <= horizon * horizon * horizon * jerk


def mildest_way_onto_speed(
    own: tuple[float, float],
    wanted: tuple[float, float],
    bounds: Bounds,
    period: float,
    horizon: float,
    twist: float = 0.0,
) -> SliderWay | None:
    """Return the first step of the mildest way to a velocity, as ``mildest_way_onto`` does.

    Args:
        own: velocity [m/s] and acceleration [m/s^2] at the start of the step.
        wanted: the same, at its end.
        bounds: of the slider; the velocity is not looked at.
        period: of the step [s].
        horizon: after which it is to be so [s].
        twist: jerk of what is wanted [m/s^3].
    """
    velocity, acceleration = own
    rate, bend = wanted
    onto = way_onto_speed(velocity, acceleration, rate, bend, bounds, period)
    if horizon < FEWEST_STEPS * period or (onto and is_hardly_a_jerk(onto, bounds[2])):
        return onto
    _, v, a = _seen_from((0.0, rate, bend), (0.0, velocity, acceleration), period, twist)
    a, part = horizon * a, period / horizon
    mean = (part * (6.0 * v + 3.0 * a) - (6.0 * v + 4.0 * a)) / (horizon * horizon)
    return _steady(velocity, acceleration, mean + twist, bounds, period)


def shortest_way_onto_speed(
    own: tuple[float, float], wanted: tuple[float, float], bounds: Bounds, period: float
) -> SliderWay:
    """Return the first step of the shortest way to a velocity; see ``mildest_way_onto_speed``.

    It is seen from a frame that has the velocity and the acceleration that are wanted.
    """
    velocity, acceleration = own
    rate, bend = wanted
    _, most, jerk = bounds
    before = rate - period * bend
    phases = to_zero(velocity - before, acceleration - bend, -most - bend, most - bend, jerk)
    return way_of(velocity, acceleration, cut_to(phases, period))


def _seen_from(
    wanted: Setpoint, own: Setpoint, period: float, twist: float = 0.0
) -> tuple[float, float, float]:
    """Return ``own`` at the start of a step as seen from what is ``wanted`` at its end."""
    height, velocity, acceleration = own
    place, rate, bend = wanted
    turn = period * twist
    return (
        height - place + period * (rate - 0.5 * period * (bend - turn / 3.0)),
        velocity - rate + period * (bend - 0.5 * turn),
        acceleration - bend + turn,
    )


def _steady(
    velocity: float, acceleration: float, jerk: float, bounds: Bounds, period: float
) -> SliderWay | None:
    """Return the step with a steady ``jerk``, if the limits allow it."""
    _, most, hardest = bounds
    end = acceleration + period * jerk
    if not (-hardest <= jerk <= hardest and -most <= end <= most):
        return None
    return way_of(velocity, acceleration, ((period, jerk),))


# A slider that is slower than the others brakes more gently, but not by more than this.
GENTLEST = 0.05

# Added to each part of the velocity, so that none is zero.
TINY = 1e-9


def braking_alone(ways: Sequence[SliderWay], limits: SliderLimits) -> list[Phases]:
    """Return the shortest way to rest of each slider, after the step that it does.

    Args:
        ways: of the sliders in the step.
        limits: of the sliders.
    """
    return [
        to_zero(way.velocity, way.acceleration, -most, most, jerk)
        for way, (_, most, jerk) in zip(ways, limits.of_sliders)
    ]


def braking_together(ways: Sequence[SliderWay], limits: SliderLimits) -> list[Phases]:
    """Return ways to rest on which the velocities keep their proportions, or nearly.

    So the platform goes on in its direction, where sliders that stop one after the other would
    make it turn aside. A slider has the part of its limits that its velocity is of the largest.

    Args:
        ways: of the sliders in the step.
        limits: of the sliders.
    """
    v1, v2, v3 = [abs(way.velocity) for way in ways]
    fastest = max(v1, v2, v3)
    if fastest == 0.0:
        return braking_alone(ways, limits)
    parts = (v1 / fastest + TINY, v2 / fastest + TINY, v3 / fastest + TINY)
    # Limits of a slider that has all of the velocity.
    p1, p2, p3 = parts
    a1, a2, a3 = limits.acceleration
    j1, j2, j3 = limits.jerk
    hardest, sharpest = min(a1 / p1, a2 / p2, a3 / p3), min(j1 / p1, j2 / p2, j3 / p3)
    together = []
    for way, part, (_, most, jerk) in zip(ways, parts, limits.of_sliders):
        gentle = max(min(hardest * part, most), GENTLEST * most, abs(way.acceleration))
        smooth = max(min(sharpest * part, jerk), GENTLEST * jerk)
        together.append(to_zero(way.velocity, way.acceleration, -gentle, gentle, smooth))
    return together
