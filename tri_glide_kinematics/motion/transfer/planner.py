r"""Plans transfers: legs from station to station, each in the frame that goes over between both.

A leg leads up from a station, across, and down to the next. It is planned like any path, in nearly
the least time, and carried: upright in the frame of the place that it leaves, then of the one that
it comes to. Both meet at an instant that depends on the leg, and the leg on the place that is met.
So the instant is found by iteration; where the sum exceeds a limit, the leg is made slower by as
much.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.limits import AT_REST, SliderLimits
from tri_glide_kinematics.motion.moves import inside
from tri_glide_kinematics.motion.path import PlatformPath, check_place
from tri_glide_kinematics.motion.path_timing import PathPlanner
from tri_glide_kinematics.motion.shaped import LimitBounds, Planned, SlowedPlan
from tri_glide_kinematics.motion.tracking import MovingTarget
from tri_glide_kinematics.motion.trajectory import (
    LinePlan,
    PathHeights,
    PathPlan,
    SequencePlan,
    StraightLine,
    TimeScaling,
    Trajectory,
)
from tri_glide_kinematics.motion.transfer.carried import Carriage, CarriedPlan, FrameState
from tri_glide_kinematics.motion.transfer.legs import (
    Leg,
    Station,
    TransferError,
    TransferPlan,
    end_of,
    frame_at,
    in_frame,
    on_slope,
    place_on,
    slope_of,
    stay,
)
from tri_glide_kinematics.vectors import (
    FloatArray,
    Vector3,
    ascending,
    combined,
    dot,
    minus,
    plus,
    scaled,
)
from tri_glide_kinematics.workspace import Workspace

# Parts of the limits of velocity, acceleration and jerk that the motion in a frame that moves is
# planned with: what is left is for the frame, whose motion may change on the way; and more of them
# where it does so already.
LEFT_TO_BASE = (0.96, 0.96, 0.92)
LEFT_IN_CHANGE = (0.9, 0.85, 0.78)

# Ways that differ by less are the same; a platform that is beside its station by less is above it
# [m].
SAME_WAY = 1e-6
BESIDE = 1e-5

# A corner is rounded by this part of the height above a station at most.
PART_OF_HEIGHT = 0.4

# Part of the time upright above a station in which the frame goes over.
PART_UPRIGHT = 0.4

# Number of instants at which it is looked when a leg leads upright, and whether it is inside.
LOOKS, QUICK_LOOKS = 200, 17

# A base leads to where the place is met, or so far from there [m]: the rest of the way is the
# frame's. After so many attempts there is none. At first it is guessed that so much of the time
# passes until the next station is met, or as much less that it takes to leave the last one.
AIMED = 0.012
ATTEMPTS = 12
PART_OF_GUESS = 0.05

# So often a base is planned for less of the limits that a leg exceeds, if it had to be slower by
# more than this factor else.
PLANNED_FOR_LESS, MUCH_SLOWER = 1, 1.015

# A leg that exceeds a limit is made slower by as much, and by this factor.
SPARE = 1.002

# The frame goes over from station to station in one of these parts of the time that it has: the
# longer it takes, the farther the base is beside the way of the platform.
PARTS_OF_LEG = (1.0, 0.5, 0.25)

# A leg is not made slower than by this factor.
SLOWEST = 1.6

# A leg to a place that it would be too fast for goes over to lower speeds in so long [s].
SLOWING = 0.15

# So often that is tried, each time slower by as much as it is too fast and by this factor.
SLOWER_ATTEMPTS, SLOWER_BY = 3, 1.02

# Knots are no closer than this: rounding would be divided by the cube of it [s].
SAME_KNOT = 1e-5

# A frame whose motion has changed is caught up with for so long at least [s], and with these parts
# of the limits of velocity, acceleration and jerk, as the rest is in use.
CATCHING_UP = 0.06
PARTS_FOR_MORE = (0.8, 0.4, 0.4)

# After a change that comes too late for the way down, the platform stays at the place for so much
# longer [s]; not for less than this part of what is allowed.
STAYS_LONGER, STAYS_FOR = (0.03, 0.06, 0.1), 0.5

# A place that is missed by this part of what is allowed is met.
UNSEEN = 0.1


class _TooFastError(TransferError):
    """A motion that would keep its limits if it were slower."""

    def __init__(self, reason: KinematicsError, slowdown: float) -> None:
        """Store the ``reason``, and how many times slower, about."""
        super().__init__(str(reason))
        self.reason, self.slowdown = reason, slowdown


@dataclass(frozen=True, eq=False)
class TransferPlanner:
    """Plans transfers inside one workspace.

    Attributes:
        workspace: where the platform may be, and of which machine.
        height: of the platform between stations, by z; stations may be higher [m].
        tolerance: how far the platform may be from a corner of its way [m].
    """

    workspace: Workspace
    height: float
    tolerance: float

    def planned(
        self,
        start: Vector3,
        stations: Sequence[Station],
        age: float,
        limits: SliderLimits,
        *,
        wait: float = 0.0,
        lifts: bool = True,
    ) -> Interruptible[TransferPlan]:
        """Return a plan from rest through all ``stations`` to rest.

        Args:
            start: of the platform. Shape (3,) [m].
            stations: in their order.
            age: time from that of the stations to the begin of the plan [s].
            limits: of the sliders.
            wait: rest before it begins [s].
            lifts: whether it goes up after the last station; after one that moves it does anyway.

        Raises:
            KinematicsError: if there is no plan.
        """
        legs: list[Leg] = []
        time, before = 0.0, Station(start, wait)
        here, frame = start, MovingTarget(start, AT_REST)
        for station in stations:
            rest = 0.0 if before.moves else before.dwell
            leg = yield from self._leg(here, frame, station, age + time, rest, limits)
            legs.append(leg)
            time += leg.plan.duration
            frame = station.after(age + time)
            here, before = frame.position, station
        if lifts or before.moves:
            rest = 0.0 if before.moves else before.dwell
            legs.append((yield from self._lift(here, frame, rest, limits)))
        elif before.dwell > 0.0:
            legs.append(stay(legs[-1], before.dwell))
        return TransferPlan(legs, wait=wait)

    def renewed(
        self,
        plan: TransferPlan,
        time: float,
        station: Station,
        age: float,
        limits: SliderLimits,
        allowed: float,
    ) -> Interruptible[TransferPlan | None]:
        """Return what is left of a ``plan`` with another motion of the station that it leads to.

        The way in the frame stays as it is, and so do its heights: whatever the other motion is,
        the place stays at the height, or on the slope, that it was planned for. Where it is not met
        in time, that way is driven slower; and where that does not do, the platform goes up.

        Args:
            plan: that is driven.
            time: in it, when the next one begins [s].
            station: how the place moves, and what is told there.
            age: time from that of the station to then [s].
            limits: of the sliders.
            allowed: so far from the place the platform may be at the arrival [m].

        Returns:
            The plan; None where it can stay as it is.

        Raises:
            KinematicsError: if there is none.
        """
        index, now = plan.present(time)
        leg = plan.legs[index]
        if not leg.moves or plan.gives_up is not None:
            return None
        end = leg.begin + leg.plan.duration
        # What is asked of the place is that it is met at the arrival, and kept to in the dwell.
        # After a late change it is met by the end of that, when a gripper has closed.
        instant = leg.arrival if now < leg.arrival else end
        there, last = (
            plus(frame_at(leg, each).displacement, end_of(leg.base)) for each in (instant, end)
        )
        place = on_slope(station.after(age - now), there, leg.slope)
        missed = math.dist(there, place.after(instant).position)
        missed_at_last = math.dist(last, place.after(end).position)
        # It may stay longer until something is told there, as to a gripper.
        told = leg.arrival + min((after for after, _ in station.outputs), default=0.0)
        if missed <= UNSEEN * allowed or now >= max(told, end - CATCHING_UP):
            return None
        refusal: KinematicsError | None = None
        held = plus(frame_at(leg, now).displacement, end_of(leg.base))
        off = math.dist(held, place.after(now).position)
        turned = math.dist(frame_at(leg, now).velocity, place.after(now).velocity)
        quickest = _time_for(off, turned, limits)
        latest = max(leg.arrival, now + CATCHING_UP)
        rate = 1.0
        for met in sorted({max(leg.upright, now + quickest), latest, end}):
            if met > end:
                continue
            try:
                carried = self._renewed_leg(leg, now, place, met)
                return (yield from self._met(plan, index, place, *carried, limits))
            except _TooFastError as error:
                refusal, rate = error.reason, 1.0 / error.slowdown
            except KinematicsError as error:
                refusal = error
            yield
        for _ in range(SLOWER_ATTEMPTS):
            if not SLOWEST * rate > 1.0 > rate or leg.arrival - now < SLOWING:
                break
            # It arrives later, on the same way in the frame.
            rate /= SLOWER_BY
            slower = _slower_leg(leg, now, rate)
            met = min(max(slower.upright, now + quickest), slower.arrival)
            try:
                carried = self._renewed_leg(slower, now, place, met)
                return (yield from self._met(plan, index, place, *carried, limits))
            except _TooFastError as error:
                refusal, rate = error.reason, rate / error.slowdown**2
            except KinematicsError as error:
                refusal = error
                break
            yield
        # The way down may need all jerk that there is: then it is caught up with at its end.
        stays = STAYS_LONGER if now < told and missed_at_last > STAYS_FOR * allowed else ()
        for longer in stays:
            later = leg._replace(arrival=leg.arrival + longer)
            try:
                carried = self._renewed_leg(later, now, place, later.arrival + later.dwell)
                return (yield from self._met(plan, index, place, *carried, limits))
            except KinematicsError as error:
                refusal = error
            yield
        if missed <= allowed:
            return None
        text = f"the place is missed by {1e3 * missed:.2g} mm, more than {1e3 * allowed:.2g} mm"
        reason = TransferError(text if refusal is None else f"{text}: {refusal}")
        return (yield from self.given_up(plan, time, limits, reason))

    def given_up(
        self, plan: TransferPlan, time: float, limits: SliderLimits, reason: KinematicsError
    ) -> Interruptible[TransferPlan]:
        """Return a plan that brakes on the way of a ``plan``, goes up from there, and rests.

        Args:
            plan: that is driven.
            time: in it, when that begins [s].
            limits: of the sliders.
            reason: why.

        Raises:
            KinematicsError: if there is none.
        """
        index, now = plan.present(time)
        leg = plan.legs[index]
        frame, base = frame_at(leg, now), leg.base
        refusal: KinematicsError = reason
        for gentler in (1.0, 1.6, math.inf):
            parts = list(self._stopped(in_frame(leg), base, now, gentler, limits))
            motion: Trajectory = SequencePlan(parts) if parts else in_frame(leg)
            ends, begins = (motion.duration, 0.0) if parts else (now, now)
            speed = math.hypot(*frame.velocity)
            duration = max(min(gentler, 2.5) * _time_for(0.0, speed, limits), ends - begins)
            rests = begins + duration
            still = combined(1.0, frame.displacement, 0.5 * duration, frame.velocity)
            still = combined(1.0, still, duration * duration / 12.0, frame.acceleration)
            carriage = Carriage((begins, rests), (frame, FrameState(still, AT_REST, AT_REST)))
            end = max(ends, rests)
            carried = CarriedPlan(self.workspace.machine, motion, carriage, end, begins)
            try:
                yield from self._proved(carried, limits)
                last = Leg(carried, base, 0.0, 0.0, math.inf, begins)
                return TransferPlan([last], plan.first + index, gives_up=reason)
            except KinematicsError as error:
                refusal = error
            yield
        raise refusal

    def _stopped(
        self,
        motion: Trajectory,
        base: PathPlan,
        now: float,
        gentler: float,
        limits: SliderLimits,
    ) -> Iterator[Trajectory]:
        """Yield a braking on the way of a ``motion`` in a frame, and the way up from there.

        Args:
            motion: that is driven.
            base: of the leg.
            now: time in the motion [s].
            gentler: the braking takes so many times as long as it should have to.
            limits: of the sliders.
        """
        machine, left = self.workspace.machine, motion.duration - now
        speed = math.hypot(*motion.platform_at(machine, now)[3:6])
        if left > 0.0 and speed > 0.0:
            duration = gentler * _time_for(0.0, speed, limits)
            if 0.5 * duration < left:
                yield SlowedPlan(machine, motion, now, duration)
                now += 0.5 * duration
            else:
                # It brakes already.
                yield SequencePlan((motion,), now)
                now = motion.duration
        x, y, z, *_ = motion.platform_at(machine, now)
        way = self.height - z
        if way > SAME_WAY:
            line = StraightLine(base.heights.geometry, (x, y, z), (0.0, 0.0, 1.0), way)
            times = np.array((0.0, _time_for(way, 0.0, limits)))
            ends = np.array((0.0, way))
            yield LinePlan(line, TimeScaling(times, ends, np.zeros(2), np.zeros(2)))

    def _renewed_leg(
        self, leg: Leg, now: float, place: MovingTarget, met: float
    ) -> tuple[Leg, CarriedPlan]:
        """Return a ``leg`` that meets a ``place``, as of the base's start, at a time in it [s]."""
        end = leg.arrival + leg.dwell
        present, goal = frame_at(leg, now), end_of(leg.base)
        carriage = self._carriage(present, now, place, goal, met, leg.arrival, end)
        carried = CarriedPlan(self.workspace.machine, leg.base, carriage, end, now)
        return leg._replace(plan=carried, begin=now), carried

    def _met(
        self,
        plan: TransferPlan,
        index: int,
        place: MovingTarget,
        leg: Leg,
        carried: CarriedPlan,
        limits: SliderLimits,
    ) -> Interruptible[TransferPlan]:
        """Return a ``plan`` with another ``leg``, if that keeps all limits.

        Raises:
            _TooFastError: if it is too fast.
            KinematicsError: if it leaves the workspace.
        """
        self._look(carried)
        use = yield from carried.limit_use(limits, 0.0, self.workspace)
        if not use.keeps_limits:
            try:
                use.check(limits)
            except KinematicsError as error:
                raise _TooFastError(error, _slowdown(use, limits)) from error
        yield from inside(carried, self.workspace, limits)
        legs = [leg]
        for following in plan.legs[index + 1 :]:
            if len(legs) == 1:
                frame = place.after(leg.begin + carried.duration)
                following = yield from self._following(following, frame, limits)
            legs.append(following)
        return TransferPlan(legs, plan.first + index)

    def _following(self, leg: Leg, frame: MovingTarget, limits: SliderLimits) -> Interruptible[Leg]:
        """Return a leg with another motion of the place that it begins at.

        Raises:
            KinematicsError: if there is none.
        """
        old, stretch = leg.plan, 1.0
        assert isinstance(old, CarriedPlan)
        start = minus(frame.position, place_on(leg.base, 0.0))
        first, leaving, *others = old.carriage.times.tolist()
        while True:
            base = PathPlan(leg.base.heights, leg.base.scaling.slower(stretch))
            left = frame._replace(position=start).after(stretch * leaving)
            states = [FrameState(start, *frame[1:3]), FrameState(*left[:3])]
            states += [old.carriage.at(time) for time in others]
            times = [stretch * time for time in (first, leaving, *others)]
            end = stretch * old.duration
            carried = CarriedPlan(self.workspace.machine, base, Carriage(times, states), end)
            self._look(carried)
            use = yield from carried.limit_use(limits, 0.0, self.workspace)
            if use.keeps_limits:
                break
            stretch *= _slowdown(use, limits) * SPARE
            if leg.moves or not stretch < SLOWEST:
                # The place that it leads to does not wait.
                use.check(limits)
            yield
        yield from inside(carried, self.workspace, limits)
        leaves, upright, arrival = (stretch * each for each in leg[2:5])
        return leg._replace(
            plan=carried, base=base, leaves=leaves, upright=upright, arrival=arrival
        )

    def _leg(
        self,
        here: Vector3,
        frame: MovingTarget,
        station: Station,
        age: float,
        wait: float,
        limits: SliderLimits,
    ) -> Interruptible[Leg]:
        """Return the leg to a ``station``, which takes as long as it has to.

        Args:
            here: where the platform is. Shape (3,) [m].
            frame: how the station moves that it is at.
            station: to be reached.
            age: time from that of the station to the begin of the leg [s].
            wait: rest in the frame before it begins [s].
            limits: of the sliders.
        """
        if not station.moves and not (any(frame.velocity) or any(frame.acceleration)):
            base = yield from self._timed(self._way(here, station.position), limits)
            base = base.delayed(wait)
            yield from check_place(base.heights.driven, self.workspace, 0.0)
            return Leg(base, base, wait, wait, base.duration)
        guess = self._guess(here, station.after(age + wait).position, limits)
        refusal: KinematicsError | None = None
        for part in PARTS_OF_LEG:
            carried = self._carried_leg(here, frame, station, age, wait, limits, part, guess)
            leg, refusal, guess = yield from carried
            if leg is not None:
                return leg
            yield
        assert refusal is not None
        raise refusal

    def _carried_leg(
        self,
        here: Vector3,
        frame: MovingTarget,
        station: Station,
        age: float,
        wait: float,
        limits: SliderLimits,
        part: float,
        guess: float,
    ) -> Interruptible[tuple[Leg | None, KinematicsError | None, float]]:
        """Return the same leg; the frame goes over in a ``part`` of the time that it has for it.

        Args:
            here: where the platform is. Shape (3,) [m].
            frame: how the station moves that it is at.
            station: to be reached.
            age: time from that of the station to the begin of the leg [s].
            wait: rest in the frame before it begins [s].
            limits: of the sliders.
            part: in (0, 1].
            guess: how long the way takes, about [s].

        Returns:
            The leg, or why there is none; and how long the way takes, about [s].

        Raises:
            KinematicsError: if the place cannot be reached.
        """
        place = station.after(age)
        changes = any(station.acceleration) or any(frame.acceleration)
        less = limits.times(*(LEFT_IN_CHANGE if changes else LEFT_TO_BASE))
        stretch, refusal = 1.0, TransferError("the place is not met: it moves too fast")
        natural: PathPlan | None = None
        early, late = PART_OF_GUESS * guess, (1.0 - PART_OF_GUESS) * guess
        instants: tuple[float, ...] = (wait + guess, wait + late, wait + early)
        first, goal = self._ends(here, frame, place, station.moves, instants, part)
        last: tuple[float, float] | None = None
        planned = 0
        for _ in range(ATTEMPTS):
            if natural is None:
                start = minus(here, first)
                try:
                    natural = yield from self._timed(self._way(start, goal), less)
                except KinematicsError as error:
                    self.workspace.check_position(place.after(instants[0]).position)
                    return None, error, guess
                guess = natural.duration
            # Where the base does not lead to just there, the frame does.
            base = PathPlan(natural.heights, natural.scaling.slower(stretch).delayed(wait))
            arrival, (upright, leaves) = base.duration, _upright(base)
            found = arrival, upright, leaves
            ends = self._ends(here, frame, place, station.moves, found, part)
            if max(math.dist(ends[0], first), math.dist(ends[1], goal)) > AIMED:
                # How long it takes depends on where the place is met: a secant, or about that.
                off = arrival - instants[0]
                across = minus(goal, minus(here, first))
                relative = minus(place.after(arrival).velocity, frame.velocity)
                slope = 0.5 * dot(across, relative) / math.hypot(*across)
                slope /= float(less.table[0].min())
                if last is not None and instants[0] != last[0]:
                    slope = (off - last[1]) / (instants[0] - last[0]) + 1.0
                last = instants[0], off
                later = off / (1.0 - min(max(slope, -1.0), 0.5)) - off
                ratio = max(1.0 + later / (arrival - wait), 0.1)
                instants = tuple(wait + ratio * (each - wait) for each in found)
                first, goal = self._ends(here, frame, place, station.moves, instants, part)
                natural = None
                continue
            for instant in (arrival, arrival + station.dwell):
                self.workspace.check_position(place.after(instant).position)
            begin, met = _goes_over(found, part, station.moves)
            present = FrameState(first, frame.velocity, frame.acceleration)
            end_of_leg = arrival + (station.dwell if station.moves else 0.0)
            carriage = self._carriage(present, 0.0, place, goal, met, arrival, end_of_leg, begin)
            carried = CarriedPlan(self.workspace.machine, base, carriage, end_of_leg)
            try:
                self._look(carried)
                use = yield from carried.limit_use(limits, 0.0, self.workspace)
                if use.keeps_limits:
                    yield from inside(carried, self.workspace, limits)
            except KinematicsError as error:
                return None, error, guess
            if use.keeps_limits:
                tilt = slope_of(station)
                dwell = station.dwell if station.moves else 0.0
                leg = Leg(carried, base, begin, met, arrival, 0.0, tilt, station.moves, dwell)
                return leg, None, guess
            slower = _slowdown(use, limits)
            if slower > MUCH_SLOWER and planned < PLANNED_FOR_LESS:
                # Less of the limits that are exceeded costs less time than to be slower everywhere.
                planned += 1
                table = less.table / np.maximum(use.use, 1.0)
                added = (
                    each.times(1.0 / max(part, 1.0)) for each, part in zip(less.added, use.added)
                )
                less = less.with_table(table).with_added(*added)
                natural = None
                continue
            # What the frame takes gets less only slowly.
            stretch *= (slower if stretch == 1.0 else slower * slower) * SPARE
            if not stretch < SLOWEST:
                break
            yield
        return None, refusal, guess

    @staticmethod
    def _ends(
        here: Vector3,
        frame: MovingTarget,
        place: MovingTarget,
        moves: bool,
        instants: tuple[float, ...],
        part: float,
    ) -> tuple[Vector3, Vector3]:
        """Return how a frame is displaced at first, and where the base ends in it [m].

        In the middle between both places the base is where the platform is.

        Args:
            here: where the platform is. Shape (3,) [m].
            frame: how the station moves that it is at.
            place: to be reached, as of the start.
            moves: whether it moves.
            instants: of the arrival, of the begin of the way down, and of the end of that up [s].
            part: of the time between that the frame takes.
        """
        begin, met = _goes_over(instants, part, moves)
        left, there, end = frame.after(begin), place.after(met), place.after(instants[0])
        way = plus(minus(left.position, frame.position), minus(there.position, end.position))
        way = combined(1.0, way, 0.5 * (met - begin), plus(left.velocity, there.velocity))
        bend = minus(left.acceleration, there.acceleration)
        way = combined(1.0, way, (met - begin) ** 2 / 12.0, bend)
        return scaled(way, -0.5), combined(1.0, end.position, -0.5, way)

    @staticmethod
    def _carriage(
        present: FrameState,
        now: float,
        place: MovingTarget,
        goal: Vector3,
        met: float,
        arrival: float,
        end: float,
        leaves: float | None = None,
    ) -> Carriage:
        """Return a carriage that meets a place, as of the base's start; that ends at ``goal``."""
        times, states = [now], [present]
        if leaves is not None and leaves > now:
            left = MovingTarget(*present).after(leaves - now)
            times.append(leaves)
            states.append(FrameState(*left[:3]))
        for time in (met, arrival, end):
            if time > times[-1] + 1e-9:
                there = place.after(time)
                times.append(time)
                moved = minus(there.position, goal)
                states.append(FrameState(moved, there.velocity, there.acceleration))
        return Carriage(times, states)

    def _lift(
        self, here: Vector3, frame: MovingTarget, wait: float, limits: SliderLimits
    ) -> Interruptible[Leg]:
        """Return the leg up from a station, to rest."""
        x, y, z = here
        top = max(self.height, z + SAME_WAY * 10.0)
        path = PlatformPath.start(here).line_to((x, y, top))
        moves = any(frame.velocity) or any(frame.acceleration)
        base = yield from self._timed(path, limits.times(*LEFT_TO_BASE) if moves else limits)
        base = base.delayed(wait)
        if not moves:
            yield from check_place(base.heights.driven, self.workspace, 0.0)
            return Leg(base, base, wait, wait, math.inf)
        leaves = wait + 0.5 * (base.duration - wait)
        left = frame._replace(position=AT_REST).after(leaves)
        refusal: KinematicsError | None = None
        shortest = _time_for(0.0, math.hypot(*left.velocity), limits)
        for gentler in (1.0, 1.6, 2.5):
            duration = gentler * shortest
            rests = leaves + duration
            half = combined(0.5 * duration, left.velocity, duration**2 / 12.0, left.acceleration)
            still = FrameState(plus(left.position, half), AT_REST, AT_REST)
            begin = FrameState(AT_REST, frame.velocity, frame.acceleration)
            carriage = Carriage((0.0, leaves, rests), (begin, FrameState(*left[:3]), still))
            end = max(base.duration, rests)
            carried = CarriedPlan(self.workspace.machine, base, carriage, end)
            try:
                yield from self._proved(carried, limits)
                return Leg(carried, base, leaves, rests, math.inf)
            except KinematicsError as error:
                refusal = error
            yield
        assert refusal is not None
        raise refusal

    def _proved(self, carried: CarriedPlan, limits: SliderLimits) -> Interruptible[None]:
        """Prove that a motion keeps limits and workspace.

        Raises:
            KinematicsError: if it does not.
        """
        self._look(carried)
        (yield from carried.limit_use(limits, 0.0, self.workspace)).check(limits)
        yield from inside(carried, self.workspace, limits)

    def _look(self, carried: CarriedPlan) -> None:
        """Look quickly whether a motion stays inside: out of reach there is nothing to prove.

        Raises:
            KinematicsError: if it does not.
        """
        for time in np.linspace(0.0, carried.duration, QUICK_LOOKS).tolist():
            place = carried.platform_at(self.workspace.machine, time)
            self.workspace.check_position(place[:3])

    def _guess(self, start: Vector3, end: Vector3, limits: SliderLimits) -> float:
        """Return how long it takes, about, from a ``start`` to an ``end`` [s]."""
        top = max(self.height, start[2], end[2])
        way = math.dist(start[:2], end[:2]) + 2.0 * top - start[2] - end[2]
        velocity, acceleration, jerk = limits.table.min(axis=1).tolist()
        return float(1.1 * (way / velocity + velocity / acceleration + acceleration / jerk))

    def _way(self, start: Vector3, end: Vector3) -> PlatformPath:
        """Return the way up from a ``start``, across, and down to an ``end`` [m]."""
        (x, y, z), (u, v, w) = start, end
        top = max(self.height, z, w)
        if math.dist(start, end) < SAME_WAY:
            # It is there. A plan leads along some way, be it one that nobody sees.
            points = [(x, y, z + 10.0 * SAME_WAY), end]
        elif math.dist((x, y), (u, v)) < SAME_WAY:
            points = [end]
        else:
            points = [(x, y, top), (u, v, top), end]
        path, last = PlatformPath.start(start), start
        for number, point in enumerate(points):
            if math.dist(point, last) < SAME_WAY:
                continue
            # The tolerance is that of the corner at its end.
            height = abs(top - (z if number == 0 else w))
            path = path.line_to(point, min(self.tolerance, PART_OF_HEIGHT * height))
            last = point
        return path

    def _timed(self, path: PlatformPath, limits: SliderLimits) -> Interruptible[PathPlan]:
        """Return the motion along a ``path``, from rest to rest, as one plan."""
        planner = PathPlanner(self.workspace)
        driven = yield from path.driven_in_pieces()
        heights = PathHeights(driven, self.workspace.machine.geometry)
        whole = yield from planner.to_the_end(heights, Planned(limits))
        parts = [part for part, _ in whole.parts(0.0)]
        first = parts[0]
        assert isinstance(first, PathPlan)
        scaling = TimeScaling.joined([part.scaling for part in parts if isinstance(part, PathPlan)])
        return PathPlan(first.heights, scaling)


