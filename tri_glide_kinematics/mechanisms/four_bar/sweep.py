r"""The motion of a four-bar linkage over an array of crank angles, on both branches.

What the loop yields is stored; what follows from it (angles, the crank pin, points of the coupler
plane) is worked out when it is asked for. Plane vectors are complex numbers inside.

The loop is closed in the ground frame: origin at the crank pivot, x axis towards the rocker pivot.
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

import cmath
import math
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.checks import finite, member
from tri_glide_kinematics.equal_numbers import directions, wrapped
from tri_glide_kinematics.mechanisms.four_bar.analysis import Branch, LinkLengths
from tri_glide_kinematics.vectors import FloatArray, Point


def constant(value: float) -> FloatArray:
    """Return ``value`` as an array without axes: numpy takes that faster than a float."""
    return np.array(value, dtype=np.float64)


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
        scale: from 4 a d sin^2(phi/2) to 2 a sin^2(phi/2), and from 2 a d sin(phi) to a sin(phi),
            in [m].
        ground: d, in [m].
        coupler: b.
        kite_scale: from 4 a^2 to half the longest link, in [m]; of meaning only for a kite.
        stretches: whether there is a change point at half a turn.
        folds: whether there is a change point at zero.
        is_limited: whether there is a crank angle that cannot be reached.
        is_kite: whether a = d and b = c, so that crank pin and rocker pivot can meet.
    """

    def __init__(self, lengths: LinkLengths) -> None:
        """Work out the constants of a linkage."""
        a, b, c, d = lengths.scaled
        size = lengths.longest
        self.trig_scale = constant(2.0 * math.sqrt(a * d))
        self.stretched_gap = constant(lengths.stretched_gap)
        self.folded_gap = constant(lengths.folded_gap)
        self.stretched_half_gap = constant(0.5 * lengths.stretched_gap)
        self.folded_half_gap = constant(0.5 * lengths.folded_gap)
        self.least_diagonal = constant((d - a) ** 2)
        self.coupler_less_rocker = constant((b - c) * (b + c))
        self.ground_less_crank = constant((d - a) * (d + a))
        self.offset_x = constant(size * (d - a))
        self.scale = constant(0.5 * size / d)
        self.ground = constant(size * d)
        self.coupler = b
        self.kite_scale = 0.25 * size / a
        self.stretches = lengths.stretches
        self.folds = lengths.folds
        self.is_limited = lengths.stretched_gap < 0.0 or lengths.folded_gap < 0.0
        self.is_kite = a == d and b == c


_CHUNK = 8192
"""Crank angles worked on at once: few enough that the workspace stays in the cache."""

_ANGLE_SLACK = 16.0 * float(np.finfo(np.float64).eps)
"""A crank angle this far beyond a limit, in [rad], is there by rounding and counts as the limit."""

_MOST_SLACK = 8.0 * _ANGLE_SLACK
"""No slack of g^2 is more than this: with 1 for the longest link, (g^2)' is 2 and g^2 4 at most."""

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
    motion: FloatArray = np.empty((2, 6, angles.size))
    # Beyond a limit the root is of a negative number, on it the division is by zero: both give the
    # NaN that is asked for. A kite divides by zero, or nearly, where g vanishes. Other linkages do
    # without the guard, which costs as much as three rows.
    may_fail = constants.is_limited or constants.is_kite
    guard = np.errstate(all="ignore") if may_fail else nullcontext()
    with guard:
        for start in range(0, angles.size, _CHUNK):
            part = slice(start, start + _CHUNK)
            omega = velocity[part] if velocity.ndim else velocity
            alpha = acceleration
            if alpha is not None and alpha.ndim:
                alpha = alpha[part]
            rows = _close_chunk(constants, angles[part], omega, alpha)
            for row, (mean, split) in enumerate(zip(*rows)):
                np.add(mean, split, motion[0, row, part])
                np.subtract(mean, split, motion[1, row, part])
    return motion


