"""The least time along a path by another optimiser: TOPP3 of copp-py, which limits jerks as well.

Its problem is linearised around a motion, so it is solved again around what comes out until that no
longer gets better. It keeps the limits at its stations only.
"""

from itertools import pairwise

import copp_py
import numpy as np

from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.trajectory import PathHeights, TimeScaling
from tri_glide_kinematics.vectors import FloatArray

# Units in which velocities, accelerations and jerks of usual drives are about one.
TIME = 0.05  # s
LENGTH = 0.025  # m

# Stations are no closer than they would be at this part of the largest speed: next to rest more of
# them only make its problem harder.
_SLOWEST = 0.1

# The optimum is reached if it gets better by less than this part; it is looked for so often.
_BETTER = 1e-4
_MOST_ROUNDS = 25


def least_time(curve: PathHeights, motion: TimeScaling, limits: SliderLimits) -> float:
    """Return the least time from rest to rest along a path, with the same stops [s].

    Args:
        curve: the path.
        motion: any from its begin to its end: stations are twice as close as its knots.
        limits: of the sliders.
    """
    stops = curve.driven.stops
    return sum(
        _between_stops(curve, motion, limits, begin, end) for begin, end in pairwise(stops.tolist())
    )


def least_time_onwards(curve: PathHeights, motion: TimeScaling, limits: SliderLimits) -> float:
    """Return the least time to rest at the end of a path without stops; inf if none is found [s].

    Args:
        curve: the path.
        motion: any from its begin to its end; it begins with the speed and acceleration from which
            the least time is counted.
        limits: of the sliders.
    """
    return _between_stops(curve, motion, limits, 0.0, curve.driven.length)


def _between_stops(
    curve: PathHeights, motion: TimeScaling, limits: SliderLimits, begin: float, end: float
) -> float:
    """Return the least time from one stop, or a begin in motion, to the next stop [s]."""
    knots = motion.times
    times = np.union1d(knots, 0.5 * (knots[1:] + knots[:-1]))
    ways, speeds, _ = motion.evaluate(times)
    inside = (ways > begin) & (ways < end)
    least = _SLOWEST * float(speeds[inside].max()) * float(np.median(np.diff(times)))
    speed, acceleration = float(speeds[0]), float(motion.accelerations[0])
    if begin > 0.0:
        speed = acceleration = 0.0
    places, squares = [begin], [(speed * TIME / LENGTH) ** 2]
    for way, speed in zip(ways[inside].tolist(), speeds[inside].tolist()):
        if way - places[-1] >= least and end - way >= least:
            places.append(way)
            squares.append((speed * TIME / LENGTH) ** 2)
    first = squares[0], acceleration * TIME**2 / LENGTH
    return _optimum(curve, np.array([*places, end]), np.array([*squares, 0.0]), limits, first)


def _optimum(
    curve: PathHeights,
    places: FloatArray,
    squares: FloatArray,
    limits: SliderLimits,
    begin: tuple[float, float],
) -> float:
    """Return the least time over stations at ``places`` [m], from squared speeds there [s].

    It begins with a squared speed and an acceleration, both in the units of this module.
    """
    stations = len(places)
    middles = 0.5 * (places[1:] + places[:-1])
    # At the first and the last station, what is seen is that of the path between them.
    pieces = curve.driven.spans_of(np.concatenate((places[:-1], middles[-1:])))
    h, first, second, third = curve.derivatives_on(pieces, places).heights
    robot = copp_py.Robot(3, capacity=stations)
    robot.append_s(places / LENGTH)
    rows = [np.ascontiguousarray(values.T) for values in (h / LENGTH, first, second * LENGTH)]
    robot.set_q(*rows, 0, dddq=np.ascontiguousarray(third.T * LENGTH**2))
    units = np.array((TIME, TIME**2, TIME**3)) / LENGTH
    velocity, acceleration, jerk = limits.table * units[:, np.newaxis]
    robot.add_velocity_limits(velocity, -velocity, start_idx_s=0, length=stations)
    robot.add_acceleration_limits(acceleration, -acceleration, start_idx_s=0, length=stations)
    robot.add_jerk_limits(jerk, -jerk, start_idx_s=0, length=stations)
    squares = np.maximum(squares, 1e-3 * squares.max())
    options = copp_py.clarabel.ClarabelOptions(allow_insufficient_progress=True)
    bends, best = None, np.inf
    for _ in range(_MOST_ROUNDS):
        problem = copp_py.solver.topp3_socp.Problem(
            robot.constraints,
            squares,
            idx_s_start=0,
            a_boundary=(begin[0], 0.0),
            b_boundary=(begin[1], 0.0),
            num_stationary_max=1,
            b_linearization=bends,
        )
        profile = copp_py.solver.topp3_socp.solve(problem, options)
        try:
            duration, _ = copp_py.interpolation.s_to_t_topp3(places / LENGTH, profile)
        except copp_py.CoppError:
            # A squared speed next to rest is less than zero: rounding.
            break
        duration *= TIME
        if not duration < best * (1.0 - _BETTER):
            return float(min(best, duration))
        best = duration
        squares, bends = profile.a, profile.b
    return float(best)
