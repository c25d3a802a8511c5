r"""How fast the platform may go at each place of a line: the coordinate in which speed is uniform.

At steady speed $\dot s$ slider i moves at $|h_i'| \dot s$, and the bend of its height asks for
$|h_i''| \dot s^2$ and $|h_i'''| \dot s^3$. The reciprocal $w$ of the largest speed at which all of
this stays inside the limits is smoothed to a p-norm

$$w^p = \sum_i \left(\frac{|h_i'|}{V_i}\right)^p + \beta^p \left(\frac{|h_i''|}{A_i}\right)^{p/2}
+ \beta^p \left(\frac{|h_i'''|}{J_i}\right)^{p/3}$$

and $\sigma = \int w\,ds$ is the coordinate: at $\dot\sigma = 1$ the sliders are near their limits
all along the line. A motion planned in $\sigma$ between constant limits uses the sliders well,
though their heights are neither linear nor monotone in s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.motion import quintics
from tri_glide_kinematics.motion.errors import PlanningError
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.lines.line_plan import WayLaw
from tri_glide_kinematics.motion.lines.straight_line import StraightLine
from tri_glide_kinematics.motion.phases import CoordinateLaw
from tri_glide_kinematics.vectors import FloatArray

# Places along a line where the pace is worked out: Chebyshev points, which are closer at both
# ends, where arms lie flattest. In between, the weight is the polynomial through its values there.
# Lines to the edge of reach need many; of larger matrices OpenBLAS may make a matter of threads.
_ANGLES = np.linspace(0.0, np.pi, 95)
PLACES = 0.5 * (1.0 - np.cos(_ANGLES))


def _derivative() -> FloatArray:
    """Return the matrix from values at the places of a line of length 1 to their derivatives."""
    signs = (-1.0) ** np.arange(len(PLACES))
    signs[[0, -1]] *= 0.5
    matrix = signs / signs[:, np.newaxis] / (PLACES[:, np.newaxis] - PLACES + np.eye(len(PLACES)))
    # A constant has the derivative zero.
    return np.asarray(matrix - np.diag(matrix.sum(axis=1)))


def _integral() -> FloatArray:
    """Return the matrix from values at the places of a line of length 1 to their integrals.

    The polynomial is a sum of cos(k a) with the angle a of a place, and its integral over
    (1 - cos a) / 2 one of sin(a) cos(k a) / 2 over the angle.
    """
    orders = np.arange(len(PLACES))
    higher, lower = orders + 1.0, orders - 1.0
    angles = _ANGLES[:, np.newaxis]
    integrals = (1.0 - np.cos(higher * angles)) / higher
    integrals -= (1.0 - np.cos(lower * angles)) / np.where(lower == 0.0, 1.0, lower)
    # The cosines at these angles are their own inverse, but for factors.
    halves = np.ones(len(PLACES))
    halves[[0, -1]] = 0.5
    values_to_cosines = 2.0 / orders[-1] * halves[:, np.newaxis] * np.cos(orders * angles) * halves
    return np.asarray(0.25 * integrals @ values_to_cosines)


DERIVATIVE = _derivative()
INTEGRAL = _integral()


class Shape(NamedTuple):
    """The two numbers of the formula above that are free.

    Attributes:
        exponent: p, a multiple of 6.
        bend: beta; 0 looks at velocities alone.
    """

    exponent: int
    bend: float


class Pace(NamedTuple):
    """A coordinate along a line, by its values at places between which it is interpolated.

    Attributes:
        ways: Shape (n,) [m].
        coordinates: ascending from 0. Shape (n,) [s].
        weights: derivative of the coordinate. Shape (n,) [s/m].
        weight_slopes: their derivative. Shape (n,) [s/m^2].
        rates: largest ones of the coordinate that no slider limit forbids at a place, bends
            aside. Shape (n,).
        accelerations: likewise. Shape (n,) [1/s].
        jerks: likewise. Shape (n,) [1/s^2].
        bent: largest part that the bends of the heights have in the p-norm anywhere, in [0, 1].
    """

    ways: FloatArray
    coordinates: FloatArray
    weights: FloatArray
    weight_slopes: FloatArray
    rates: FloatArray
    accelerations: FloatArray
    jerks: FloatArray
    bent: float

    def start(self, speed: float, gain: float) -> tuple[float, float, float]:
        """Return the coordinate, its rate and acceleration at the start of the line.

        Args:
            speed: of the platform [m/s].
            gain: acceleration of the platform [m/s^2].
        """
        weight, slope = float(self.weights[0]), float(self.weight_slopes[0])
        return 0.0, weight * speed, weight * gain + slope * speed * speed

    def ramp_limits(self, rate: float, *, at_end: bool) -> tuple[float, float]:
        """Return acceleration and jerk for a ramp between rest and ``rate`` at one end of the line.

        Only the places that the ramp may pass count.
        """
        way = self.coordinates[-1] - self.coordinates[::-1] if at_end else self.coordinates
        accelerations = self.accelerations[::-1] if at_end else self.accelerations
        jerks = self.jerks[::-1] if at_end else self.jerks
        places = 1
        for _ in range(3):
            acceleration = float(accelerations[:places].min())
            jerk = float(jerks[:places].min())
            # Twice the way of a ramp at these limits.
            reach = rate * (rate / acceleration + acceleration / jerk)
            places = int(np.searchsorted(way, reach)) + 1
        return acceleration, jerk

    def law(self, coordinate: CoordinateLaw) -> WayLaw:
        """Return the way over time that belongs to a coordinate over time."""
        # Derivatives of the inverse function: s' = 1 / w, s'' = -w_s / w^3.
        slopes = 1.0 / self.weights
        bends = -self.weight_slopes * slopes * slopes * slopes
        spans = self.coordinates[1:] - self.coordinates[:-1]
        table = quintics.coefficients(spans, self.ways, slopes, bends)
        index = self.coordinates[1:-1].searchsorted(coordinate.values, side="right")
        span = spans[index]
        x = (coordinate.values - self.coordinates[index]) / span
        x = np.minimum(np.maximum(x, 0.0), 1.0)
        way, first, second = quintics.evaluate(table[:, index], x)
        rate = coordinate.rates / span
        gain = coordinate.accelerations / span
        return WayLaw(coordinate.times, way, first * rate, second * rate * rate + first * gain)


def line_pace(
    line: StraightLine, limits: SliderLimits, shape: Shape, platform_speed: float = math.inf
) -> Pace:
    """Return the coordinate of ``line`` in which the speed may be 1 everywhere.

    Args:
        line: of positive length.
        limits: of the sliders.
        shape: of the p-norm.
        platform_speed: largest speed of the platform [m/s]; it is one more term of the norm.

    Raises:
        PlanningError: if the need for speed changes too much between two places to be followed.
    """
    ways = line.length * PLACES
    _, first, second, third = line.derivatives(ways)
    bounds = limits.table[..., np.newaxis]
    velocity, acceleration, jerk = np.abs(np.array((first, second, third)) / bounds)
    squared = velocity * velocity
    powers = np.array(
        (squared * squared * squared, acceleration * acceleration * acceleration, jerk * jerk)
    )
    if shape.exponent > 6:
        powers **= shape.exponent // 6
    of_velocity, of_acceleration, of_jerk = powers.sum(axis=1)
    p = float(shape.exponent)
    of_bends = shape.bend**p * (of_acceleration + of_jerk)
    sum_of_powers = of_velocity + of_bends + platform_speed**-p
    weights = sum_of_powers ** (1.0 / p)
    coordinates = line.length * (INTEGRAL @ weights)
    if not (coordinates[1:] > coordinates[:-1]).all():
        raise PlanningError("the line comes too close to where an arm lies flat")
    # Height per way over each limit, of the slider for which it is largest.
    rates, accelerations, jerks = weights / np.abs(first / bounds).max(axis=1)
    return Pace(
        ways,
        coordinates,
        weights,
        DERIVATIVE @ weights / line.length,
        rates,
        accelerations,
        jerks,
        float((of_bends / sum_of_powers).max()),
    )
