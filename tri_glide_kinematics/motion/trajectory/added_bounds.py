"""Motions that keep added bounds: which parts of the limits they can use where there are some."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import inf
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.limits import RELATIVE_ROUNDING, SliderLimits, SliderState
from tri_glide_kinematics.motion.trajectory.trajectory import (
    Motion,
    Trajectory,
    added_use,
    check_added,
)

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