def _time_for(way: float, speed: float, limits: SliderLimits) -> float:
    """Return how long it takes to go a ``way`` [m] and to change by a ``speed`` [m/s].

    Those are the largest velocity, acceleration and jerk of a quintic from rest to rest, and of a
    speed that changes with the cube of the time, as the platform were a slider.
    """
    velocity, acceleration, jerk = PARTS_FOR_MORE * limits.table.min(axis=1)
    return float(
        max(
            1.875 * way / velocity,
            1.5 * speed / acceleration + math.sqrt(5.774 * way / acceleration),
            math.sqrt(6.0 * speed / jerk) + math.cbrt(60.0 * way / jerk),
            CATCHING_UP,
        )
    )


def _slowdown(use: LimitBounds, limits: SliderLimits) -> float:
    """Return by which factor a motion has to be slower."""
    velocity, acceleration, jerk = use.use.max(axis=1).tolist()
    factors = [velocity, math.sqrt(acceleration), math.cbrt(jerk)]
    factors += [
        part ** (1.0 / bound.order) for bound, part in zip(limits.added, use.added.tolist())
    ]
    return max(1.0, *factors)


def _slower_leg(leg: Leg, now: float, rate: float) -> Leg:
    """Return a ``leg`` that from ``now`` [s] on goes over to a ``rate`` of its speeds, below 1."""
    scaling, less = leg.base.scaling, 1.0 - rate
    dense = np.linspace(0.0, 1.0, 400)
    passed = now + SLOWING * (dense - less * dense**3 * (1.0 - 0.5 * dense))

    def later(times: FloatArray) -> FloatArray:
        going = now + SLOWING * np.interp(times, passed, dense)
        after = now + SLOWING + (times - passed[-1]) / rate
        return np.where(times < now, times, np.where(times < passed[-1], going, after))

    some = passed[:: len(dense) // 10]
    apart = np.abs(np.subtract.outer(scaling.times, some)).min(axis=1)
    knots = ascending(np.concatenate((scaling.times[apart > SAME_KNOT], some)))
    times = later(knots)
    u = np.clip((times - now) / SLOWING, 0.0, 1.0)
    rates, bends = 1.0 - less * u * u * (3.0 - 2.0 * u), -6.0 * less * u * (1.0 - u) / SLOWING
    inside = np.where(
        (u > 0.0) & (u < 1.0), now + SLOWING * (u - less * u**3 * (1.0 - 0.5 * u)), knots
    )
    ways, speeds, accelerations = scaling.evaluate(inside)
    slower = TimeScaling(times, ways, speeds * rates, accelerations * rates**2 + speeds * bends)
    leaves, upright, arrival = later(np.array(leg[2:5])).tolist()
    base = PathPlan(leg.base.heights, slower)
    return leg._replace(base=base, leaves=leaves, upright=upright, arrival=arrival)


def _goes_over(instants: tuple[float, ...], part: float, moves: bool) -> tuple[float, float]:
    """Return when a frame begins to go over to the next station, and when that is met [s]."""
    _, upright, leaves = instants
    time = part * (upright - leaves)
    # Where the next station rests, the frame of the one before is soon left.
    begin = upright - time if moves else leaves
    return begin, begin + time


def _upright(base: PathPlan) -> tuple[float, float]:
    """Return from when on a motion is above its end, and when it leaves its start [s].

    It is upright for some time then. The frame goes over in a part of that, too, as it is still
    where it was, nearly: it begins, and ends, without acceleration.
    """
    times = np.linspace(0.0, base.duration, LOOKS)
    ways, _, _ = base.scaling.evaluate(times)
    places = base.heights.place_series(ways, np.zeros(LOOKS)).values[0, :2]
    at_start = np.hypot(*(places - places[:, :1])) < BESIDE
    at_end = np.hypot(*(places - places[:, -1:])) < BESIDE
    leaves = LOOKS if at_start.all() else int(np.argmin(at_start))
    arrives = 0 if at_end.all() else LOOKS - int(np.argmin(at_end[::-1]))
    if leaves >= arrives:
        # All of it is upright.
        return float(0.75 * base.duration), float(0.25 * base.duration)
    moves = float(times[int(np.argmax(ways > ways[0]))])
    left, met = float(times[max(leaves - 1, 0)]), float(times[min(arrives, LOOKS - 1)])
    return met + PART_UPRIGHT * (base.duration - met), left - PART_UPRIGHT * (left - moves)
