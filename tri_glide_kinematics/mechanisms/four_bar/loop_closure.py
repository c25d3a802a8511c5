r"""The loop of a four-bar linkage, closed for arrays of crank angles, with its rates.

Everything here is in the ground frame: origin at the crank pivot, x axis towards the rocker pivot.
With the letters of source 004 (crank a, coupler b, rocker c, ground d, crank angle phi), the
diagonal :math:`\vec g` leads from the crank pin to the rocker pivot and the coupler is

.. math::

    \vec b = p\,\vec g \pm h\,\vec g^\perp, \qquad
    p = \frac{g^2 + b^2 - c^2}{2 g^2}, \qquad
    h = \frac{R}{2 g^2}, \qquad
    R^2 = \big((b+c)^2 - g^2\big) \big(g^2 - (b-c)^2\big),

with the upper sign for the open branch. Whatever is to be known of both branches is therefore a
mean plus or minus half a difference, and each is worked out once. The rates follow from the
derivatives of :math:`g^2` and of :math:`M = (g^2)'/R`, see ``docs/mechanisms/four_bar.md``.

At a change point one factor of :math:`R^2` is a perfect square, :math:`4 a d \cos^2(\varphi/2)` or
:math:`4 a d \sin^2(\varphi/2)`. Its root is taken with its sign: the branches then pass the fold
smoothly, and the quotients that would be 0/0 there cancel before they are formed.
"""

from __future__ import annotations

import math
from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.mechanisms.four_bar.analysis import LinkLengths
from tri_glide_kinematics.vectors import FloatArray


def constant(value: float) -> FloatArray:
    """Return ``value`` as an array without axes: numpy takes that faster than a float."""
    return np.array(value, dtype=np.float64)


@dataclass(frozen=True)
class LoopConstants:
    """The numbers of a linkage that the loop needs.

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


_CHUNK = 8192
"""Crank angles worked on at once: few enough that the workspace stays in the cache."""

_ANGLE_SLACK = 16.0 * float(np.finfo(np.float64).eps)
"""A crank angle this far beyond a limit, in [rad], is there by rounding and counts as the limit."""

_MOST_SLACK = 8.0 * _ANGLE_SLACK
"""No slack of g^2 is more than this: with 1 for the longest link, (g^2)' is 2 and g^2 4 at most."""

_WORK_ROWS = 28
"""Intermediate results that one chunk keeps, each of them in a row."""


_HALF = constant(0.5)


def close_loop(
    constants: LoopConstants,
    angles: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray | None,
) -> FloatArray:
    """Close the loop at each crank angle on both branches.

    Args:
        constants: of the linkage.
        angles: crank angles from the ground line, in [rad]. Shape (n,).
        velocity: crank velocities, in [rad/s]. Shape () or (n,).
        acceleration: crank accelerations, in [rad/s^2]. Shape () or (n,). None if all are zero.

    Returns:
        Shape (2, 6, n): branch (open, crossed); x and y of the rocker pin in [m], coupler and
        rocker velocity in [rad/s], coupler and rocker acceleration in [rad/s^2]. All six are NaN
        beyond the crank's limits; the four rates are NaN on a limit, where they would be infinite.
    """
    count = angles.size
    motion: FloatArray = np.empty((2, 6, count))
    size = min(max(count, 1), _CHUNK)
    work: FloatArray = np.empty((_WORK_ROWS, size))
    # Beyond a limit the root is of a negative number, on it the division is by zero: both give the
    # NaN that is asked for. A kite divides by zero, or nearly, where g vanishes. Other linkages do
    # without the guard, which costs as much as three rows.
    may_fail = constants.is_limited or constants.is_kite
    guard = np.errstate(all="ignore") if may_fail else nullcontext()
    with guard:
        for start in range(0, count, size):
            part = slice(start, start + size)
            rows = work[:, : count - start]
            omega = velocity[part] if velocity.ndim else velocity
            alpha = acceleration
            if alpha is not None and alpha.ndim:
                alpha = alpha[part]
            _close_chunk(constants, angles[part], omega, alpha, rows)
            mean, split, result = rows[0:6], rows[6:12], motion[:, :, part]
            np.add(mean, split, result[0])
            np.subtract(mean, split, result[1])
    return motion


