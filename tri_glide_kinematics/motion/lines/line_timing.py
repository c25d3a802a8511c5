"""Time scalings of moves to a target and of braking, from rest and in mid-motion."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.constant_jerk import evaluate, rest_to_rest
from tri_glide_kinematics.motion.errors import PlanningError
from tri_glide_kinematics.motion.hard_braking import hardest_braking
from tri_glide_kinematics.motion.knots import (
    knots,
    knots_with_blend,
    lasting,
    shortest_piece,
    with_knots_of,
)
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.lines.derivative_bounds import derivative_bounds, slowdown
from tri_glide_kinematics.motion.lines.line_entry import Entry
from tri_glide_kinematics.motion.lines.path_parametrisation import (
    PathParametrisation,
    SpeedNorm,
    parametrise,
)
from tri_glide_kinematics.motion.lines.straight_line import StraightLine
from tri_glide_kinematics.motion.lines.time_scaling import TimeScaling
from tri_glide_kinematics.motion.ruckig_planner import RuckigPlanner

# The path parametrisation of moves to a target. A motion from rest begins with all the jerk of the
# path parameter; next to its top speed it uses less, by up to this fraction, as the bends of the
# heights need jerk as well. Found by trial over thousands of random lines.
NORM = SpeedNorm(6, 1.1)
JERK_OF_BENDS = 0.5

# Speed against the direction of the line, as a fraction of the largest speed, that is rounding.
NO_WAY_BACK = 1e-9

# Fraction of acceleration and jerk that is used in mid-motion.
MOVING_FRACTION = 0.9

# Number of quintics in a time scaling.
PIECES = 48


class LineTiming:
    """Finds time scalings of moves and brakings; keeps nothing of a motion."""

    def __init__(self) -> None:
        """Prepare ruckig."""
        self._ruckig = RuckigPlanner(1)

    def from_rest(self, line: StraightLine, limits: SliderLimits) -> Interruptible[TimeScaling]:
        """Return the shortest time scaling found from rest to rest at the end of ``line``.

        It is stretched by the factor with which all limits just hold.

        Args:
            line: of positive length.
            limits: of the sliders.

        Raises:
            PlanningError: if the line comes so close to the reach of an arm that none is found.
        """
        parametrisation = parametrise(line, limits, NORM)
        yield
        target, rate, acceleration, jerk = (
            float(parametrisation.coordinates[-1]),
            float(parametrisation.rates.min()),
            float(parametrisation.accelerations.min()),
            float(parametrisation.jerks.min()),
        )
        # Each phase is to be long enough for knots of its own, however large the jerk may be.
        shortest = shortest_piece(target, acceleration)
        jerk = min(jerk, 0.5 * acceleration / shortest, 0.25 * rate / shortest**2)
        jerks = jerk, (1.0 - JERK_OF_BENDS * parametrisation.bend_fraction) * jerk
        phases = rest_to_rest(target, rate, acceleration, jerks)
        times = np.array(knots(phases, PIECES, shortest))
        scaling = parametrisation.time_scaling(evaluate(phases, (0.0, 0.0, 0.0), times))
        scaling = scaling.with_ends((0.0, 0.0, 0.0), line.length)
        yield
        bounds = derivative_bounds(line, scaling)
        # This is looked at before the motion is stretched, which would hide it.
        if not bounds.backwards <= NO_WAY_BACK * float(scaling.speeds.max()):
            raise PlanningError("the line comes too close to where an arm lies flat")
        return scaling.slower(float(slowdown(bounds, limits).max()))

    def in_motion(
        self,
        entry: Entry,
        parametrisation: PathParametrisation,
        fraction: float,
        speed_factor: float,
    ) -> TimeScaling:
        """Return the time scaling that continues ``entry`` to rest at the end of its line.

        Args:
            entry: line, speed and acceleration at its start, and blend.
            parametrisation: of the line, with ``NORM``.
            fraction: of acceleration and jerk that may be used.
            speed_factor: by which the whole motion is planned slower, at most 1.

        Raises:
            PlanningError: if ruckig finds none.
        """
        initial = parametrisation.start(entry.speed, entry.acceleration)
        target = float(parametrisation.coordinates[-1])
        acceleration = (
            fraction
            * MOVING_FRACTION
            * speed_factor**2
            * float(parametrisation.accelerations.min())
        )
        jerk = fraction * MOVING_FRACTION * speed_factor**3 * float(parametrisation.jerks.min())
        (phases,) = self._ruckig.to_rest_at(
            [target],
            [initial[0]],
            [initial[1]],
            [initial[2]],
            ([speed_factor], [acceleration], [jerk]),
        )
        shortest = shortest_piece(target, acceleration)
        phases = lasting(phases, entry.blend)
        times = knots_with_blend(phases, PIECES, shortest, entry.blend)
        scaling = parametrisation.time_scaling(evaluate(phases, initial, times))
        return scaling.with_ends((0.0, entry.speed, entry.acceleration), entry.line.length)

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
        scaling = TimeScaling(
            *hardest_braking(
                lambda ways: line.derivatives(ways)[1:],
                (0.0, speed, acceleration),
                limits,
                fraction=fraction,
                longest=longest,
            )
        )
        if blend is None:
            return scaling
        times = scaling.times.tolist()
        shortest = shortest_piece(float(scaling.ways[-1]), max(limits.acceleration))
        if blend.duration > times[-1] + shortest:
            times.append(blend.duration)
        return scaling.with_knots(np.array(with_knots_of(times, blend, shortest)))
