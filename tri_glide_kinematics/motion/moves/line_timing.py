r"""Time scalings along a line: of moves to its end, of jogs, and of brakings.

They are planned in a path parametrisation: the coordinate in which the speed may be 1 everywhere.
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

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.errors import PlanningError
from tri_glide_kinematics.motion.limits import RELATIVE_ROUNDING, SliderLimits
from tri_glide_kinematics.motion.moves.hard_braking import hardest_braking
from tri_glide_kinematics.motion.moves.line_entry import Entry
from tri_glide_kinematics.motion.trajectory import (
    CoordinateProfile,
    Phases,
    RuckigPlanner,
    StraightLine,
    TimeScaling,
    UsableParts,
    after,
    bounds_along,
    cut_to,
    evaluate,
    knots,
    lasting,
    merged,
    quintics,
    rest_to_rest,
    shortest_piece,
    total_duration,
    with_knots_of,
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

    @property
    def total(self) -> float:
        """Coordinate at the end of the line [s]."""
        return float(self.coordinates[-1])

    @property
    def least(self) -> tuple[float, float, float]:
        """Rate, acceleration and jerk that no slider limit forbids anywhere on the line."""
        return float(self.rates.min()), float(self.accelerations.min()), float(self.jerks.min())

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


# The path parametrisation of moves to a target. A motion from rest begins with all the jerk of the
# path parameter; next to its top speed it uses less, by up to this fraction, as the bends of the
# heights need jerk as well. Found by trial over thousands of random lines.
NORM = SpeedNorm(6, 1.1)
JERK_OF_BENDS = 0.5

# Speed against the direction of the line, as a fraction of the largest speed, that is rounding.
NO_WAY_BACK = 1e-9

# Number of quintics in a time scaling.
PIECES = 48


class MovingFactors(NamedTuple):
    """How much of the limits a motion along a line uses that goes on from another one.

    Attributes:
        begin: part of acceleration and jerk while the blend lasts.
        after: how much faster than the limits of the coordinate ask for it is after that: of the
            rate this part is used, of the acceleration its square, of the jerk its cube.
    """

    begin: float
    after: float
    begin_rate: float = 1.0


class LineTiming:
    """Finds time scalings of moves, jogs and brakings; keeps nothing of a motion."""

    def __init__(self) -> None:
        """Prepare ruckig."""
        self._ruckig = RuckigPlanner(1)

    def from_rest(
        self, line: StraightLine, limits: SliderLimits, usable: UsableParts | None = None
    ) -> Interruptible[TimeScaling]:
        """Return the shortest time scaling found from rest to rest at the end of ``line``.

        It is stretched by the factor with which all limits just hold.

        Args:
            line: of positive length.
            limits: of the sliders.
            usable: parts of them, which may be others while the platform brakes; then it is not
                stretched for the added bounds.

        Raises:
            PlanningError: if the line comes so close to the reach of an arm that none is found.
        """
        parametrisation = parametrise(line, limits, NORM, limits.platform_speed)
        target, (rate, acceleration, jerk) = parametrisation.total, parametrisation.least
        # Each phase is to be long enough for knots of its own, however large the jerk may be.
        shortest = shortest_piece(target, acceleration)
        jerk = min(jerk, 0.5 * acceleration / shortest, 0.25 * rate / shortest**2)
        jerks = jerk, (1.0 - JERK_OF_BENDS * parametrisation.bend_fraction) * jerk
        if usable is None:
            phases = rest_to_rest(target, rate, acceleration, jerks)
        else:
            upwards, downwards = usable.rising * acceleration, usable.braking * acceleration
            rates = [usable.velocity * rate], [upwards], [min(jerks)]
            (phases,) = self._ruckig.to_rest_at(
                [target], [0.0], [0.0], [0.0], rates, downwards=[downwards]
            )
            limits = limits.with_added()
        times = np.array(knots(phases, PIECES, shortest))
        scaling = parametrisation.time_scaling(evaluate(phases, (0.0, 0.0, 0.0), times))
        scaling = scaling.with_ends((0.0, 0.0, 0.0), line.length)
        bounds = yield from bounds_along(line, scaling, limits)
        # This is looked at before the motion is stretched, which would hide it.
        if not bounds.backwards <= NO_WAY_BACK * float(scaling.speeds.max()):
            raise PlanningError("the line comes too close to where an arm lies flat")
        slower = 1.0 if usable is None else usable.slower
        return scaling.slower(slower * float(bounds.slowdown(limits).max()))

    def in_motion(
        self,
        entry: Entry,
        parametrisation: PathParametrisation,
        factors: MovingFactors,
    ) -> TimeScaling:
        """Return the time scaling that continues ``entry`` to rest at the end of its line.

        Args:
            entry: line, speed and acceleration at its start, and blend.
            parametrisation: of the line, with ``NORM``.
            factors: how much of the limits is used.

        Raises:
            PlanningError: if ruckig finds none.
        """
        initial = parametrisation.start(entry.speed, entry.acceleration)
        phases = self.phases(entry, parametrisation, factors)
        shortest = shortest_piece(parametrisation.total, parametrisation.least[1])
        times = with_knots_of(knots(phases, PIECES, shortest), entry.blend, shortest)
        scaling = parametrisation.time_scaling(evaluate(phases, initial, np.array(times)))
        return scaling.with_ends((0.0, entry.speed, entry.acceleration), entry.line.length)

    def phases(
        self, entry: Entry, parametrisation: PathParametrisation, factors: MovingFactors
    ) -> Phases:
        """Return the phases of the coordinate; the arguments are those of ``in_motion``.

        While the blend lasts it has its part of the limits; after it the line has all of them.
        """
        state = parametrisation.start(entry.speed, entry.acceleration)
        phases: Phases = []
        if entry.blend is not None:
            until = entry.blend.duration
            phases = self._to_end(parametrisation, state, factors.begin_rate, factors.begin)
            if total_duration(phases) <= until:
                return lasting(phases, entry.blend)
            phases = cut_to(phases, until)
            value, rate, acceleration = evaluate(phases, state, np.array([until]))[1:]
            state = float(value[0]), float(rate[0]), float(acceleration[0])
        speed = factors.after
        return [*phases, *self._to_end(parametrisation, state, speed, speed * speed, speed)]

    def _to_end(
        self,
        parametrisation: PathParametrisation,
        state: tuple[float, float, float],
        rate: float,
        fraction: float,
        of_jerk: float = 1.0,
    ) -> Phases:
        """Return the phases from a ``state`` of the coordinate to rest at the end of the line."""
        _, acceleration, jerk = parametrisation.least
        limits = [rate], [fraction * acceleration], [of_jerk * fraction * jerk]
        value, speed, change = state
        (phases,) = self._ruckig.to_rest_at(
            [parametrisation.total], [value], [speed], [change], limits
        )
        return phases

    def braking(
        self, entry: Entry, limits: SliderLimits, fraction: float, longest: float
    ) -> TimeScaling:
        """Return the time scaling that brakes the motion of ``entry`` along its line.

        Args:
            entry: line, speed and acceleration at its start, and blend.
            limits: of the sliders.
            fraction: of acceleration and jerk that is used.
            longest: time that it may take [s].

        Raises:
            PlanningError: if none is found.
        """
        line, speed, acceleration, blend = entry
        start = (0.0, speed, acceleration)
        scaling = hardest_braking(line, start, limits, fraction=fraction, longest=longest)
        if blend is None:
            return scaling
        times = scaling.times.tolist()
        shortest = shortest_piece(float(scaling.ways[-1]), max(limits.acceleration))
        if blend.duration > times[-1] + shortest:
            times.append(blend.duration)
        return scaling.with_knots(np.array(with_knots_of(times, blend, shortest)))

    def jog(
        self, entry: Entry, parametrisation: PathParametrisation, factors: JogFactors
    ) -> TimedJog:
        """Return the time scaling that continues ``entry`` up to the end of its line.

        Each ramp looks at the slider limits along its own part of the line, as these differ much
        between the middle of the workspace and its edge.

        Args:
            entry: line, speed and acceleration at its start, and blend.
            parametrisation: of the line, with the speed of the platform as one of its limits.
            factors: fractions of the limits that are used.

        Raises:
            PlanningError: if ruckig finds none, or none that ends soon.
        """
        initial = parametrisation.start(entry.speed, entry.acceleration)
        target = parametrisation.total
        rate = factors.speed
        acceleration, jerk = parametrisation.ramp_limits(max(rate, initial[1]), at_end=False)
        begin_limits = ([rate], [factors.begin * acceleration], [factors.begin * jerk])
        end_acceleration, end_jerk = parametrisation.ramp_limits(rate, at_end=True)
        end_limits = ([rate], [factors.end * end_acceleration], [factors.end * end_jerk])
        (phases,) = self._ruckig.to_velocity([rate], [initial[1]], [initial[2]], begin_limits)
        state = initial
        for duration, phase_jerk in phases:
            state = after(duration, *state, phase_jerk)
        ramp = rate * (rate / end_limits[1][0] + end_limits[1][0] / end_limits[2][0])
        if state[0] + ramp < target:
            steady_from = total_duration(phases)
            (ending,) = self._ruckig.to_rest_at([target], [state[0]], [rate], [0.0], end_limits)
        else:
            # There is no room to become steady: one motion, with the limits of all of the line.
            fraction = min(factors.begin, factors.end)
            _, most, sharpest = parametrisation.least
            whole = [rate], [fraction * most], [fraction * sharpest]
            steady_from, phases = 0.0, []
            (ending,) = self._ruckig.to_rest_at([target], [0.0], [initial[1]], [initial[2]], whole)
        # The last three phases of ruckig are the ramp to rest.
        steady_until = steady_from + total_duration(ending[:-3])
        phases = [*phases, *ending]
        if total_duration(phases) > GIVEN_UP_AFTER:
            raise PlanningError("the way to the edge would take hours")
        phases = lasting(phases, entry.blend)
        shortest = shortest_piece(target, acceleration)
        # Steady motion takes most of the time; knots are needed where the line changes.
        passed = steady_from + (parametrisation.coordinates - state[0]) / rate
        steady = (passed > steady_from) & (passed < steady_until)
        times = merged(knots(phases, JOG_PIECES, shortest), passed[steady].tolist(), shortest)
        times = with_knots_of(times, entry.blend, shortest)
        scaling = parametrisation.time_scaling(evaluate(phases, initial, np.array(times)))
        scaling = scaling.with_ends((0.0, entry.speed, entry.acceleration), entry.line.length)
        return TimedJog(scaling, steady_from, steady_until)


# A jog is to have its full speed in the middle of the workspace. So the bends of the heights, which
# matter near the edge alone, have a large weight: the speed is reduced there, and only there.
JOG_NORM = SpeedNorm(12, 3.0)

# Number of quintics in the time scaling, besides those of the steady part.
JOG_PIECES = 32

# After a limit was exceeded by some factor, the next attempt is slower by that factor and this one.
JOG_MARGIN = 1.03

# A jog that takes longer than this is given up [s]: the attempts become that slow only where the
# limits are broken at any speed.
GIVEN_UP_AFTER = 1e4


class JogFactors(NamedTuple):
    """Which fraction of the limits a jog uses.

    Attributes:
        begin: of acceleration and jerk in the first ramp.
        end: of acceleration and jerk in the last ramp.
        speed: of the steady speed.
    """

    begin: float
    end: float = 0.8
    speed: float = 1.0

    def after(self, timed: TimedJog, slowdowns: FloatArray) -> JogFactors:
        """Return the factors for the next attempt, with which the limits should hold.

        Args:
            timed: what was planned with these factors.
            slowdowns: factor by which each piece of it is too fast. Shape (k,).
        """
        # Pieces end where the ramps do, but for rounding; their middles are clear of that.
        middles = 0.5 * (timed.scaling.times[:-1] + timed.scaling.times[1:])
        ramping = middles < timed.steady_from
        ending = middles > timed.steady_until
        begin, end = _excess(slowdowns[ramping]), _excess(slowdowns[ending])
        steady = _excess(slowdowns[~ramping & ~ending])
        return JogFactors(self.begin / begin**2, self.end / end**2, self.speed / steady)


class TimedJog(NamedTuple):
    """The time scaling of a jog.

    Attributes:
        scaling: to rest at the end of the line.
        steady_from: when the speed becomes steady [s].
        steady_until: when it no longer is [s].
    """

    scaling: TimeScaling
    steady_from: float
    steady_until: float


def _excess(slowdowns: FloatArray) -> float:
    """Return the largest factor, with a margin, or 1 if there is none above 1."""
    largest = float(slowdowns.max(initial=0.0))
    return JOG_MARGIN * largest if largest > 1.0 + RELATIVE_ROUNDING else 1.0
