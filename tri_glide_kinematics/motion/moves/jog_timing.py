"""Time scaling of a jog: a ramp to steady speed, and one to rest at the edge."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.motion.moves.blends import Entry
from tri_glide_kinematics.motion.moves.parametrisation import PathParametrisation, SpeedNorm
from tri_glide_kinematics.motion.trajectory import (
    RELATIVE_ROUNDING,
    PlanningError,
    RuckigPlanner,
    TimeScaling,
    after,
    evaluate,
    lasting,
    merged,
    shortest_piece,
    total_duration,
    with_knots_of,
)
from tri_glide_kinematics.motion.trajectory.knots import knots
from tri_glide_kinematics.vectors import FloatArray

# A jog is to have its full speed in the middle of the workspace. So the bends of the heights, which
# matter near the edge alone, have a large weight: the speed is reduced there, and only there.
NORM = SpeedNorm(12, 3.0)

# Number of quintics in the time scaling, besides those of the steady part.
PIECES = 32

# After a limit was exceeded by some factor, the next attempt is slower by that factor and this one.
MARGIN = 1.03

# A jog that takes longer than this is given up [s]: the attempts become that slow only where the
# limits are broken at any speed.
LONGEST = 1e4


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
    return MARGIN * largest if largest > 1.0 + RELATIVE_ROUNDING else 1.0


class JogTiming:
    """Finds time scalings of jogs; keeps nothing of a motion."""

    def __init__(self) -> None:
        """Prepare ruckig."""
        self._ruckig = RuckigPlanner(1)

    def time_scaling(
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
        target = float(parametrisation.coordinates[-1])
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
            whole = (
                [rate],
                [fraction * float(parametrisation.accelerations.min())],
                [fraction * float(parametrisation.jerks.min())],
            )
            steady_from, phases = 0.0, []
            (ending,) = self._ruckig.to_rest_at([target], [0.0], [initial[1]], [initial[2]], whole)
        # The last three phases of ruckig are the ramp to rest.
        steady_until = steady_from + total_duration(ending[:-3])
        phases = [*phases, *ending]
        if total_duration(phases) > LONGEST:
            raise PlanningError("the way to the edge would take hours")
        phases = lasting(phases, entry.blend)
        shortest = shortest_piece(target, acceleration)
        # Steady motion takes most of the time; knots are needed where the line changes.
        passed = steady_from + (parametrisation.coordinates - state[0]) / rate
        steady = (passed > steady_from) & (passed < steady_until)
        times = merged(knots(phases, PIECES, shortest), passed[steady].tolist(), shortest)
        if entry.blend is not None:
            times = with_knots_of(times, entry.blend, shortest)
        scaling = parametrisation.time_scaling(evaluate(phases, initial, np.array(times)))
        scaling = scaling.with_ends((0.0, entry.speed, entry.acceleration), entry.line.length)
        return TimedJog(scaling, steady_from, steady_until)
