"""When the platform is where on a straight line: way laws, from rest and in mid-motion."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.errors import PlanningError
from tri_glide_kinematics.limits import SliderLimits
from tri_glide_kinematics.planning.line_demand import line_demand, slowdown
from tri_glide_kinematics.planning.line_entry import Entry
from tri_glide_kinematics.planning.line_plan import WayLaw
from tri_glide_kinematics.planning.pacing import Pace, Shape, line_needs
from tri_glide_kinematics.planning.phases import (
    evaluate,
    knots,
    knots_with_blend,
    shortest_piece,
)
from tri_glide_kinematics.planning.ruckig_planner import RuckigPlanner
from tri_glide_kinematics.planning.straight_line import StraightLine


class Style(NamedTuple):
    """A way to plan the coordinate of a line.

    Attributes:
        shape: of the pace.
        speed: largest rate of the coordinate; 1 is what the pace takes for its limit.
        gain: which part of the coordinate's largest acceleration and jerk is used.
    """

    shape: Shape
    speed: float
    gain: float


# From rest. One style suits lines along which the sliders move evenly, the others those with bends
# in the middle or near the ends; all found by trial over thousands of random lines.
EVEN = Style(Shape(12, 0.0), 1.0, 0.9)
STYLES = (EVEN, Style(Shape(6, 1.1), 1.0, 0.9), Style(Shape(12, 1.4), 1.3, 1.0))
# In mid-motion.
MOVING = Style(Shape(6, 1.1), 1.0, 0.9)

# What is done if the best law takes longer than the even one would without bends, by more than a
# factor: a style is refined with so many cosines.
REFINEMENTS = ((1.15, Style(Shape(6, 1.1), 1.4, 1.0), 4), (1.3, Style(Shape(6, 0.9), 1.4, 1.0), 6))
REFINEMENT_ROUNDS = 5
REFINEMENT_STEP = 0.5
REFINEMENT_DAMPING = 0.2

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

        Each motion tried is stretched in time by the factor with which all limits just hold.

        Args:
            line: of positive length.
            limits: of the sliders.

        Raises:
            PlanningError: if ruckig finds none.
        """
        needs = line_needs(line, limits)
        laws = [self._rest_to_rest(line, needs.pace(style.shape), style) for style in STYLES]
        even = _duration(laws[STYLES.index(EVEN)])
        together = WayLaw(*map(np.array, zip(*laws)))
        factors = slowdown(line_demand(line, together), limits).max(axis=-1)
        best = min((law.slower(float(factor)) for law, factor in zip(laws, factors)), key=_duration)
        for excess, style, harmonics in REFINEMENTS:
            if _duration(best) > excess * even:
                laws = self._refined(line, limits, needs.pace(style.shape), style, harmonics)
                best = min((best, *laws), key=_duration)
        return best

    def in_motion(self, entry: Entry, paced: Pace, part: float, haste: float) -> WayLaw:
        """Return the law that continues the motion of ``entry`` to rest at the end of its line.

        Args:
            entry: line, speed and acceleration at its start, and blend.
            paced: coordinate of the line, of the shape of ``MOVING``.
            part: of acceleration and jerk that may be used.
            haste: factor of the speed with which the law is planned, at most 1.

        Raises:
            PlanningError: if ruckig finds none.
        """
        initial = paced.start(entry.speed, entry.gain)
        target = float(paced.coordinates[-1])
        acceleration = part * MOVING.gain * haste**2 * float(paced.accelerations.min())
        jerk = part * MOVING.gain * haste**3 * float(paced.jerks.min())
        (phases,) = self._ruckig.to_rest_at(
            [target],
            [initial[0]],
            [initial[1]],
            [initial[2]],
            ([haste * MOVING.speed], [acceleration], [jerk]),
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

    def _rest_to_rest(self, line: StraightLine, paced: Pace, style: Style) -> WayLaw:
        """Return a law from rest to rest, with as many knots as any; it may exceed the limits."""
        target = float(paced.coordinates[-1])
        acceleration = style.gain * float(paced.accelerations.min())
        jerk = style.gain * float(paced.jerks.min())
        (phases,) = self._ruckig.to_rest_at(
            [target], [0.0], [0.0], [0.0], ([style.speed], [acceleration], [jerk])
        )
        times = np.array(knots(phases, PIECES, shortest_piece(target, acceleration)))
        law = paced.law(evaluate(phases, (0.0, 0.0, 0.0), times))
        return law.with_ends((0.0, 0.0, 0.0), line.length)

    def _refined(
        self, line: StraightLine, limits: SliderLimits, basis: Pace, style: Style, harmonics: int
    ) -> list[WayLaw]:
        """Change a pace step by step so that all pieces use the limits more equally."""
        paced = basis
        place = basis.coordinates / basis.coordinates[-1]
        orders = np.arange(harmonics + 1)
        angles = math.pi * orders[1:] * place[:, np.newaxis]
        cosines, sines = np.cos(angles), np.sin(angles)
        rates = math.pi / basis.coordinates[-1] * orders[1:] * basis.weights[:, np.newaxis]
        grid = np.linspace(0.0, 1.0, 33)
        modes = np.cos(math.pi * orders * grid[:, np.newaxis])
        damping = np.diag(REFINEMENT_DAMPING * orders**2.0)
        strengths = np.zeros(harmonics)
        laws = []
        for _ in range(REFINEMENT_ROUNDS):
            law = self._rest_to_rest(line, paced, style)
            factors = slowdown(line_demand(line, law), limits)
            laws.append(law.slower(float(factors.max())))
            middles = np.interp(0.5 * (law.ways[1:] + law.ways[:-1]), basis.ways, place)
            use = np.interp(grid, middles, np.log(factors / factors.max()))
            weighted = modes * np.exp(use)[:, np.newaxis]
            fit = np.linalg.solve(weighted.T @ modes + damping, weighted.T @ use)
            strengths += REFINEMENT_STEP * fit[1:]
            change = np.exp(cosines @ strengths)
            paced = basis.refined(change, change * -((sines * rates) @ strengths))
        return laws


def _duration(law: WayLaw) -> float:
    return float(law.times[-1])
