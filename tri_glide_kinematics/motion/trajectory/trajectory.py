"""A trajectory: a motion of the sliders up to rest that can be asked whether it keeps all limits.

Each check raises the error that names what would be broken, where and by how much. Where there are
added bounds, motions are made anew with parts of the limits until they keep them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from itertools import accumulate
from math import inf
from typing import ClassVar, NamedTuple, TypeVar

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible, at_once, blocks
from tri_glide_kinematics.motion.errors import LimitError, SliderTravelError
from tri_glide_kinematics.motion.limits import (
    ORDERS,
    RELATIVE_ROUNDING,
    TRAVEL_ROUNDING,
    AddedBound,
    SampledPlan,
    Series,
    SliderLimits,
    SliderState,
    divided,
    positions,
    quartered,
)
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import BoolArray, FloatArray, Indices, ascending
from tri_glide_kinematics.wording import number_text
from tri_glide_kinematics.workspace import Workspace

# Parts of its time at which it is looked where a motion leads.
PARTS = np.linspace(0.0, 1.0, 65)

Motion = TypeVar("Motion", bound="Trajectory")

# Taylor series in cells, of slider heights or of the platform's position, and in which of the cells
# they are of the heights.
MixedSeries = tuple[Series, BoolArray]

# Number of cells that are looked at between two breaks: that takes a millisecond at most.
CELLS_AT_ONCE = 64

# Between two knots there are so many at first, at most.
_CELLS_BETWEEN = 4

# How much is used is known to this part, where it is more than is allowed.
_CLOSE = 1e-6

# Cells are not made shorter than this [s].
_SHORTEST = 0.0005


class Trajectory(ABC):
    """A motion of the sliders up to rest; heights, velocities and accelerations are continuous.

    Attributes:
        duration: time from the start until all sliders rest [s].
        is_along_curve: whether the platform moves along one curve.
    """

    __slots__ = ()

    duration: float
    is_along_curve: ClassVar[bool] = False

    @property
    def straight_from(self) -> float:
        """From when on the platform is on one straight line; infinite where there is none [s]."""
        return inf

    def __repr__(self) -> str:
        """Return its kind and how long it takes."""
        return f"<{type(self).__name__}, {number_text(self.duration)} s>"

    @abstractmethod
    def at(self, time: float) -> SliderState:
        """Return the setpoint at a ``time`` [s]; outside, that of the start or of the end."""

    @abstractmethod
    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints at many ``times``. Shape (n,) [s]."""

    def check_limits(self, limits: SliderLimits, since: float = 0.0) -> None:
        """Raise an error if a limit or an added bound may be exceeded from ``since`` [s] on.

        Raises:
            SliderLimitError: names the slider and the limit.
            AddedBoundError: names what is bounded, and the bound.
            PlanningError: if the platform would go back along its line or path.
        """
        at_once(checked(self, limits, since))

    @abstractmethod
    def check_sliders(self, limits: SliderLimits, since: float = 0.0) -> None:
        """Raise an error if a limit of a slider may be exceeded from the time ``since`` [s] on.

        Raises:
            SliderLimitError: names the slider and the limit.
            PlanningError: if the platform would go back along its line or path.
        """

    def checking_sliders(self, limits: SliderLimits, since: float = 0.0) -> Interruptible[None]:
        """Do what ``check_sliders`` does, in pieces where it takes long."""
        self.check_sliders(limits, since)
        return
        yield

    @abstractmethod
    def checking_inside(self, region: Workspace, limits: SliderLimits) -> Interruptible[None]:
        """Do what ``check_inside`` does, in pieces."""

    @abstractmethod
    def knots(self) -> FloatArray:
        """Return the ascending instants between which it is smooth, its end among them [s]."""

    @abstractmethod
    def mixed_series(self, machine: TriGlide, times: FloatArray, half: FloatArray) -> MixedSeries:
        """Return Taylor series in cells: of the slider heights, or of the platform's position.

        Args:
            machine: whose sliders move.
            times: middles of the cells, each between two knots, or outside. Shape (n,) [s].
            half: of the lengths of the cells. Shape (n,) [s].

        Returns:
            The series [m], and in which cells they are of the heights. Shape (n,).
        """

    def platform_series(self, machine: TriGlide, times: FloatArray, half: FloatArray) -> Series:
        """Return Taylor series of the platform's position [m]; see ``mixed_series``."""
        return positions(machine, *self.mixed_series(machine, times, half), half)

    def places(self, machine: TriGlide) -> FloatArray:
        """Return places that the platform passes, the first and the last among them.

        Args:
            machine: whose sliders move.

        Returns:
            Shape (n, 3) [m].
        """
        return machine.forward_batch(self.sample(self.duration * PARTS).heights)

    def platform_at(self, machine: TriGlide, time: float) -> tuple[float, ...]:
        """Return how the platform moves at a ``time`` [s]; outside, as at the start or at the end.

        Returns:
            Nine plain numbers: position [m], velocity [m/s] and acceleration [m/s^2].

        Raises:
            NoPoseError: if no pose belongs to the heights.
        """
        return machine.forward_motion(*self.at(time))

    def keeps_limits(self, limits: SliderLimits, since: float = 0.0) -> bool:
        """Return whether ``limits`` hold from the time ``since`` [s] on."""
        try:
            self.check_limits(limits, since)
        except LimitError:
            return False
        return True

    def check_inside(self, region: Workspace, limits: SliderLimits) -> None:
        """Raise an error if the sliders leave their travel, or the platform its workspace.

        Args:
            region: where the platform may be, and the ends of the travel.
            limits: of the sliders, which the trajectory keeps.

        Raises:
            SliderTravelError: if a slider leaves its travel.
            KinematicsError: if the platform leaves the ``region``.
        """
        at_once(self.checking_inside(region, limits))

    def check_travel(
        self,
        lowest: Sequence[float] | FloatArray,
        highest: Sequence[float] | FloatArray,
        region: Workspace,
    ) -> None:
        """Raise an error if a slider leaves its travel, or goes on where it is outside already.

        Args:
            lowest: heights of the sliders on the way. Shape (3,) [m].
            highest: likewise. Shape (3,) [m].
            region: its limits hold the ends of the travel, though it may be wider.

        Raises:
            SliderTravelError: names the slider.
        """
        heights, travel = self.at(0.0).heights, region.limits
        for i in range(3):
            lower = min(travel.lower_heights[i], heights[i]) - TRAVEL_ROUNDING
            upper = max(travel.upper_heights[i], heights[i]) + TRAVEL_ROUNDING
            if not lower <= lowest[i]:
                raise SliderTravelError(i, float(lowest[i]), travel.lower_heights[i])
            if not highest[i] <= upper:
                raise SliderTravelError(i, float(highest[i]), travel.upper_heights[i])

    def parts(self, time: float) -> list[tuple[Trajectory, float]]:
        """Return the trajectories that it is made of, and how much of each is past at ``time`` [s].

        Of several, those that are over are left out.
        """
        return [(self, time)]


