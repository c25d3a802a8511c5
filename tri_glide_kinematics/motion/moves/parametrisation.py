r"""Path parametrisation of a line: the coordinate in which the speed may be 1 everywhere.

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

from tri_glide_kinematics.motion.errors import PlanningError
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.trajectory import (
    CoordinateProfile,
    StraightLine,
    TimeScaling,
    quintics,
)
from tri_glide_kinematics.vectors import FloatArray

# Places along a line where the weight w is calculated: Chebyshev points, which are closer at both
# ends, where arms lie flattest. In between, w is the polynomial through its values there. Lines to
# the edge of reach need many; for larger matrices OpenBLAS may start threads. The matrices are made
# here: with numpy.polynomial.chebyshev the derivative has ten times the rounding errors.
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


class SpeedNorm(NamedTuple):
    """The two numbers that are free in the p-norm of the module's text.

    Attributes:
        exponent: p, a multiple of 6.
        bend_weight: beta; 0 looks at velocities alone.
    """

    exponent: int
    bend_weight: float


class PathParametrisation(NamedTuple):
    """A path parameter along a line, by its values at places between which it is interpolated.

    Attributes:
        ways: Shape (n,) [m].
        coordinates: ascending from 0. Shape (n,) [s].
        weights: derivative of the coordinate. Shape (n,) [s/m].
        weight_slopes: their derivative. Shape (n,) [s/m^2].
        rates: largest ones of the coordinate that no slider limit forbids at a place, bends
            aside. Shape (n,).
        accelerations: likewise. Shape (n,) [1/s].
        jerks: likewise. Shape (n,) [1/s^2].
        bend_fraction: largest fraction of $w^p$ that is due to the bends of the heights, in [0, 1].
    """

    ways: FloatArray
    coordinates: FloatArray
    weights: FloatArray
    weight_slopes: FloatArray
    rates: FloatArray
    accelerations: FloatArray
    jerks: FloatArray
    bend_fraction: float

    def start(self, speed: float, acceleration: float) -> tuple[float, float, float]:
        """Return the coordinate, its rate and acceleration at the start of the line.

        Args:
            speed: of the platform [m/s].
            acceleration: of the platform [m/s^2].
        """
        weight, slope = float(self.weights[0]), float(self.weight_slopes[0])
        return 0.0, weight * speed, weight * acceleration + slope * speed * speed

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

    def time_scaling(self, profile: CoordinateProfile) -> TimeScaling:
        """Return the way over time that belongs to a ``profile`` of the coordinate over time."""
        # Derivatives of the inverse function: s' = 1 / w, s'' = -w_s / w^3.
        slopes = 1.0 / self.weights
        bends = -self.weight_slopes * slopes * slopes * slopes
        spans = self.coordinates[1:] - self.coordinates[:-1]
        table = quintics.coefficients(spans, self.ways, slopes, bends)
        index = self.coordinates[1:-1].searchsorted(profile.values, side="right")
        span = spans[index]
        x = (profile.values - self.coordinates[index]) / span
        x = np.minimum(np.maximum(x, 0.0), 1.0)
        way, first, second = quintics.evaluate(table[:, index], x)
        rate = profile.rates / span
        acceleration = profile.accelerations / span
        return TimeScaling(
            profile.times, way, first * rate, second * rate * rate + first * acceleration
        )


def parametrise(
    line: StraightLine, limits: SliderLimits, norm: SpeedNorm, platform_speed: float = math.inf
) -> PathParametrisation:
    """Return the coordinate of ``line`` in which the speed may be 1 everywhere.

    Args:
        line: of positive length.
        limits: of the sliders.
        norm: exponent and weight of the p-norm.
        platform_speed: largest speed of the platform [m/s]; it is one more term of the norm.

    Raises:
        PlanningError: if the weight changes too much between two places to be interpolated.
    """
    ways = line.length * PLACES
    derivatives = line.derivatives(ways).heights[1:]
    bounds = limits.table[..., np.newaxis]
    velocity, acceleration, jerk = np.abs(derivatives / bounds)
    squared = velocity * velocity
    powers = np.array(
        (squared * squared * squared, acceleration * acceleration * acceleration, jerk * jerk)
    )
    if norm.exponent > 6:
        powers **= norm.exponent // 6
    of_velocity, of_acceleration, of_jerk = powers.sum(axis=1)
    p = float(norm.exponent)
    of_bends = norm.bend_weight**p * (of_acceleration + of_jerk)
    sum_of_powers = of_velocity + of_bends + platform_speed**-p
    weights = sum_of_powers ** (1.0 / p)
    coordinates = line.length * (INTEGRAL @ weights)
    if not (coordinates[1:] > coordinates[:-1]).all():
        raise PlanningError("the line comes too close to where an arm lies flat")
    # Height per way over each limit, of the slider for which it is largest.
    rates, accelerations, jerks = weights / np.abs(derivatives[0] / bounds).max(axis=1)
    return PathParametrisation(
        ways,
        coordinates,
        weights,
        DERIVATIVE @ weights / line.length,
        rates,
        accelerations,
        jerks,
        float((of_bends / sum_of_powers).max()),
    )