def _close_chunk(
    k: LoopConstants, angles: FloatArray, omega: FloatArray, alpha: FloatArray | None
) -> tuple[tuple[FloatArray, ...], tuple[FloatArray, ...]]:
    """The mean of both branches, and half their difference (open less crossed).

    Each has six rows in the order of :func:`close_loop`.
    """
    # g^2 and its distance from both bounds, by the half angle: no digits are lost near a limit.
    half = angles * _HALF
    cos, sin = np.cos(half), np.sin(half)
    cos *= k.trig_scale
    sin *= k.trig_scale
    slope = cos * sin  # (g^2)' = 2 a d sin(phi)
    cos2, sin2 = cos * cos, sin * sin
    to_stretched = cos2 + k.stretched_gap  # (b + c)^2 - g^2
    to_folded = sin2 + k.folded_gap  # g^2 - (b - c)^2
    inverse = _HALF / (sin2 + k.least_diagonal)  # 1 / (2 g^2)
    gx, pin_y = sin2 * k.scale, slope * k.scale
    gx += k.offset_x
    gaps = to_stretched, to_folded
    on_limit = _snap_to_limits(k, slope, (cos2, sin2), gaps) if k.is_limited else None
    root, gain, gain_slope = _root_and_gain(k, (cos, sin), (cos2, sin2), gaps, slope)

    # From here on a slope is by time.
    if k.is_kite:
        inverse[np.isinf(inverse)] = 0.0  # g = 0: what is divided by it below is zero as well
    slope *= inverse
    slope *= omega + omega  # (g^2)' / g^2
    gain_slope *= omega * omega
    if alpha is not None:
        gain_slope += alpha * gain
    gain *= omega

    # The diagonal turns with 1/2 - (d^2 - a^2)/(2 g^2).
    turn = inverse * k.ground_less_crank
    turn_slope = turn * slope
    turn_slope *= omega
    np.subtract(_HALF, turn, turn)
    if alpha is not None:
        turn_slope += alpha * turn
    turn *= omega

    # Against the diagonal, the rocker turns with p M and the coupler with (p - 1) M.
    foot = inverse * k.coupler_less_rocker
    slope *= foot  # -p'
    beyond = _HALF - foot  # 1 - p
    foot += _HALF  # p
    if on_limit is not None:
        gain[on_limit] = np.nan
        foot[on_limit] = np.copysign(k.coupler * np.sqrt(2.0 * inverse[on_limit]), foot[on_limit])
        beyond[on_limit] = 1.0 - foot[on_limit]
    rocker = foot * gain
    foot *= gain_slope
    slope *= gain
    foot -= slope
    rates = rocker - gain, rocker, foot - gain_slope, foot

    # The rocker pin is at ground - (1 - p) g, and h times the perpendicular of g to either side.
    if k.is_kite:
        half_height = k.kite_scale * (cos if k.stretches else np.sqrt(to_stretched))
        to_side = cos * half_height, sin * half_height
    else:
        root *= inverse  # h
        to_side = root * pin_y, root * gx
    gx *= beyond
    pin_y *= beyond
    mean = k.ground - gx, pin_y, turn, turn, turn_slope, turn_slope
    return mean, (*to_side, *rates)


Pair = tuple[FloatArray, FloatArray]


