r"""Proof that a whole path is inside the workspace, from samples that each vouch for more.

Between two samples that are inside, three bounds leave nothing to chance:

- Condition number: per metre of the platform the Jacobian J changes by at most
  $K = \sqrt{\sum_i (L_i^2/s_i^3)^2}$, and each singular value by no more than J does. So around
  each sample lies a ball in which the condition number is kept, and both balls have to meet.
- Reach, box and cylinder are convex: only so far as the path bends away from its chord can it be
  farther out than both samples, by at most $a \Delta t^2/8$ with the platform's acceleration a.
- Slider travel: likewise with the acceleration of the sliders.

If this is not enough, the interval is halved. So that this ends, ``TOLERANCE`` is granted: a
place of an accepted path breaks reach, box, cylinder or travel by at most this, and is at most
this far from a place that keeps the condition number. (docs/kinematics.md derives the bounds.)
"""

from __future__ import annotations

from collections.abc import Callable
from math import hypot, inf, sqrt
from typing import NamedTuple, Protocol

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.tri_glide import (
    TriGlideGeometry,
    ball_that_keeps,
    extreme_singular_values,
)
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace.limits import ROUNDING, WorkspaceBounds

# A path may break a limit by this between two samples that keep it [m].
TOLERANCE = 5e-5

# A path that needs more runs along the edge, closer to it than can be decided; it is refused.
MAX_SAMPLES = 4000

# Samples that are looked at between two breaks: that takes 0.2 ms.
SAMPLES_IN_PIECE = 12


class SliderMotionState(NamedTuple):
    """Motion of the sliders at one instant.

    Attributes:
        heights: Shape (3,) [m].
        velocities: Shape (3,) [m/s].
    """

    heights: Vector3
    velocities: Vector3


class MovingSliders(Protocol):
    """Anything with heights and velocities of the sliders, such as a setpoint of the engine."""

    @property
    def heights(self) -> Vector3:
        """Shape (3,) [m]."""

    @property
    def velocities(self) -> Vector3:
        """Shape (3,) [m/s]."""


class Surroundings(NamedTuple):
    """Bounds of the Jacobian around a place that keeps the condition number.

    Attributes:
        radius: no place within this distance breaks the condition number [m].
        singular_value: least one of the Jacobian within it, or less. The platform moves at most
            the way of the sliders (Euclidean norm over the three) divided by this.
        slope: within it the Jacobian changes by at most this per metre [1/m].
    """

    radius: float
    singular_value: float
    slope: float


class Sample(NamedTuple):
    """Bounds that hold at one place of a path.

    Attributes:
        time: parameter of the path.
        inside: whether the place keeps all limits; if not, only the time has a meaning.
        surroundings: of the place.
        speed: of the sliders (Euclidean norm) per unit of the parameter.
        slack: distance to the nearest bound of reach, box and cylinder [m].
        travel: distance to the nearest end of slider travel [m].
    """

    time: float
    inside: bool
    surroundings: Surroundings = Surroundings(0.0, 1.0, 0.0)
    speed: float = 0.0
    slack: float = inf
    travel: float = inf


class ConditionField:
    """The condition number of the Jacobian as a field over the plane, with a bound."""

    def __init__(self, geometry: TriGlideGeometry, max_condition: float) -> None:
        """Prepare for a machine and its largest condition number."""
        self._anchors = geometry.anchors
        self._lengths = geometry.arm_lengths
        self._sign = geometry.handedness
        self._max_condition = max_condition

    def around(self, x: float, y: float) -> Surroundings | None:
        """Return what is known around a place of the platform [m]; None if it is not inside."""
        rows = []
        distances = []
        for (anchor_x, anchor_y), length in zip(self._anchors, self._lengths):
            across_x, across_y = anchor_x - x, anchor_y - y
            distance = hypot(across_x, across_y)
            if not distance < length:
                return None
            rise = sqrt((length - distance) * (length + distance))
            rows.append((across_x / rise, across_y / rise, 1.0))
            distances.append(distance)
        largest, smallest = extreme_singular_values((rows[0], rows[1], rows[2]))
        smallest *= self._sign
        # Positive inside.
        margin = smallest - largest / self._max_condition
        if not margin >= -ROUNDING * largest / self._max_condition:
            return None
        radius, slope = ball_that_keeps(
            margin, smallest, self._max_condition, self._lengths, distances, TOLERANCE
        )
        return Surroundings(radius, smallest - slope * radius, slope)


