r"""The next step towards a target that moves.

Sliders that held the platform on the target would have some height, rate and acceleration at the
end of the step. A slider that can have them a horizon later, as they go on, sets out on the mildest
way there: to be there at once would answer each rounding error with the whole jerk. Each other one
catches up in the shortest time, seen from a frame that moves with the slider of the target: what
the target does takes its part of the limits of velocity and acceleration.

A target may end at any time. Sliders that catch up in the shortest time are then so fast that the
platform dives below the end. So they are no faster than ones that could still arrive where the
target is now, or a little ahead of it (``MovingTarget.lead``), with the velocity that it has. They
arrive in the frame of their way there: one axis along it and two across.
Sliders that arrive each for itself do so one after the other, and lead the platform aside and past
the end.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, inf
from operator import mul, sub

from tri_glide_kinematics.motion.limits import EDGE_CLEARANCE, SliderLimits, SliderState
from tri_glide_kinematics.motion.tracking.moving_target import MovingTarget
from tri_glide_kinematics.motion.tracking.slider_way import (
    FEWEST_STEPS,
    TINY,
    Bounds,
    Setpoint,
    SliderWay,
    is_near,
    mildest_way_onto,
    way_of,
    way_onto,
    within,
)
from tri_glide_kinematics.motion.tracking.straight_motion import approach, slider_line, way_to_rest
from tri_glide_kinematics.motion.trajectory import RuckigPlanner, cut_to
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

# What the target may take of the limits: there is always something left to catch up with. A
# target that takes more is not followed, only run after.
FRACTION_OF_VELOCITY = 0.98
FRACTION_OF_ACCELERATION = 0.5

# A target is caught up with until the mildest way onto it takes no more than this of the jerk, with
# the horizon or this one: a long one would take long from where it is the mildest way [s].
NEAR = 0.2
NEAR_HORIZON = 0.045

# The way onto a target whose reports are noise takes so long at most [s]. Where that is sure, the
# target is near with a horizon that is longer by this part: noise alone would keep it away.
LONGEST, NOISY = 0.2, 0.5

# Few reports may happen to show little noise of the position: what it was fades so slowly [s].
FADING = 2.0

# What of the limits of acceleration and jerk sliders count on that could arrive where the target is
# now: along their way there, and in each direction across. One slider may need all three.
SHARE_ALONG = 0.65
SHARE_ACROSS = 0.25

# The frame is along the way to where the target is so much later, so near it along its motion [s].
ONWARDS = 0.02

# What of them the acceleration may take with which they arrive.
FRACTION_OF_BEND = 0.9

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
    (x, y, z), (dx, dy, dz), *_ = target
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


def horizon_of_noise(noise: tuple[float, float], jerk: float) -> float:
    """Return for how long the mildest way lasts that takes a ``jerk`` for some noise [s].

    Args:
        noise: of the position [m] and of the velocity [m/s].
        jerk: of the way [m/s^3].
    """
    height, rate = noise
    return min(max((60.0 * height / jerk) ** (1.0 / 3.0), (36.0 * rate / jerk) ** 0.5), LONGEST)


class TargetTracking:
    """Steps towards moving targets."""

    def __init__(self, workspace: Workspace) -> None:
        """Prepare for a ``workspace`` and its machine."""
        self._workspace = workspace
        self._ruckig = RuckigPlanner(3)
        # Whether it is being caught up with: then in the shortest time, until it is reached.
        self._is_behind = True
        # Mean error of the position of late [m].
        self._noise = 0.0

    def step_towards(
        self,
        state: SliderState,
        target: MovingTarget,
        limits: SliderLimits,
        period: float,
        horizon: float = 0.0,
    ) -> list[SliderWay]:
        """Return the next step of each slider.

        Args:
            state: where the step begins; inside the limits.
            target: at the end of the step.
            limits: of the sliders.
            period: of the step [s].
            horizon: how long the way onto the target may take [s].

        Raises:
            KinematicsError: if the machine has no pose at the target, a number is not finite, or
                the target is far away and outside the workspace.
        """
        position, velocity, acceleration, lead, noise, jerk, sure = target
        machine = self._workspace.machine
        heights, rates, bends, twists = slider_line(machine, position, velocity)
        if any(acceleration):
            _, more = machine.inverse_velocity(position, acceleration)
            bends = bends[0] + more[0], bends[1] + more[1], bends[2] + more[2]
        if any(jerk):
            _, more = machine.inverse_velocity(position, jerk)
            twists = twists[0] + more[0], twists[1] + more[1], twists[2] + more[2]
        own = list(zip(*state))
        wanted = list(zip(heights, rates, bends))
        numbers = list(zip(own, wanted, limits.of_sliders))
        self._noise = max(noise[0], self._noise * max(1.0 - period / FADING, 0.0))
        noise = self._noise, noise[1]
        calm = horizon_of_noise(noise, NEAR * min(limits.jerk)) if horizon > 0.0 else 0.0
        # Few long steps go far beyond what ends meanwhile: each of them has to be near.
        if self._is_behind or horizon <= FEWEST_STEPS * period:
            near = max(min(horizon, NEAR_HORIZON), (1.0 + NOISY * sure) * calm)
            self._is_behind = not all(
                is_near(one, other, NEAR * bound[2], period, near) for one, other, bound in numbers
            )
        horizon = max(horizon, calm)
        if not self._is_behind:
            ways = [
                way
                for each, twist in zip(numbers, twists)
                if (way := mildest_way_onto(*each, period, horizon, twist))
            ]
            if len(ways) == 3:
                return ways
        onto = [way_onto(*each, period) for each in numbers]
        ways = [way for way in onto if way]
        self._is_behind = len(ways) < 3
        if not self._is_behind:
            return ways
        # It would end in a to and fro next to the edge.
        self._workspace.check_position(position)
        # What added bounds leave in all directions, here and at the target: a step that counts on
        # more cannot be ended.
        places = state.heights, heights
        left = min((e.acceleration(place) for e in limits.added for place in places), default=inf)
        bounds = [(fastest, min(most, left), jerk) for fastest, most, jerk in limits.of_sliders]
        caught = self._catch_up(own, wanted, bounds, period)
        speed = hypot(*velocity)
        if speed > 0.0 and lead < inf:
            # The sliders' size of it, where the platform goes as fast as it may.
            fastest = limits.platform_speed / speed * hypot(*rates)
            caught = self._held_back(caught, own, wanted, bounds, fastest, lead / speed, period)
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

    def _held_back(
        self,
        caught: list[SliderWay],
        own: Sequence[Setpoint],
        wanted: Sequence[Setpoint],
        bounds: Sequence[Bounds],
        fastest_along: float,
        lead: float,
        period: float,
    ) -> list[SliderWay]:
        """Return steps that are no faster than those to where the target is, with its velocity.

        Args:
            caught: steps on the shortest ways to where it will be.
            own: sliders at the start of the step.
            wanted: those of the target at its end.
            bounds: of the sliders.
            fastest_along: what the speed of the platform leaves to them together [m/s].
            lead: how far ahead of it they may arrive [s].
            period: of the step [s].
        """
        places, rates, bends = zip(*wanted)
        size = hypot(*rates)
        if not size > 0.0:
            return caught
        missing = [place - height for place, (height, _, _) in zip(places, own)]
        # The way onto a target that comes near leads away from where it goes.
        if sum(map(mul, missing, rates)) <= lead * size * size:
            return caught
        onwards = lead + ONWARDS
        chord = [behind + onwards * rate for behind, rate in zip(missing, rates)]
        length = hypot(*chord)
        frame = _frame_along([part / length for part in chord])
        heights, velocities, accelerations = [_turned(frame, each) for each in zip(*own)]
        aims = [place + (lead - period) * rate for place, rate in zip(places, rates)]
        limits = []
        for share, most in zip((FRACTION_OF_VELOCITY, SHARE_ALONG, SHARE_ALONG), zip(*bounds)):
            along = min(one / (abs(part) + TINY) for one, part in zip(most, frame[0]))
            across = SHARE_ACROSS * min(most)
            limits.append((share * along, across, across))
        limits[0] = (min(limits[0][0], fastest_along), *limits[0][1:])
        fastest, most, _ = limits
        if velocities[0] < -period * most[0]:
            # First it has to turn, with all that there is.
            return caught
        aims, passing = _turned(frame, aims), _turned(frame, rates)
        # No faster than it can become on its way there: for a run-up it would first move away.
        bounds_along = most[0], limits[2][0]
        way = aims[0] - heights[0] + way_to_rest(max(velocities[0], 0.0), *bounds_along)
        passing[0] = min(passing[0], approach(way + EDGE_CLEARANCE, *bounds_along).speed)
        # On a curve it goes on across; a target that slows down is not run after.
        bend, *aside = _turned(frame, bends)
        found = self._ruckig.to_pass(
            aims,
            [within(rate, bound) for rate, bound in zip(passing, fastest)],
            list(zip(heights, velocities, accelerations)),
            (limits[0], limits[1], limits[2]),
            [within(a, FRACTION_OF_BEND * b) for a, b in zip((min(bend, 0.0), *aside), most)],
        )
        third = period / 3.0
        jerks = []
        for acceleration, phases in zip(accelerations, found):
            ends = [
                way_of(0.0, acceleration, cut_to(phases, part * third)).acceleration
                for part in (1, 2, 3)
            ]
            jerks.append([each / third for each in map(sub, ends, (acceleration, *ends))])
        turned = [_turned(list(zip(*frame)), each) for each in zip(*jerks)]
        arriving = [
            way_of(velocity, acceleration, [(third, jerk) for jerk in each])
            for (_, velocity, acceleration), each in zip(own, zip(*turned))
        ]
        gain = sum(
            part * (way.velocity - other.velocity)
            for part, way, other in zip(frame[0], caught, arriving)
        )
        return arriving if gain > TINY * size else caught


def _frame_along(direction: Sequence[float]) -> list[Sequence[float]]:
    """Return three axes at right angles, the first of which is a ``direction``. Shape (3, 3)."""
    x, y, z = direction
    # Beside the axis that is most across.
    least = min(range(3), key=lambda axis: abs(direction[axis]))
    u, v, w = [(axis == least) - direction[least] * part for axis, part in enumerate(direction)]
    size = hypot(u, v, w)
    u, v, w = u / size, v / size, w / size
    return [direction, (u, v, w), (y * w - z * v, z * u - x * w, x * v - y * u)]


def _turned(frame: Sequence[Sequence[float]], vector: Sequence[float]) -> list[float]:
    """Return the parts of a ``vector`` along the axes of a ``frame``. Shape (3,)."""
    return [sum(map(mul, axis, vector)) for axis in frame]