class SequencePlan(Trajectory):
    """One plan after the other; each ends where the next begins, and the last one at rest."""

    def __init__(self, plans: Sequence[Trajectory], skipped: float = 0.0) -> None:
        """Join the ``plans``, of whose first one ``skipped`` seconds are past already."""
        first, *others = plans
        parts = first.parts(0.0) or [(first, 0.0)]
        plans = (*(plan for plan, _ in parts), *others)
        skipped += parts[0][1]
        ends = list(accumulate(plan.duration for plan in plans))
        past = min(bisect_right(ends, skipped), len(plans) - 1)
        begin = ends[past - 1] if past else 0.0
        self._plans = tuple(plans[past:])
        self._skipped = skipped - begin
        self._ends = [end - begin for end in ends[past:]]
        self.duration = max(self._ends[-1] - self._skipped, 0.0)

    def at(self, time: float) -> SliderState:
        """Return the setpoint ``time`` seconds after the start; after the end, that of the end."""
        plan, time = self._plan_at(time)
        return plan.at(time)

    def platform_at(self, machine: TriGlide, time: float) -> tuple[float, ...]:
        """Return how the platform moves at a ``time`` [s]."""
        plan, time = self._plan_at(time)
        return plan.platform_at(machine, time)

    def _plan_at(self, time: float) -> tuple[Trajectory, float]:
        """Return which plan is driven at a ``time``, and how much of it is past [s]."""
        if time >= self.duration:
            # Times are sums here, and the last plan may not be over yet but for rounding.
            return self._plans[-1], self._plans[-1].duration
        time += self._skipped
        index = min(bisect_right(self._ends, time), len(self._plans) - 1)
        return self._plans[index], time - self._ends[index - 1] if index else time

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints at many ``times``. Shape (n,) [s]."""
        owner, past = self._plans_at(times)
        sampled = SampledPlan(times, *(np.empty((len(times), 3)) for _ in range(3)))
        for index in sorted(set(owner.tolist())):
            mine = owner == index
            part = self._plans[index].sample(past[mine])
            for values, of_part in zip(sampled[1:], part[1:]):
                values[mine] = of_part
        return sampled

    def check_sliders(self, limits: SliderLimits, since: float = 0.0) -> None:
        """Check what is left of each plan, as that does."""
        at_once(self.checking_sliders(limits, since))

    def checking_sliders(self, limits: SliderLimits, since: float = 0.0) -> Interruptible[None]:
        """Do the same, in pieces."""
        for number, (plan, past) in enumerate(self.parts(since)):
            if number:
                yield
            yield from plan.checking_sliders(limits, past)

    def checking_inside(self, region: Workspace, limits: SliderLimits) -> Interruptible[None]:
        """Check each plan."""
        for plan in self._plans:
            yield from plan.checking_inside(region, limits)

    def knots(self) -> FloatArray:
        """Return the instants between which it is smooth."""
        begins = [-self._skipped, *(end - self._skipped for end in self._ends)]
        knots = [
            np.append(plan.knots()[plan.knots() < end - begin] + begin, end)
            for plan, begin, end in zip(self._plans, begins, begins[1:])
        ]
        return ascending(np.concatenate(knots))

    def mixed_series(self, machine: TriGlide, times: FloatArray, half: FloatArray) -> MixedSeries:
        """Return Taylor series, each from the plan that it lies in."""
        owner, past = self._plans_at(times)
        return at_once(joined_series(self._plans, owner, machine, past, half))

    def _plans_at(self, times: FloatArray) -> tuple[Indices, FloatArray]:
        """Return which plan is driven at each of many ``times``, and how much of it is past [s]."""
        shifted = times + self._skipped
        owner = np.minimum(np.searchsorted(self._ends, shifted, side="right"), len(self._plans) - 1)
        return owner, shifted - np.array([0.0, *self._ends[:-1]])[owner]

    def parts(self, time: float) -> list[tuple[Trajectory, float]]:
        """Return the plans that are not over at ``time`` [s], and how much of each is past."""
        time += self._skipped
        begins = [0.0, *self._ends]
        return [
            (plan, max(time - begin, 0.0))
            for plan, begin, end in zip(self._plans, begins, self._ends)
            if end > time
        ]


# Series of so many cells take half a millisecond.
CELLS_IN_PIECE = 60


def joined_series(
    plans: Sequence[Trajectory],
    owner: Indices,
    machine: TriGlide,
    times: FloatArray,
    half: FloatArray,
) -> Interruptible[MixedSeries]:
    """Return Taylor series in cells, each of one of several plans; see ``Trajectory.mixed_series``.

    Args:
        plans: the plans.
        owner: the index of the plan of each cell. Shape (n,).
        machine: whose sliders move.
        times: middles of the cells, each in its plan. Shape (n,) [s].
        half: of the lengths of the cells. Shape (n,) [s].
    """
    series = Series(*np.empty((2, ORDERS, 3, len(times))))
    of_sliders = np.empty(len(times), dtype=bool)
    cells = 0
    for index in sorted(set(owner.tolist())):
        mine = owner == index
        part, of_sliders[mine] = plans[index].mixed_series(machine, times[mine], half[mine])
        series.put(mine, part)
        cells += int(np.count_nonzero(mine))
        if cells >= CELLS_IN_PIECE:
            yield
            cells = 0
    return series, of_sliders


class AddedUse(NamedTuple):
    """How much of an added bound a motion uses at most, by bounds.

    Attributes:
        part: an upper bound; NaN where nothing is known.
        time: when [s].
    """

    part: float
    time: float


def added_use(
    trajectory: Trajectory, bound: AddedBound, since: float = 0.0, until: float = inf
) -> Interruptible[AddedUse]:
    """Return which part of an added ``bound`` a motion uses at most between two instants [s].

    Where it may be exceeded, cells are made smaller, and so the bounds. Where a middle uses more
    than is allowed, no cell is made smaller that cannot use more than that. So only cells about the
    largest use are, and there are few of them however long the motion takes.
    """
    edges = trajectory.knots()
    until = min(until, trajectory.duration)
    inside = edges[(edges > since) & (edges < until)]
    edges = ascending(np.concatenate(((since,), inside, (max(until, since),))))
    middles, half = divided(edges, _CELLS_BETWEEN, _CELLS_BETWEEN)
    part, time, known = 0.0, since, 0.0
    while len(middles):
        most, middle = np.empty((2, len(middles)))
        for some in blocks(len(middles), CELLS_AT_ONCE):
            yield
            with np.errstate(invalid="ignore"):
                series = trajectory.platform_series(bound.machine, middles[some], half[some])
            yield
            with np.errstate(invalid="ignore"):
                most[some], middle[some] = bound.used(series, half[some])
        known = float(np.fmax(known, np.fmax.reduce(middle)))
        settled = (half <= 0.5 * _SHORTEST) | (most <= close_to(known))
        found = np.where(settled, most, 0.0)
        worst = int(found.argmax())
        # An unknown use counts as more, and stays unknown.
        if not found[worst] <= part and part == part:
            part, time = float(found[worst]), float(middles[worst])
        middles, half = quartered(middles[~settled], half[~settled])
    return AddedUse(part, time)


def close_to(known: float | FloatArray) -> FloatArray:
    """Return what a cell may use at most, by bounds, so that no smaller ones are looked at.

    Args:
        known: which part is used somewhere. Of any shape, as the result.
    """
    part = np.where(known > 1.0 + RELATIVE_ROUNDING, known * (1.0 + _CLOSE), 1.0)
    return np.asarray(part * (1.0 + RELATIVE_ROUNDING))


def checked(motion: Motion, limits: SliderLimits, since: float = 0.0) -> Interruptible[Motion]:
    """Return a ``motion`` that keeps limits and added bounds; see ``Trajectory.check_limits``."""
    yield from motion.checking_sliders(limits, since)
    yield from check_added(motion, limits, since)
    return motion


def check_added(
    trajectory: Trajectory, limits: SliderLimits, since: float = 0.0
) -> Interruptible[None]:
    """Raise an error if a motion may exceed one of the added bounds from ``since`` [s] on.

    Raises:
        AddedBoundError: names what would be exceeded, and the bound.
    """
    for bound in limits.added:
        if since < trajectory.duration:
            use = yield from added_use(trajectory, bound, since)
            if not use.part <= 1.0 + RELATIVE_ROUNDING:
                raise bound.error(use.part, use.time)


# A motion leaves this part of a bound beyond what it exceeded, so that the next one keeps it; and
# with each attempt so many times as much.
_SPARE = 1e-6
_MORE_TO_SPARE = 3.0


class UsableParts(NamedTuple):
    """Which parts of the limits a motion from rest to rest can use where there are added bounds.

    Attributes:
        velocity: in (0, 1].
        rising: of the accelerations while it gets faster, in (0, 1].
        braking: of the accelerations while it gets slower, in (0, 1].
        slower: the whole motion takes so many times as long.
    """

    velocity: float = 1.0
    rising: float = 1.0
    braking: float = 1.0
    slower: float = 1.0

    def after(
        self, motion: Trajectory, fastest: float, limits: SliderLimits, attempt: int
    ) -> Interruptible[UsableParts]:
        """Return less, by as much as a ``motion`` with these exceeds the added bounds.

        Args:
            motion: from rest to rest.
            fastest: when it is so [s].
            limits: with the added bounds.
            attempt: how many there were before. Late ones are slower as a whole: that takes longer,
                but makes all forces smaller that come of the motion, those of its speed, too.

        Raises:
            AddedBoundError: if a part of a bound is not known.
        """
        velocity, rising, braking, slower = self
        spare = _SPARE * _MORE_TO_SPARE**attempt
        for bound in limits.added:
            before = yield from added_use(motion, bound, 0.0, fastest)
            behind = yield from added_use(motion, bound, fastest)
            first, last = before.part, behind.part
            for use in (before, behind):
                if use.part != use.part:
                    raise bound.error(use.part, use.time)
            if attempt >= _STRETCHED:
                slower /= _left(max(first, last), spare) ** (1.0 / bound.order)
            elif bound.order == 1:
                velocity *= _left(max(first, last), spare)
            else:
                rising, braking = rising * _left(first, spare), braking * _left(last, spare)
        return UsableParts(velocity, rising, braking, slower)


def _left(part: float, spare: float) -> float:
    """Return by which factor less is to be used where a ``part`` of a bound is."""
    return (1.0 - spare) / part if part > 1.0 + RELATIVE_ROUNDING else 1.0


# Number of attempts to make a motion that keeps the added bounds, each with other parts of its
# limits.
ATTEMPTS = 10

# From this attempt on the whole motion is made slower.
_STRETCHED = 5


def kept(
    plan: Callable[[UsableParts], tuple[Motion, float]], limits: SliderLimits
) -> Interruptible[Motion]:
    """Return a motion from rest to rest that is proved to keep all added bounds.

    Args:
        plan: makes the motion with parts of the limits, and tells when it is fastest [s].
        limits: with the added bounds.

    Raises:
        AddedBoundError: if a part of a bound is not known, or none keeps it after some attempts.
        KinematicsError: if there is no plan.
    """
    usable = UsableParts()
    motion, fastest = plan(usable)
    for attempt in range(ATTEMPTS if limits.added else 0):
        yield
        less = yield from usable.after(motion, fastest, limits, attempt)
        if less == usable:
            return motion
        usable = less
        motion, fastest = plan(usable)
    yield from check_added(motion, limits)
    return motion


# In motion where forces are bounded, one multiple after the other of the acceleration that they
# allow whichever way is tried, as the direction may allow more, and velocities ask for a part.
_MULTIPLES = (4.0, 2.0, 1.0, 0.5)


def gentler(limits: SliderLimits, state: SliderState) -> Iterator[SliderLimits]:
    """Yield ``limits``, and lower accelerations one after the other where forces are bounded.

    None are yielded twice: accelerations are no lower than the present ones.

    Args:
        limits: in force.
        state: where a motion begins; its accelerations stay within all of them.
    """
    yield limits
    allowed = min((bound.acceleration(state.heights) for bound in limits.added), default=inf)
    last = limits.table[1]
    for multiple in _MULTIPLES:
        lower = np.maximum(multiple * allowed, np.abs(state[2]))
        accelerations = np.minimum(limits.table[1], lower)
        if not np.array_equal(accelerations, last):
            last = accelerations
            table = limits.table.copy()
            table[1] = accelerations
            yield limits.with_table(table)
