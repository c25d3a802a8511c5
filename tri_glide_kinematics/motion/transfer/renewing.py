"""What is left of a transfer, planned again as the station that it leads to moves otherwise."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.motion.tracking import MovingTarget
from tri_glide_kinematics.motion.trajectory import PathPlan, TimeScaling
from tri_glide_kinematics.motion.transfer.carried import Carriage, CarriedPlan
from tri_glide_kinematics.motion.transfer.legs import (
    Leg,
    Station,
    TransferError,
    TransferPlan,
    on_slope,
    place_on,
)
from tri_glide_kinematics.motion.transfer.lifting import given_up
from tri_glide_kinematics.motion.transfer.meeting import SLOWEST, SPARE
from tri_glide_kinematics.motion.transfer.ways import (
    BESIDE,
    CATCHING_UP,
    Ways,
    slowdown,
    time_for,
    upright,
)
from tri_glide_kinematics.vectors import FloatArray, ascending, minus

# A leg to a place that it would be too fast for goes over to lower speeds in so long [s].
SLOWING = 0.15

# So often that is tried, each time slower by as much as it is too fast and by this factor.
SLOWER_ATTEMPTS, SLOWER_BY = 3, 1.02

# Knots are no closer than this: rounding would be divided by the cube of it [s].
SAME_KNOT = 1e-5

# After changes that come too late for the way down, the platform stays at the place for so much
# longer in all [s]; not for less than this part of what is allowed.
STAYS_LONGER, STAYS_FOR = (0.03, 0.06, 0.1), 0.5

# A place that is missed by this part of what is allowed is met.
UNSEEN = 0.1


class _TooFastError(TransferError):
    """A motion that would keep its limits if it were slower."""

    def __init__(self, reason: KinematicsError, slowdown: float) -> None:
        """Store the ``reason``, and how many times slower, about."""
        super().__init__(str(reason))
        self.reason, self.slowdown = reason, slowdown


class Renewal:
    """Plans again what is left of one plan."""

    def __init__(self, ways: Ways, plan: TransferPlan, time: float, limits: SliderLimits) -> None:
        """Begin at a ``time`` in a ``plan`` [s], within ``limits``."""
        self._ways, self._plan, self._time, self._limits = ways, plan, time, limits
        self._index, self._now = plan.present(time)
        self._leg = plan.legs[self._index]

    def to(
        self, station: Station, age: float, allowed: float
    ) -> Interruptible[TransferPlan | None]:
        """Return what is left with another motion of the ``station`` that it leads to.

        The way in the frame stays as it is, and so do its heights: whatever the other motion is,
        the place stays at the height, or on the slope, that it was planned for. Where it is not met
        in time, that way is driven slower; and where that does not do, the platform goes up.

        Args:
            station: how the place moves, and what is told there.
            age: time from that of the station to the begin [s].
            allowed: so far from the place the platform may be at the arrival [m].

        Returns:
            The plan; None where it can stay as it is.

        Raises:
            KinematicsError: if there is none.
        """
        leg, now, limits = self._leg, self._now, self._limits
        if not leg.moves or self._plan.gives_up is not None:
            return None
        end = leg.begin + leg.plan.duration
        # What is asked of the place is that it is met at the arrival, and kept to in the dwell.
        # After a late change it is met by the end of that, when a gripper has closed.
        instant = leg.arrival if now < leg.arrival else end
        there = leg.is_at(instant)
        place = on_slope(station.after(age - now), there, leg.slope)
        missed = math.dist(there, place.after(instant).position)
        # It may stay longer until something is told there, as to a gripper.
        told = leg.arrival + min((after for after, _ in station.outputs), default=0.0)
        if missed <= UNSEEN * allowed or now >= max(told, end - CATCHING_UP):
            return None
        missed_at_last = math.dist(leg.is_at(end), place.after(end).position)
        stays = now < told and missed_at_last > STAYS_FOR * allowed
        try:
            return (yield from self._renewed(place, end, allowed, STAYS_LONGER if stays else ()))
        except KinematicsError as refusal:
            if missed <= allowed:
                return None
            text = f"the place is missed by {1e3 * missed:.2g} mm, more than {1e3 * allowed:.2g} mm"
            reason = TransferError(f"{text}: {refusal}")
        return (yield from given_up(self._ways, self._plan, self._time, limits, reason))

    def _renewed(
        self, place: MovingTarget, end: float, allowed: float, stays: Iterable[float]
    ) -> Interruptible[TransferPlan]:
        """Return a plan that meets a ``place``, later and slower if need be.

        Args:
            place: as of the start of the base.
            end: of the leg as it is planned, in the base [s].
            allowed: so far from the place the platform may be at the arrival [m].
            stays: for how much longer than it has to the platform may stay at the place [s].

        Raises:
            KinematicsError: if there is none.
        """
        leg, now, present = self._leg, self._now, place.after(self._now)
        off = math.dist(leg.is_at(now), present.position)
        turned = math.dist(leg.frame_at(now).velocity, present.velocity)
        quickest = time_for(off, turned, self._limits)
        latest = max(leg.arrival, now + CATCHING_UP)
        rate = 1.0
        for met in sorted({max(leg.upright, now + quickest), latest, end}):
            if met > end:
                continue
            try:
                return (yield from self._met(leg, place, met, allowed))
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
            slower = slower_leg(leg, now, rate)
            met = min(max(slower.upright, now + quickest), slower.arrival)
            try:
                return (yield from self._met(slower, place, met, allowed))
            except _TooFastError as error:
                refusal, rate = error.reason, rate / error.slowdown**2
            except KinematicsError as error:
                refusal = error
                break
            yield
        # The way down may need all jerk that there is: then it is caught up with at its end.
        for longer in stays:
            # What it stays longer already since renewals before belongs to it.
            later = leg._replace(arrival=leg.base.duration + longer)
            if not later.arrival > leg.arrival:
                continue
            try:
                end = later.arrival + later.ride
                return (yield from self._met(later, place, end, allowed))
            except KinematicsError as error:
                refusal = error
            yield
        raise refusal

    def _met(
        self, leg: Leg, place: MovingTarget, met: float, allowed: float
    ) -> Interruptible[TransferPlan]:
        """Return a plan whose present ``leg`` meets a ``place``, if that keeps all limits.

        Args:
            leg: as it is driven in the frame.
            place: as of the start of its base.
            met: when it is met, in the base [s].
            allowed: so far from the place the platform may be at the arrival [m].

        Raises:
            _TooFastError: if it is too fast.
            KinematicsError: if it leaves the workspace, arrives too far from the place, or would be
                too low on the way.
        """
        end = leg.arrival + leg.ride
        begins, instants = [(self._now, leg.frame_at(self._now))], (met, leg.arrival, end)
        carriage = Carriage.onto(begins, place, leg.goal, instants)
        check_height(leg, carriage, self._now)
        carried = CarriedPlan(self._ways.workspace.machine, leg.base, carriage, end, self._now)
        renewed = leg._replace(plan=carried, begin=self._now)
        off = math.dist(renewed.is_at(leg.arrival), place.after(leg.arrival).position)
        if off > allowed and self._now < leg.arrival:
            text = f"{1e3 * off:.2g} mm from the place at the arrival"
            raise TransferError(f"{text}, at most {1e3 * allowed:.2g} mm")
        use = yield from carried.use_inside(self._ways.workspace, self._limits)
        if not use.keeps_limits:
            try:
                use.check(self._limits)
            except KinematicsError as error:
                raise _TooFastError(error, slowdown(use, self._limits)) from error
        legs = [renewed, *self._plan.legs[self._index + 1 :]]
        if len(legs) > 1:
            frame = place.after(self._now + carried.duration)
            legs[1] = yield from self._following(legs[1], frame)
        return TransferPlan(legs, self._plan.first + self._index)

    def _following(self, leg: Leg, frame: MovingTarget) -> Interruptible[Leg]:
        """Return a leg with another motion of the place that it begins at.

        Raises:
            KinematicsError: if there is none.
        """
        old, stretch, region = leg.carried, 1.0, self._ways.workspace
        assert old is not None
        begin = frame._replace(position=minus(frame.position, place_on(leg.base, 0.0)))
        first, leaving, *others = old.carriage.times.tolist()
        while True:
            base = PathPlan(leg.base.heights, leg.base.scaling.slower(stretch))
            states = [begin, begin.after(stretch * leaving)]
            states += [old.carriage.at(time) for time in others]
            times = [stretch * time for time in (first, leaving, *others)]
            end = stretch * old.duration
            carriage = Carriage(times, states)
            check_height(leg._replace(base=base), carriage, 0.0)
            carried = CarriedPlan(region.machine, base, carriage, end)
            use = yield from carried.use_inside(region, self._limits)
            if use.keeps_limits:
                break
            stretch *= slowdown(use, self._limits) * SPARE
            if leg.moves or not stretch < SLOWEST:
                # The place that it leads to does not wait.
                use.check(self._limits)
            yield
        upright, arrival = stretch * leg.upright, stretch * leg.arrival
        return leg._replace(plan=carried, base=base, upright=upright, arrival=arrival)


def check_height(leg: Leg, carriage: Carriage, begin: float) -> None:
    """Check that the platform is not too low between the stations, from ``begin`` [s] on.

    A place on a slope that is met elsewhere is higher or lower there, and so is the way to it.

    Raises:
        TransferError: if it is.
    """
    end, leaves = upright(leg.base)
    begin = max(begin, leaves)
    sunk = -carriage.lowest(begin, end) - leg.spare if begin < end else 0.0
    if sunk > BESIDE:
        text = f"the way to the place would be {1e3 * sunk:.2g} mm too low"
        raise TransferError(f"{text}, at most {1e3 * BESIDE:g} mm")


def slower_leg(leg: Leg, now: float, rate: float) -> Leg:
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
    upright, arrival = later(np.array((leg.upright, leg.arrival))).tolist()
    base = PathPlan(leg.base.heights, slower)
    return leg._replace(base=base, upright=upright, arrival=arrival)
