r"""Slider heights, and their derivatives, while the platform moves along a straight line or a path.

The platform is at $p(s)$. With $d_i$ the horizontal vector from anchor i to it, arm i rises by

$$R_i = \sqrt{L_i^2 - |d_i|^2}, \quad R_i R_i' = x_i = -d_i \cdot p',$$

where only the horizontal parts of $p$ count, and the slider height is $h_i = p_z + R_i$. With
$g = R' = x / R$ the higher derivatives follow from differentiating $R g = x$ again and again:
$R g' = x' - g^2$ and $R g'' = x'' - 3 g g'$.

On a straight line, $p(s) = p_0 + s\,u$ with $|u| = 1$, these are simple: with $c_i$ the horizontal
vector from anchor i to $p_0$ and $m = -|u_{xy}|^2$ there is $x_i = m s - c_i \cdot u_{xy}$ and
$x_i' = m$, so that $R g' = m - g^2$, $R g'' = -3 g g'$ and $R g''' = -3 g'^2 - 4 g g''$.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain
from math import dist, inf, sqrt
from typing import NamedTuple, Protocol

import numpy as np

from tri_glide_kinematics.motion.errors import PathTimingError
from tri_glide_kinematics.motion.limits import (
    Series,
    SliderState,
    arms_of,
    moved,
    new_state,
    polynomial,
    slider_state,
)
from tri_glide_kinematics.motion.path import DrivenPath
from tri_glide_kinematics.tri_glide import ArmTooShortError, TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray, Indices, Vector3
from tri_glide_kinematics.workspace import Workspace

_FACTORIALS = np.array((1.0, 1.0, 2.0, 6.0, 24.0, 120.0))[:, np.newaxis, np.newaxis]

# The breaks of a curve that has none.
_NO_BREAKS = np.empty(0)


class HeightDerivatives(NamedTuple):
    """Slider heights along a path, at n places.

    Attributes:
        heights: and first, second and third derivative by s. Shape (4, 3, n).
        rates: of the driven way by s, the magnitude of $p'$. Shape (n,).
    """

    heights: FloatArray
    rates: FloatArray


class PlatformParts(NamedTuple):
    """How fast the platform is, and may be, in m parts of a curve.

    Attributes:
        rates: of the driven way by s, where parts begin and then where they end. Shape (2 m,).
        place: upper bounds in each part of the magnitudes of the platform's derivatives by s, from
            first to third. Shape (3, m).
        speed_limits: largest speeds of the platform. Shape (m,) [m/s].
    """

    rates: FloatArray
    place: FloatArray
    speed_limits: FloatArray


class CurveParts(NamedTuple):
    """What a curve is like in m parts of it, from where each begins to where it ends.

    Attributes:
        at_ends: first, second and third derivative of the slider heights by s, where parts begin
            and then where they end. Shape (3, 3, 2 m).
        by_way: upper bounds in each part of the absolute derivatives of the slider heights by s,
            from first to fifth. Each of the shape (3, m).
        platform: its speed; None if the curve asks for none.
    """

    at_ends: FloatArray
    by_way: FloatArray | tuple[FloatArray, ...]
    platform: PlatformParts | None


class Curve(Protocol):
    """Where the platform moves, seen from the sliders."""

    @property
    def breaks(self) -> FloatArray:
        """Ascending ways at which a derivative up to the fifth may jump. Shape (n,) [m]."""

    def state(self, way: float, speed: float, acceleration: float) -> SliderState:
        """Return the setpoint at one place.

        Args:
            way: place on the curve [m].
            speed: of it [m/s].
            acceleration: of it [m/s^2].
        """

    def platform(self, way: float, speed: float, acceleration: float) -> tuple[float, ...]:
        """Return how the platform moves; the arguments are as of ``state``.

        Returns:
            Nine plain numbers: position [m], velocity [m/s] and acceleration [m/s^2].
        """

    def derivatives(self, ways: FloatArray) -> HeightDerivatives:
        """Return heights and their derivatives at ``ways``. Shape (n,) [m]."""

    def in_parts(self, ways: FloatArray) -> CurveParts:
        """Return what the curve is like in parts between breaks.

        Args:
            ways: where parts begin, and then where they end. Shape (2 m,) [m].
        """

    def place_series(self, ways: FloatArray, half: FloatArray) -> Series:
        """Return Taylor series of the platform's position over the way.

        Args:
            ways: middles of parts between breaks. Shape (n,) [m].
            half: of the lengths of the parts. Shape (n,) [m].
        """


class StraightLine:
    """A segment in the platform's space, seen from the sliders.

    Attributes:
        start: where it begins. Shape (3,) [m].
        direction: unit vector. Shape (3,).
        length: [m].
        known_inside: workspace of which it is known that it holds all of the segment, or None.
        slope: vertical component of the direction.
        curvature: m of the module's formulas, common to all arms.
        arms: for each arm $R^2$ [m^2] and $x$ [m] at the start.
        start_heights: of the sliders. Shape (3,) [m].
        start_slopes: first derivatives of the heights at the start. Shape (3,).
        start_bends: second derivatives of the heights at the start. Shape (3,) [1/m].
    """

    def __init__(
        self,
        geometry: TriGlideGeometry,
        start: Sequence[float],
        direction: Sequence[float],
        length: float,
    ) -> None:
        """Prepare the segment of ``length`` [m] from ``start`` [m] along a unit ``direction``.

        Raises:
            ArmTooShortError: if an end of it, and so some of it, is out of reach of an arm.
        """
        x, y, z = (float(value) for value in start)
        ux, uy, uz = (float(value) for value in direction)
        self.start: Vector3 = (x, y, z)
        self.direction: Vector3 = (ux, uy, uz)
        self.length = length
        self.known_inside: Workspace | None = None
        self.slope = uz
        self.curvature = m = -(ux * ux + uy * uy)
        arms, values = [], []
        for anchor, arm_length in zip(geometry.anchors, geometry.arm_lengths):
            cx, cy = x - anchor[0], y - anchor[1]
            arms.append((arm_length * arm_length - cx * cx - cy * cy, -(cx * ux + cy * uy)))
        self.arms = tuple(arms)
        # The numbers for each setpoint are in one tuple, as that is unpacked soonest.
        self._numbers = (*chain.from_iterable(arms), m, uz, z)
        self._arm_lengths = geometry.arm_lengths
        # Rises are concave along a line: if both ends are within reach, so is what is between.
        self.heights_at(length)
        for (square, tilt), height in zip(arms, self.heights_at(0.0)):
            rise = sqrt(square)
            rate = tilt / rise
            values.append((height, rate + uz, (m - rate * rate) / rise))
        self.start_heights, self.start_slopes, self.start_bends = zip(*values)
        self._rises, self._tilts = np.array(arms).T[..., np.newaxis]

    @classmethod
    def between(
        cls, geometry: TriGlideGeometry, start: Sequence[float], end: Sequence[float]
    ) -> StraightLine:
        """Return the segment between two different points [m]."""
        length = dist(start, end)
        x, y, z = ((b - a) / length for a, b in zip(start, end))
        return cls(geometry, start, (x, y, z), length)

    def point(self, way: float) -> Vector3:
        """Return the point at distance ``way`` [m] from the start."""
        (x, y, z), (ux, uy, uz) = self.start, self.direction
        return (x + way * ux, y + way * uy, z + way * uz)

    def heights_at(self, way: float) -> Vector3:
        """Return the slider heights at one distance [m].

        Raises:
            ArmTooShortError: if it is out of reach of an arm.
        """
        heights = []
        for arm, (square, tilt) in enumerate(self.arms):
            square += way * (2.0 * tilt + self.curvature * way)
            if not square > 0.0:
                length = self._arm_lengths[arm]
                distance = sqrt(length * length - square)
                raise ArmTooShortError(self.point(way), arm, distance, length)
            heights.append(self.start[2] + self.slope * way + sqrt(square))
        h1, h2, h3 = heights
        return h1, h2, h3

    @property
    def breaks(self) -> FloatArray:
        """There are none."""
        return _NO_BREAKS

    def derivatives(self, ways: FloatArray) -> HeightDerivatives:
        """Return heights and their derivatives at ``ways``, shape (n,) [m]."""
        table = np.empty((4, 3, len(ways)))
        rise = self._derivatives(ways, table[1:])
        table[0] = self.start[2] + self.slope * ways + rise
        return HeightDerivatives(table, np.ones(len(ways)))

    def state(self, way: float, speed: float, acceleration: float) -> SliderState:
        """Return the setpoint at one place, in plain floats: it is called in each control cycle.

        Args:
            way: place on the line [m].
            speed: of it [m/s].
            acceleration: of it [m/s^2].
        """
        s1, x1, s2, x2, s3, x3, m, slope, base = self._numbers
        base, change, square = base + slope * way, m * way, speed * speed
        y1, y2, y3 = x1 + change, x2 + change, x3 + change
        r1 = sqrt(s1 + way * (x1 + y1))
        r2 = sqrt(s2 + way * (x2 + y2))
        r3 = sqrt(s3 + way * (x3 + y3))
        g1, g2, g3 = y1 / r1, y2 / r2, y3 / r3
        f1, f2, f3 = g1 + slope, g2 + slope, g3 + slope
        return new_state(
            SliderState,
            (
                (base + r1, base + r2, base + r3),
                (f1 * speed, f2 * speed, f3 * speed),
                (
                    f1 * acceleration + (m - g1 * g1) / r1 * square,
                    f2 * acceleration + (m - g2 * g2) / r2 * square,
                    f3 * acceleration + (m - g3 * g3) / r3 * square,
                ),
            ),
        )

    def platform(self, way: float, speed: float, acceleration: float) -> tuple[float, ...]:
        """Return position, velocity and acceleration of the platform."""
        (x, y, z), (ux, uy, uz) = self.start, self.direction
        return (
            x + way * ux,
            y + way * uy,
            z + way * uz,
            speed * ux,
            speed * uy,
            speed * uz,
            acceleration * ux,
            acceleration * uy,
            acceleration * uz,
        )

    def in_parts(self, ways: FloatArray) -> CurveParts:
        """Return what the line is like in parts.

        Args:
            ways: where parts begin, and then where they end. Shape (2 m,) [m].
        """
        at_ends = np.empty((3, 3, len(ways)))
        rise = self._derivatives(ways, at_ends)
        count = len(ways) // 2
        steepest = np.abs(at_ends[0] - self.slope).reshape(3, 2, count).max(axis=1)
        flatness = 1.0 / rise.reshape(3, 2, count).min(axis=1)
        ratio = steepest * flatness
        g2 = (steepest * steepest - self.curvature) * flatness
        g4 = g2 * g2 * flatness
        by_way = (steepest + abs(self.slope), g2, 3.0 * ratio * g2, 15.0 * g4, 105.0 * ratio * g4)
        return CurveParts(at_ends, by_way, None)

    def place_series(self, ways: FloatArray, half: FloatArray) -> Series:
        """Return Taylor series of the platform's position over the way."""
        start, direction = (np.array(v)[:, np.newaxis] for v in (self.start, self.direction))
        places = start + direction * ways
        return polynomial(np.array((places, np.broadcast_to(direction, places.shape))), half)

    def _derivatives(self, ways: FloatArray, table: FloatArray) -> FloatArray:
        """Put three derivatives of the heights at ``ways`` into a table; return the rises R.

        Args:
            ways: Shape (n,) [m].
            table: is filled. Shape (3, 3, n).

        Returns:
            Shape (3, n) [m].
        """
        first, second, third = table
        x, rise = self._rise(ways)
        np.divide(x, rise, out=first)
        np.divide(self.curvature - first * first, rise, out=second)
        np.divide(-3.0 * first * second, rise, out=third)
        first += self.slope
        return rise

    def _rise(self, ways: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return x and R of the module's formulas. Each of the shape (3, n)."""
        x = self._tilts + self.curvature * ways
        return x, np.sqrt(self._rises + ways * (self._tilts + x))


# However small the scale is, no path is to be driven more slowly [m/s].
SLOWEST = 1e-7


class Slowing(NamedTuple):
    """How a motion comes down to the speed that its path asks for.

    Attributes:
        until: place up to which it may be faster [m].
        speed: that the platform may have up to there [m/s].
        afterwards: that it may have behind it [m/s].
    """

    until: float
    speed: float
    afterwards: float


@dataclass(eq=False, repr=False)
class PathHeights:
    """A driven path, seen from the sliders.

    Attributes:
        driven: where the platform moves.
        geometry: of the machine.
        speed_scale: factor of the platform speeds that the path asks for.
        rapid: largest speed of the platform where the path asks for none [m/s].
        arms: as ``slider_state`` takes them.
        steps: speeds that a shaper needs besides; None without one.
        slowing: of a motion that is faster where it begins; None without.
        fastest: largest speed of the platform, whatever the path asks for [m/s].
    """

    driven: DrivenPath
    geometry: TriGlideGeometry
    speed_scale: float = 1.0
    steps: SpeedSteps | None = None
    slowing: Slowing | None = None
    fastest: float = inf
    rapid: float = inf

    def __post_init__(self) -> None:
        """Look at the path from the sliders of a machine."""
        self._anchors = np.array(self.geometry.anchors).T[..., np.newaxis]
        self._squares = np.square(np.array(self.geometry.arm_lengths))[:, np.newaxis]
        self.arms = arms_of(self.geometry)

    def at_speeds(
        self,
        speed_scale: float,
        steps: SpeedSteps | None = None,
        fastest: float = inf,
        rapid: float = inf,
    ) -> PathHeights:
        """Return the same with other speeds."""
        same = (speed_scale, fastest, rapid) == (self.speed_scale, self.fastest, self.rapid)
        if same and steps is self.steps and self.slowing is None:
            return self
        return PathHeights(self.driven, self.geometry, speed_scale, steps, None, fastest, rapid)

    def is_slower(self, other: PathHeights) -> bool:
        """Return whether the path asks for less speed than with the speeds of the ``other``."""
        return self.speed_scale < other.speed_scale or self.rapid < other.rapid

    def with_speeds_of(self, other: PathHeights) -> PathHeights:
        """Return the same with the speeds that hold for an ``other`` one."""
        return replace(other, driven=self.driven, geometry=self.geometry)

    def with_slowing(self, slowing: Slowing) -> PathHeights:
        """Return the same for a motion that is faster where it begins."""
        return replace(self, slowing=slowing)

    def timing_error(self, place: float, reason: str) -> PathTimingError:
        """Return the error that no motion is found at a ``place`` [m], for a ``reason``."""
        segment = int(self.driven.segment_of(np.array([place]))[0])
        return PathTimingError(segment, place, reason)

    def speed_limits(self, ways: FloatArray) -> FloatArray:
        """Return the largest speeds of the platform at ``ways``. Shape (n,) [m/s]."""
        speeds = self.speed_scale * self.driven.speed_limits(ways)
        speeds[np.isinf(speeds)] = self.rapid
        still: FloatArray | float = 0.0
        if self.slowing is not None:
            until, speed, afterwards = self.slowing
            still = np.where(ways < until, speed, afterwards)
            speeds = np.maximum(speeds, still)
        if self.steps is not None:
            rates = self.driven.rates(self.driven.spans_of(ways), ways)
            speeds = np.minimum(speeds, self.steps.at(ways, rates, still))
        return np.maximum(np.minimum(speeds, self.fastest), SLOWEST)

    def relative(self, places: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return where the platform is seen from each anchor, and how far its arm rises.

        Args:
            places: of the platform. Shape (n, 3) [m].

        Returns:
            Two horizontal components [m], and the square of the rise [m^2], which is not positive
            where an arm does not reach. Each of the shape (3, n).
        """
        x = places[:, 0] - self._anchors[0]
        y = places[:, 1] - self._anchors[1]
        return x, y, self._squares - x * x - y * y

    def derivatives(self, ways: FloatArray) -> HeightDerivatives:
        """Return heights and their derivatives at ``ways``, shape (n,) [m].

        Out of reach they are NaN.
        """
        return self.seen_from_sliders(self.driven.derivatives(ways, 3))

    def derivatives_on(self, pieces: Indices, ways: FloatArray) -> HeightDerivatives:
        """Return the same on ``pieces`` of the path that are known. Shape (n,)."""
        return self.seen_from_sliders(self.driven.derivatives_on(pieces, ways, 3))

    def seen_from_sliders(self, table: FloatArray) -> HeightDerivatives:
        """Return heights and their derivatives.

        Args:
            table: position of the platform and three derivatives. Shape (4 or more, n, 3).
        """
        dx, dy, squares = self.relative(table[0])
        (x1, y1, z1), (x2, y2, z2), (x3, y3, z3) = table[1:4].transpose(0, 2, 1)
        with np.errstate(invalid="ignore"):
            rises = np.sqrt(squares)
        flatness = 1.0 / rises
        level = x1 * x1 + y1 * y1
        heights = np.empty((4, *rises.shape))
        heights[0] = table[0, :, 2] + rises
        g = (dx * x1 + dy * y1) * -flatness
        heights[1] = g + z1
        g1 = -(level + dx * x2 + dy * y2 + g * g) * flatness
        heights[2] = g1 + z2
        g2 = -(3.0 * (x1 * x2 + y1 * y2 + g * g1) + dx * x3 + dy * y3) * flatness
        heights[3] = g2 + z3
        return HeightDerivatives(heights, np.sqrt(level + z1 * z1))

    @property
    def breaks(self) -> FloatArray:
        """Ascending ways between which the path is smooth. Shape (n,) [m]."""
        return self.driven.breaks

    def in_parts(self, ways: FloatArray) -> CurveParts:
        """Return what the path is like in parts between breaks.

        Args:
            ways: where parts begin, and then where they end. Shape (2 m,) [m].
        """
        begins, ends = ways.reshape(2, -1)
        middles = 0.5 * (begins + ends)
        pieces = self.driven.spans_of(middles)
        table = self.driven.derivatives_on(np.concatenate((pieces, pieces)), ways, 5)
        heights, rates = self.seen_from_sliders(table)
        by_way, place = self._largest_by_way(table, ends - begins)
        platform = PlatformParts(rates, place, self.speed_limits(middles))
        return CurveParts(heights[1:], by_way, platform)

    def place_series(self, ways: FloatArray, half: FloatArray) -> Series:
        """Return Taylor series of the platform's position over the way."""
        values = self.driven.derivatives(ways, 5).transpose(0, 2, 1) / _FACTORIALS
        bounds = np.abs(values)
        # Of a tilted circle only the whole has a constant magnitude.
        bounds[5] = np.sqrt(np.square(values[5]).sum(axis=0))
        return Series(values, moved(bounds, half))

    def _largest_by_way(
        self, table: FloatArray, length: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return bounds of the derivatives of the heights, and of the platform's place, by the way.

        Args:
            table: derivatives of the platform's position up to the fifth, where parts begin and
                then where they end. Shape (6, 2 m, 3).
            length: of the parts. Shape (m,) [m].

        Returns:
            From the first to the fifth, shape (5, 3, m), and from the first to the third, shape
            (3, m).
        """
        count = len(length)
        half = 0.5 * length
        dx, dy, squares = self.relative(table[0])
        # The horizontal parts alone bend the arms.
        x, y, z = table[1:].transpose(2, 0, 1)
        level = np.sqrt(x * x + y * y).reshape(5, 2, count).max(axis=1)
        upright = np.abs(z).reshape(5, 2, count).max(axis=1)
        # Of a tilted circle only the whole has a constant magnitude.
        level[4] = upright[4] = np.hypot(level[4], upright[4])
        for order in (3, 2, 1, 0):
            level[order] += half * level[order + 1]
            upright[order] += half * upright[order + 1]
        p1, p2, p3, p4, p5 = level
        away = np.sqrt(dx * dx + dy * dy).reshape(3, 2, count).max(axis=1) + half * p1
        x1 = p1 * p1 + away * p2
        x2 = 3.0 * p1 * p2 + away * p3
        x3 = 3.0 * p2 * p2 + 4.0 * p1 * p3 + away * p4
        x4 = 10.0 * p2 * p3 + 5.0 * p1 * p4 + away * p5
        x0 = np.abs(dx * x[0] + dy * y[0]).reshape(3, 2, count).max(axis=1)
        x0 += half * x1
        rise = squares.reshape(3, 2, count).min(axis=1) - (0.25 * length * length) * x1
        with np.errstate(invalid="ignore"):
            flatness = 1.0 / np.sqrt(rise)
        g = x0 * flatness
        g1 = (x1 + g * g) * flatness
        g2 = (x2 + 3.0 * g * g1) * flatness
        g3 = (x3 + 3.0 * g1 * g1 + 4.0 * g * g2) * flatness
        g4 = (x4 + 10.0 * g1 * g2 + 5.0 * g * g3) * flatness
        by_way = np.array((g, g1, g2, g3, g4)) + upright[:, np.newaxis]
        return by_way, np.hypot(level[:3], upright[:3])

    def state(self, way: float, speed: float, acceleration: float) -> SliderState:
        """Return the setpoint at one place, in plain floats: it is called in each control cycle.

        Args:
            way: place on the path [m].
            speed: of it [m/s].
            acceleration: of it [m/s^2].
        """
        return slider_state(self.arms, self.platform(way, speed, acceleration))

    def platform(self, way: float, speed: float, acceleration: float) -> tuple[float, ...]:
        """Return position, velocity and acceleration of the platform."""
        x, y, z, x1, y1, z1, x2, y2, z2 = self.driven.state(way)
        square = speed * speed
        return (
            x,
            y,
            z,
            x1 * speed,
            y1 * speed,
            z1 * speed,
            x1 * acceleration + x2 * square,
            y1 * acceleration + y2 * square,
            z1 * acceleration + z2 * square,
        )


class SpeedSteps(NamedTuple):
    """Largest speeds along a path, each from one place to the next.

    Attributes:
        edges: ascending places. Shape (n + 1,) [m].
        asked: of the platform, because the path asks for it; infinite outside. Shape (n + 2,)
            [m/s].
        bends: of the place, because of bends; infinite outside. Shape (n + 2,) [m/s].
    """

    edges: FloatArray
    asked: FloatArray
    bends: FloatArray

    def at(self, ways: FloatArray, rates: FloatArray, still: FloatArray | float) -> FloatArray:
        """Return the largest speeds of the platform at ``ways`` [m]. Shape (n,) [m/s].

        Args:
            ways: places. Shape (n,) [m].
            rates: of the driven way by the place there. Shape (n,).
            still: so fast it may be whatever the path asks for. Shape (n,) [m/s].
        """
        step = np.searchsorted(self.edges, ways, "right")
        asked = np.maximum(self.asked[step], still)
        return np.asarray(np.minimum(asked, self.bends[step] * rates))
