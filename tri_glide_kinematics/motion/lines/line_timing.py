"""When the platform is where on a straight line: way laws, from rest and in mid-motion."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.motion.errors import PlanningError
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.lines.line_demand import line_demand, slowdown
from tri_glide_kinematics.motion.lines.line_entry import Entry
from tri_glide_kinematics.motion.lines.line_plan import WayLaw
from tri_glide_kinematics.motion.lines.pacing import Pace, Shape, line_pace
from tri_glide_kinematics.motion.lines.straight_line import StraightLine
from tri_glide_kinematics.motion.phases import (
    evaluate,
    knots,
    knots_with_blend,
    rest_to_rest,
    shortest_piece,
)
from tri_glide_kinematics.motion.ruckig_planner import RuckigPlanner

# The pace of moves to a target. From rest all of its jerk is used next to rest, but up to this part
# less next to the top speed, where the bends of the heights need jerk as well. Found by trial over
# thousands of random lines.
SHAPE = Shape(6, 1.1)
JERK_OF_BENDS = 0.5

# Speed against the direction of the line, as a part of the largest speed, that is rounding.
NO_WAY_BACK = 1e-9

# Which part of acceleration and jerk is used in mid-motion.
MOVING_PART = 0.9

# Number of quintics in a way law, and in that of a braking.
PIECES = 48
BRAKING_PIECES = 24


class LineTiming:
    """Finds way laws; holds ruckig and nothing else."""

    def __init__(self) -> None:
        """Prepare ruckig."""
        self._ruckig = RuckigPlanner(1)

    def from_rest(self, line: StraightLine, limits: SliderLimits) -> WayLaw:
        """Return the law of the shortest motion found from rest to rest at the end of ``line``.

        It is stretched in time by the factor with which all limits just hold.

        Args:
            line: of positive length.
            limits: of the sliders.

        Raises:
            PlanningError: if the line comes so close to the reach of an arm that none is found.
        """
        paced = line_pace(line, limits, SHAPE)
        target, rate, acceleration, jerk = (
            float(paced.coordinates[-1]),
            float(paced.rates.min()),
            float(paced.accelerations.min()),
            float(paced.jerks.min()),
        )
        # Each phase is to be long enough for knots of its own, however large the jerk may be.
        shortest = shortest_piece(target, acceleration)
        jerk = min(jerk, 0.5 * acceleration / shortest, 0.25 * rate / shortest**2)
        jerks = jerk, (1.0 - JERK_OF_BENDS * paced.bent) * jerk
        phases = rest_to_rest(target, rate, acceleration, jerks)
        times = np.array(knots(phases, PIECES, shortest))
        law = paced.law(evaluate(phases, (0.0, 0.0, 0.0), times))
        law = law.with_ends((0.0, 0.0, 0.0), line.length)
        demand = line_demand(line, law)
        # This is looked at before the law is stretched, which would hide it.
        if not demand.backwards <= NO_WAY_BACK * float(law.speeds.max()):
            raise PlanningError("the line comes too close to where an arm lies flat")
        return law.slower(float(slowdown(demand, limits).max()))

    def in_motion(self, entry: Entry, paced: Pace, part: float, haste: float) -> WayLaw:
        """Return the law that continues the motion of ``entry`` to rest at the end of its line.

        Args:
            entry: line, speed and acceleration at its start, and blend.
            paced: coordinate of the line, of the shape of ``SHAPE``.
            part: of acceleration and jerk that may be used.
            haste: factor of the speed with which the law is planned, at most 1.

        Raises:
            PlanningError: if ruckig finds none.
        """
        initial = paced.start(entry.speed, entry.gain)
        target = float(paced.coordinates[-1])
        acceleration = part * MOVING_PART * haste**2 * float(paced.accelerations.min())
        jerk = part * MOVING_PART * haste**3 * float(paced.jerks.min())
        (phases,) = self._ruckig.to_rest_at(
            [target],
            [initial[0]],
            [initial[1]],
            [initial[2]],
            ([haste], [acceleration], [jerk]),
        )
        shortest = shortest_piece(target, acceleration)
        times = knots_with_blend(phases, PIECES, shortest, entry.blend)
        law = paced.law(evaluate(phases, initial, times))
        return law.with_ends((0.0, entry.speed, entry.gain), entry.line.length)

    def braking(self, entry: Entry, limits: SliderLimits, part: float) -> WayLaw:
        """Return the law that brakes the motion of ``entry`` along its line.

        Raises:
            PlanningError: if there is no speed, or ruckig finds none.
        """
        _, speed, gain, blend = entry
        if speed == 0.0:
            raise PlanningError("the platform hardly moves")
        slopes, bends = entry.line.start_slopes, entry.line.start_bends
        steep = [max(abs(slope), 1e-9) for slope in slopes]
        acceleration = part * min(
            max(a - abs(bend) * speed * speed, 0.1 * a) / slope
            for a, bend, slope in zip(limits.acceleration, bends, steep)
        )
        jerk = part * min(j / slope for j, slope in zip(limits.jerk, steep))
        (phases,) = self._ruckig.to_rest([speed], [gain], ([1.0], [acceleration], [jerk]))
        shortest = shortest_piece(speed * speed / acceleration, acceleration)
        times = knots_with_blend(phases, BRAKING_PIECES, shortest, blend)
        law = WayLaw(*evaluate(phases, (0.0, speed, gain), times))
        return law.with_ends((0.0, speed, gain), float(law.ways[-1]))
