"""When the platform is where in a jog: a ramp to steady speed, and one to rest at the edge."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.motion.errors import PlanningError
from tri_glide_kinematics.motion.limits import RELATIVE_ROUNDING
from tri_glide_kinematics.motion.lines.line_entry import Entry
from tri_glide_kinematics.motion.lines.line_plan import WayLaw
from tri_glide_kinematics.motion.lines.pacing import Pace, Shape
from tri_glide_kinematics.motion.phases import (
    after_phase,
    evaluate,
    knots,
    merged,
    rest_until,
    shortest_piece,
    with_knots_of,
)
from tri_glide_kinematics.motion.ruckig_planner import RuckigPlanner
from tri_glide_kinematics.vectors import FloatArray

# A jog is to have its speed in the middle of the workspace, whatever the edge where it ends asks
# for: so the pace is careful with bends, which matter near the edge alone.
SHAPE = Shape(12, 3.0)

# Number of quintics in the way law, besides those of the steady part.
PIECES = 32

# A limit that was exceeded by a factor is aimed at with this factor more.
MARGIN = 1.03

# A jog that takes longer than this leads nowhere [s]: none is planned to, but where the limits get
# broken however slow it is.
LONGEST = 1e4


class JogGains(NamedTuple):
    """Which part of the limits a jog uses.

    Attributes:
        begin: of acceleration and jerk in the first ramp.
        end: of acceleration and jerk in the last ramp.
        haste: of the steady speed.
    """

    begin: float
    end: float = 0.8
    haste: float = 1.0

    def after(self, timed: TimedJog, slowdowns: FloatArray) -> JogGains:
        """Return the gains that should keep the limits better.

        Args:
            timed: what was planned with these gains.
            slowdowns: factor by which each piece of it is too fast. Shape (k,).
        """
        # Pieces end where the ramps do, but for rounding; their middles are clear of that.
        middles = 0.5 * (timed.law.times[:-1] + timed.law.times[1:])
        ramping = middles < timed.steady_from
        ending = middles > timed.steady_until
        begin, end = _excess(slowdowns[ramping]), _excess(slowdowns[ending])
        steady = _excess(slowdowns[~ramping & ~ending])
        return JogGains(self.begin / begin**2, self.end / end**2, self.haste / steady)


class TimedJog(NamedTuple):
    """The way law of a jog.

    Attributes:
        law: to rest at the end of the line.
        steady_from: when the speed becomes steady [s].
        steady_until: when it no longer is [s].
    """

    law: WayLaw
    steady_from: float
    steady_until: float


def _excess(slowdowns: FloatArray) -> float:
    """Return the largest factor, with a margin, or 1 if there is none above 1."""
    largest = float(slowdowns.max(initial=0.0))
    return MARGIN * largest if largest > 1.0 + RELATIVE_ROUNDING else 1.0


class JogTiming:
    """Finds way laws of jogs; holds ruckig and nothing else."""

    def __init__(self) -> None:
        """Prepare ruckig."""
        self._ruckig = RuckigPlanner(1)

    def law(self, entry: Entry, paced: Pace, gains: JogGains) -> TimedJog:
        """Return the law that continues ``entry`` up to the end of its line.

        Each ramp looks at the slider limits along its own part of the line, as these differ much
        between the middle of the workspace and its edge.

        Args:
            entry: line, speed and acceleration at its start, and blend.
            paced: coordinate of the line, with the speed of the platform as one of its limits.
            gains: what of the limits is used.

        Raises:
            PlanningError: if ruckig finds none, or none that ends soon.
        """
        initial = paced.start(entry.speed, entry.gain)
        target = float(paced.coordinates[-1])
        rate = gains.haste
        acceleration, jerk = paced.ramp_limits(max(rate, initial[1]), at_end=False)
        begin_limits = ([rate], [gains.begin * acceleration], [gains.begin * jerk])
        end_acceleration, end_jerk = paced.ramp_limits(rate, at_end=True)
        end_limits = ([rate], [gains.end * end_acceleration], [gains.end * end_jerk])
        (phases,) = self._ruckig.to_velocity([rate], [initial[1]], [initial[2]], begin_limits)
        state = initial
        for duration, phase_jerk in phases:
            state = after_phase(state, duration, phase_jerk)
        ramp = rate * (rate / end_limits[1][0] + end_limits[1][0] / end_limits[2][0])
        if state[0] + ramp < target:
            steady_from = sum(duration for duration, _ in phases)
            (ending,) = self._ruckig.to_rest_at([target], [state[0]], [rate], [0.0], end_limits)
        else:
            # There is no room to become steady: one motion, with the limits of all of the line.
            gain = min(gains.begin, gains.end)
            whole = (
                [rate],
                [gain * float(paced.accelerations.min())],
                [gain * float(paced.jerks.min())],
            )
            steady_from, phases = 0.0, []
            (ending,) = self._ruckig.to_rest_at([target], [0.0], [initial[1]], [initial[2]], whole)
        # The last three phases of ruckig are the ramp to rest.
        steady_until = steady_from + sum(duration for duration, _ in ending[:-3])
        phases += ending
        if sum(duration for duration, _ in phases) > LONGEST:
            raise PlanningError("the way to the edge would take hours")
        if entry.blend is not None:
            rest_until(phases, entry.blend.duration)
        shortest = shortest_piece(target, acceleration)
        # Steady motion takes most of the time; knots are needed where the line changes.
        passed = steady_from + (paced.coordinates - state[0]) / rate
        steady = (passed > steady_from) & (passed < steady_until)
        times = merged(knots(phases, PIECES, shortest), passed[steady].tolist(), shortest)
        if entry.blend is not None:
            times = with_knots_of(times, entry.blend, shortest)
        law = paced.law(evaluate(phases, initial, np.array(times)))
        law = law.with_ends((0.0, entry.speed, entry.gain), entry.line.length)
        return TimedJog(law, steady_from, steady_until)
