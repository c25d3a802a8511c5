"""When the platform is where on a straight line: way laws, from rest and in mid-motion."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.limits import SliderLimits
from tri_glide_kinematics.planning.line_demand import line_demand, slowdown
from tri_glide_kinematics.planning.line_entry import Entry
from tri_glide_kinematics.planning.line_plan import WayLaw
from tri_glide_kinematics.planning.pacing import Pace, Shape, pace
from tri_glide_kinematics.planning.phases import evaluate, knots, shortest_piece, with_knots_of
from tri_glide_kinematics.planning.plans import FloatArray
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
REFINED = Style(Shape(6, 0.9), 1.15, 1.0)

# With a given platform speed, and in mid-motion.
CAPPED = Style(Shape(12, 1.2), 1.0, 0.9)
MOVING = Style(Shape(6, 1.1), 1.0, 1.0)

# If the best style takes longer than the even one would without bends by more than this factor, so
# many refinements with so many cosines follow.
GOOD_ENOUGH = 1.1
REFINEMENTS = 3
HARMONICS = np.arange(1, 5)
REFINEMENT_STEP = 0.5
REFINEMENT_DAMPING = 0.02

# Number of quintics in a way law, and in that of a braking.
PIECES = 48
BRAKING_PIECES = 24


class LineTiming:
    """Finds way laws; holds ruckig and nothing else."""

    def __init__(self) -> None:
        """Prepare ruckig."""
        self._ruckig = RuckigPlanner(1)

    def from_rest(
        self, line: StraightLine, limits: SliderLimits, platform_speed: float = math.inf
    ) -> WayLaw:
        """Return the law of the shortest motion found from rest to rest at the end of ``line``.

        Each motion tried is stretched in time by the factor with which all limits just hold.

        Args:
            line: of positive length.
            limits: of the sliders.
            platform_speed: largest speed of the platform [m/s].

        Raises:
            PlanningError: if ruckig finds none.
        """
        if platform_speed < math.inf:
            capped = pace(line, limits, CAPPED.shape, platform_speed)
            return self._stretched(line, capped, CAPPED, limits)[0]
        laws = []
        even = math.inf
        for style in STYLES:
            law, factors = self._stretched(line, pace(line, limits, style.shape), style, limits)
            laws.append(law)
            if style is EVEN:
                even = law.times[-1] / factors.max()
        if min(law.times[-1] for law in laws) > GOOD_ENOUGH * even:
            laws += self._refinements(line, limits)
        return min(laws, key=lambda law: float(law.times[-1]))

    def in_motion(
        self, entry: Entry, limits: SliderLimits, platform_speed: float, part: float
    ) -> WayLaw:
        """Return the law that continues the motion of ``entry`` to rest at the end of its line.

        Args:
            entry: line, speed and acceleration at its start, and blend.
            limits: of the sliders.
            platform_speed: largest speed of the platform [m/s].
            part: of acceleration and jerk that may be used.

        Raises:
            PlanningError: if ruckig finds none.
        """
        line, speed, gain, blend = entry
        shape = MOVING.shape if platform_speed == math.inf else CAPPED.shape
        paced = pace(line, limits, shape, platform_speed)
        weight = float(paced.weights[0])
        initial = (
            0.0,
            weight * speed,
            weight * gain + float(paced.weight_slopes[0]) * speed * speed,
        )
        target = float(paced.coordinates[-1])
        acceleration = part * paced.acceleration
        (phases,) = self._ruckig.to_rest_at(
            [target],
            [0.0],
            [initial[1]],
            [initial[2]],
            ([1.0], [acceleration], [part * paced.jerk]),
        )
        duration = sum(time for time, _ in phases)
        if blend is not None and blend.duration > duration:
            phases.append((blend.duration - duration, 0.0))
        shortest = shortest_piece(target, acceleration)
        times = knots(phases, PIECES, shortest)
        if blend is not None:
            times = with_knots_of(times, blend, shortest)
        law = paced.law(evaluate(phases, initial, np.array(times)))
        return _with_ends(law, (0.0, speed, gain), line.length)

    def braking(self, entry: Entry, limits: SliderLimits, part: float) -> WayLaw:
        """Return the law that brakes the motion of ``entry`` along its line.

        Raises:
            PlanningError: if ruckig finds none.
        """
        _, speed, gain, blend = entry
        slopes, bends = entry.line.start_slopes, entry.line.start_bends
        steep = [max(abs(slope), 1e-9) for slope in slopes]
        acceleration = part * min(
            max(a - abs(bend) * speed * speed, 0.1 * a) / slope
            for a, bend, slope in zip(limits.acceleration, bends, steep)
        )
        jerk = part * min(j / slope for j, slope in zip(limits.jerk, steep))
        (phases,) = self._ruckig.to_rest([speed], [gain], ([1.0], [acceleration], [jerk]))
        duration = sum(time for time, _ in phases)
        if blend is not None and blend.duration > duration:
            phases.append((blend.duration - duration, 0.0))
        shortest = shortest_piece(speed * speed / acceleration, acceleration)
        times = knots(phases, BRAKING_PIECES, shortest)
        if blend is not None:
            times = with_knots_of(times, blend, shortest)
        law = WayLaw(*evaluate(phases, (0.0, speed, gain), np.array(times)))
        return _with_ends(law, (0.0, speed, gain), float(law.ways[-1]))

    def _stretched(
        self, line: StraightLine, paced: Pace, style: Style, limits: SliderLimits
    ) -> tuple[WayLaw, FloatArray]:
        """Return a law from rest to rest inside the limits, and how much each piece uses."""
        target = float(paced.coordinates[-1])
        acceleration, jerk = style.gain * paced.acceleration, style.gain * paced.jerk
        (phases,) = self._ruckig.to_rest_at(
            [target], [0.0], [0.0], [0.0], ([style.speed], [acceleration], [jerk])
        )
        times = np.array(knots(phases, PIECES, shortest_piece(target, acceleration)))
        law = paced.law(evaluate(phases, (0.0, 0.0, 0.0), times))
        law = _with_ends(law, (0.0, 0.0, 0.0), line.length)
        factors = slowdown(line_demand(line, law), limits)
        return law.slower(float(factors.max())), factors

    def _refinements(self, line: StraightLine, limits: SliderLimits) -> list[WayLaw]:
        """Change a pace step by step so that all pieces use the limits more equally."""
        paced = basis = pace(line, limits, REFINED.shape)
        place = basis.coordinates / basis.coordinates[-1]
        angles = math.pi * HARMONICS * place[:, np.newaxis]
        cosines, sines = np.cos(angles), np.sin(angles)
        rates = math.pi / basis.coordinates[-1] * HARMONICS * basis.weights[:, np.newaxis]
        grid = np.linspace(0.0, 1.0, 33)
        modes = np.cos(math.pi * np.arange(len(HARMONICS) + 1) * grid[:, np.newaxis])
        damping = np.diag(REFINEMENT_DAMPING * np.arange(len(HARMONICS) + 1) ** 2.0)
        strengths = np.zeros(len(HARMONICS))
        laws = []
        for _ in range(REFINEMENTS + 1):
            law, factors = self._stretched(line, paced, REFINED, limits)
            laws.append(law)
            middles = np.interp(0.5 * (law.ways[1:] + law.ways[:-1]), basis.ways, place)
            use = np.interp(grid, middles, np.log(factors / factors.max()))
            weighted = modes * np.exp(use)[:, np.newaxis]
            fit = np.linalg.solve(weighted.T @ modes + damping, weighted.T @ use)
            strengths += REFINEMENT_STEP * fit[1:]
            change = np.exp(cosines @ strengths)
            paced = basis.refined(change, change * -((sines * rates) @ strengths))
        return laws


def _with_ends(law: WayLaw, start: tuple[float, float, float], length: float) -> WayLaw:
    """Set the exact values at the start, and rest at ``length`` [m]."""
    for values, first, last in zip(law[1:], start, (length, 0.0, 0.0)):
        values[0], values[-1] = first, last
    return law
