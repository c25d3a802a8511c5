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

from tri_glide_kinematics.limits import SliderLimits
from tri_glide_kinematics.planning.line_plan import WayLaw
from tri_glide_kinematics.planning.phases import CoordinateLaw
from tri_glide_kinematics.planning.plans import FloatArray
from tri_glide_kinematics.planning.straight_line import StraightLine

# Places along a line where the pace is worked out; closer at both ends, where arms lie flattest.
PLACES = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 41)))


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
        accelerations: largest ones of the coordinate that no slider limit forbids at a place.
            Shape (n,) [1/s].
        jerks: likewise. Shape (n,) [1/s^2].
    """

    ways: FloatArray
    coordinates: FloatArray
    weights: FloatArray
    weight_slopes: FloatArray
    accelerations: FloatArray
    jerks: FloatArray

    def refined(self, factors: FloatArray, slopes: FloatArray) -> Pace:
        """Return the pace whose weights are multiplied.

        Args:
            factors: at each place. Shape (n,).
            slopes: their derivatives along the line. Shape (n,) [1/m].
        """
        weights = self.weights * factors
        weight_slopes = self.weight_slopes * factors + self.weights * slopes
        return self._replace(
            coordinates=_integrated(self.ways, weights, weight_slopes),
            weights=weights,
            weight_slopes=weight_slopes,
        )

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
        index = np.searchsorted(self.coordinates, coordinate.values, side="right") - 1
        index = np.clip(index, 0, len(self.ways) - 2)
        ends = (self.ways, self.coordinates, 1.0 / self.weights, self.weight_slopes)
        way, begin, slope, bend = (values[index] for values in ends)
        last, end, last_slope, last_bend = (values[index + 1] for values in ends)
        span = end - begin
        x = np.clip((coordinate.values - begin) / span, 0.0, 1.0)
        # Derivatives of the inverse function: s' = 1 / w, s'' = -w_s / w^3.
        bend = -0.5 * bend * slope * slope * slope * span * span
        last_bend = -0.5 * last_bend * last_slope * last_slope * last_slope * span * span
        slope, last_slope, step = slope * span, last_slope * span, last - way
        c3 = 10.0 * step - 6.0 * slope - 4.0 * last_slope - 3.0 * bend + last_bend
        c4 = -15.0 * step + 8.0 * slope + 7.0 * last_slope + 3.0 * bend - 2.0 * last_bend
        c5 = 6.0 * step - 3.0 * (slope + last_slope) - bend + last_bend
        first = slope + x * (2.0 * bend + x * (3.0 * c3 + x * (4.0 * c4 + x * (5.0 * c5))))
        second = 2.0 * bend + x * (6.0 * c3 + x * (12.0 * c4 + x * (20.0 * c5)))
        rate = coordinate.rates / span
        return WayLaw(
            coordinate.times,
            way + x * (slope + x * (bend + x * (c3 + x * (c4 + x * c5)))),
            first * rate,
            second * rate * rate + first * coordinate.accelerations / span,
        )


class LineNeeds(NamedTuple):
    """What steady motion asks of the sliders along a line, as parts of their limits.

    Each of shape (n, 3): at n places, of three sliders.

    Attributes:
        ways: the places. Shape (n,) [m].
        velocity: asked for by unit speed [s/m].
        velocity_slope: its derivative along the line; so for the others.
        acceleration: asked for by the bend at unit speed [s^2/m^2].
        acceleration_slope: its derivative.
        jerk: likewise [s^3/m^3].
        jerk_slope: its derivative.
        slopes_per_acceleration: height per way, over the largest acceleration [s^2/m].
        slopes_per_jerk: likewise [s^3/m].
    """

    ways: FloatArray
    velocity: FloatArray
    velocity_slope: FloatArray
    acceleration: FloatArray
    acceleration_slope: FloatArray
    jerk: FloatArray
    jerk_slope: FloatArray
    slopes_per_acceleration: FloatArray
    slopes_per_jerk: FloatArray

    def pace(self, shape: Shape, platform_speed: float = math.inf) -> Pace:
        """Return the coordinate of the line in which the speed may be 1 everywhere.

        Args:
            shape: of the p-norm.
            platform_speed: largest speed of the platform [m/s]; it is one more term of the norm.
        """
        p = shape.exponent
        strength = shape.bend**p
        lower = self.velocity ** (p - 1)
        total = lower * self.velocity
        slope = p * lower * self.velocity_slope
        if strength:
            lower_y = strength * self.acceleration ** (p // 2 - 1)
            lower_z = strength * self.jerk ** (p // 3 - 1)
            # The second derivative is never positive, so that an odd power needs its sign back.
            sign = -1.0 if p // 2 % 2 else 1.0
            total += sign * lower_y * self.acceleration + lower_z * self.jerk
            slope += sign * (p // 2) * lower_y * self.acceleration_slope
            slope += (p // 3) * lower_z * self.jerk_slope
        sum_of_powers = total.sum(axis=-1) + platform_speed**-p
        weights = sum_of_powers ** (1.0 / p)
        weight_slopes = weights * slope.sum(axis=-1) / (p * sum_of_powers)
        return Pace(
            self.ways,
            _integrated(self.ways, weights, weight_slopes),
            weights,
            weight_slopes,
            weights / self.slopes_per_acceleration.max(axis=-1),
            weights / self.slopes_per_jerk.max(axis=-1),
        )


def line_needs(line: StraightLine, limits: SliderLimits) -> LineNeeds:
    """Return what steady motion along ``line`` asks of the sliders."""
    ways = line.length * PLACES
    rise, first, second, third = line.derivatives(ways)
    tilt = first - line.slope
    fourth = -(3.0 * second * second + 4.0 * tilt * third) / rise
    velocity, acceleration, jerk = (
        np.array(values) for values in (limits.velocity, limits.acceleration, limits.jerk)
    )
    slopes = np.abs(first)
    return LineNeeds(
        ways,
        *(first / velocity, second / velocity),
        *(second / acceleration, third / acceleration),
        *(third / jerk, fourth / jerk),
        *(slopes / acceleration, slopes / jerk),
    )


def _integrated(ways: FloatArray, weights: FloatArray, slopes: FloatArray) -> FloatArray:
    """Integrate from place to place by the trapezoidal rule with its correction at the ends."""
    step = np.diff(ways)
    areas = step * (0.5 * (weights[1:] + weights[:-1]) + step * (slopes[:-1] - slopes[1:]) / 12.0)
    return np.concatenate(([0.0], np.cumsum(areas)))
