"""One set of modes from the swings behind several moves.

A move excites only the modes that lie in its direction, so a mode is seen in some of the swings.
What is found in two of them is one mode if the numbers differ by no more than three standard
deviations, or than a shaper would notice. Its frequency and damping are means, weighted by the
inverse variances. If the swings differ by more than their standard deviations say, as modes do from
place to place and with the size of the swing, that of the mean grows by as much.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from tri_glide_kinematics.calibration.ringdown.modes import (
    LEAST_AMPLITUDE,
    MOST_DAMPING_DEVIATION,
    MOST_FREQUENCY_DEVIATION,
    MOST_MODES,
    NotKnown,
    Oscillation,
    RingDown,
)
from tri_glide_kinematics.errors import KinematicsError

# Numbers that differ by so many standard deviations may be the same.
ALIKE_DEVIATIONS = 3.0


@dataclass(frozen=True, eq=False)
class CombinedModes:
    """What several swings of one machine say of its modes.

    Attributes:
        ringdowns: of each swing.
        modes: none, one or two, the one with the largest amplitude first. Numbers are those of all
            swings together, amplitudes and phases those of the largest swing.
        seen: in how many swings each of the modes was found.
        left_out: other modes that were found in a swing, and why they are left out.
        reason: why there is no mode; None if there is one.
    """

    ringdowns: tuple[RingDown, ...]
    modes: tuple[Oscillation, ...]
    seen: tuple[int, ...]
    left_out: tuple[tuple[Oscillation, NotKnown], ...]
    reason: NotKnown | None


@dataclass
class _Group:
    """What is taken for one mode: the swings in which it was found, and what was found there."""

    swings: list[int]
    found: list[Oscillation]

    @property
    def together(self) -> Oscillation:
        """Their mean, with the amplitudes of the first, which is the largest."""
        frequency, frequency_deviation = _mean(
            [(one.frequency, one.frequency_deviation) for one in self.found]
        )
        damping, damping_deviation = _mean(
            [(one.damping, one.damping_deviation) for one in self.found]
        )
        return replace(
            self.found[0],
            frequency=frequency,
            damping=damping,
            frequency_deviation=frequency_deviation,
            damping_deviation=damping_deviation,
            resolution=min(one.resolution for one in self.found),
        )


def combine_modes(ringdowns: Sequence[RingDown]) -> CombinedModes:
    """Return the modes that several swings of one machine show.

    Raises:
        KinematicsError: if there are no swings, or they are not of the same quantity.
    """
    if not ringdowns:
        raise KinematicsError("0 swings: at least one is needed")
    quantities = {found.recording.quantity for found in ringdowns}
    if len(quantities) > 1:
        raise KinematicsError("positions and accelerations cannot be combined")
    groups = _groups(ringdowns)
    modes: list[tuple[Oscillation, int]] = []
    left_out: list[tuple[Oscillation, NotKnown]] = []
    for group in groups:
        one = group.together
        reason = _reason(one, modes)
        if reason is None:
            modes.append((one, len(group.found)))
        else:
            left_out.append((one, reason))
    return CombinedModes(
        tuple(ringdowns),
        tuple(one for one, _ in modes),
        tuple(count for _, count in modes),
        tuple(left_out),
        None if modes else _why_none(ringdowns, left_out),
    )


def _groups(ringdowns: Sequence[RingDown]) -> list[_Group]:
    """Return the modes of all swings, those that are alike together, the largest first."""
    found = sorted(
        ((one, swing) for swing, each in enumerate(ringdowns) for one in each.modes),
        key=lambda pair: -pair[0].amplitude,
    )
    groups: list[_Group] = []
    for one, swing in found:
        # Two of one swing have been told apart there.
        possible = [
            group
            for group in groups
            if swing not in group.swings and _are_alike(one, group.together)
        ]
        if possible:
            nearest = min(possible, key=lambda group: _apart(one, group.together))
            nearest.swings.append(swing)
            nearest.found.append(one)
        else:
            groups.append(_Group([swing], [one]))
    return groups


def _apart(one: Oscillation, other: Oscillation) -> float:
    return abs(one.frequency - other.frequency)


def _are_alike(one: Oscillation, other: Oscillation) -> bool:
    """Return whether two may be the same mode, or the same to a shaper."""
    frequency = ALIKE_DEVIATIONS * math.hypot(one.frequency_deviation, other.frequency_deviation)
    damping = ALIKE_DEVIATIONS * math.hypot(one.damping_deviation, other.damping_deviation)
    return _apart(one, other) <= max(frequency, MOST_FREQUENCY_DEVIATION * other.frequency) and abs(
        one.damping - other.damping
    ) <= max(damping, MOST_DAMPING_DEVIATION)


def _mean(found: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return the weighted mean of values with standard deviations, and its standard deviation."""
    # A swing without noise would have an infinite weight.
    least = max(deviation for _, deviation in found) * 1e-6
    if least <= 0.0:
        return found[0]
    weights = [max(deviation, least) ** -2 for _, deviation in found]
    whole = math.fsum(weights)
    mean = math.fsum(weight * value for weight, (value, _) in zip(weights, found)) / whole
    squares = math.fsum(weight * (value - mean) ** 2 for weight, (value, _) in zip(weights, found))
    excess = squares / (len(found) - 1) if len(found) > 1 else 1.0
    return mean, math.sqrt(max(excess, 1.0) / whole)


def _reason(one: Oscillation, modes: Sequence[tuple[Oscillation, int]]) -> NotKnown | None:
    """Return why something that was found is left out, beside the larger ``modes``."""
    if not one.is_certain:
        return NotKnown.TOO_UNCERTAIN
    if modes and one.amplitude < LEAST_AMPLITUDE * modes[0][0].amplitude:
        return NotKnown.TOO_SMALL
    return None if len(modes) < MOST_MODES else NotKnown.TOO_MANY


def _why_none(
    ringdowns: Sequence[RingDown], left_out: Sequence[tuple[Oscillation, NotKnown]]
) -> NotKnown:
    """Return why no mode is known: what holds for most swings, of equally many the first."""
    if left_out:
        return left_out[0][1]
    reasons = [found.reason for found in ringdowns if found.reason is not None]
    return Counter(reasons).most_common(1)[0][0]
