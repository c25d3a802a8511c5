r"""The next step towards a wanted velocity of the platform.

A platform that moves along the wanted direction already, or rests, stays on its line. Else wanted
of the sliders is $J(p) u$, and the acceleration with which that changes on the way, both of the
end of the step, where the platform will then be. A slider that can be so at the
end of the step is made so; each other one goes there by the shortest change of its velocity, seen
from a frame that has the wanted velocity and acceleration, and is cut after the step. So there is
no lag but that of the limits, and a steady velocity is kept on a straight line.
"""

from __future__ import annotations

from math import hypot

from tri_glide_kinematics.motion.tracking.slider_way import (
    Bounds,
    SliderWay,
    way_of,
    way_onto_speed,
)
from tri_glide_kinematics.motion.tracking.straight_step import straight_step
from tri_glide_kinematics.motion.tracking.velocity_phases import cut_to, to_zero
from tri_glide_kinematics.motion.tracking.wanted_motion import WantedMotion, wanted_motion
from tri_glide_kinematics.motion.tracking.way_ahead import WayAhead
from tri_glide_kinematics.motion.trajectory.cubic import AT_REST, SliderState
from tri_glide_kinematics.motion.trajectory.limits import SliderLimits
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace.workspace import Workspace

# A jog that is slower than this is none [m/s].
SLOWEST_JOG = 1e-7


class VelocityTracking:
    """Steps towards velocities of the platform."""

    def __init__(self, workspace: Workspace) -> None:
        """Prepare for a ``workspace`` and its machine."""
        self._machine = workspace.machine
        self._ahead = WayAhead(workspace)

    def step_towards(
        self, state: SliderState, velocity: Vector3, limits: SliderLimits, period: float
    ) -> list[SliderWay]:
        """Return the next step of each slider.

        Args:
            state: where the step begins; inside the limits.
            velocity: of the platform, wanted at the end of the step. Shape (3,) [m/s].
            limits: of the sliders.
            period: of the step [s].

        Raises:
            KinematicsError: if the machine has no pose there, or a number is not finite.
        """
        machine = self._machine
        place = machine.forward_velocity(state.heights, state.velocities)
        rates = accelerations = AT_REST
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
            straight = straight_step(machine, state, place, wanted, limits, period)
            if straight:
                return straight
            if not stop:
                rates, accelerations = wanted.rates(), wanted.accelerations(limits)
        return [
            _way_towards(*numbers, period)
            for numbers in zip(
                zip(state.velocities, state.accelerations),
                zip(rates, accelerations),
                zip(limits.velocity, limits.acceleration, limits.jerk),
            )
        ]


def _way_towards(
    own: tuple[float, float], wanted: tuple[float, float], bounds: Bounds, period: float
) -> SliderWay:
    """Return the next step of one slider.

    Args:
        own: velocity [m/s] and acceleration [m/s^2] at the start.
        wanted: the same at the end.
        bounds: of the slider.
        period: of the step [s].
    """
    velocity, acceleration = own
    rate, bend = wanted
    _, most, jerk = bounds
    way = way_onto_speed(velocity, acceleration, rate, bend, bounds, period)
    if way:
        return way
    before = rate - period * bend
    phases = to_zero(velocity - before, acceleration - bend, -most - bend, most - bend, jerk)
    return way_of(velocity, acceleration, cut_to(phases, period))
