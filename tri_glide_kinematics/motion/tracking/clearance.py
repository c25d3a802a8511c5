r"""Whether the sliders may go through phases of constant jerk: limits, travel and workspace.

Each slider stays between the extremes of its own displacement, so all three stay in a box. Let $c$
be its centre and $D$ half of its diagonal. A straight line of the sliders from $c$ to any place
of the box is no longer than $D$, and along it the platform moves at most $D/\sigma$, where
$\sigma$ bounds the least singular value of the Jacobian from below. If the platform at $c$ has
so much room in all directions, every place of the box is inside, whatever path leads there. How
long the path is does not matter, and when a slider is where does not either.

Where the room is too small for that, the path itself is traced, with few samples.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import copysign, hypot, sqrt
from typing import NamedTuple

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.errors import AddedBoundError
from tri_glide_kinematics.motion.limits import (
    RELATIVE_ROUNDING,
    TRAVEL_ROUNDING,
    SliderLimits,
    SliderState,
)
from tri_glide_kinematics.motion.trajectory import CubicPlan, Phases, SliderProfile, check_added
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits


class Excursion(NamedTuple):
    """What a slider does on phases of constant jerk.

    Attributes:
        lowest: of the displacement, at most 0 [m].
        highest: of the displacement, at least 0 [m].
        speed: largest absolute velocity [m/s].
        acceleration: largest absolute one [m/s^2].
        jerk: largest absolute one [m/s^3].
        duration: of all phases [s].
        displacement: at the end [m].
        end_velocity: [m/s].
        end_acceleration: [m/s^2].
    """

    lowest: float
    highest: float
    speed: float
    acceleration: float
    jerk: float
    duration: float
    displacement: float
    end_velocity: float
    end_acceleration: float


def excursion(velocity: float, acceleration: float, phases: Phases) -> Excursion:
    """Return what a slider does from a velocity [m/s] and an acceleration [m/s^2] on.

    The extremes of a cubic are at its ends or where its rate is zero; each is calculated.
    """
    v, a = velocity, acceleration
    x = lowest = highest = time = most_jerk = 0.0
    speed, most = abs(v), abs(a)
    for length, jerk in phases:
        if length <= 0.0:
            continue
        b = a + length * jerk
        w = v + 0.5 * length * (a + b)
        y = x + length * (v + length * (2.0 * a + b) / 6.0)
        turns = v * w < 0.0
        if a * b < 0.0:
            # The velocity has its own extreme inside.
            turning = v - a * a / (2.0 * jerk)
            speed = max(speed, abs(turning))
            turns = turns or turning * v < 0.0 or turning * w < 0.0
        if turns:
            for root in _roots(v, a, jerk):
                if 0.0 < root < length:
                    turn = x + root * (v + root * (0.5 * a + root * jerk / 6.0))
                    lowest, highest = min(lowest, turn), max(highest, turn)
        x, v, a = y, w, b
        # Comparisons, as they take half the time of calls of min and max; and so that NaN stays.
        if not x >= lowest:
            lowest = x
        if not x <= highest:
            highest = x
        size = abs(v)
        if not size <= speed:
            speed = size
        size = abs(a)
        if not size <= most:
            most = size
        size = abs(jerk)
        if not size <= most_jerk:
            most_jerk = size
        time += length
    return Excursion(lowest, highest, speed, most, most_jerk, time, x, v, a)


def _roots(velocity: float, acceleration: float, jerk: float) -> tuple[float, ...]:
    """Return the times at which the velocity is zero [s]."""
    squared = acceleration * acceleration - 2.0 * jerk * velocity
    if squared < 0.0:
        return ()
    total = -(acceleration + copysign(sqrt(squared), acceleration))
    first = (total / jerk,) if jerk != 0.0 else ()
    return (*first, 2.0 * velocity / total) if total != 0.0 else first


# A trace may examine this many places of the path; with more of them a cycle would take too long.
TRACE_SAMPLES = 24

ONE_AND_ROUNDING = 1.0 + RELATIVE_ROUNDING


Ways = Sequence[Phases]


class Certified(NamedTuple):
    """Ways of the three sliders that keep all limits.

    Attributes:
        ways: phases of each slider.
        duration: until the last of them has gone its way [s].
    """

    ways: Ways
    duration: float


def first_certified(
    workspace: Workspace,
    start: SliderState,
    choices: Iterable[Ways],
    limits: SliderLimits,
    samples: int = TRACE_SAMPLES,
    at_once: int = TRACE_SAMPLES,
) -> Interruptible[Certified | None]:
    """Return the first of ``choices`` that keeps all limits up to its end, if one does.

    Reach, box, cylinder and condition number hold as ``Workspace.check_path`` has it, velocities,
    accelerations, jerks and the travel of the sliders to rounding. Only one choice is traced.

    Args:
        workspace: limits of the platform and of the travel.
        start: where the sliders are.
        choices: phases of each slider.
        limits: of the sliders.
        samples: places of the path that a trace may examine.
        at_once: so many of them are examined between two breaks.
    """
    traceable = None
    for ways in choices:
        excursions = [
            excursion(velocity, acceleration, phases)
            for velocity, acceleration, phases in zip(start.velocities, start.accelerations, ways)
        ]
        box = _box(start, excursions, workspace.limits)
        if box is None or not keep_limits(excursions, limits):
            continue
        try:
            # A plan takes a third of the time of all the rest.
            if limits.added:
                yield from check_added(CubicPlan(start, ways), limits)
        except AddedBoundError:
            continue
        centre, half_diagonal = box
        if half_diagonal <= workspace.free_way(centre):
            return Certified(ways, max(one.duration for one in excursions))
        traceable = traceable or (ways, excursions)
    if traceable is None:
        return None
    ways, excursions = traceable
    certified = Certified(ways, max(one.duration for one in excursions))
    most = hypot(*(one.acceleration for one in excursions))
    sliders = [SliderProfile(*values) for values in zip(*start, ways)]

    def state(time: float) -> SliderState:
        """Return the sliders at an instant [s]."""
        (h1, v1, a1, _), (h2, v2, a2, _), (h3, v3, a3, _) = [
            slider.at(time, time) for slider in sliders
        ]
        return SliderState((h1, h2, h3), (v1, v2, v3), (a1, a2, a3))

    proof = workspace.path_proof(state, certified.duration, most, samples, at_once)
    return certified if (yield from proof) else None


def _box(
    start: SliderState, excursions: Sequence[Excursion], bounds: WorkspaceLimits
) -> tuple[Vector3, float] | None:
    """Return centre and half diagonal of the box that the sliders stay in [m], if in the travel.

    A slider that is outside its travel may go no farther.
    """
    one, two, three = excursions
    h1, h2, h3 = start.heights
    low1, low2, low3 = h1 + one.lowest, h2 + two.lowest, h3 + three.lowest
    high1, high2, high3 = h1 + one.highest, h2 + two.highest, h3 + three.highest
    end1, end2, end3 = bounds.lower_heights
    rounding = TRAVEL_ROUNDING
    if not (low1 >= end1 - rounding and low2 >= end2 - rounding and low3 >= end3 - rounding):
        end1, end2, end3 = min(end1, h1), min(end2, h2), min(end3, h3)
        if not (low1 >= end1 - rounding and low2 >= end2 - rounding and low3 >= end3 - rounding):
            return None
    end1, end2, end3 = bounds.upper_heights
    if not (high1 <= end1 + rounding and high2 <= end2 + rounding and high3 <= end3 + rounding):
        end1, end2, end3 = max(end1, h1), max(end2, h2), max(end3, h3)
        if not (high1 <= end1 + rounding and high2 <= end2 + rounding and high3 <= end3 + rounding):
            return None
    centre = 0.5 * (low1 + high1), 0.5 * (low2 + high2), 0.5 * (low3 + high3)
    return centre, 0.5 * hypot(high1 - low1, high2 - low2, high3 - low3)


def keep_limits(excursions: Sequence[Excursion], limits: SliderLimits) -> bool:
    """Return whether the sliders keep velocity, acceleration and jerk, to rounding."""
    for one, (speed, acceleration, jerk) in zip(excursions, limits.of_sliders):
        # Written so that NaN does not pass.
        if not (
            one.speed <= speed * ONE_AND_ROUNDING
            and one.acceleration <= acceleration * ONE_AND_ROUNDING
            and one.jerk <= jerk * ONE_AND_ROUNDING
        ):
            return False
    return True