def _snap_to_limits(
    k: LoopConstants, slope: FloatArray, squares: Pair, gaps: Pair
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


def _root_and_gain(
    k: LoopConstants, trig: Pair, squares: Pair, gaps: Pair, slope: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """R, M = (g^2)'/R and M'.

    Of a change-point linkage R has the sign that makes it smooth. It is the product of two roots,
    and M the product of 2 sqrt(ad) cos(phi/2) over the first and 2 sqrt(ad) sin(phi/2) over the
    second; at a change point the quotient is 1.
    """
    (cos, sin), (to_stretched, to_folded) = trig, gaps
    if k.stretches and k.folds:
        return cos * sin, np.ones_like(cos), np.zeros_like(cos)
    if k.stretches:
        root = np.sqrt(to_folded)
        return root * cos, sin / root, k.folded_half_gap * cos / (to_folded * root)
    if k.folds:
        root = np.sqrt(to_stretched)
        return root * sin, cos / root, -k.stretched_half_gap * sin / (to_stretched * root)
    square = to_stretched * to_folded
    root = np.sqrt(square)
    square *= root
    gain_slope = squares[0] * to_stretched
    gain_slope *= k.folded_half_gap
    gain_slope -= squares[1] * to_folded * k.stretched_half_gap
    gain_slope /= square
    return root, slope / root, gain_slope


ComplexArray = NDArray[np.complex128]

SINGULAR_SINE = 1e-7
"""Coupler and rocker count as in line if the sine of the angle between them is not above this."""


@dataclass(frozen=True)
class GroundFrame:
    """The position of the ground link in the plane.

    Attributes:
        crank_pivot: x and y of the crank pivot, in [m].
        angle: from the x axis to the line from crank pivot to rocker pivot, in [rad].
    """

    crank_pivot: tuple[float, float] = (0.0, 0.0)
    angle: float = 0.0

    @cached_property
    def rotation(self) -> complex:
        """Unit vector along the ground."""
        return cmath.rect(1.0, self.angle)

    def place(self, points: ComplexArray) -> FloatArray:
        """Return points given in the ground frame as x and y in the plane. Shape (n, 2)."""
        return _as_pairs(complex(*self.crank_pivot) + self.rotation * points)

    def turn(self, vectors: ComplexArray) -> FloatArray:
        """Return vectors given in the ground frame as x and y in the plane. Shape (n, 2)."""
        return _as_pairs(self.rotation * vectors)


@dataclass(frozen=True, eq=False)
class PointMotion:
    """Motion of a point of the coupler plane over n crank angles.

    Attributes:
        position: in [m]. Shape (n, 2).
        velocity: in [m/s]. Shape (n, 2).
        acceleration: in [m/s^2]. Shape (n, 2).
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True, eq=False)
class Sweep:
    """The motion over n crank angles. Rows beyond the crank's limits are NaN.

    Attributes:
        lengths: of the linkage.
        frame: where it lies.
        crank_angles: in [rad], from the x axis of the plane. Shape (n,).
        crank_velocities: in [rad/s]. Shape () or (n,).
        crank_accelerations: in [rad/s^2]. Shape () or (n,).
        motion: x and y of the rocker pin in the ground frame in [m]; coupler and rocker velocity in
            [rad/s]; coupler and rocker acceleration in [rad/s^2]. Shape (6, n) of one branch,
            (2, 6, n) of the open and the crossed one.
    """

    lengths: LinkLengths
    frame: GroundFrame
    crank_angles: FloatArray
    crank_velocities: FloatArray
    crank_accelerations: FloatArray
    motion: FloatArray


@dataclass(frozen=True, eq=False)
class BranchSweep(Sweep):
    """One ``branch`` over n crank angles."""

    branch: Branch

    @property
    def coupler_velocities(self) -> FloatArray:
        """In [rad/s]; NaN at a limit, where it is infinite. Shape (n,)."""
        return self.motion[2]

    @property
    def rocker_velocities(self) -> FloatArray:
        """In [rad/s]; NaN at a limit, where it is infinite. Shape (n,)."""
        return self.motion[3]

    @property
    def coupler_accelerations(self) -> FloatArray:
        """In [rad/s^2]; NaN at a limit. Shape (n,)."""
        return self.motion[4]

    @property
    def rocker_accelerations(self) -> FloatArray:
        """In [rad/s^2]; NaN at a limit. Shape (n,)."""
        return self.motion[5]

    @property
    def is_reachable(self) -> NDArray[np.bool_]:
        """Whether the linkage can be closed at the crank angle. Shape (n,)."""
        return ~np.isnan(self.motion[0])

    @property
    def is_singular(self) -> NDArray[np.bool_]:
        """Whether coupler and rocker are in line: on a limit or a change point. Shape (n,).

        There the crank does not determine the motion. At a change point the rates are those of the
        branch that passes it smoothly; on a limit they are NaN.
        """
        with np.errstate(invalid="ignore"):
            singular: NDArray[np.bool_] = np.sin(self.transmission_angles) <= SINGULAR_SINE
        return singular

    @property
    def crank_pins(self) -> FloatArray:
        """Positions of the crank pin, in [m]; NaN beyond the limits. Shape (n, 2)."""
        return self.frame.place(np.where(self.is_reachable, self._crank, np.nan))

    @property
    def rocker_pins(self) -> FloatArray:
        """Positions of the rocker pin, in [m]. Shape (n, 2)."""
        if self.frame == GroundFrame():
            return self.motion[0:2].T
        return self.frame.place(self._rocker_pin)

    @property
    def coupler_angles(self) -> FloatArray:
        """From the x axis to the line from crank pin to rocker pin, in (-pi, pi]. Shape (n,)."""
        return directions(self.frame.rotation * self._coupler)

    @property
    def rocker_angles(self) -> FloatArray:
        """From the x axis to the line from rocker pivot to rocker pin, in (-pi, pi]. Shape (n,)."""
        return directions(self.frame.rotation * self._rocker)

    @property
    def transmission_angles(self) -> FloatArray:
        """Angle between coupler and rocker at the rocker pin, in [0, pi]. Shape (n,)."""
        return np.abs(np.angle(self._rocker * self._coupler.conj()))

    def point_of_coupler_plane(self, x: float, y: float) -> PointMotion:
        """Motion of a point that is fixed to the coupler: its positions are a coupler curve.

        Args:
            x: from the crank pin along the line to the rocker pin, in [m].
            y: to the left of it, in [m].

        Raises:
            NotFiniteError: if a coordinate is NaN or infinite.
        """
        offset = complex(finite("x", x), finite("y", y)) / self.lengths.coupler * self._coupler
        position = self._crank + offset
        velocity = 1j * (self.crank_velocities * self._crank + self.coupler_velocities * offset)
        acceleration = (1j * self.crank_accelerations - self.crank_velocities**2) * self._crank + (
            1j * self.coupler_accelerations - self.coupler_velocities**2
        ) * offset
        return PointMotion(
            self.frame.place(position), self.frame.turn(velocity), self.frame.turn(acceleration)
        )

    @property
    def _crank(self) -> ComplexArray:
        """Crank pivot to crank pin in the ground frame, in [m]."""
        return self.lengths.crank * np.exp(1j * (self.crank_angles - self.frame.angle))

    @property
    def _rocker_pin(self) -> ComplexArray:
        """Crank pivot to rocker pin in the ground frame, in [m]."""
        return self.motion[0] + 1j * self.motion[1]

    @property
    def _coupler(self) -> ComplexArray:
        """Crank pin to rocker pin in the ground frame, in [m]."""
        return self._rocker_pin - self._crank

    @property
    def _rocker(self) -> ComplexArray:
        """Rocker pivot to rocker pin in the ground frame, in [m]."""
        return self._rocker_pin - self.lengths.ground


class FourBarSweep(Sweep):
    """Both branches over n crank angles.

    A branch is followed by its identity (:class:`Branch`), never by nearness to the row before, so
    a row does not depend on the other rows.
    """

    @property
    def open(self) -> BranchSweep:
        """The open branch."""
        return self.branch(Branch.OPEN)

    @property
    def crossed(self) -> BranchSweep:
        """The crossed branch."""
        return self.branch(Branch.CROSSED)

    def branch(self, branch: Branch) -> BranchSweep:
        """Return one of the two branches.

        Raises:
            NotAChoiceError: if ``branch`` is no ``Branch``, but its name, for example.
        """
        motion = self.motion[0 if member("branch", branch, Branch) is Branch.OPEN else 1]
        return BranchSweep(**{**vars(self), "motion": motion}, branch=branch)


def _as_pairs(vectors: ComplexArray) -> FloatArray:
    """Return complex numbers as x and y. Shape (n, 2)."""
    return np.ascontiguousarray(vectors).view(np.float64).reshape(-1, 2)


@dataclass(frozen=True)
class FourBarPose:
    """One position of a linkage with its rates.

    Attributes:
        branch: the branch it lies on.
        crank_angle: as asked for, in [rad].
        coupler_angle: from the x axis to the line from crank pin to rocker pin, in (-pi, pi].
        rocker_angle: from the x axis to the line from rocker pivot to rocker pin, in (-pi, pi].
        coupler_velocity: in [rad/s].
        rocker_velocity: in [rad/s].
        coupler_acceleration: in [rad/s^2].
        rocker_acceleration: in [rad/s^2].
        crank_pivot: in [m].
        crank_pin: in [m].
        rocker_pin: in [m].
        rocker_pivot: in [m].
        transmission_angle: between coupler and rocker at the rocker pin, from 0 to pi, in [rad].
        is_singular: whether coupler and rocker are in line. On a limit of the crank the four rates
            are NaN then, at a change point they are those of the smooth motion of the branch.
    """

    branch: Branch
    crank_angle: float
    coupler_angle: float
    rocker_angle: float
    coupler_velocity: float
    rocker_velocity: float
    coupler_acceleration: float
    rocker_acceleration: float
    crank_pivot: Point
    crank_pin: Point
    rocker_pin: Point
    rocker_pivot: Point
    transmission_angle: float
    is_singular: bool
    _sweep: BranchSweep = field(repr=False, compare=False)

    def point_of_coupler_plane(self, x: float, y: float) -> PointMotion:
        """Motion of a point that is fixed to the coupler; its arrays have shape (2,).

        Args:
            x: from the crank pin along the line to the rocker pin, in [m].
            y: to the left of it, in [m].

        Raises:
            NotFiniteError: if a coordinate is NaN or infinite.
        """
        motion = self._sweep.point_of_coupler_plane(x, y)
        return PointMotion(motion.position[0], motion.velocity[0], motion.acceleration[0])

    @classmethod
    def of(cls, sweep: BranchSweep, rocker_pivot: Point) -> FourBarPose:
        """Take the pose from the only row of a sweep; ``rocker_pivot`` is its place in [m]."""
        # As the sweep works them out, but once and without arrays: those cost more than the motion.
        frame, crank_angle = sweep.frame, float(sweep.crank_angles[0])
        x, y, a, b, c, d = sweep.motion[:, 0].tolist()
        rates = (a, b, c, d)
        rocker_pin = complex(x, y)
        crank_pin = cmath.rect(sweep.lengths.crank, crank_angle - frame.angle)
        coupler, rocker = rocker_pin - crank_pin, rocker_pin - sweep.lengths.ground
        transmission_angle = abs(cmath.phase(rocker * coupler.conjugate()))
        pivot = complex(*frame.crank_pivot)
        first, second = (pivot + frame.rotation * pin for pin in (crank_pin, rocker_pin))
        return cls(
            sweep.branch,
            crank_angle,
            wrapped(cmath.phase(frame.rotation * coupler)),
            wrapped(cmath.phase(frame.rotation * rocker)),
            *rates,
            frame.crank_pivot,
            (first.real, first.imag),
            (second.real, second.imag),
            rocker_pivot,
            transmission_angle,
            math.sin(transmission_angle) <= SINGULAR_SINE,
            sweep,
        )
