r"""The next step towards a wanted velocity of the platform.

A platform that moves along the wanted direction already, or rests, stays on its line. Else wanted
of the sliders is $J(p) u$, and the acceleration with which that changes on the way, both of the
end of the step, where the platform will then be. A slider that can be so at the
end of the step is made so; each other one goes there by the shortest change of its velocity, seen
from a frame that has the wanted velocity and acceleration, and is cut after the step. So there is
no lag but that of the limits, and a steady velocity is kept on a straight line.

With a horizon, a slider that can be so a horizon later sets out on the mildest way there instead.
"""

from __future__ import annotations

from math import hypot, inf

from tri_glide_kinematics.motion.limits import AT_REST, SliderLimits, SliderState
from tri_glide_kinematics.motion.tracking.moving_target import WantedVelocity
from tri_glide_kinematics.motion.tracking.slider_way import (
    Bounds,
    SliderWay,
    mildest_way_onto_speed,
    shortest_way_onto_speed,
    way_of,
    way_onto,
    way_onto_speed,
)
from tri_glide_kinematics.motion.tracking.straight_motion import (
    TINY,
    WantedMotion,
    WayAhead,
    slider_line,
    wanted_motion,
)
from tri_glide_kinematics.motion.tracking.trend import bend_of_turn
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import Vector3, plus
from tri_glide_kinematics.workspace import Workspace

# What of the limits of the jerk the motion along the line may take: the rest keeps to the line.
FRACTION_OF_JERK = 0.95

# A step that ends at the wanted speed has two jerks, which the three of the sliders do not follow
# exactly: they may be harder.
FRACTION_AT_END = 0.6

# With one jerk a step the shortest change of the speed cannot be followed to its end. It is left
# when two jerks over so many steps lead there.
SOON = 4

# A platform is on the line if it moves so little across it [m/s], [m/s^2].
ACROSS = 1e-6
ACCELERATION_ACROSS = 1e-3


def straight_step(
    machine: TriGlide,
    state: SliderState,
    place: tuple[Vector3, Vector3],
    wanted: WantedMotion,
    limits: SliderLimits,
    period: float,
    horizon: float = 0.0,
) -> list[SliderWay] | None:
    """Return the next step of each slider, or None if the platform is not on the line.

    Args:
        machine: the kinematics.
        state: where the step begins.
        place: position [m] and velocity [m/s] of the platform there.
        wanted: how the platform is to move at the end of the step.
        limits: of the sliders.
        period: of the step [s].
        horizon: how long the way to the wanted speed may take [s].

    Raises:
        KinematicsError: if the machine has no pose there.
    """
    (x, y, z), velocity = place
    ux, uy, uz = wanted.direction
    speed = _along(velocity, wanted.direction, ACROSS)
    if speed is None:
        return None
    # The acceleration of the platform is what the bends do not explain.
    _, rates, bends, twists = wanted.line
    squared = speed * speed
    a1, a2, a3 = state.accelerations
    b1, b2, b3 = slider_line(machine, (x, y, z), wanted.direction).accelerations
    _, acceleration_vector = machine.forward_velocity(
        state.heights, (a1 - squared * b1, a2 - squared * b2, a3 - squared * b3)
    )
    acceleration = _along(acceleration_vector, wanted.direction, ACCELERATION_ACROSS)
    if acceleration is None:
        return None
    most = jerk = inf
    for rate, bend, twist, largest, hardest in zip(
        rates, bends, twists, limits.acceleration, limits.jerk
    ):
        size = abs(rate) + TINY
        taken = abs(3.0 * bend * speed * acceleration + twist * squared * speed)
        most = min(most, (largest + bend * squared) / size)
        jerk = min(jerk, (FRACTION_OF_JERK * hardest - taken) / size)
    slope = wanted.slope
    if not (jerk > 0.0 and most > abs(slope)):
        return None
    _, way, faster, acceleration = _along_line(
        (speed, acceleration), wanted, (inf, most, jerk), period, horizon
    )
    heights, rates, bends, _ = slider_line(
        machine, (x + way * ux, y + way * uy, z + way * uz), wanted.direction
    )
    ways = []
    for own, height, rate, bend, bounds in zip(
        zip(*state), heights, rates, bends, limits.of_sliders
    ):
        end = height, rate * faster, rate * acceleration + bend * faster * faster
        onto = way_onto(own, end, bounds, period)
        if onto is None:
            return None
        ways.append(onto)
    return ways