def _close_chunk(
    k: LoopConstants,
    angles: FloatArray,
    omega: FloatArray,
    alpha: FloatArray | None,
    work: FloatArray,
) -> None:
    """Fill the first twelve rows of ``work``.

    Six rows are the mean of the branches, six are half their difference (open less crossed), each
    in the order of :func:`close_loop`. The last argument of a numpy function is where its result
    goes; a row is used again where its first content has served.
    """
    # fmt: off
    (
        mean_x, mean_y, mean_coupler, mean_rocker, mean_coupler_slope, mean_rocker_slope,
        split_x, split_y, split_coupler, split_rocker, split_coupler_slope, split_rocker_slope,
        cos, sin, cos2, sin2, to_stretched, to_folded,
        slope, inverse, root, root3, gain, gain_slope, foot, beyond, gx, pin_y,
    ) = work
    # fmt: on
    trig, squares, gaps = work[12:14], work[14:16], work[16:18]
    add, subtract, multiply, divide = np.add, np.subtract, np.multiply, np.divide

    # g^2 and its distance from both bounds, by the half angle: no digits are lost near a limit.
    multiply(angles, _HALF, cos)
    np.sin(cos, sin)
    np.cos(cos, cos)
    multiply(trig, k.trig_scale, trig)
    multiply(trig, trig, squares)
    multiply(cos, sin, slope)  # (g^2)' = 2 a d sin(phi)
    add(cos2, k.stretched_gap, to_stretched)  # (b + c)^2 - g^2
    add(sin2, k.folded_gap, to_folded)  # g^2 - (b - c)^2
    add(sin2, k.least_diagonal, inverse)
    divide(_HALF, inverse, inverse)  # 1 / (2 g^2)
    multiply(sin2, k.scale_x, gx)
    add(gx, k.offset_x, gx)
    multiply(slope, k.scale_y, pin_y)
    on_limit = _snap_to_limits(k, slope, squares, gaps) if k.is_limited else None

    # R, M = (g^2)'/R and M'.
    if k.stretches or k.folds:
        _pass_change_point(k, trig, gaps, root, gain, gain_slope)
    else:
        multiply(to_stretched, to_folded, root3)
        np.sqrt(root3, root)
        divide(slope, root, gain)
        multiply(root3, root, root3)
        multiply(squares, gaps, gaps)
        multiply(to_stretched, k.folded_half_gap, to_stretched)
        multiply(to_folded, k.stretched_half_gap, to_folded)
        subtract(to_stretched, to_folded, gain_slope)
        divide(gain_slope, root3, gain_slope)

    # From here on a slope is by time.
    if k.is_kite:
        inverse[np.isinf(inverse)] = 0.0  # g = 0: what is divided by it below is zero as well
    multiply(slope, inverse, slope)
    multiply(slope, omega + omega, slope)  # (g^2)' / g^2
    multiply(gain_slope, omega * omega, gain_slope)
    if alpha is not None:
        gain_slope += alpha * gain
    multiply(gain, omega, gain)

    # The diagonal turns with 1/2 - (d^2 - a^2)/(2 g^2).
    multiply(inverse, k.ground_less_crank, mean_rocker)
    multiply(mean_rocker, slope, mean_coupler_slope)
    multiply(mean_coupler_slope, omega, mean_coupler_slope)
    subtract(_HALF, mean_rocker, mean_rocker)
    if alpha is not None:
        mean_coupler_slope += alpha * mean_rocker
    multiply(mean_rocker, omega, mean_rocker)
    mean_coupler[:] = mean_rocker
    mean_rocker_slope[:] = mean_coupler_slope

    # Against the diagonal, the rocker turns with p M and the coupler with (p - 1) M.
    multiply(inverse, k.coupler_less_rocker, foot)
    multiply(foot, slope, slope)  # -p'
    subtract(_HALF, foot, beyond)  # 1 - p
    add(foot, _HALF, foot)  # p
    if on_limit is not None:
        gain[on_limit] = np.nan
        foot[on_limit] = np.copysign(k.coupler * np.sqrt(2.0 * inverse[on_limit]), foot[on_limit])
        beyond[on_limit] = 1.0 - foot[on_limit]
    multiply(foot, gain, split_rocker)
    subtract(split_rocker, gain, split_coupler)
    multiply(foot, gain_slope, split_rocker_slope)
    multiply(slope, gain, slope)
    subtract(split_rocker_slope, slope, split_rocker_slope)
    subtract(split_rocker_slope, gain_slope, split_coupler_slope)

    # The rocker pin is at ground - (1 - p) g, and h times the perpendicular of g to either side.
    multiply(beyond, gx, gain)
    subtract(k.ground, gain, mean_x)
    multiply(beyond, pin_y, mean_y)
    if k.is_kite:
        half_height = cos if k.stretches else np.sqrt(to_stretched)
        np.multiply(trig, k.kite_scale * half_height, work[6:8])
    else:
        multiply(root, inverse, root)  # h
        multiply(root, pin_y, split_x)
        multiply(root, gx, split_y)


def _snap_to_limits(
    k: LoopConstants, slope: FloatArray, squares: FloatArray, gaps: FloatArray
) -> NDArray[np.bool_] | None:
    """Make zero what only rounding keeps from it: g^2 less its bounds. Tell where, if anywhere."""
    on_limit = None
    for gap, square, bound in zip(gaps, squares, (k.stretched_gap, k.folded_gap)):
        if bound < 0.0:
            distance = np.abs(gap)
            if distance.min() <= _MOST_SLACK:
                here = distance <= _ANGLE_SLACK * (np.abs(slope) + square)
                gap[here] = 0.0
                on_limit = here if on_limit is None else on_limit | here
    return on_limit


def _pass_change_point(
    k: LoopConstants,
    trig: FloatArray,
    gaps: FloatArray,
    root: FloatArray,
    gain: FloatArray,
    gain_slope: FloatArray,
) -> None:
    """Fill R, M and M' of a change-point linkage, R with the sign that makes it smooth.

    R is the product of two roots, and M the product of 2 sqrt(ad) cos(phi/2) over the first and
    2 sqrt(ad) sin(phi/2) over the second; at a change point the quotient is 1.
    """
    cos, sin = trig
    to_stretched, to_folded = gaps
    if k.stretches and k.folds:
        np.multiply(cos, sin, root)
        gain.fill(1.0)
        gain_slope.fill(0.0)
    elif k.stretches:
        np.sqrt(to_folded, root)
        np.divide(sin, root, gain)
        np.divide(k.folded_half_gap * cos, to_folded * root, gain_slope)
        np.multiply(root, cos, root)
    else:
        np.sqrt(to_stretched, root)
        np.divide(cos, root, gain)
        np.divide(-k.stretched_half_gap * sin, to_stretched * root, gain_slope)
        np.multiply(root, sin, root)
