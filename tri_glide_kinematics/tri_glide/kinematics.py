r"""Closed-form kinematics of a tri-glide.

Arm i leads from the platform centre $A = (x, y, z)$ up to its carriage $(a_{ix}, a_{iy}, h_i)$ over
the anchor $a_i$. With $F_i = a_i - (x, y)$ and the rise $s_i = \sqrt{L_i^2 - |F_i|^2}$:
$h_i = z + s_i$, and the Jacobian of the heights has the rows $(F_{ix}/s_i, F_{iy}/s_i, 1)$.
The derivation is in docs/kinematics.md; source 000 is the starting point.

The functions for one pose take any three numbers and calculate in plain floats, as they run in
each control cycle; a tuple or list of Python floats is the fastest input. Numbers of any other type
become plain floats first: float32 would be calculated in single precision, uint8 would wrap.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import hypot, inf, isfinite, sqrt

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import array_of_shape, three_floats
from tri_glide_kinematics.equal_numbers import first_smallest
from tri_glide_kinematics.errors import KinematicsError, NotFiniteError, Refusal
from tri_glide_kinematics.tri_glide import batch
from tri_glide_kinematics.tri_glide.conditioning import (
    Matrix3,
    extreme_singular_values,
    extreme_singular_values_batch,
)
from tri_glide_kinematics.tri_glide.geometry import TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.wording import number_text, unit_question, vector_text


class UnreachableError(KinematicsError):
    """The platform cannot be held at a position."""

    refusal = Refusal.UNREACHABLE

    def __init__(self, message: str, position: Sequence[float]) -> None:
        """Store the ``position`` [m] that the ``message`` is about."""
        super().__init__(message)
        self.position = tuple(position)


class ArmTooShortError(UnreachableError):
    """An arm does not span the horizontal distance to its tower."""

    def __init__(
        self, position: Sequence[float], arm: int, distance: float, arm_length: float
    ) -> None:
        """Store what is too far.

        Args:
            position: of the platform [m].
            arm: index of the arm, 0 to 2 (the text counts from 1).
            distance: horizontal distance from the platform to the arm's anchor [m].
            arm_length: [m].
        """
        super().__init__(
            f"position {vector_text(position)} m is out of reach of arm {arm + 1}: horizontal "
            f"distance {number_text(distance)} m, arm length {number_text(arm_length)} m"
            f"{unit_question(distance, arm_length)}",
            position,
        )
        self.arm = arm
        self.distance = distance
        self.arm_length = arm_length


class WrongAssemblyModeError(UnreachableError):
    """The platform would have to be above, or in, the plane through the three carriages."""

    def __init__(self, position: Sequence[float], plane_height: float) -> None:
        """Store the ``position`` [m] and the ``plane_height`` [m].

        Args:
            position: of the platform [m].
            plane_height: of the carriages' plane over the platform [m]; negative if below it.
        """
        super().__init__(
            f"position {vector_text(position)} m belongs to the other assembly mode: the plane "
            f"of the carriages is {number_text(plane_height, 3)} m above it, not more than 0 m",
            position,
        )
        self.plane_height = plane_height


class NoPoseError(KinematicsError):
    """Slider heights to which no pose of the platform below the sliders belongs."""

    refusal = Refusal.UNREACHABLE

    def __init__(self, message: str, heights: Sequence[float]) -> None:
        """Store the slider ``heights`` [m] that the ``message`` is about."""
        super().__init__(message)
        self.heights = tuple(heights)


class SpheresDoNotMeetError(NoPoseError):
    """The sphere about each carriage with its arm as radius: all three have no common point."""

    def __init__(self, heights: Sequence[float], discriminant: float, longest_arm: float) -> None:
        """Store what does not meet.

        Args:
            heights: of the sliders [m].
            discriminant: not positive [m^2].
            longest_arm: [m].
        """
        apart = max(heights) - min(heights)
        super().__init__(
            f"slider heights {vector_text(heights)} m are too far apart: the arms do not "
            f"meet (discriminant {number_text(discriminant, 3)} m^2)"
            f"{unit_question(apart, longest_arm)}",
            heights,
        )
        self.discriminant = discriminant


class PlatformAboveSliderError(NoPoseError):
    """The arms meet, but one of them does not lead upwards to its slider."""

    def __init__(self, heights: Sequence[float], arm: int, rise: float) -> None:
        """Store the slider ``heights`` [m], the index of the ``arm`` and its ``rise`` [m]."""
        super().__init__(
            f"slider heights {vector_text(heights)} m put the platform above slider "
            f"{arm + 1}: arm {arm + 1} rises by {number_text(rise, 3)} m, not more than 0 m",
            heights,
        )
        self.arm = arm
        self.rise = rise


class TriGlide:
    """A tri-glide whose constants are worked out once.

    Both directions know one and the same set of poses: each arm leads upwards from the platform
    to its carriage, and the platform lies below the plane through the three carriages. On the edge
    of this set, where an arm lies level or the platform lies in the plane, the machine is singular;
    the edge itself is refused. So what one direction accepts, the other gives back, to rounding
    times the condition number of the Jacobian.
    """

    __slots__ = (
        "_forward_constants",
        "_inverse_constants",
        "_rate_constants",
        "_single_mode",
        "_solved",
        "geometry",
    )

    def __init__(self, geometry: TriGlideGeometry, *, compiled: bool = False) -> None:
        """Prepare the constants of ``geometry``.

        Args:
            geometry: of the machine.
            compiled: whether the batch functions are compiled when they are first called, which
                takes seconds and makes them about twice as fast. This needs numba; where it is not
                installed, they work as without this.
        """
        self.geometry = geometry
        is_compiled = compiled and batch.numba_is_installed()
        self._solved = batch.by_loop if is_compiled else batch.by_blocks
        (x1, y1), (x2, y2), (x3, y3) = geometry.anchors
        length1, length2, length3 = geometry.arm_lengths
        area = geometry.doubled_area
        # The inverse of the matrix of the anchor differences turns differences between the arms
        # into a slope of the carriages' plane, and its columns are those of the barycentric
        # coordinates of the platform in the anchor triangle.
        ux, uy = (y3 - y1) / area, (x1 - x3) / area
        vx, vy = (y1 - y2) / area, (x2 - x1) / area
        k2 = ((x2 - x1) ** 2 + (y2 - y1) ** 2 + (length1 - length2) * (length1 + length2)) / 2.0
        k3 = ((x3 - x1) ** 2 + (y3 - y1) ** 2 + (length1 - length3) * (length1 + length3)) / 2.0
        self._inverse_constants = (
            *(x1, y1, length1 * length1),
            *(x2, y2, length2 * length2),
            *(x3, y3, length3 * length3),
            *(-ux, -uy, -vx, -vy),
        )
        self._forward_constants = (
            *(x1, y1, length1 * length1),
            *(ux, vx, uy, vy),
            *(ux * k2 + vx * k3, uy * k2 + vy * k3),
        )
        self._rate_constants = (x1, y1, x2 - x1, y2 - y1, x3 - x1, y3 - y1, area)
        self._single_mode = geometry.has_single_assembly_mode()

    def __eq__(self, other: object) -> bool:
        """Return whether the other machine has the same geometry, and so the same poses."""
        return self.geometry == other.geometry if isinstance(other, TriGlide) else NotImplemented

    def __hash__(self) -> int:
        """Return the hash of the geometry."""
        return hash(self.geometry)

    def __repr__(self) -> str:
        """Return the call that makes this machine."""
        return f"TriGlide({self.geometry!r})"

    def inverse(self, position: Iterable[float]) -> Vector3:
        """Return the slider heights that hold the platform at ``position``.

        Args:
            position: x, y, z of the platform. Shape (3,) [m].

        Returns:
            Heights of the carriages. Shape (3,) [m].

        Raises:
            WrongShapeError: if there are not three numbers.
            NotANumberError: if one of them is no number.
            NotFiniteError: if one of them is NaN or infinite.
            ArmTooShortError: if an arm is not longer than its horizontal distance.
            WrongAssemblyModeError: if the platform is not below the plane of the carriages.
                Both are an UnreachableError.
        """
        x, y, z = three_floats("position", position)
        _, _, q1, _, _, q2, _, _, q3 = arms = self._arms(x, y)
        # Written so that NaN and infinity fail a comparison and cost nothing otherwise.
        if q1 > 0.0 and q2 > 0.0 and q3 > 0.0 and z * 0.0 == 0.0:
            s1 = sqrt(q1)
            s2 = sqrt(q2)
            s3 = sqrt(q3)
            if self._single_mode or self._depth(arms, s1, s2, s3) > 0.0:
                return s1 + z, s2 + z, s3 + z
        raise self._inverse_error((x, y, z), (0.0, 0.0, 0.0))

    def inverse_velocity(
        self, position: Iterable[float], velocity: Iterable[float]
    ) -> tuple[Vector3, Vector3]:
        """Return slider heights and their rates for a moving platform.

        Args:
            position: x, y, z of the platform. Shape (3,) [m].
            velocity: of the platform. Shape (3,) [m/s].

        Returns:
            Heights [m] and height rates [m/s], each of shape (3,).

        Raises:
            KinematicsError: as in ``inverse``, for the velocity too.
        """
        x, y, z = three_floats("position", position)
        dx, dy, dz = three_floats("velocity", velocity)
        f1x, f1y, q1, f2x, f2y, q2, f3x, f3y, q3 = arms = self._arms(x, y)
        if q1 > 0.0 and q2 > 0.0 and q3 > 0.0:
            s1 = sqrt(q1)
            s2 = sqrt(q2)
            s3 = sqrt(q3)
            rate1 = (f1x * dx + f1y * dy) / s1 + dz
            # The first rate holds all of the velocity: it is finite only if the velocity is.
            if (z + rate1) * 0.0 == 0.0 and (
                self._single_mode or self._depth(arms, s1, s2, s3) > 0.0
            ):
                return (
                    (s1 + z, s2 + z, s3 + z),
                    (
                        rate1,
                        (f2x * dx + f2y * dy) / s2 + dz,
                        (f3x * dx + f3y * dy) / s3 + dz,
                    ),
                )
        raise self._inverse_error((x, y, z), (dx, dy, dz))

    def forward(self, heights: Iterable[float]) -> Vector3:
        """Return the platform position that belongs to slider ``heights``.

        Of the two points where the arms meet it is the one below the plane of the carriages.

        Args:
            heights: of the carriages. Shape (3,) [m].

        Returns:
            x, y, z of the platform. Shape (3,) [m].

        Raises:
            WrongShapeError: if there are not three numbers.
            NotANumberError: if one of them is no number.
            NotFiniteError: if one of them is NaN or infinite.
            SpheresDoNotMeetError: if the arms do not meet.
            PlatformAboveSliderError: if they meet above one of the sliders. Both are a NoPoseError.
        """
        h1, h2, h3 = three_floats("heights", heights)
        d2 = h2 - h1
        d3 = h3 - h1
        px, py, mx, my, n, discriminant = self._meeting_line(d2, d3)
        if discriminant > 0.0:
            w = (px * mx + py * my - sqrt(discriminant)) / n
            if w < 0.0 and w < d2 and w < d3:
                x1, y1 = self._forward_constants[:2]
                return x1 + (px - mx * w), y1 + (py - my * w), h1 + w
        raise self._forward_error((h1, h2, h3), (0.0, 0.0, 0.0))

    def forward_velocity(
        self, heights: Iterable[float], height_rates: Iterable[float]
    ) -> tuple[Vector3, Vector3]:
        """Return platform position and velocity for moving sliders.

        Args:
            heights: of the carriages. Shape (3,) [m].
            height_rates: their velocities. Shape (3,) [m/s].

        Returns:
            Position [m] and velocity [m/s] of the platform, each of shape (3,).

        Raises:
            KinematicsError: as in ``forward``, for the rates too.
        """
        h1, h2, h3 = three_floats("heights", heights)
        rate1, rate2, rate3 = three_floats("height_rates", height_rates)
        d2 = h2 - h1
        d3 = h3 - h1
        px, py, mx, my, n, discriminant = self._meeting_line(d2, d3)
        if discriminant > 0.0:
            root = sqrt(discriminant)
            w = (px * mx + py * my - root) / n
            if w < 0.0 and w < d2 and w < d3:
                wx = px - mx * w
                wy = py - my * w
                x1, y1, c2x, c2y, c3x, c3y, area = self._rate_constants
                g2 = (d2 - w) * (rate2 - rate1)
                g3 = (d3 - w) * (rate3 - rate1)
                qx = c2x * g3 - c3x * g2
                qy = c2y * g3 - c3y * g2
                qz = d2 * g3 - d3 * g2
                scale = area * root
                dx = (w * qy - wy * qz) / scale
                dy = (wx * qz - w * qx) / scale
                dz = (wy * qx - wx * qy) / scale
                if (dx + dy + dz) * 0.0 == 0.0:
                    return (x1 + wx, y1 + wy, h1 + w), (dx, dy, rate1 + dz)
        raise self._forward_error((h1, h2, h3), (rate1, rate2, rate3))

    def forward_motion(
        self, heights: Vector3, height_rates: Vector3, accelerations: Vector3
    ) -> tuple[float, ...]:
        r"""Return how the platform moves with the sliders: the fastest way to all of it.

        Seen from carriage 1 the platform is at $W = P - w M$, on the line where the arms may meet,
        and $|W|$ is constant. So $w' = W \cdot (P' - w M') / (W \cdot M)$, where $W \cdot M$ is
        the root of the discriminant; and the same, differentiated once more.

        Args:
            heights: of the carriages, plain floats as all of the others. Shape (3,) [m].
            height_rates: their velocities. Shape (3,) [m/s].
            accelerations: Shape (3,) [m/s^2].

        Returns:
            Nine plain numbers: position [m], velocity [m/s] and acceleration [m/s^2].

        Raises:
            KinematicsError: as in ``forward``.
        """
        h1, h2, h3 = heights
        v1, v2, v3 = height_rates
        a1, a2, a3 = accelerations
        d2 = h2 - h1
        d3 = h3 - h1
        # As ``_meeting_line``: its call would take a tenth of all this.
        x1, y1, b1, ux, vx, uy, vy, px0, py0 = self._forward_constants
        e2 = 0.5 * d2 * d2
        e3 = 0.5 * d3 * d3
        px = ux * e2 + vx * e3 + px0
        py = uy * e2 + vy * e3 + py0
        mx = ux * d2 + vx * d3
        my = uy * d2 + vy * d3
        n = 1.0 + mx * mx + my * my
        c = px * my - py * mx
        discriminant = n * b1 - px * px - py * py - c * c
        if discriminant > 0.0:
            root = sqrt(discriminant)
            w = (px * mx + py * my - root) / n
            d2 -= w
            d3 -= w
            if w < 0.0 < d2 and d3 > 0.0:
                wx = px - mx * w
                wy = py - my * w
                r2 = v2 - v1
                r3 = v3 - v1
                f2 = d2 * r2
                f3 = d3 * r3
                gx = ux * f2 + vx * f3
                gy = uy * f2 + vy * f3
                dw = (wx * gx + wy * gy) / root
                dx = gx - mx * dw
                dy = gy - my * dw
                f2 = d2 * (a2 - a1) + r2 * (r2 - 2.0 * dw)
                f3 = d3 * (a3 - a1) + r3 * (r3 - 2.0 * dw)
                gx = ux * f2 + vx * f3
                gy = uy * f2 + vy * f3
                ddw = (wx * gx + wy * gy + dx * dx + dy * dy + dw * dw) / root
                return (
                    *(x1 + wx, y1 + wy, h1 + w),
                    *(dx, dy, v1 + dw),
                    *(gx - mx * ddw, gy - my * ddw, a1 + ddw),
                )
        raise self._forward_error(heights, height_rates)

    def jacobian(self, position: Iterable[float]) -> Matrix3:
        r"""Return the matrix that turns the platform velocity into the height rates.

        Row i is $(F_{ix}/s_i, F_{iy}/s_i, 1)$; it has no unit.

        Args:
            position: x, y, z of the platform. Shape (3,) [m].

        Returns:
            Rows of the matrix. Shape (3, 3).

        Raises:
            KinematicsError: as in ``inverse``.
        """
        x, y, _ = place = three_floats("position", position)
        self.inverse(place)
        f1x, f1y, q1, f2x, f2y, q2, f3x, f3y, q3 = self._arms(x, y)
        s1, s2, s3 = sqrt(q1), sqrt(q2), sqrt(q3)
        return (f1x / s1, f1y / s1, 1.0), (f2x / s2, f2y / s2, 1.0), (f3x / s3, f3y / s3, 1.0)

    def singular_values(self, position: Iterable[float]) -> tuple[float, float]:
        """Return the largest and the smallest singular value of the Jacobian.

        No motion of the platform needs sliders faster than the largest times its own speed
        (Euclidean norms of both), and no motion of the sliders drives the platform faster than
        their speed divided by the smallest.

        Raises:
            KinematicsError: as in ``inverse``.
        """
        largest, smallest = extreme_singular_values(self.jacobian(position))
        return largest, abs(smallest)

    def condition_number(self, position: Iterable[float]) -> float:
        """Return the condition number of the Jacobian in the 2-norm, at least 1.

        Raises:
            KinematicsError: as in ``inverse``.
        """
        largest, smallest = self.singular_values(position)
        return largest / smallest if smallest > 0.0 else inf

    def inverse_batch(self, positions: ArrayLike) -> FloatArray:
        """Return the slider heights of many positions.

        Args:
            positions: Shape (n, 3) [m].

        Returns:
            Shape (n, 3) [m]; a row of NaN where ``inverse`` would raise an error.

        Raises:
            WrongShapeError: if ``positions`` has another shape.
        """
        rows = array_of_shape("positions", positions, (None, 3))
        constants = (*self._inverse_constants, self._single_mode)
        return self._solved(batch.inverse, constants, rows)

    def forward_batch(self, heights: ArrayLike) -> FloatArray:
        """Return the platform positions of many slider heights.

        Args:
            heights: Shape (n, 3) [m].

        Returns:
            Shape (n, 3) [m]; a row of NaN where ``forward`` would raise an error.

        Raises:
            WrongShapeError: if ``heights`` has another shape.
        """
        rows = array_of_shape("heights", heights, (None, 3))
        return self._solved(batch.forward, self._forward_constants, rows)

    def condition_number_batch(self, positions: ArrayLike) -> FloatArray:
        """Return the condition number of the Jacobian of many positions, as for a map.

        Args:
            positions: Shape (n, 3) [m].

        Returns:
            Shape (n,); NaN where ``inverse`` would raise an error.

        Raises:
            WrongShapeError: if ``positions`` has another shape.
        """
        places = array_of_shape("positions", positions, (None, 3))
        # At the height zero: next to a large one, the rises would lose their digits.
        with np.errstate(invalid="ignore"):
            rises = self.inverse_batch(places * (1.0, 1.0, 0.0))
        across = np.asarray(self.geometry.anchors) - places[:, np.newaxis, :2]
        matrices = np.ones((3, 3, len(places)))
        np.divide(across.transpose(1, 2, 0), rises.T[:, np.newaxis], out=matrices[:, :2])
        largest, smallest = extreme_singular_values_batch(matrices)
        return np.asarray(np.abs(largest / smallest))

    def _arms(self, x: float, y: float) -> tuple[float, ...]:
        """Return the horizontal part of each arm, two numbers [m], and its rise squared [m^2]."""
        x1, y1, b1, x2, y2, b2, x3, y3, b3, _, _, _, _ = self._inverse_constants
        f1x = x1 - x
        f1y = y1 - y
        f2x = x2 - x
        f2y = y2 - y
        f3x = x3 - x
        f3y = y3 - y
        q1 = b1 - f1x * f1x - f1y * f1y
        q2 = b2 - f2x * f2x - f2y * f2y
        q3 = b3 - f3x * f3x - f3y * f3y
        return f1x, f1y, q1, f2x, f2y, q2, f3x, f3y, q3

    def _depth(self, arms: Sequence[float], s1: float, s2: float, s3: float) -> float:
        """Return how far the platform is below the carriages' plane [m], from arms and rises."""
        f1x, f1y = arms[:2]
        ux, uy, vx, vy = self._inverse_constants[9:]
        return s1 + (ux * f1x + uy * f1y) * (s2 - s1) + (vx * f1x + vy * f1y) * (s3 - s1)

    def _meeting_line(self, d2: float, d3: float) -> tuple[float, ...]:
        """Return where the arms may meet, for heights above the first carriage [m].

        Seen from carriage 1, on the line (px, py, 0) - w (mx, my, -1): px, py, mx, my, and with n
        and the discriminant the w at the lower end of arm 1, (p m - sqrt(discriminant)) / n.
        """
        _, _, b1, ux, vx, uy, vy, px0, py0 = self._forward_constants
        e2 = 0.5 * d2 * d2
        e3 = 0.5 * d3 * d3
        px = ux * e2 + vx * e3 + px0
        py = uy * e2 + vy * e3 + py0
        mx = ux * d2 + vx * d3
        my = uy * d2 + vy * d3
        n = 1.0 + mx * mx + my * my
        c = px * my - py * mx
        return px, py, mx, my, n, n * b1 - px * px - py * py - c * c

    def _inverse_error(
        self, position: Sequence[float], velocity: Sequence[float]
    ) -> KinematicsError:
        """Return the reason why these numbers have no inverse solution."""
        not_finite = _not_finite("position", position) or _not_finite("velocity", velocity)
        if not_finite:
            return not_finite
        arms = self._arms(*position[:2])
        squared_rises = arms[2::3]
        worst = first_smallest(squared_rises)
        if squared_rises[worst] <= 0.0:
            distance = hypot(*arms[3 * worst : 3 * worst + 2])
            return ArmTooShortError(position, worst, distance, self.geometry.arm_lengths[worst])
        depth = self._depth(arms, *map(sqrt, squared_rises))
        if depth <= 0.0:
            return WrongAssemblyModeError(position, depth)
        return NotFiniteError("height_rates[0]", inf)

    def _forward_error(
        self, heights: Sequence[float], height_rates: Sequence[float]
    ) -> KinematicsError:
        """Return the reason why these numbers have no forward solution."""
        not_finite = _not_finite("heights", heights) or _not_finite("height_rates", height_rates)
        if not_finite:
            return not_finite
        h1, h2, h3 = heights
        d2, d3 = h2 - h1, h3 - h1
        px, py, mx, my, n, discriminant = self._meeting_line(d2, d3)
        if not discriminant > 0.0:
            # Heights so far apart that their squares overflow leave NaN.
            too_far = discriminant if isfinite(discriminant) else -inf
            return SpheresDoNotMeetError(heights, too_far, max(self.geometry.arm_lengths))
        w = (px * mx + py * my - sqrt(discriminant)) / n
        rises = (-w, d2 - w, d3 - w)
        lowest = first_smallest(rises)
        if rises[lowest] <= 0.0:
            return PlatformAboveSliderError(heights, lowest, rises[lowest])
        return NotFiniteError("velocity[2]", inf)


def _not_finite(name: str, values: Sequence[float]) -> NotFiniteError | None:
    """Return the error for the first component that is NaN or infinite, if there is one."""
    for index, value in enumerate(values):
        if not isfinite(value):
            return NotFiniteError(f"{name}[{index}]", float(value))
    return None
