"""Plans along a path: the whole of it, its parts one after the other, and brakings on it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import chain
from math import inf
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.checks import finite_vector, member
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible, at_once
from tri_glide_kinematics.motion.errors import (
    SOUND,
    CutBendError,
    MotionError,
    PathTimingError,
    PlanningError,
    SliderLimitError,
)
from tri_glide_kinematics.motion.limits import AT_REST, SliderLimits, SliderState
from tri_glide_kinematics.motion.moves import MotionKind, MotionPlanner, hardest_braking
from tri_glide_kinematics.motion.path import (
    DrivenPath,
    PlatformPath,
    ShapedCorners,
    check_place,
)
from tri_glide_kinematics.motion.path_timing.grid import MOST_PIECES
from tri_glide_kinematics.motion.path_timing.speed_estimate import (
    SAMPLES,
    SHORTEST_CELL,
    estimated,
    samples,
)
from tri_glide_kinematics.motion.path_timing.windows import ABOVE_ROUNDING, plan_window
from tri_glide_kinematics.motion.shaped import Bends, Planned, planned_shaped
from tri_glide_kinematics.motion.shaping import Shaper, Shaping
from tri_glide_kinematics.motion.trajectory import (
    LinePlan,
    PathHeights,
    PathPlan,
    PathStart,
    RuckigPlanner,
    SequencePlan,
    Slowing,
    TimeScaling,
    Trajectory,
    check_added,
    check_along,
    checked,
    evaluate,
    total_duration,
)
from tri_glide_kinematics.vectors import FloatArray, ascending
from tri_glide_kinematics.workspace import Workspace

# Part above the speed that the path asks for to which a hard braking from that speed is checked, as
# its few pieces bound the speed no better.
_ABOVE_SPEED = 0.01

# Number of breaks of the path that are looked at together in an estimate; the part of what is seen
# that is kept, as the estimate is at rest at its end; and the number of places, about, that it
# keeps of a long path.
_BREAKS_AHEAD = 30_000
_KEPT_AHEAD = 0.9
_PLACES_KEPT = 200_000

# Of a path that is longer than so many windows samples are planned, each of one window, until the
# standard error of the duration is at most such a part of it; but at least and at most so many.
_MOST_WINDOWS = 12
_STANDARD_ERROR = 0.005
_LEAST_SAMPLES = 8
_MOST_SAMPLES = 48

# Multiples of this part, without the wholes, are spread evenly, however many there are of them.
_SPREAD = 0.5 * 5.0**0.5 - 0.5

# A sample begins at such a part of the estimated speed. It counts between these parts of its time:
# at first it gets as fast as it would be there, and at last it comes to rest.
_PART_OF_SPEED = 0.5
_COUNTED = (0.125, 0.5)

# Parts of the limits of velocity, acceleration and jerk that a line is planned with, from rest and
# in motion. Its own bounds are a little larger, up to 1.6e-4, 3e-4 and 8e-3: from rest that is
# stretched away, in motion it cannot be. There larger margins of the first two would leave less
# than the line uses already.
_OF_LINE = (1.0 - 3e-5,) * 3
_OF_LINE_IN_MOTION = (1.0 - 1e-3, 1.0 - 5e-4, 1.0 - 1e-2)

# A line is driven sooner where that takes less than this part of the time that is left.
_WORTH_IT = 0.99

# A braking leads so much farther, one after another, than one that only the slopes limit.
_BRAKING_WAYS = (1.15, 1.6, 2.5, 4.0)


def brake(curve: PathHeights, start: PathStart, limits: SliderLimits) -> Interruptible[PathPlan]:
    """Return a motion that comes to rest soon, along the path.

    Args:
        curve: the path.
        start: where the motion is, inside all limits.
        limits: of the sliders.

    Raises:
        PlanningError: if none is found from here, or if there is nothing to brake.
    """
    if not start.speed > 0.0:
        raise PlanningError("the platform rests")
    stop = _next_stop(curve, start.place)
    shortest = _shortest(curve, start, limits)
    for factor in _BRAKING_WAYS:
        until = min(start.place + factor * shortest, stop)
        try:
            found = yield from plan_window(curve, start, limits, until=until)
            return PathPlan(curve, found.scaling)
        except MotionError:
            if until == stop:
                break
    raise PlanningError("no braking along the path keeps the limits from here")


def _slowing(curve: PathHeights, start: PathStart, limits: SliderLimits) -> Iterator[PathHeights]:
    """Yield a path for a motion that may be faster than it asks for, in the order of attempts.

    In the first one the motion has to keep the speed from its start on, if it does so there. Then
    it has a way to slow down on, and then it need not slow down so much: the next part goes on with
    that. In the last one it stays as fast as it is.

    Args:
        curve: the path, with the speeds that it asks for.
        start: where the motion is, inside all limits.
        limits: of the sliders.
    """
    place = np.array([start.place])
    speed = start.speed * float(curve.derivatives(place).rates[0])
    if speed <= float(curve.speed_limits(place)[0]):
        yield curve
    shortest = _shortest(curve, start, limits)
    for factor, part in _SLOWING:
        until = start.place + factor * shortest
        yield curve.with_slowing(Slowing(until, _NO_FASTER * speed, part * speed))


def _next_stop(curve: PathHeights, place: float) -> float:
    """Return the place of the next stop behind a ``place`` on the path [m]."""
    stops = curve.driven.stops
    return float(stops[min(int(np.searchsorted(stops, place, "right")), len(stops) - 1)])


def _shortest(curve: PathHeights, start: PathStart, limits: SliderLimits) -> float:
    """Return how far the platform goes on if it brakes as the slopes of the heights here allow [m].

    Raises:
        PlanningError: if ruckig finds no braking.
    """
    slopes = np.abs(curve.derivatives(np.array([start.place])).heights[1])
    _, acceleration, jerk = (limits.table[..., np.newaxis] / slopes).min(axis=(1, 2)).tolist()
    # A path that begins to bend leaves less; what is asked for now has to be possible.
    acceleration = max(acceleration, abs(start.acceleration))
    (phases,) = RuckigPlanner(1).to_rest(
        [start.speed], [start.acceleration], ([1.0], [acceleration], [jerk])
    )
    final = evaluate(phases, start, np.array([total_duration(phases)]))
    # A platform that brakes already may rest sooner than the jerk allows to end that.
    return max(float(final.values[-1]) - start.place, 0.5 * start.speed**2 / acceleration)


# Attempts, one after another, of a platform that is faster than the path asks for: the way to slow
# down, as a part of that to rest, and the part of its speed that it has to come down to.
_SLOWING = ((2.0, 0.0), (4.0, 0.3), (inf, 1.0))
_NO_FASTER = 1.005

# Of the tolerances, roundings take this part where there is a shaper.
ROUNDED_PART = 0.3

# A corner is cut less than if it were not rounded, so it is passed at so many times that speed; and
# its rounding is so many times as long as the way in the mean time by which impulses come before
# their mean. Both as measured, in the middle of corners of 20 to 130 degrees.
ROUNDED_SPEED = 1.3
ROUNDED_WAY = 3.6

# So fast a platform has been at most behind the place where it is now [m/s], and over so many spans
# it is looked back.
FARTHEST_BACK = 1.0
MOST_BACK = 300


class PathPlanner:
    """Plans the parts of a path inside one workspace."""

    def __init__(self, workspace: Workspace) -> None:
        """Prepare for paths inside ``workspace``."""
        self._workspace = workspace

    def begun(
        self, path: PlatformPath, limits: SliderLimits, shaper: Shaping | None = None
    ) -> Interruptible[PathHeights]:
        """Return a ``path`` as driven, seen from the sliders; all of it is inside the workspace.

        Args:
            path: of one segment at least.
            limits: of the sliders; where corners stop because of a shaper depends on them.
            shaper: it needs a part of the tolerances; None without one.

        Raises:
            KinematicsError: if a place of it is not, it has no segment, or a bend of it has no
                tolerance, though there is a shaper.
        """
        if shaper is None:
            driven = yield from path.driven_in_pieces()
        else:
            segments = yield from PlatformPath.segments.in_pieces(path)
            driven = yield from DrivenPath.of(
                segments, _shaped_corners(shaper.covering(None), limits)
            )
        return (yield from self._seen(driven))

    def _seen(self, driven: DrivenPath, place: float = 0.0) -> Interruptible[PathHeights]:
        """Return a path seen from the sliders, checked from a ``place`` [m] on."""
        if driven.shaped is not None:
            segment = yield from driven.bend_without_tolerance()
            if segment is not None:
                raise CutBendError(segment)
        yield from check_place(driven, self._workspace, place)
        return PathHeights(driven, self._workspace.machine.geometry)

    def with_speeds(
        self,
        heights: PathHeights,
        place: float,
        scale: float,
        limits: SliderLimits,
        shaper: Shaper | None,
        cut: float = 1.0,
        rapid: float = inf,
    ) -> Interruptible[PathHeights]:
        """Return a path with the speeds that hold for what is planned next.

        Args:
            heights: of the path.
            place: where the next part begins [m].
            scale: of the speeds that the path asks for.
            limits: which may bound the speed of the platform, too.
            shaper: cuts bends the less the slower they are driven; None without one.
            cut: the part that it may cut them by, of what the tolerances leave.
            rapid: largest speed of the platform where the path asks for none [m/s].
        """
        if shaper is None:
            return heights.at_speeds(scale, None, limits.platform_speed, rapid)
        driven = heights.driven
        behind = place - FARTHEST_BACK * shaper.duration
        stop = int(np.searchsorted(driven.stops, place, "right"))
        last, following = driven.stops[[stop - 1, min(stop, len(driven.stops) - 1)]]
        ends = np.searchsorted(driven.breaks, (max(behind, last), place, following), "right")
        first, here, end = (ends - 1).tolist()
        spans = slice(max(first, here - MOST_BACK), max(min(end, here + MOST_PIECES), here + 1))
        steps = yield from Bends(driven, spans).speeds(shaper, scale, cut)
        return heights.at_speeds(scale, steps, limits.platform_speed, rapid)

    def extended(
        self, heights: PathHeights, path: PlatformPath, place: float
    ) -> Interruptible[PathHeights]:
        """Return a path with another one behind it.

        Args:
            heights: of the path before.
            path: begins where that one ends.
            place: up to which it stays as it is [m].

        Raises:
            KinematicsError: if a place of it is outside the workspace, or it begins elsewhere.
        """
        driven = yield from heights.driven.extended(path.segments, place)
        return (yield from self._seen(driven, place))

    def from_rest(
        self, heights: PathHeights, place: float, limits: SliderLimits
    ) -> Interruptible[PathPlan]:
        """Return the plan of the next part of a path, from rest at a ``place`` on it [m].

        Raises:
            PathTimingError: if none is found.
        """
        with SOUND:
            return (yield from plan_window(heights, PathStart(place, 0.0, 0.0), limits))

    def going_on(
        self, plan: PathPlan, heights: PathHeights, time: float, limits: SliderLimits
    ) -> Interruptible[PathPlan]:
        """Return the plan of what comes after a part of a path, without a stop.

        Args:
            plan: of that part.
            heights: of the path, which is the same as that of the ``plan`` up to there.
            time: when the next one begins, in the ``plan`` [s].
            limits: for the next part.

        Raises:
            PathTimingError: if none is found.
        """
        start, held = plan.on_curve(time), plan.scaling.since(time)
        is_slower = heights.is_slower(plan.heights) or plan.heights.slowing
        # Where the limits leave nothing to slow down with, it goes on as it was, and tries again.
        as_it_was = heights.with_speeds_of(plan.heights)
        slowing = chain(_slowing(heights, start, limits), (as_it_was,))
        for curve in slowing if is_slower else (heights,):
            try:
                # The held motion stays as fast, and so is no guess for one that slows down.
                guess = held if curve.slowing is None else None
                with SOUND:
                    return (yield from plan_window(curve, start, limits, guess))
            except PathTimingError as error:
                refusal = error
                yield
        raise refusal

    def to_the_end(
        self, heights: PathHeights, planned: Planned, shaper: Shaper | None = None
    ) -> Interruptible[SequencePlan]:
        """Return the plan of a whole path, from rest at its start to rest at its end.

        Args:
            heights: of the path.
            planned: what it keeps.
            shaper: at each stop it has the time to become empty; None without one.

        Raises:
            PathTimingError: if none is found.
        """
        scaled = yield from self.with_speeds(heights, 0.0, 1.0, planned.limits, shaper, planned.cut)
        plan = yield from self.from_rest(scaled, 0.0, planned.limits)
        return SequencePlan((yield from self._going_on_to_the_end(plan, planned, shaper)))

    def _going_on_to_the_end(
        self, plan: PathPlan, planned: Planned, shaper: Shaper | None = None
    ) -> Interruptible[tuple[PathPlan, ...]]:
        """Return what is driven of a ``plan``, and all parts that come after that."""
        parts = []
        while not plan.ends_path:
            part, plan = yield from self._part_and_next(plan, planned, shaper)
            parts.append(part)
        return *parts, plan

    def timed(self, heights: PathHeights, limits: SliderLimits) -> Interruptible[FloatArray]:
        """Return when the motion ``to_the_end`` is where, its duration within a hundredth.

        A long path is not planned as a whole: it is estimated (``speed_estimate.py``), and the
        estimate is corrected by what samples of it take as planned.

        Returns:
            Ascending places [m] and times [s]. Shape (2, n).

        Raises:
            PathTimingError: if no motion is found.
        """
        yield from heights.driven.measured()
        heights = yield from self.with_speeds(heights, 0.0, 1.0, limits, None)
        plan = yield from self.from_rest(heights, 0.0, limits)
        if not plan.ends_path:
            window = min(plan.continue_at, plan.duration)
            ahead = yield from _MotionAhead.estimated(heights, limits)
            if ahead.times[-1] > _MOST_WINDOWS * window:
                ratio = (yield from ahead.duration(window)) / ahead.times[-1]
                return np.array((ahead.places, ratio * ahead.times))
        parts = yield from self._going_on_to_the_end(plan, Planned(limits))
        whole = TimeScaling.joined([part.scaling for part in parts])
        return np.array((whole.ways, whole.times))

    def _part_and_next(
        self, plan: PathPlan, planned: Planned, shaper: Shaper | None
    ) -> Interruptible[tuple[PathPlan, PathPlan]]:
        """Return what is driven of a ``plan``, and the plan of what comes after that."""
        time = plan.continue_at
        is_going_on = time < plan.duration
        place = plan.place(time)
        scaled = yield from self.with_speeds(
            plan.heights, place, 1.0, planned.limits, shaper, planned.cut
        )
        if is_going_on:
            try:
                following = yield from self.going_on(plan, scaled, time, planned.limits)
                return plan.until(time), following
            except KinematicsError:
                # The platform comes to rest where the plan does, and goes on from there.
                yield
            place = plan.place(plan.duration)
            scaled = yield from self.with_speeds(
                plan.heights, place, 1.0, planned.limits, shaper, planned.cut
            )
        following = yield from self.from_rest(scaled, place, planned.limits)
        return plan, following if shaper is None else following.delayed(shaper.duration)

    def sooner(self, plan: LinePlan, time: float, limits: SliderLimits) -> Interruptible[LinePlan]:
        """Return a motion that is sooner at the end of a line, from a ``time`` in a ``plan`` on.

        Args:
            plan: from rest to rest on a straight line, which keeps the limits.
            time: when the motion begins, in the ``plan`` [s].
            limits: of the sliders.

        Raises:
            KinematicsError: if none is found that is.
        """
        line, start = plan.line, plan.on_curve(time)
        path = PlatformPath.start(line.start).line_to(line.point(plan.scaling.ways[-1]))
        driven = yield from path.driven_in_pieces()
        curve = PathHeights(driven, self._workspace.machine.geometry)
        curve = curve.at_speeds(1.0, None, limits.platform_speed)
        less = limits.times(*(_OF_LINE_IN_MOTION if start.speed > 0.0 else _OF_LINE))
        with SOUND:
            left = plan.scaling.since(time)
            found = yield from plan_window(curve, start, less, hurried_from=left)
        parts = yield from self._going_on_to_the_end(found, Planned(less))
        scaling = TimeScaling.joined([part.scaling for part in parts])
        if not scaling.times[-1] < _WORTH_IT * (plan.duration - time):
            raise PlanningError("no motion is sooner at the end of the line")
        try:
            return (yield from checked(LinePlan(line, scaling), limits))
        except SliderLimitError as error:
            if start.speed > 0.0:
                raise
            slower = scaling.slower(error.slowdown * ABOVE_ROUNDING)
        return (yield from checked(LinePlan(line, slower), limits))

    def brake_hard(
        self, plan: PathPlan, time: float, limits: SliderLimits, longest: float
    ) -> Interruptible[PathPlan]:
        """Return the hardest braking on the path, from a ``time`` in a ``plan`` on [s].

        It takes a millisecond, and there is none where the path bends too much.

        Raises:
            KinematicsError: if it does not keep all limits, or takes more than ``longest`` [s].
        """
        curve, start = plan.heights, plan.on_curve(time)
        with SOUND:
            stop = _next_stop(curve, start.place)
            scaling = hardest_braking(curve, start, limits, until=stop, longest=longest)
            yield
            check_along(curve, scaling, limits, above=_ABOVE_SPEED)
            found = PathPlan(curve, scaling)
        # Its few pieces bound the speed only nearly.
        yield from check_added(found, limits)
        return found

    def brake(self, plan: PathPlan, time: float, limits: SliderLimits) -> Interruptible[PathPlan]:
        """Return a plan that comes to rest soon on the path, from a ``time`` in a ``plan`` [s].

        Raises:
            KinematicsError: if none keeps all limits just now.
        """
        try:
            return (yield from self.brake_hard(plan, time, limits, inf))
        except KinematicsError:
            yield
        with SOUND:
            return (yield from brake(plan.heights, plan.on_curve(time), limits))


def _shaped_corners(shaper: Shaper, limits: SliderLimits) -> ShapedCorners:
    """Return how corners are driven with a ``shaper``."""
    ahead = sum(a * max(shaper.delay - t, 0.0) for a, t in zip(shaper.amplitudes, shaper.times))
    slow = ROUNDED_WAY * ahead
    # The speed that a platform at rest can have after as long a time.
    acceleration, jerk = min(limits.acceleration), min(limits.jerk)
    if slow < 2.0 * acceleration / jerk:
        slowest = 0.25 * jerk * slow * slow
    else:
        slowest = acceleration * (slow - acceleration / jerk)
    rate = ROUNDED_SPEED * (1.0 - ROUNDED_PART) / ahead
    return ShapedCorners(ROUNDED_PART, rate, slowest, shaper.duration + 2.0 * slow)


class _MotionAhead(NamedTuple):
    """An estimate of the motion along a whole path.

    Attributes:
        heights: of the sliders along the path.
        limits: of the sliders.
        places: ascending. Shape (n,) [m].
        times: when the platform is there. Shape (n,) [s].
        speeds: there. Shape (n,) [m/s].
    """

    heights: PathHeights
    limits: SliderLimits
    places: FloatArray
    times: FloatArray
    speeds: FloatArray

    @classmethod
    def estimated(cls, heights: PathHeights, limits: SliderLimits) -> Interruptible[_MotionAhead]:
        """Estimate it, from stop to stop."""
        breaks, length = heights.breaks, heights.driven.length
        every = 1 + (len(breaks) + SAMPLES * len(heights.driven.stops)) // _PLACES_KEPT
        parts = [np.zeros((3, 1))]
        while parts[-1][0, -1] < length:
            place, time, speed = parts[-1][:, -1].tolist()
            stop = _next_stop(heights, place)
            first = int(np.searchsorted(breaks, place, "right"))
            end = min(float(breaks[min(first + _BREAKS_AHEAD, len(breaks) - 1)]), stop)
            places = samples(place, end, breaks[first : int(np.searchsorted(breaks, end))])
            places = ascending(np.append(places, 0.5 * (places[1:] + places[:-1])))
            yield
            seen = heights.derivatives(places)
            yield
            found = estimated(heights, places, seen, speed, limits, SHORTEST_CELL)
            last = len(places) - 1 if end == stop else int(_KEPT_AHEAD * len(places))
            kept = np.append(np.arange(0, last, every), last)
            times = time + found.each * found.cells
            parts.append(np.array((places, times, found.speeds))[:, kept])
            yield
        return cls(heights, limits, *np.concatenate(parts, axis=1))

    def duration(self, window: float) -> Interruptible[float]:
        """Return how long the motion takes, as estimated and then corrected by samples [s].

        Args:
            window: about how long a window is [s].

        Raises:
            PathTimingError: if no sample is found.
        """
        whole = float(self.times[-1])
        pairs = []
        for number in range(1, _MOST_SAMPLES + 1):
            pair = yield from self._sample(whole * (number * _SPREAD % 1.0), window)
            if pair is None:
                continue
            pairs.append(pair)
            planned, told = np.transpose(pairs)
            ratio = float(planned.sum() / told.sum())
            error = len(pairs) ** 0.5 * float(np.std(planned - ratio * told) / planned.sum())
            if len(pairs) >= _LEAST_SAMPLES and error <= _STANDARD_ERROR:
                break
        if not pairs:
            raise self.heights.timing_error(0.0, "no motion keeps the limits")
        return ratio * whole

    def _sample(self, time: float, window: float) -> Interruptible[tuple[float, float] | None]:
        """Return how long a part of a window takes, as planned and as estimated [s].

        Args:
            time: when it begins, as estimated; if a stop follows soon, it begins there [s].
            window: how soon that is [s].

        Returns:
            None if no motion is found that begins there.
        """
        here, there = np.interp((time, time + window), self.times, self.places).tolist()
        stop = _next_stop(self.heights, here)
        start = PathStart(stop, 0.0, 0.0)
        if stop > there or stop == self.places[-1]:
            speed = float(np.interp(time, self.times, self.speeds))
            start = PathStart(here, _PART_OF_SPEED * speed, 0.0)
        try:
            with SOUND:
                plan = yield from plan_window(self.heights, start, self.limits)
        except MotionError:
            return None
        since, until = (part * plan.duration for part in _COUNTED)
        if not start.speed > 0.0:
            since = 0.0
        if not plan.continue_at < plan.duration:
            until = plan.duration
        ways = plan.place(since), plan.place(until)
        return until - since, float(np.diff(np.interp(ways, self.places, self.times))[0])


def time_path(
    path: PlatformPath,
    workspace: Workspace,
    limits: SliderLimits,
    shaper: Shaping | None = None,
) -> Trajectory:
    """Return the motion along a path in nearly the least time, from rest to rest.

    Without a shaper it is the motion of a ``MotionEngine`` that follows the path from its start. It
    stops in corners that are not rounded; there it goes on at once, an engine with its next step.

    Args:
        path: of one segment at least.
        workspace: where the platform may be, and of which machine.
        limits: of the sliders.
        shaper: for the modes of vibration that the motion is to leave alone, or what chooses one
            for the places of the path. It cuts bends; the platform is as slow there as the
            tolerances ask for.

    Raises:
        KinematicsError: if a place of the path is outside the workspace, if no motion keeps the
            limits, if the path has no segment, or if a bend has no tolerance for a shaper.
    """
    planner = PathPlanner(workspace)
    heights = at_once(planner.begun(path, limits, shaper))
    if shaper is None:
        return at_once(planner.to_the_end(heights, Planned(limits)))
    chosen = shaper.covering(heights.driven.places())
    motion = at_once(
        planned_shaped(
            lambda less: planner.to_the_end(heights, less, chosen),
            limits,
            workspace.machine,
            chosen,
        )
    )
    motion.check_inside(workspace, limits)
    return motion


def plan_move(
    workspace: Workspace,
    limits: SliderLimits,
    start: Sequence[float],
    end: Sequence[float],
    *,
    kind: MotionKind = MotionKind.SLIDER,
    shaper: Shaping | None = None,
) -> Trajectory:
    """Return the motion of the platform from rest at one position to rest at another.

    Without a shaper it is the motion of a ``MotionEngine`` of this ``kind`` that moves from there
    and does not plan in pieces.

    Args:
        workspace: where the platform may be, and of which machine.
        limits: of the sliders.
        start: of the platform. Shape (3,) [m].
        end: of the platform. Shape (3,) [m].
        kind: slider moves bend, linear ones are straight lines.
        shaper: for the modes of vibration that the motion is to leave alone, or what chooses one
            for the places that it passes; lines stay straight.

    Raises:
        NotAChoiceError: if ``kind`` is no ``MotionKind``, but its name, for example.
        WrongShapeError: if a position has not three numbers.
        NotFiniteError: if one of them is NaN or infinite.
        KinematicsError: if a position or the way between is outside the workspace.
    """
    member("kind", kind, MotionKind)
    x, y, z = finite_vector("end", end, 3)
    heights = workspace.check_position(finite_vector("start", start, 3))
    workspace.check_position((x, y, z))
    planner = MotionPlanner(workspace, kind)
    state = SliderState(heights, AT_REST, AT_REST)
    region = planner.region(state)
    target = (x, y, z)
    with SOUND:
        if shaper is None:
            plan = at_once(planner.move(state, target, limits, region, moving=False))
            if isinstance(plan, LinePlan):
                with suppress(KinematicsError):
                    plan = at_once(PathPlanner(workspace).sooner(plan, 0.0, limits))
            return plan
        shaped = planned_shaped(
            lambda less: planner.move(state, target, less.limits, region, moving=False),
            limits,
            workspace.machine,
            shaper,
        )
        motion = at_once(shaped)
        motion.check_inside(region, limits)
        return motion
