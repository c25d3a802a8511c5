"""Plans on straight platform lines: from rest, in motion, of jogs, and to a stop.

However a plan was found, it is compared with the limits as a whole before it is handed out. Whether
it stays inside the workspace is for the caller to check.

A motion that is under way goes over to a line without a stop (``line_entry.py``): the line takes
over its part along it, and a blend brings the rest to zero. Or the blend brakes all of it, and the
line begins meanwhile.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible, at_once
from tri_glide_kinematics.motion.errors import LimitError, PlanningError
from tri_glide_kinematics.motion.limits import RELATIVE_ROUNDING, SliderLimits, SliderState
from tri_glide_kinematics.motion.moves.line_entry import (
    Entry,
    LineBuilder,
    LineEntry,
    check_length,
)
from tri_glide_kinematics.motion.moves.line_timing import (
    JOG_NORM,
    NORM,
    JogFactors,
    LineTiming,
    MovingFactors,
    PathParametrisation,
    parametrise,
)
from tri_glide_kinematics.motion.trajectory import (
    LinePlan,
    StraightLine,
    TimeScaling,
    UsableParts,
    bounds_along,
    checked,
    kept,
    shortest_piece,
    total_duration,
    with_knots_of,
)
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import Vector3

# A blend may take this many times as long as a stop, as a jog is to follow the hand.
LONGEST_JOG_BLEND = 2.0

# A jog has more to adapt: two ramps and the speed in between.
JOG_ATTEMPTS = 4


class LinearMotion:
    """Finds plans on straight lines for one machine; keeps nothing of a motion."""

    def __init__(self, machine: TriGlide) -> None:
        """Prepare ruckig for ``machine``."""
        self._machine = machine
        self._entry = LineEntry(machine)
        self._timing = LineTiming()

    def from_rest(self, line: StraightLine, limits: SliderLimits) -> LinePlan:
        """Return the shortest plan found from rest at the start of ``line`` to rest at its end.

        Args:
            line: of positive length.
            limits: of the sliders.

        Raises:
            PlanningError: if the line comes so close to the reach of an arm that none is found.
        """
        return LinePlan(line, at_once(self._timing.from_rest(line, limits)))

    def kept_from_rest(self, line: StraightLine, limits: SliderLimits) -> Interruptible[LinePlan]:
        """Return the same where there are added bounds, which it keeps.

        Args:
            line: of positive length.
            limits: of the sliders.

        Raises:
            KinematicsError: if none is found that does.
        """

        def plan(usable: UsableParts) -> tuple[LinePlan, float]:
            """Return the plan with parts of the limits, and when it is fastest [s]."""
            scaling = at_once(self._timing.from_rest(line, limits, usable))
            return LinePlan(line, scaling), float(scaling.times[scaling.speeds.argmax()])

        found = yield from kept(plan, limits)
        yield
        found.check_sliders(limits)
        return found

    def jog(
        self,
        state: SliderState,
        builder: LineBuilder,
        limits: SliderLimits,
        fraction: float,
        platform_speed: float,
    ) -> Interruptible[LinePlan]:
        """Return a plan that goes over to steady speed along a line, and to rest at its end.

        Args:
            state: of the sliders, at rest or in motion.
            builder: makes the line.
            limits: of the sliders.
            fraction: of acceleration and jerk for the blend; the line gets what is left.
            platform_speed: largest speed of the platform once it is on the line [m/s].

        Raises:
            KinematicsError: if it does not keep the limits, or there is none.
        """
        entry = self._entry.moving(state, builder.line, limits, fraction)
        yield
        entry = yield from _limited(entry, builder)
        check_length(entry.blend, state, limits, LONGEST_JOG_BLEND)
        yield
        fastest = min(platform_speed, limits.platform_speed)
        parametrisation = parametrise(entry.line, limits, JOG_NORM, fastest)
        factors = JogFactors(begin=1.0 - fraction)
        for _ in range(JOG_ATTEMPTS):
            yield
            timed = self._timing.jog(entry, parametrisation, factors)
            yield
            bounds = yield from bounds_along(entry.line, timed.scaling, limits, entry.blend)
            slowdowns = bounds.slowdown(limits)
            if slowdowns.max() <= 1.0 + RELATIVE_ROUNDING:
                break
            factors = factors.after(timed, slowdowns)
        scaling = timed.scaling
        if entry.blend is None and entry.speed == 0.0:
            scaling = scaling.slower(max(float(slowdowns.max()), 1.0))
        yield
        return (yield from checked(LinePlan(entry.line, scaling, entry.blend), limits))

    def brake(
        self,
        state: SliderState,
        limits: SliderLimits,
        fraction: float,
        beside: float,
        longest: float = math.inf,
    ) -> Interruptible[LinePlan]:
        """Return a plan that comes to rest along the direction in which the platform moves.

        Args:
            state: of the sliders, in motion.
            limits: of the sliders.
            fraction: of acceleration and jerk that is used.
            beside: part of it that leads onto the line, where the platform is beside it.
            longest: time that it may take [s].

        Raises:
            KinematicsError: if it does not keep the limits, or there is none.
        """
        _, velocity = self._machine.forward_velocity(state.heights, state.velocities)
        speed = math.hypot(*velocity)
        if speed == 0.0:
            raise PlanningError("the platform moves in no direction")
        x, y, z = velocity
        geometry, ahead = self._machine.geometry, (x / speed, y / speed, z / speed)

        def line_from(start: Vector3) -> StraightLine:
            """Return the beginning of the line: where it ends, the braking tells."""
            return StraightLine(geometry, start, ahead, 0.0)

        entry = self._entry.moving(state, line_from, limits, beside * fraction)
        yield
        if entry.blend is not None:
            if entry.blend.duration > longest:
                raise PlanningError("the motion beside the line would go on for too long")
            fraction *= 1.0 - beside
        scaling = self._timing.braking(entry, limits, fraction, longest)
        yield
        return (yield from checked(LinePlan(entry.line, scaling, entry.blend), limits))


def _limited(entry: Entry, builder: LineBuilder) -> Interruptible[Entry]:
    """Return an ``entry`` whose line has its final length.

    Raises:
        KinematicsError: if there is none inside the workspace.
    """
    return entry._replace(line=(yield from builder.limited(entry.line)))


# In mid-motion a time scaling cannot be stretched, as its first speed is given. It is made again,
# slower or faster: this many times at most, by more than the limits ask for. These are the factors
# of time while the blend lasts and after it; each further attempt has them several times.
ATTEMPTS = 5
MARGIN = 1.02
AFTER_MARGIN = 1.003

# It is not made faster if it uses this part of the limits after the blend, and given up if it has
# less than this part of them while the blend lasts.
WELL_USED = 0.98
LEAST_BEGIN = 0.1

# Fractions of acceleration and jerk that blends of moves use; the line has what is left.
MOVE_BLEND_FRACTIONS = (0.2, 0.4, 0.6)

# A blend may take this many times as long as a stop.
LONGEST_MOVE_BLEND = 4.0

# Fractions of a braking that are over when a new line begins.
DELAYS = (0.3, 0.5, 0.7, 0.8, 0.9, 1.0)

# Factor by which a line that begins during a gentle braking takes longer, about.
GENTLY_SLOWER = 1.2

# Gentler brakings leave more for a line that begins sooner: the fraction of acceleration and jerk
# that they use, and how much slower the line is and its delay, one after the other. Of many
# combinations these make up for nearly all others, over a hundred random turns.
GENTLE_BRAKINGS = (
    (0.7, ((1.0, 0.0), (1.0, 0.2), (1.25, 0.0), (1.5, 0.0))),
    (0.5, ((1.0, 0.1), (1.25, 0.0), (1.25, 0.2), (1.5, 0.0))),
)

# The wait before is divided into so many pieces, as bounds of long ones are wide.
WAITING_PIECES = 12


class WayOnto(NamedTuple):
    """A way to go over from a motion to a line.

    Attributes:
        entry: how the line takes the motion over.
        expected: how long its plan will take, about [s].
        plan: makes the plan, which keeps the limits, or raises a KinematicsError.
    """

    entry: Entry
    expected: float
    plan: Callable[[], Interruptible[LinePlan]]


class LineJoining:
    """Finds ways onto lines for one machine; keeps nothing of a motion."""

    def __init__(self, machine: TriGlide) -> None:
        """Prepare ruckig for ``machine``."""
        self._entry = LineEntry(machine)
        self._timing = LineTiming()

    def ways(
        self, state: SliderState, builder: LineBuilder, limits: SliderLimits
    ) -> Interruptible[list[WayOnto]]:
        """Return the ways to go over from ``state`` to a line without stopping.

        Args:
            state: of the sliders.
            builder: makes the line.
            limits: of the sliders.

        Returns:
            Those that are expected to be over first come first; there may be none.
        """
        ways: list[WayOnto] = []
        for fraction in MOVE_BLEND_FRACTIONS:
            try:
                ways.append((yield from self.blending(state, builder, limits, fraction)))
            except KinematicsError:
                continue
            yield
            if ways[-1].entry.blend is None:
                # The others are the same.
                break
        try:
            entry = self._entry.resting(state, builder.line, limits, 1.0)
            entry = yield from _limited(entry, builder)
            yield
            undelayed = yield from self._timing.from_rest(entry.line, limits)
        except KinematicsError:
            pass
        else:
            ways += [self._delaying(entry, undelayed, delay, limits) for delay in DELAYS]
            for gentle in GENTLE_BRAKINGS:
                ways.append(self._gentle(state, builder, limits, entry, undelayed, gentle))
        return sorted(ways, key=attrgetter("expected"))

    def soonest(self, ways: list[WayOnto]) -> Interruptible[LinePlan]:
        """Return the plan that is over first, of all ``ways`` that may be so.

        Its way is taken off the list, and so are those that have no plan.

        Raises:
            KinematicsError: if none keeps the limits.
        """
        best: tuple[LinePlan, WayOnto] | None = None
        refusal: KinematicsError = PlanningError("no line is joined without a stop")
        for way in list(ways):
            if best is not None and best[0].duration <= way.expected:
                break
            yield
            try:
                plan = yield from way.plan()
            except KinematicsError as error:
                ways.remove(way)
                refusal = error
            else:
                if best is None or plan.duration < best[0].duration:
                    best = plan, way
        if best is None:
            raise refusal
        ways.remove(best[1])
        return best[0]

    def blending(
        self, state: SliderState, builder: LineBuilder, limits: SliderLimits, fraction: float
    ) -> Interruptible[WayOnto]:
        """Return the way with a blend, which goes over to a line without stopping.

        Args:
            state: of the sliders.
            builder: makes the line.
            limits: of the sliders.
            fraction: of acceleration and jerk for the blend; the line gets what is left.

        Raises:
            KinematicsError: if there is none.
        """
        entry = self._entry.moving(state, builder.line, limits, fraction)
        yield
        entry = yield from _limited(entry, builder)
        check_length(entry.blend, state, limits, LONGEST_MOVE_BLEND)
        parametrisation = parametrise(entry.line, limits, NORM, limits.platform_speed)
        factors = MovingFactors(1.0 - fraction, 1.0)
        phases = self._timing.phases(entry, parametrisation, factors)
        plan = partial(self._adapted, entry, parametrisation, factors, limits)
        return WayOnto(entry, total_duration(phases), plan)

    def _delaying(
        self, entry: Entry, undelayed: TimeScaling, delay: float, limits: SliderLimits
    ) -> WayOnto:
        """Return the way that brakes, and begins with the line when a part of that is over.

        The arguments are those of ``_delayed``.
        """
        assert entry.blend is not None
        braking = entry.blend.duration
        expected = max(float(undelayed.times[-1]) + delay * braking, braking)
        return WayOnto(entry, expected, partial(_delayed, entry, undelayed, delay, limits))

    def _gentle(
        self,
        state: SliderState,
        builder: LineBuilder,
        limits: SliderLimits,
        hard: Entry,
        undelayed: TimeScaling,
        gentle: tuple[float, Sequence[tuple[float, float]]],
    ) -> WayOnto:
        """Return the way that brakes gently, and meanwhile begins with the line.

        Args:
            state: of the sliders.
            builder: makes the line.
            limits: of the sliders.
            hard: the entry at rest after the hardest braking.
            undelayed: time scaling of its line.
            gentle: one of ``GENTLE_BRAKINGS``.
        """
        fraction, choices = gentle
        assert hard.blend is not None
        braking = hard.blend.duration / fraction
        expected = max(GENTLY_SLOWER * float(undelayed.times[-1]), braking)

        def plan() -> Interruptible[LinePlan]:
            entry = self._entry.resting(state, builder.line, limits, fraction)
            entry = yield from _limited(entry, builder)
            yield
            scaling = yield from self._timing.from_rest(entry.line, limits)
            for slow, part in choices[:-1]:
                yield
                try:
                    return (yield from _delayed(entry, scaling.slower(slow), part, limits))
                except KinematicsError:
                    continue
            yield
            slow, part = choices[-1]
            return (yield from _delayed(entry, scaling.slower(slow), part, limits))

        return WayOnto(hard, expected, plan)

    def _adapted(
        self,
        entry: Entry,
        parametrisation: PathParametrisation,
        factors: MovingFactors,
        limits: SliderLimits,
    ) -> Interruptible[LinePlan]:
        """Return a plan that uses the limits nearly in full, while the blend lasts and after it.

        Raises:
            KinematicsError: if none keeps the limits.
        """
        blend = entry.blend
        best: LinePlan | None = None
        refusal: KinematicsError | None = None
        for attempt in range(ATTEMPTS):
            if attempt:
                yield
            scaling = self._timing.in_motion(entry, parametrisation, factors)
            plan = LinePlan(entry.line, scaling, blend)
            bounds = yield from bounds_along(entry.line, scaling, limits, blend)
            slower = bounds.slowdown(limits)
            begins = scaling.times[:-1] < (blend.duration if blend is not None else 0.0)
            begin = float(slower[begins].max(initial=0.0))
            after = float(slower[~begins].max(initial=0.0))
            try:
                bounds.check(scaling.times, limits)
            except LimitError as error:
                if best is None and attempt == ATTEMPTS - 1:
                    raise
                refusal = error
            else:
                if best is None or plan.duration < best.duration:
                    best = plan
                if after > WELL_USED:
                    break
            fast = float((bounds.velocity[:, begins] / limits.table[0, :, None]).max(initial=0.0))
            rate = min(factors.begin_rate, 1.0) / (MARGIN * fast) if fast > 1.0 else None
            factors = MovingFactors(
                factors.begin / (MARGIN * begin) ** (3 + 3 * attempt)
                if begin > 1.0
                else factors.begin,
                factors.after / (AFTER_MARGIN ** (1 + 2 * attempt) * after)
                if after > 0.0
                else factors.after,
                rate or factors.begin_rate,
            )
            if factors.begin < LEAST_BEGIN:
                break
        if best is None:
            raise refusal or PlanningError("no way")
        return best


def _delayed(
    entry: Entry, undelayed: TimeScaling, delay: float, limits: SliderLimits
) -> Interruptible[LinePlan]:
    """Return the plan that brakes, and begins with the line when a part of that is over.

    Args:
        entry: at rest.
        undelayed: time scaling of its line.
        delay: this part of the braking.
        limits: of the sliders.

    Raises:
        KinematicsError: if it does not keep the limits.
    """
    blend = entry.blend
    assert blend is not None
    wait = delay * blend.duration
    scaling = undelayed.delayed(wait)
    times = scaling.times.tolist()
    if wait > 0.0:
        times[:1] = np.linspace(0.0, wait, WAITING_PIECES, endpoint=False).tolist()
    if blend.duration > times[-1]:
        times.append(blend.duration)
    shortest = shortest_piece(entry.line.length, max(limits.acceleration))
    scaling = scaling.with_knots(np.array(with_knots_of(times, blend, shortest)))
    return (yield from checked(LinePlan(entry.line, scaling, blend), limits))
