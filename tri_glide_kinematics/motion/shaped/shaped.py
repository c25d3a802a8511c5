r"""Shaped trajectories: the platform moves as the mean of its motion at some earlier instants.

An input shaper makes of the platform's position $p(t)$ the position $\sum_k A_k\,p(t - t_k)$, with
impulses $A_k > 0$ whose sum is 1 (``shaping``). On a straight line that stays on the line, and as
the means of places inside a convex shape they are inside it. Of the limits of the sliders this says
nothing: they are proved for the shaped motion itself, with Taylor series in cells of time that are
made smaller where that is needed.

What was driven before belongs to it: the shaped motion remembers it as long as the shaper lasts.
"""

from __future__ import annotations

from abc import abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, partial
from math import ceil, hypot, inf, sqrt
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible, at_once
from tri_glide_kinematics.motion.errors import CutBendError, SliderLimitError
from tri_glide_kinematics.motion.limits import (
    AT_REST,
    ORDERS,
    QUANTITIES,
    RELATIVE_ROUNDING,
    SHORTEST_CELL,
    SampledPlan,
    Series,
    SliderLimits,
    SliderState,
    arms_of,
    dividing,
    heights_of,
    positions,
    quartered,
    slider_state,
)
from tri_glide_kinematics.motion.shaped.bends import (
    DrivenPart,
    PathDriven,
    along_one_path,
    path_driven,
)
from tri_glide_kinematics.motion.shaping import Shaper, Shaping
from tri_glide_kinematics.motion.trajectory import (
    MixedSeries,
    Trajectory,
    close_to,
    joined_series,
)
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import BoolArray, FloatArray, ascending
from tri_glide_kinematics.workspace import Workspace

# Largest numbers of cells that are looked at together, and of copies in cells of a motion along a
# curve, or of one of the sliders, which takes longer; and the least number of cells, as fewer of
# them take nearly as long.
CELLS_AT_ONCE = 64
COPIES_ALONG_CURVE, COPIES_OF_SLIDERS = 512, 128
LEAST_AT_ONCE = 12

# Knots that are closer are one: a jerk this long is below rounding [s].
SAME_TIME = 1e-11

# One impulse at once changes nothing.
_UNSHAPED = Shaper((0.0,), (1.0,))

# So long a motion is proved together to be inside the workspace, at most [s].
CHECKED_TOGETHER = 1.0

# Velocity, acceleration and jerk by the coefficients of a Taylor series.
_TO_DERIVATIVES = np.array((1.0, 2.0, 6.0))[:, np.newaxis, np.newaxis]

# Largest distance between the places of a plan and of one that goes on along its path [m].
APART = 1e-6

# Excess of a limit, as a part of it, above which it does not matter how large it is.
_COARSE = 0.1

# 4 (x - x^3) is no more than this, from -1 to 1: 8 / sqrt(27), rounded up.
_ABOVE_CHORD = 1.5397

# Number of attempts to plan a motion from rest to rest with limits that leave what shaping takes.
# Nothing waits for it; a few paths need more than five.
ATTEMPTS = 8

# How much more they leave, so that the next attempt keeps the limits though it is another motion:
# the excess counts with this power, and by this factor more; what is cut, by its own factor.
_POWER = 1.5
_MORE = 1.002
_LESS_CUT = 1.05


class Planned(NamedTuple):
    """What plans keep, so that the shaped motion keeps its limits.

    Attributes:
        limits: of the sliders.
        cut: the part that bends of a path are cut by, of what its tolerances leave.
    """

    limits: SliderLimits
    cut: float = 1.0


