"""What the loop of a four-bar linkage needs to know of the linkage, worked out once."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.mechanisms.four_bar.lengths import LinkLengths
from tri_glide_kinematics.vectors import FloatArray


def constant(value: float) -> FloatArray:
    """Return ``value`` as an array without axes: numpy takes that faster than a float."""
    return np.array(value, dtype=np.float64)


@dataclass(frozen=True)
class LoopConstants:
    """What the loop needs to know of a linkage.

    Letters are those of source 004, with the longest link as unit; attributes in [m] say so.

    Attributes:
        trig_scale: 2 sqrt(ad).
        stretched_gap: (b + c)^2 - (a + d)^2.
        folded_gap: (a - d)^2 - (b - c)^2.
        stretched_half_gap: half of the former.
        folded_half_gap: half of the latter.
        least_diagonal: (a - d)^2, which is g^2 at crank angle 0.
        coupler_less_rocker: b^2 - c^2.
        ground_less_crank: d^2 - a^2.
        offset_x: d - a, in [m].
        scale_x: from 4 a d sin^2(phi/2) to 2 a sin^2(phi/2), in [m].
        scale_y: from 2 a d sin(phi) to a sin(phi), in [m].
        ground: d, in [m].
        coupler: b.
        kite_scale: from 4 a^2 to half the longest link, in [m]; of meaning only for a kite.
        stretches: whether there is a change point at half a turn.
        folds: whether there is a change point at zero.
        is_limited: whether there is a crank angle that cannot be reached.
        is_kite: whether a = d and b = c, so that crank pin and rocker pivot can meet.
    """

    trig_scale: FloatArray
    stretched_gap: FloatArray
    folded_gap: FloatArray
    stretched_half_gap: FloatArray
    folded_half_gap: FloatArray
    least_diagonal: FloatArray
    coupler_less_rocker: FloatArray
    ground_less_crank: FloatArray
    offset_x: FloatArray
    scale_x: FloatArray
    scale_y: FloatArray
    ground: FloatArray
    coupler: float
    kite_scale: float
    stretches: bool
    folds: bool
    is_limited: bool
    is_kite: bool

    @classmethod
    def of(cls, lengths: LinkLengths) -> LoopConstants:
        """Work out the constants of a linkage."""
        a, b, c, d = lengths.scaled
        size = lengths.longest
        return cls(
            trig_scale=constant(2.0 * math.sqrt(a * d)),
            stretched_gap=constant(lengths.stretched_gap),
            folded_gap=constant(lengths.folded_gap),
            stretched_half_gap=constant(0.5 * lengths.stretched_gap),
            folded_half_gap=constant(0.5 * lengths.folded_gap),
            least_diagonal=constant((d - a) ** 2),
            coupler_less_rocker=constant((b - c) * (b + c)),
            ground_less_crank=constant((d - a) * (d + a)),
            offset_x=constant(size * (d - a)),
            scale_x=constant(0.5 * size / d),
            scale_y=constant(0.5 * size / d),
            ground=constant(size * d),
            coupler=b,
            kite_scale=0.25 * size / a,
            stretches=lengths.stretches,
            folds=lengths.folds,
            is_limited=lengths.stretched_gap < 0.0 or lengths.folded_gap < 0.0,
            is_kite=a == d and b == c,
        )