def _along(vector: Vector3, direction: Vector3, across: float) -> float | None:
    """Return the part of a vector along a direction, or None if there is more ``across`` it."""
    (x, y, z), (ux, uy, uz) = vector, direction
    along = x * ux + y * uy + z * uz
    beside = hypot(x - along * ux, y - along * uy, z - along * uz)
    return along if beside <= across else None


def _along_line(
    own: tuple[float, float], wanted: WantedMotion, bounds: Bounds, period: float, horizon: float
) -> SliderWay:
    """Return the way of the platform along the line in the step.

    Args:
        own: speed [m/s] and acceleration [m/s^2] at the start.
        wanted: how the platform is to move at the end of the step.
        bounds: of the motion along the line.
        period: of the step [s].
        horizon: how long the way to the wanted speed may take [s].
    """
    _, most, jerk = bounds
    at_end = inf, most, FRACTION_AT_END * jerk
    aim = wanted.speed, wanted.slope
    onto = mildest_way_onto_speed(own, aim, at_end, period, horizon)
    if onto:
        return onto
    for periods in range(2, SOON + 1):
        ahead = (periods - 1) * period
        later = wanted.speed + ahead * wanted.slope
        onto = way_onto_speed(*own, later, wanted.slope, bounds, periods * period)
        if onto:
            return way_of(*own, ((period, onto.phases[0][1]),))
    shortest = shortest_way_onto_speed(own, aim, bounds, period)
    mean = sum(length * one for length, one in shortest.phases) / period
    return way_of(*own, ((period, mean),))


# A jog that is slower than this is none [m/s].
SLOWEST_JOG = 1e-7


class VelocityTracking:
    """Steps towards velocities of the platform."""

    def __init__(self, workspace: Workspace) -> None:
        """Prepare for a ``workspace`` and its machine."""
        self._machine = workspace.machine
        self._ahead = WayAhead(workspace)

    def step_towards(
        self,
        state: SliderState,
        asked: WantedVelocity,
        limits: SliderLimits,
        period: float,
        horizon: float = 0.0,
    ) -> list[SliderWay]:
        """Return the next step of each slider.

        Args:
            state: where the step begins; inside the limits.
            asked: of the platform at the end of the step.
            limits: of the sliders.
            period: of the step [s].
            horizon: how long the change to the velocity may take; a halt, and an approach to an
                edge, is as soon as it can be [s].

        Raises:
            KinematicsError: if the machine has no pose there, or a number is not finite.
        """
        machine = self._machine
        place = machine.forward_velocity(state.heights, state.velocities)
        rates = accelerations = twists = AT_REST
        velocity, acceleration = asked
        stop = hypot(*velocity) < SLOWEST_JOG
        if stop and hypot(*place[1]) > SLOWEST_JOG:
            # To a halt along the line, if there is one.
            velocity = place[1]
        if not stop or velocity is place[1]:
            (x, y, z), (dx, dy, dz) = place
            end = x + period * dx, y + period * dy, z + period * dz
            wanted = wanted_motion(machine, self._ahead, end, velocity, limits)
            if stop:
                wanted = WantedMotion(wanted.direction, 0.0, 0.0, wanted.line)
            if stop or wanted.slope:
                horizon = 0.0
            straight = straight_step(machine, state, place, wanted, limits, period, horizon)
            if straight:
                return straight
            if not stop:
                rates, accelerations = wanted.rates(), wanted.accelerations(limits)
                if any(acceleration) and horizon > 0.0:
                    _, turning = machine.inverse_velocity(end, acceleration)
                    accelerations = plus(accelerations, turning)
                    _, twists = machine.inverse_velocity(end, bend_of_turn(velocity, acceleration))
        ways = []
        for own, aim, bounds, twist in zip(
            zip(*state[1:]), zip(rates, accelerations), limits.of_sliders, twists
        ):
            mildest = mildest_way_onto_speed(own, aim, bounds, period, horizon, twist)
            ways.append(mildest or shortest_way_onto_speed(own, aim, bounds, period))
        return ways