class LimitBounds(NamedTuple):
    """How much of the limits is used at most, by bounds.

    Attributes:
        use: parts of velocity, acceleration and jerk of each slider; NaN where no bound is known.
            Shape (3, 3).
        when: instants at which it is so much. Shape (3, 3) [s].
        cut: of a path, the part of what bends may be cut by.
        segment: of the path, where it is so much.
        added: parts of the added bounds. Shape (m,).
        added_at: instants at which it is so much. Shape (m,) [s].
    """

    use: FloatArray
    when: FloatArray
    cut: float
    segment: int
    added: FloatArray
    added_at: FloatArray

    @property
    def keeps_limits(self) -> bool:
        """Whether no limit may be exceeded."""
        return self.within(RELATIVE_ROUNDING)

    def within(self, rounding: float) -> bool:
        """Return whether no limit may be exceeded by more than this part of it."""
        most = 1.0 + rounding
        return bool((self.use <= most).all() and (self.added <= most).all() and self.cut <= 1.0)

    def check(self, limits: SliderLimits) -> None:
        """Raise an error if one of the ``limits`` may be exceeded.

        Raises:
            SliderLimitError: names the slider and the limit.
            AddedBoundError: names what an added bound is of, and the bound.
            CutBendError: names the segment.
        """
        for (quantity, unit), parts, bounds, when in zip(
            QUANTITIES, self.use, limits.table, self.when
        ):
            for slider, part in enumerate(parts.tolist()):
                if not part <= 1.0 + RELATIVE_ROUNDING:
                    bound, time = float(bounds[slider]), float(when[slider])
                    raise SliderLimitError(quantity, slider, part * bound, bound, unit, time)
        for added, part, time in zip(limits.added, self.added.tolist(), self.added_at.tolist()):
            if not part <= 1.0 + RELATIVE_ROUNDING:
                raise added.error(part, time)
        if not self.cut <= 1.0:
            raise CutBendError(self.segment, self.cut)

    def leaving(self, planned: Planned) -> Planned:
        """Return less than was ``planned`` with, by as much as the motion exceeds its limits."""

        def excess(part: FloatArray) -> FloatArray:
            return np.where(part > 1.0, part**_POWER * _MORE, 1.0)

        table = planned.limits.table / excess(self.use)
        parts = (1.0 / excess(self.added)).tolist()
        added = (bound.times(part) for bound, part in zip(planned.limits.added, parts))
        cut = planned.cut / (self.cut * _LESS_CUT) if self.cut > 1.0 else planned.cut
        return Planned(planned.limits.with_table(table).with_added(*added), cut)


class BoundedPlan(Trajectory):
    """A plan whose limits are proved by bounds of how much of them it uses."""

    @abstractmethod
    def limit_use(
        self, limits: SliderLimits, since: float = 0.0, region: Workspace | None = None
    ) -> Interruptible[LimitBounds]:
        """Return bounds of how much of the limits is used, from the time ``since`` [s] on.

        Where a bound is beyond a limit, or outside the travel in a ``region``, cells are made
        smaller, and so the bounds.
        """

    def check_sliders(self, limits: SliderLimits, since: float = 0.0) -> None:
        """Compare bounds of the derivatives with the limits.

        Raises:
            SliderLimitError: if a limit may be exceeded.
        """
        at_once(self.checking_sliders(limits, since))

    def checking_sliders(self, limits: SliderLimits, since: float = 0.0) -> Interruptible[None]:
        """Do the same, in pieces."""
        limits = limits.with_added()
        (yield from self.limit_use(limits, since)).check(limits)


