r"""The next step towards a target that moves.

Sliders that held the platform on the target would have some height, rate and acceleration at the
end of the step. A slider that can have them by then, within its limits, gets them. Each other one
catches up in the shortest time, seen from a frame that moves with the slider of the target: what
the target does takes its part of the limits of velocity and acceleration.

A target may end at any time. A slider that catches up in the shortest time is then so fast that it
dives below the end. So it is no faster than one that could still arrive where the target is now, or
a little ahead of it (``MovingTarget.lead``), with the velocity that the target has. All sliders
catch up at the same time: one after the other they lead the platform aside, and past the end.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, inf
from operator import truediv

from tri_glide_kinematics.motion.limits import EDGE_CLEARANCE, SliderLimits, SliderState
from tri_glide_kinematics.motion.tracking.moving_target import MovingTarget
from tri_glide_kinematics.motion.tracking.slider_way import (
    TINY,
    Bounds,
    Setpoint,
    SliderWay,
    cut_to,
    way_of,
    way_onto,
    within,
)
from tri_glide_kinematics.motion.tracking.straight_motion import slider_line
from tri_glide_kinematics.motion.tracking.way_ahead import approach
from tri_glide_kinematics.motion.trajectory import RuckigPlanner
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

# What the target may take of the limits: there is always something left to catch up with. A
# target that takes more is not followed, only run after.
FRACTION_OF_VELOCITY = 0.98
FRACTION_OF_ACCELERATION = 0.5

# What of the limits of acceleration and jerk a platform counts on that could arrive where the
# target is now: on a way that bends the sliders need the rest.
FRACTION_OF_ARRIVAL = 0.85

# A slider that moves less than this part of the fastest one lets the platform dive but little.
LEAST_PART = 0.25

# What of the limits a platform takes that catches up on a straight line: a slider may have to move
# more than the platform.
FRACTION_OF_STRAIGHT = 0.25


def straight_towards(place: Vector3, target: MovingTarget, limits: SliderLimits) -> Vector3:
    """Return a velocity that leads straight onto a target.

    Args:
        place: of the platform. Shape (3,) [m].
        target: to be caught up with.
        limits: of the sliders.

    Returns:
        Velocity that slows down before the target. Shape (3,) [m/s].
    """
    (x, y, z), (dx, dy, dz), _, _ = target
    x, y, z = x - place[0], y - place[1], z - place[2]
    distance = hypot(x, y, z)
    if distance == 0.0:
        return target.velocity
    speed, _ = approach(
        distance + EDGE_CLEARANCE,
        FRACTION_OF_STRAIGHT * min(limits.acceleration),
        FRACTION_OF_STRAIGHT * min(limits.jerk),
    )
    part = speed / distance
    return dx + part * x, dy + part * y, dz + part * z


class TargetTracking:
    """Steps towards moving targets."""

    def __init__(self, workspace: Workspace) -> None:
        """Prepare for a ``workspace`` and its machine."""
        self._workspace = workspace
        self._ruckig = RuckigPlanner(3)

    def step_towards(
        self, state: SliderState, target: MovingTarget, limits: SliderLimits, period: float
    ) -> list[SliderWay]:
        """Return the next step of each slider.

        Args:
            state: where the step begins; inside the limits.
            target: at the end of the step.
            limits: of the sliders.
            period: of the step [s].

        Raises:
            KinematicsError: if the machine has no pose at the target, a number is not finite, or
                the target is far away and outside the workspace.
        """
        position, velocity, acceleration, lead = target
        machine = self._workspace.machine
        heights, rates, bends, _ = slider_line(machine, position, velocity)
        if any(acceleration):
            _, more = machine.inverse_velocity(position, acceleration)
            bends = bends[0] + more[0], bends[1] + more[1], bends[2] + more[2]
        own = list(zip(*state))
        wanted = list(zip(heights, rates, bends))
        bounds = list(zip(limits.velocity, limits.acceleration, limits.jerk))
        onto = [way_onto(*each, period) for each in zip(own, wanted, bounds)]
        ways = [way for way in onto if way]
        if len(ways) == 3:
            return ways
        # It would end in a to and fro next to the edge.
        self._workspace.check_position(position)
        # What added bounds leave in all directions: a step that counts on more cannot be ended.
        left = min((each.acceleration(state.heights) for each in limits.added), default=inf)
        bounds = [(fastest, min(most, left), jerk) for fastest, most, jerk in bounds]
        caught = self._catch_up(own, wanted, bounds, period)
        speed = hypot(*velocity)
        if speed > 0.0 and lead < inf:
            arriving = self._arrive(own, wanted, bounds, (speed, lead), period)
            # The slower one of both, for each slider that is behind by more than the lead. The way
            # onto a target that comes near leads away from where it goes.
            least = LEAST_PART * max(map(abs, rates))
            caught = [
                arrival
                if abs(rate) > least
                and rate * (place - height) > max(lead, TINY) * rate * rate / speed
                and rate * (way.velocity - arrival.velocity) > TINY * speed
                else way
                for (height, _, _), (place, rate, _), way, arrival in zip(
                    own, wanted, caught, arriving
                )
            ]
        return [way or other for way, other in zip(onto, caught)]

    def _catch_up(
        self,
        own: Sequence[Setpoint],
        wanted: Sequence[Setpoint],
        bounds: Sequence[Bounds],
        period: float,
    ) -> list[SliderWay]:
        """Return steps on the shortest ways to where the sliders of the target will be.

        Args:
            own: sliders at the start of the step.
            wanted: those of the target at its end.
            bounds: of the sliders.
            period: of the step [s].
        """
        relative, velocities, accelerations = [], [], []
        for (height, velocity, acceleration), (place, rate, bend), (fastest, most, _) in zip(
            own, wanted, bounds
        ):
            bend = within(bend, FRACTION_OF_ACCELERATION * most)
            rate = within(rate, FRACTION_OF_VELOCITY * fastest)
            # The frame where the step begins.
            before = within(rate - period * bend, FRACTION_OF_VELOCITY * fastest)
            place -= 0.5 * period * (rate + before)
            relative.append((height - place, velocity - before, acceleration - bend))
            velocities.append((-fastest - before, fastest - before))
            accelerations.append((-most - bend, most - bend))
        found = self._ruckig.onto_origin(
            relative, velocities, accelerations, [jerk for _, _, jerk in bounds]
        )
        return [
            way_of(velocity, acceleration, cut_to(phases, period))
            for (_, velocity, acceleration), phases in zip(own, found)
        ]

    def _arrive(
        self,
        own: Sequence[Setpoint],
        wanted: Sequence[Setpoint],
        bounds: Sequence[Bounds],
        motion: tuple[float, float],
        period: float,
    ) -> list[SliderWay]:
        """Return steps on the shortest ways to where the target is, with its velocity there.

        Each slider has the part of the limits that it has of the motion, so that the platform
        arrives as one with equal limits in all directions would.

        Args:
            own: sliders at the start of the step.
            wanted: those of the target at its end.
            bounds: of the sliders.
            motion: speed of the target [m/s], and its lead [m].
            period: of the step [s].
        """
        speed, lead = motion
        parts = [abs(rate) / speed + TINY for _, rate, _ in wanted]
        fastest, *others = zip(*bounds)
        later = lead / speed - period
        passing = [within(w[1], FRACTION_OF_VELOCITY * most) for w, most in zip(wanted, fastest)]
        places = [place + later * rate for place, rate, _ in wanted]
        limits: list[Sequence[float]] = []
        for bound in others:
            common = FRACTION_OF_ARRIVAL * min(*bound, *map(truediv, bound, parts))
            limits.append([max(common * p, LEAST_PART * most) for p, most in zip(parts, bound)])
        found = self._ruckig.to_pass(places, passing, own, (fastest, limits[0], limits[1]))
        return [
            way_of(velocity, acceleration, cut_to(phases, period))
            for (_, velocity, acceleration), phases in zip(own, found)
        ]