def path_probe(
    forward: Callable[[Vector3], Vector3],
    bounds: WorkspaceBounds,
    field: ConditionField,
    state: Callable[[float], MovingSliders],
) -> Callable[[float], Sample]:
    """Return what examines a motion of the sliders at an instant.

    Args:
        forward: kinematics from slider heights [m] to the platform [m].
        bounds: of the workspace.
        field: of its condition number.
        state: returns the setpoint of the sliders at an instant.
    """

    def probe(time: float) -> Sample:
        setpoint = state(time)
        heights = setpoint.heights
        try:
            position = forward(heights)
        except KinematicsError:
            return Sample(time, False)
        slack = bounds.slack(position)
        travel = bounds.travel_slack(heights)
        around = field.around(position[0], position[1])
        if around is None or not (slack >= -ROUNDING and travel >= -ROUNDING):
            return Sample(time, False)
        return Sample(time, True, around, hypot(*setpoint.velocities), slack, travel)

    return probe


def traced(
    probe: Callable[[float], Sample],
    end: float,
    acceleration: float,
    max_samples: int = MAX_SAMPLES,
    in_piece: int = SAMPLES_IN_PIECE,
) -> Interruptible[tuple[float, float] | None]:
    """Return where a path leaves the inside, interruptibly; None if it is proved to stay there.

    Args:
        probe: examines the path at a parameter from 0 to ``end``.
        end: of the parameter.
        acceleration: largest one of the sliders (Euclidean norm), per square of the parameter.
        max_samples: after so many the proof is given up.
        in_piece: between two breaks so many are looked at.

    Returns:
        The parameter of a sample up to which the path is inside, and that of the next one, which is
        outside (or at which the proof was given up).
    """
    reached = probe(0.0)
    if not reached.inside:
        return 0.0, 0.0
    ahead = [probe(end)]
    samples = 0
    while ahead:
        following = ahead[-1]
        if _is_inside_between(reached, following, acceleration):
            if not following.inside:
                break
            reached = ahead.pop()
        elif samples >= max_samples - 2:
            break
        else:
            if samples and samples % in_piece == 0:
                yield
            ahead.append(probe(0.5 * (reached.time + following.time)))
            samples += 1
    return (reached.time, ahead[-1].time) if ahead else None


def _is_inside_between(first: Sample, second: Sample, acceleration: float) -> bool:
    """Return whether the path between two samples is inside, up to ``TOLERANCE``.

    Of the second one, if it is outside, nothing is asked but that it is near.
    """
    step = second.time - first.time
    radius, singular_value, slope = first.surroundings
    if not second.inside:
        return step * (first.speed + 0.5 * acceleration * step) <= TOLERANCE * singular_value
    second_radius, second_value, second_slope = second.surroundings
    way = step * (0.5 * (first.speed + second.speed) + 0.25 * acceleration * step)
    if way > radius * singular_value + second_radius * second_value:
        return False
    if acceleration * step * step > 8.0 * (min(first.travel, second.travel) + TOLERANCE):
        return False
    singular_value = min(singular_value, second_value)
    allowed = min(first.slack, second.slack) + TOLERANCE
    if way <= 2.0 * singular_value * allowed:
        return True
    speed = (max(first.speed, second.speed) + 0.5 * acceleration * step) / singular_value
    bend = (acceleration + max(slope, second_slope) * speed * speed) / singular_value
    return bend * step * step <= 8.0 * allowed