class ShapedTrajectory(BoundedPlan):
    """The shaped motion of some plans, of which each takes over from the one before.

    Attributes:
        driven: ascending; the first begins at rest, or earlier than the shaper lasts.
        duration: time from now until all sliders rest [s].
        shaper: its impulses.
    """

    def __init__(self, machine: TriGlide, shaper: Shaper, driven: Sequence[DrivenPart]) -> None:
        """Shape the motion of a ``machine``."""
        self._machine = machine
        self._arms = arms_of(machine.geometry)
        self.shaper = shaper
        self.driven = tuple(driven)
        self._impulses = tuple(zip(shaper.amplitudes, shaper.times))
        # The state at rest, once it was asked for.
        self._final: SliderState | None = None
        # Before the first one begins there was rest where it begins.
        self._begins = [-inf, *(part.begin for part in self.driven[1:])]
        # Bounds of the heights and of the accelerations, from the look at the limits.
        self._extremes: tuple[FloatArray, FloatArray] | None = None
        self._extremes_for: Workspace | None = None
        self._acceleration = inf
        # Begin, end and acceleration of each cell that was looked at, in their order. Shape (3, n).
        self._cells = np.empty((3, 0))
        self.duration = max(self._end + shaper.duration, 0.0)

    @property
    def _end(self) -> float:
        """When the unshaped motion comes to rest [s]."""
        begin, plan, skipped = self.driven[-1]
        return max(begin + plan.duration - skipped, begin)

    def at(self, time: float) -> SliderState:
        """Return the setpoint at a ``time`` [s]; outside, that of the start or of the end."""
        if time >= self.duration:
            if self._final is not None:
                return self._final
            time = self.duration
        x = y = z = vx = vy = vz = ax = ay = az = 0.0
        for amplitude, delay in self._impulses:
            before = time - delay
            begin, plan, skipped = self.driven[bisect_right(self._begins, before) - 1]
            past = before - begin if before > begin else 0.0
            px, py, pz, ux, uy, uz, bx, by, bz = plan.platform_at(self._machine, past + skipped)
            x += amplitude * px
            y += amplitude * py
            z += amplitude * pz
            vx += amplitude * ux
            vy += amplitude * uy
            vz += amplitude * uz
            ax += amplitude * bx
            ay += amplitude * by
            az += amplitude * bz
        state = slider_state(self._arms, (x, y, z, vx, vy, vz, ax, ay, az))
        if time == self.duration:
            # Times are sums here, and the last copy may not be at its end yet but for rounding.
            self._final = state = SliderState(state.heights, AT_REST, AT_REST)
        return state

    def place(self, time: float) -> float:
        """Return the mean of the places on the path that the last plan leads along [m].

        What was driven before that path counts as the place where it begins.

        Args:
            time: of the setpoint [s].
        """
        parts = along_one_path(self.driven, APART)
        first = len(self.driven) - len(parts)
        if not parts:
            return 0.0
        mean = 0.0
        for amplitude, delay in self._impulses:
            before = time - delay
            # Before the first of these parts, the place where that begins.
            index = max(bisect_right(self._begins, before) - 1, first)
            begin, plan, skipped = parts[index - first]
            mean += amplitude * plan.place(max(before - begin, 0.0) + skipped)
        return mean

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints at many ``times``. Shape (n,) [s]."""
        half = np.zeros(len(times))
        position = self.platform_series(self._machine, np.asarray(times, dtype=np.float64), half)
        heights = heights_of(self._machine.geometry, position, half).values
        return SampledPlan(times, heights[0].T, heights[1].T, 2.0 * heights[2].T)

    def knots(self) -> FloatArray:
        """Return the instants from now on between which it is smooth."""
        ends = [*self._begins[1:], self._end]
        unshaped = np.concatenate(
            [
                np.clip(part.plan.knots() - part.skipped, 0.0, end - part.begin) + part.begin
                for part, end in zip(self.driven, ends)
            ]
        )
        knots = np.add.outer(np.array(self.shaper.times), unshaped)
        knots = ascending(np.clip(knots, 0.0, self.duration))
        return knots[np.diff(knots, prepend=-1.0) > SAME_TIME]

    def mixed_series(self, machine: TriGlide, times: FloatArray, half: FloatArray) -> MixedSeries:
        """Return Taylor series of the platform's position."""
        series = at_once(self._mean_series(machine, times, half))
        return series, np.zeros(len(times), dtype=bool)

    def _mean_series(
        self, machine: TriGlide, times: FloatArray, half: FloatArray
    ) -> Interruptible[Series]:
        """Return Taylor series of the platform's position, the mean of those of all copies."""
        delays = self.shaper.times
        before = -np.subtract.outer(delays, times).ravel()
        halves = np.tile(half, len(delays))
        owner = np.maximum(np.searchsorted(self._begins, before, side="right") - 1, 0)
        # Before the first part there was rest where it begins.
        past = np.array([part.begin - part.skipped for part in self.driven])
        plans = [part.plan for part in self.driven]
        mixed = yield from joined_series(plans, owner, machine, before - past[owner], halves)
        shape = (ORDERS, 3, len(delays), len(times))
        mean = (
            np.einsum("omkn,k->omn", each.reshape(shape), self.shaper.amplitudes)
            for each in positions(machine, *mixed, halves)
        )
        return Series(*mean)

    def limit_use(
        self, limits: SliderLimits, since: float = 0.0, region: Workspace | None = None
    ) -> Interruptible[LimitBounds]:
        """Return bounds of how much of the limits is used, by Taylor series in cells of time."""
        path = path_driven(self.driven)
        edges = self.knots()
        edges = ascending(np.append(edges[edges > since], since))
        middles, half = yield from dividing(edges, 1)
        most, when, known = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
        most_added, added_at, known_added = np.zeros((3, len(limits.added)))
        most_cut, cut_at = 0.0, 0.0
        cells = []
        lowest = highest = np.array(self.at(self.duration).heights)
        yield
        moving = (part.plan for part in self.driven if part.plan.duration > 0.0)
        is_along = all(plan.is_along_curve for plan in moving)
        copies = COPIES_ALONG_CURVE if is_along else COPIES_OF_SLIDERS
        together = max(min(CELLS_AT_ONCE, copies // len(self.shaper.times)), LEAST_AT_ONCE)
        while len(middles):
            settled = half <= 0.5 * SHORTEST_CELL
            for first in range(0, len(middles), together):
                some = slice(first, first + together)
                position = yield from self._mean_series(self._machine, middles[some], half[some])
                yield
                added = []
                for bound in limits.added:
                    added.append(bound.used(position, half[some]))
                    yield
                series = heights_of(self._machine.geometry, position, half[some])
                low, high = heights_within(series, half[some])
                table = limits.table[..., np.newaxis]
                there = np.abs(series.values[1:4]) * _TO_DERIVATIVES / table
                use = np.maximum(largest_of(series, half[some]) / table, there)
                cut_there, cut = self._cut(path, middles[some], half[some])
                known = np.fmax(known, np.fmax.reduce(there, axis=2))
                proved = (use <= close_to(known)[..., np.newaxis]).all(axis=(0, 1)) & (cut <= 1.0)
                if region is not None:
                    proved &= _between(low, high, region)
                # A limit exceeded in the middle of a cell is exceeded in smaller cells, too.
                exceeded = (there > 1.0 + _COARSE).any(axis=(0, 1)) | (cut_there > 1.0)
                use = np.where(exceeded, np.fmax(use, there), use)
                for number, each in enumerate(added):
                    known_added[number] = np.fmax(known_added[number], np.fmax.reduce(each.middle))
                    proved &= each.most <= close_to(known_added[number])
                    broken = each.middle > 1.0 + _COARSE
                    # No smaller cells for the other limits; what they would show is not known.
                    use = np.where(broken & ~exceeded, there, use)
                    exceeded |= broken
                settled[some] |= proved | exceeded
                chosen = settled[some]
                if chosen.any():
                    accelerations = np.hypot.reduce(use[1] * limits.table[1][:, np.newaxis])
                    ends = middles[some] - half[some], middles[some] + half[some]
                    cells.append(np.array((*ends, accelerations))[:, chosen])
                    lowest = np.minimum(lowest, low[:, chosen].min(axis=1))
                    highest = np.maximum(highest, high[:, chosen].max(axis=1))
                    index = use[..., chosen].argmax(axis=-1)[..., np.newaxis]
                    found = np.take_along_axis(use[..., chosen], index, axis=-1)[..., 0]
                    # An unknown cut counts as more, and stays unknown.
                    worst = int(cut[chosen].argmax())
                    if cut[chosen][worst] > most_cut:
                        most_cut = float(cut[chosen][worst])
                        cut_at = float(middles[some][chosen][worst])
                    for number, each in enumerate(added):
                        parts = each.most[chosen]
                        if not parts[parts.argmax()] <= most_added[number]:
                            most_added[number] = parts[parts.argmax()]
                            added_at[number] = middles[some][chosen][parts.argmax()]
                    more = ~(found <= most) & ~np.isnan(most)
                    most = np.where(more, found, most)
                    when = np.where(more, middles[some][chosen][index[..., 0]], when)
                yield
            middles, half = quartered(middles[~settled], half[~settled])
        self._extremes, self._extremes_for = (lowest, highest), region
        self._acceleration = float(np.nan_to_num(hypot(*(most[1] * limits.table[1])), nan=inf))
        found = np.concatenate((self._cells[:, :0], *cells), axis=1)
        self._cells = found[:, found[0].argsort()]
        segment = path.segment(cut_at - self.shaper.delay) if path else 0
        return LimitBounds(most, when, most_cut, segment, most_added, added_at)

    def _cut(
        self, path: PathDriven | None, times: FloatArray, half: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return how much bends of a ``path`` are cut; see ``PathDriven.cut``."""
        if path is None:
            return np.zeros(len(times)), np.zeros(len(times))
        before = np.subtract.outer(times, self.shaper.times).T
        return path.cut(before, half, np.array(self.shaper.amplitudes))

    def checking_inside(self, region: Workspace, limits: SliderLimits) -> Interruptible[None]:
        """Check travel, and the way; of a line, until it is left no more."""
        # A closer look tells nothing new if the look at the limits was for this region.
        is_known = self._extremes is not None and self._extremes_for is region
        if not is_known and (self._extremes is None or not _between(*self._extremes, region)):
            at_once(self.limit_use(limits, 0.0, region))
        assert self._extremes is not None
        self.check_travel(*self._extremes, region)
        begin, plan, skipped = self.driven[-1]
        # From then on the mean is a place of that line, which was checked with its plan.
        on_line = begin + max(plan.straight_from - skipped, 0.0) + self.shaper.duration
        until = min(self.duration, on_line)
        if until <= 0.0:
            return
        most = hypot(*limits.acceleration)
        for begin, end, acceleration in self._checked_together(until, most):
            yield
            yield from region.path_check(partial(self._since, begin), end - begin, acceleration)

    def _checked_together(self, until: float, most: float) -> Iterator[tuple[float, float, float]]:
        """Yield what is checked together: begin, end [s] and acceleration [m/s^2].

        A long motion needs more samples than one that can be decided on at once; where it is slow
        and steady it has small accelerations, and so needs few of them.
        """
        allowed = most * CHECKED_TOGETHER**2
        acceleration = min(most, self._acceleration)
        if acceleration * until**2 <= allowed:
            yield 0.0, until, acceleration
            return
        # The motion before the cells was driven before, and keeps the limits.
        ends = np.minimum(np.append(self._cells[0, :1], (*self._cells[1], until)), until)
        accelerations = np.fmin((most, *self._cells[2], most), most)
        begin = end = largest = 0.0
        for cell_end, of_cell in zip((*ends.tolist(), inf), (*accelerations.tolist(), most)):
            if cell_end <= end:
                continue
            together = max(largest, of_cell)
            if end > begin and not together * (cell_end - begin) ** 2 <= allowed:
                # A cell may be too long, too.
                count = ceil(sqrt(largest / allowed) * (end - begin)) or 1
                step = (end - begin) / count
                yield from (
                    (begin + part * step, begin + (part + 1) * step, largest)
                    for part in range(count)
                )
                begin, together = end, of_cell
            end, largest = cell_end, together

    def _since(self, begin: float, time: float) -> SliderState:
        return self.at(begin + time)


class SeriesPlan(BoundedPlan):
    """A plan of which setpoints and Taylor series are known; they prove all the rest."""

    def __init__(self, machine: TriGlide, duration: float) -> None:
        """Move the sliders of a ``machine`` for a ``duration`` [s]."""
        self._machine = machine
        self.duration = duration

    @cached_property
    def _proof(self) -> ShapedTrajectory:
        """The same motion, as it is proved."""
        return ShapedTrajectory(self._machine, _UNSHAPED, (DrivenPart(0.0, self, 0.0),))

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints at many ``times``. Shape (n,) [s]."""
        states = [self.at(time) for time in np.asarray(times).tolist()]
        return SampledPlan(times, *np.array(states).reshape(-1, 3, 3).transpose(1, 0, 2))

    def limit_use(
        self, limits: SliderLimits, since: float = 0.0, region: Workspace | None = None
    ) -> Interruptible[LimitBounds]:
        """Return bounds of how much of the limits is used, from the time ``since`` [s] on."""
        return self._proof.limit_use(limits, since, region)

    def checking_inside(self, region: Workspace, limits: SliderLimits) -> Interruptible[None]:
        """Check travel and the way."""
        return self._proof.checking_inside(region, limits)


def _between(lowest: FloatArray, highest: FloatArray, region: Workspace) -> BoolArray:
    """Return whether heights are inside the travel, for shapes (3,) or (3, n) [m]. Shape (n,)."""
    travel = region.limits
    inside = (lowest.T >= travel.lower_heights) & (highest.T <= travel.upper_heights)
    return np.asarray(inside.all(axis=-1))


def heights_within(series: Series, half: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return bounds of heights in cells, from below and from above. Each (m, n) [m].

    Args:
        series: of the heights. Shape (6, m, n) [m].
        half: of the lengths of the cells. Shape (n,) [s].
    """
    powers = half ** np.arange(6.0)[:, np.newaxis]
    c0, c1, c2, c3, c4, _ = series.values * powers[:, np.newaxis]
    rest = series.bounds[5] * powers[5]
    sizes = np.abs((c1, c2, c3, c4))
    turns = sizes[0] < 2.0 * sizes[1] + 3.0 * sizes[2] + 4.0 * sizes[3] + 5.0 * rest
    beyond = np.abs(c1 + c3) + np.where(turns, sizes[1:].sum(axis=0), 0.0) + rest
    middle = c0 + c2 + c4
    return middle - beyond, middle + beyond


def largest_of(series: Series, half: FloatArray) -> FloatArray:
    """Return bounds of velocities, accelerations and jerks in cells. Shape (3, m, n).

    Args:
        series: of some quantities. Shape (6, m, n).
        half: of the lengths of the cells. Shape (n,) [s].
    """
    _, c1, c2, c3, c4, _ = series.values
    rest = series.bounds[5] * half**3
    a2, a3, a4 = c2 * half, c3 * half**2, c4 * half**3
    # At the ends; within, by how much each is above the straight line between these.
    even, odd = c1 + 3.0 * a3, 2.0 * a2 + 4.0 * a4
    velocity = np.abs(even) + np.abs(odd)
    turns = np.abs(a2) < 3.0 * np.abs(a3) + 6.0 * np.abs(a4) + 10.0 * rest * half
    # A parabola that turns between the ends: where a motion begins to brake that is as fast as
    # allowed, it turns at an end, and there is nothing to add.
    bend = 3.0 * np.abs(a3)
    missing = np.maximum(bend - np.abs(a2 + 2.0 * a4), 0.0)
    above = missing * (missing / np.where(bend > 0.0, bend, 1.0))
    velocity += np.where(turns, above + _ABOVE_CHORD * np.abs(a4), 0.0) + 5.0 * rest * half
    acceleration = np.abs(2.0 * c2 + 12.0 * c4 * half**2) + np.abs(6.0 * c3 * half)
    acceleration += 12.0 * np.abs(c4) * half**2 + 20.0 * rest
    jerk = np.abs(6.0 * c3) + np.abs(24.0 * c4) * half + 60.0 * series.bounds[5] * half**2
    return np.array((velocity, acceleration, jerk))


def planned_shaped(
    plan: Callable[[Planned], Interruptible[Trajectory]],
    limits: SliderLimits,
    machine: TriGlide,
    shaping: Shaping,
) -> Interruptible[ShapedTrajectory]:
    """Return a plan, shaped, that keeps the ``limits``; it begins now.

    Shaping takes some of the limits, as the sliders' ratios change on the way: nothing on lines as
    a rule, some percent else. Where the shaped plan exceeds one, it is planned again for less.

    Args:
        plan: returns a plan that keeps what it is given.
        limits: that the shaped plan has to keep.
        machine: whose sliders move.
        shaping: its impulses, or what chooses them for the places that it passes.

    Raises:
        SliderLimitError: if no plan keeps them.
        KinematicsError: if there is no plan.
    """
    planned = Planned(limits)
    for _ in range(ATTEMPTS):
        unshaped = yield from plan(planned)
        shaper = shaping.covering(unshaped.places(machine))
        shaped = ShapedTrajectory(machine, shaper, _one_after_the_other(unshaped))
        use = yield from shaped.limit_use(limits)
        if use.keeps_limits:
            break
        planned = use.leaving(planned)
    use.check(limits)
    return shaped


def _one_after_the_other(plan: Trajectory) -> list[DrivenPart]:
    """Return the trajectories that a ``plan`` is made of, which begins now."""
    begin, driven = 0.0, []
    for part, past in plan.parts(0.0) or [(plan, 0.0)]:
        driven.append(DrivenPart(begin, part, past))
        begin += part.duration - past
    return driven
