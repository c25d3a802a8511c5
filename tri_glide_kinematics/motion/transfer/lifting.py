"""Ways up from a station, or from where a transfer is given up; the frame comes to rest on them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.limits import AT_REST, SliderLimits
from tri_glide_kinematics.motion.path import check_place
from tri_glide_kinematics.motion.shaped import SlowedPlan
from tri_glide_kinematics.motion.tracking import MovingTarget
from tri_glide_kinematics.motion.trajectory import (
    LinePlan,
    PathPlan,
    SequencePlan,
    StraightLine,
    TimeScaling,
    Trajectory,
)
from tri_glide_kinematics.motion.transfer.carried import (
    Carriage,
    CarriedPlan,
    first_proved,
    moves,
    resting_after,
)
from tri_glide_kinematics.motion.transfer.legs import Leg, TransferPlan
from tri_glide_kinematics.motion.transfer.ways import (
    BESIDE,
    LEFT_TO_BASE,
    SAME_WAY,
    SPARE_HEIGHT,
    Ways,
    time_for,
)

# A frame comes to rest in one of these multiples of the time that it should have to take.
GENTLER = (1.0, 1.6, 2.5)


def lifted(
    ways: Ways, frame: MovingTarget, wait: float, limits: SliderLimits
) -> Interruptible[Leg]:
    """Return the leg up from a station, to rest.

    Args:
        ways: in the frame.
        frame: how the station moves, and where the platform is.
        wait: rest in the frame before it begins [s].
        limits: of the sliders.

    Raises:
        KinematicsError: if there is none.
    """
    if not moves(frame):
        base = (yield from ways.timed(ways.up(frame.position), limits)).delayed(wait)
        yield from check_place(base.heights.driven, ways.workspace, 0.0)
        return Leg(base, base, wait, math.inf)
    less, higher = limits.times(*LEFT_TO_BASE), ways
    while True:
        base = (yield from ways.timed(higher.up(frame.position), less)).delayed(wait)
        motion = yield from _resting(ways, frame, base, wait, limits)
        low = ways.height - motion.platform_at(ways.workspace.machine, motion.duration)[2]
        if low <= BESIDE:
            return Leg(motion, base, float(motion.carriage.times[-1]), math.inf)
        # The frame sinks until it rests. Where the platform gets no higher, the reach ends this.
        higher = replace(higher, height=higher.height + SPARE_HEIGHT * low)


def _resting(
    ways: Ways, frame: MovingTarget, base: PathPlan, wait: float, limits: SliderLimits
) -> Interruptible[CarriedPlan]:
    """Return a ``base`` in a ``frame`` that comes to rest; see ``lifted``."""
    leaves = wait + 0.5 * (base.duration - wait)
    begin = frame._replace(position=AT_REST)
    left = begin.after(leaves)
    shortest = time_for(0.0, math.hypot(*left.velocity), limits)

    def carried(gentler: float) -> CarriedPlan:
        rests = leaves + gentler * shortest
        still = resting_after(left, gentler * shortest)
        carriage = Carriage((0.0, leaves, rests), (begin, left, still))
        return CarriedPlan(ways.workspace.machine, base, carriage, max(base.duration, rests))

    return (yield from first_proved(map(carried, GENTLER), ways.workspace, limits))


def given_up(
    ways: Ways, plan: TransferPlan, time: float, limits: SliderLimits, reason: KinematicsError
) -> Interruptible[TransferPlan]:
    """Return a plan that brakes on the way of a ``plan``, goes up from there, and rests.

    Args:
        ways: how high it goes.
        plan: that is driven.
        time: in it, when that begins [s].
        limits: of the sliders.
        reason: why.

    Raises:
        KinematicsError: if there is none.
    """
    index, now = plan.present(time)
    leg, machine = plan.legs[index], ways.workspace.machine
    frame = leg.frame_at(now)
    shortest = time_for(0.0, math.hypot(*frame.velocity), limits)

    def carried(gentler: float, slower: float) -> CarriedPlan:
        parts = list(_stopped(ways, leg.in_frame, leg.base, now, slower, limits))
        duration = max(gentler * shortest, SequencePlan(parts).duration if parts else 0.0)
        still = resting_after(frame, duration)
        if still.position[2] < -BESIDE:
            # The height is that of the platform, not that in a frame which has sunk.
            higher = replace(ways, height=ways.height - still.position[2])
            parts = list(_stopped(higher, leg.in_frame, leg.base, now, slower, limits))
        motion: Trajectory = SequencePlan(parts) if parts else leg.in_frame
        ends, begins = (motion.duration, 0.0) if parts else (now, now)
        carriage = Carriage((begins, begins + duration), (frame, still))
        return CarriedPlan(machine, motion, carriage, max(ends, begins + duration), begins)

    # At last what is driven in the frame goes on to its end.
    slower = (*GENTLER[:-1], math.inf)
    motion = yield from first_proved(map(carried, GENTLER, slower), ways.workspace, limits)
    last = Leg(motion, leg.base, 0.0, math.inf, motion.begin)
    return TransferPlan([last], plan.first + index, gives_up=reason)


def _stopped(
    ways: Ways,
    motion: Trajectory,
    base: PathPlan,
    now: float,
    slower: float,
    limits: SliderLimits,
) -> Iterator[Trajectory]:
    """Yield a braking on the way of a ``motion`` in a frame, and the way up from there.

    Args:
        ways: how high it goes.
        motion: that is driven.
        base: of the leg.
        now: time in the motion [s].
        slower: the braking takes so many times as long as it should have to.
        limits: of the sliders.
    """
    machine, left = ways.workspace.machine, motion.duration - now
    speed = math.hypot(*motion.platform_at(machine, now)[3:6])
    if left > 0.0 and speed > 0.0:
        duration = slower * time_for(0.0, speed, limits)
        if 0.5 * duration < left:
            yield SlowedPlan(machine, motion, now, duration)
            now += 0.5 * duration
        else:
            # It brakes already.
            yield SequencePlan((motion,), now)
            now = motion.duration
    x, y, z, *_ = motion.platform_at(machine, now)
    way = ways.height - z
    if way > SAME_WAY:
        line = StraightLine(base.heights.geometry, (x, y, z), (0.0, 0.0, 1.0), way)
        times = np.array((0.0, time_for(way, 0.0, limits)))
        ends = np.array((0.0, way))
        yield LinePlan(line, TimeScaling(times, ends, np.zeros(2), np.zeros(2)))
