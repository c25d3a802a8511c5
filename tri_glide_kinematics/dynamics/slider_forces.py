r"""Forces of the sliders for a motion, and the motion for forces, in closed form.

Each arm has constant masses in the velocities of its ends (``Arm.end_masses``), so the machine has
constant masses in the heights $h$ and the platform position $p$ together. With $J$ the Jacobian
of the heights, $k$ the third row of $J^{-1}$, $e$ the vertical unit vector and $m_i$, $b_i$, $M$
the constants of ``Constants``, the forces of the sliders are

$$F_i = m_i \ddot h_i + b_i \ddot z - w_i + y_i + \text{friction}_i, \qquad
J^T y = M \ddot p + e \sum_i b_i \ddot h_i - W.$$

The derivation is in docs/dynamics.md. The functions for one pose calculate in plain floats, as in
``TriGlide``.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from math import copysign
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import array_of_shape, finite_vector, positive, three_floats
from tri_glide_kinematics.dynamics.equations import (
    Slopes,
    driven,
    height_rates,
    platform_rates,
    slopes_of,
    squares_of,
)
from tri_glide_kinematics.dynamics.masses import Constants, Masses
from tri_glide_kinematics.errors import NotFiniteError
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3, combined

Matrix3 = tuple[Vector3, Vector3, Vector3]

# Poses per block: their intermediate results stay in the processor's cache.
BLOCK = 6_000

# Combinations of sliders that stay and that move are followed so often; nearly always two will do.
GUESSES = 6


class Energy(NamedTuple):
    """Energy of the whole machine.

    Attributes:
        kinetic: [J].
        potential: zero where all heights and the position of the platform are zero [J].
    """

    kinetic: float
    potential: float


class PathForces(NamedTuple):
    r"""Forces along a path $p(s)$, linear in what its timing chooses.

    The forces are $a \ddot s + b \dot s^2 + c + d \dot s + f \operatorname{sign} \dot s$, with the
    attributes in this order. Each has shape (n, 3).

    Attributes:
        acceleration: a, [N] for each unit of the acceleration of s.
        speed_squared: b, [N] for each unit of the squared speed of s.
        rest: c, the forces that hold the platform at the place [N].
        speed: d, viscous friction, [N] for each unit of the speed of s.
        direction: f, dry friction; its sign is that of the slider's way along the path [N].
    """

    acceleration: FloatArray
    speed_squared: FloatArray
    rest: FloatArray
    speed: FloatArray
    direction: FloatArray

    def at(self, speeds: ArrayLike, accelerations: ArrayLike) -> FloatArray:
        """Return the forces for a timing of the path.

        Args:
            speeds: of s. Shape (n,).
            accelerations: of s. Shape (n,).

        Returns:
            Shape (n, 3) [N].

        Raises:
            WrongShapeError: if an array has another shape.
        """
        shape = (len(self.rest),)
        speed = array_of_shape("speeds", speeds, shape)[:, np.newaxis]
        acceleration = array_of_shape("accelerations", accelerations, shape)[:, np.newaxis]
        return np.asarray(
            self.acceleration * acceleration
            + (self.speed_squared * speed + self.speed) * speed
            + self.rest
            + self.direction * np.sign(speed)
        )


class SliderForces:
    """The forces of the sliders of a machine with masses, whose constants are worked out once.

    Forces are those that the drives have to exert, upwards positive.

    Attributes:
        machine: whose sliders they are.
        masses: that it moves.
        constants: the masses in the velocities of sliders and platform.
    """

    __slots__ = ("_friction", "_geometry", "_numbers", "constants", "machine", "masses")

    def __init__(self, machine: TriGlide, masses: Masses) -> None:
        """Prepare the constants.

        Args:
            machine: whose sliders they are.
            masses: that it moves.
        """
        self.machine = machine
        self.masses = masses
        constants = Constants.of(machine.geometry.arm_lengths, masses)
        self.constants = constants
        self._numbers = (
            *constants.sliders,
            *constants.couplings,
            constants.platform,
            *constants.weights,
            *constants.weight,
        )
        self._friction = (*masses.coulomb, *masses.viscous)
        self._geometry = machine.geometry

    def __repr__(self) -> str:
        """Return the call that makes this object."""
        return f"SliderForces({self.machine!r}, {self.masses!r})"

    def with_payload(self, payload: float) -> SliderForces:
        """Return the forces of the same machine with another ``payload`` [kg].

        Raises:
            KinematicsError: as for ``Masses``.
        """
        return SliderForces(self.machine, self.masses.with_payload(payload))

    def forces(
        self, heights: Iterable[float], velocities: Iterable[float], accelerations: Iterable[float]
    ) -> Vector3:
        """Return the forces for a motion of the sliders.

        Dry friction of a slider at rest is not known from its motion, and counts as zero.

        Args:
            heights: Shape (3,) [m].
            velocities: Shape (3,) [m/s].
            accelerations: Shape (3,) [m/s^2].

        Returns:
            Shape (3,) [N].

        Raises:
            KinematicsError: as for ``TriGlide.forward_velocity``, for the accelerations too.
        """
        rows = three_floats("heights", heights)
        rates = three_floats("velocities", velocities)
        a1, a2, a3 = second = three_floats("accelerations", accelerations)
        position, velocity = self.machine.forward_velocity(rows, rates)
        slopes = slopes_of(self._geometry, rows, position)
        q1, q2, q3 = squares_of(rows, position, rates, velocity)
        platform = platform_rates(slopes, a1 + q1, a2 + q2, a3 + q3)
        return self._with_friction(rates, driven(self._numbers, slopes, second, platform), second)

    def at(
        self, position: Iterable[float], velocity: Iterable[float], acceleration: Iterable[float]
    ) -> Vector3:
        """Return the forces for a motion of the platform; else as ``forces``.

        Args:
            position: Shape (3,) [m].
            velocity: Shape (3,) [m/s].
            acceleration: Shape (3,) [m/s^2].

        Returns:
            Shape (3,) [N].

        Raises:
            KinematicsError: as for ``TriGlide.inverse_velocity``, for the acceleration too.
        """
        place = three_floats("position", position)
        rate = three_floats("velocity", velocity)
        platform = three_floats("acceleration", acceleration)
        heights, rates = self.machine.inverse_velocity(place, rate)
        slopes = slopes_of(self._geometry, heights, place)
        q1, q2, q3 = squares_of(heights, place, rates, rate)
        a1, a2, a3 = height_rates(slopes, *platform)
        forces = driven(self._numbers, slopes, (a1 - q1, a2 - q2, a3 - q3), platform)
        return self._with_friction(rates, forces, platform)

    def mass_matrix(self, heights: Iterable[float]) -> Matrix3:
        """Return the matrix that turns accelerations of the sliders into forces.

        Args:
            heights: Shape (3,) [m].

        Returns:
            Rows of the symmetric, positive definite matrix. Shape (3, 3) [kg].

        Raises:
            KinematicsError: as for ``TriGlide.forward``.
        """
        rows = three_floats("heights", heights)
        return self._mass_matrix(slopes_of(self._geometry, rows, self.machine.forward(rows)))

    def bias(self, heights: Iterable[float], velocities: Iterable[float]) -> Vector3:
        """Return the forces without accelerations of the sliders, and without friction.

        These hold the weight, and turn the velocities of platform and arms.

        Args:
            heights: Shape (3,) [m].
            velocities: Shape (3,) [m/s].

        Returns:
            Shape (3,) [N].

        Raises:
            KinematicsError: as for ``TriGlide.forward_velocity``.
        """
        return self._moving(heights, velocities)[1]

    def accelerations(
        self, heights: Iterable[float], velocities: Iterable[float], forces: Iterable[float]
    ) -> Vector3:
        """Return the accelerations of the sliders that forces of the drives give.

        A slider with a velocity of exactly zero stays at rest while its dry friction is enough to
        hold it. Which ones stay is decided for all sliders together.

        Args:
            heights: Shape (3,) [m].
            velocities: Shape (3,) [m/s].
            forces: of the drives. Shape (3,) [N].

        Returns:
            Shape (3,) [m/s^2].

        Raises:
            KinematicsError: as for ``forces``.
        """
        rates = three_floats("velocities", velocities)
        driving = finite_vector("forces", forces, 3)
        matrix, bias = self._moving(heights, rates)
        coulomb, viscous = self.masses.coulomb, self.masses.viscous
        rest, dry = [], []
        for i in range(3):
            moving = rates[i] != 0.0
            friction = viscous[i] * rates[i] + (copysign(coulomb[i], rates[i]) if moving else 0.0)
            rest.append(driving[i] - bias[i] - friction)
            dry.append(0.0 if moving else coulomb[i])
        return _against_dry_friction(matrix, rest, dry, (0.0, 0.0, 0.0))

    def step(
        self,
        heights: Iterable[float],
        velocities: Iterable[float],
        forces: Iterable[float],
        duration: float,
    ) -> tuple[Vector3, Vector3]:
        """Return heights and velocities after a short time, as for a simulation.

        This is the midpoint rule, whose error goes with the square of the duration. Dry friction
        acts by the velocities at the end of the step (Moreau, "Unilateral contact and dry friction
        in finite freedom dynamics", 1988): so a slider comes to rest within a step and stays there,
        and dry friction, however large, makes nothing swing.

        Args:
            heights: Shape (3,) [m].
            velocities: Shape (3,) [m/s].
            forces: of the drives, constant over the step. Shape (3,) [N].
            duration: of the step, greater than zero [s].

        Returns:
            Heights [m] and velocities [m/s], each of shape (3,).

        Raises:
            KinematicsError: as for ``forces``, or if the duration is not greater than zero.
        """
        places = three_floats("heights", heights)
        rates = three_floats("velocities", velocities)
        driving = finite_vector("forces", forces, 3)
        time = positive("duration", duration, "s")
        half = 0.5 * time
        middle = combined(1.0, places, half, rates)
        dry = [time * friction for friction in self.masses.coulomb]
        d1, d2, d3 = self.masses.viscous
        # Half of the viscous friction is that of the velocities before the step.
        braking = (half * d1 * rates[0], half * d2 * rates[1], half * d3 * rates[2])
        after, between = rates, rates
        # The forces that turn velocities are those in the middle of the step: a first guess of
        # them, then those of the velocities that it gives.
        for _ in range(2):
            matrix, bias = self._moving(middle, between)
            momenta = [
                sum(m * rate for m, rate in zip(row, rates)) + time * (force - each) - lost
                for row, force, each, lost in zip(matrix, driving, bias, braking)
            ]
            (a, b, c), (_, d, e), (_, _, f) = matrix
            braked = (a + half * d1, b, c), (b, d + half * d2, e), (c, e, f + half * d3)
            after = _against_dry_friction(braked, momenta, dry, rates)
            between = combined(0.5, rates, 0.5, after)
        return combined(1.0, places, time, between), after

    def energy(self, heights: Iterable[float], velocities: Iterable[float]) -> Energy:
        """Return the energy of the machine in motion.

        Args:
            heights: Shape (3,) [m].
            velocities: Shape (3,) [m/s].

        Raises:
            KinematicsError: as for ``TriGlide.forward_velocity``.
        """
        rows = three_floats("heights", heights)
        rates = three_floats("velocities", velocities)
        position, (dx, dy, dz) = self.machine.forward_velocity(rows, rates)
        sliders, couplings, platform, weights, weight = self.constants
        doubled = platform * (dx * dx + dy * dy + dz * dz)
        potential = -sum(w * place for w, place in zip(weight, position))
        for mass, coupling, slider_weight, height, rate in zip(
            sliders, couplings, weights, rows, rates
        ):
            doubled += (mass * rate + 2.0 * coupling * dz) * rate
            potential -= slider_weight * height
        return Energy(0.5 * doubled, potential)

    def forces_batch(
        self, heights: ArrayLike, velocities: ArrayLike, accelerations: ArrayLike
    ) -> FloatArray:
        """Return the forces for many motions of the sliders; else as ``forces``.

        Args:
            heights: Shape (n, 3) [m].
            velocities: Shape (n, 3) [m/s].
            accelerations: Shape (n, 3) [m/s^2].

        Returns:
            Shape (n, 3) [N], in Fortran order; a row of NaN where ``forces`` would raise an error.

        Raises:
            WrongShapeError: if an array has another shape.
        """
        rows = array_of_shape("heights", heights, (None, 3))
        rates = array_of_shape("velocities", velocities, rows.shape)
        second = array_of_shape("accelerations", accelerations, rows.shape)
        positions = self.machine.forward_batch(rows)
        result = np.empty(rows.shape[::-1])
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            for start in range(0, len(rows), BLOCK):
                some = slice(start, start + BLOCK)
                place, height, rate, acceleration = (
                    np.ascontiguousarray(each[some].T) for each in (positions, rows, rates, second)
                )
                slopes = slopes_of(self._geometry, height, place)
                squares = squares_of(height, place, rate, platform_rates(slopes, *rate))
                platform = platform_rates(slopes, *(acceleration + squares))
                forces = driven(self._numbers, slopes, acceleration, platform)
                for row, *each in zip(
                    result, forces, rate, self.masses.viscous, self.masses.coulomb
                ):
                    force, velocity, viscous, coulomb = each
                    row[some] = force + viscous * velocity + coulomb * np.sign(velocity)
        # An infinity would leave infinite forces, where one call raises an error. The first force
        # holds all numbers: it is finite only if they are.
        result[:, ~np.isfinite(result[0])] = np.nan
        return result.T

    def along_path(
        self, positions: ArrayLike, tangents: ArrayLike, curvatures: ArrayLike
    ) -> PathForces:
        """Return the forces along a path of the platform, linear in what its timing chooses.

        Args:
            positions: p(s). Shape (n, 3) [m].
            tangents: the first derivative of p by s. Shape (n, 3).
            curvatures: the second derivative of p by s. Shape (n, 3).

        Returns:
            Each part of shape (n, 3); a row of NaN where there is no pose.

        Raises:
            WrongShapeError: if an array has another shape.
        """
        rows = array_of_shape("positions", positions, (None, 3))
        first = array_of_shape("tangents", tangents, rows.shape).T
        second = array_of_shape("curvatures", curvatures, rows.shape).T
        places, heights = rows.T, self.machine.inverse_batch(rows).T
        slopes = slopes_of(self._geometry, heights, places)
        rates = np.array(height_rates(slopes, *first))
        bends = np.subtract(
            height_rates(slopes, *second), squares_of(heights, places, rates, first)
        )
        still = np.zeros(rates.shape)
        at_rest, needed, bent = (
            np.transpose(driven(self._numbers, slopes, *each))
            for each in ((still, still), (rates, first), (bends, second))
        )
        return PathForces(
            needed - at_rest,
            bent - at_rest,
            at_rest,
            rates.T * self.masses.viscous,
            np.sign(rates).T * self.masses.coulomb,
        )

    def _moving(
        self, heights: Iterable[float], velocities: Iterable[float]
    ) -> tuple[Matrix3, Vector3]:
        """Return mass matrix and bias."""
        rows = three_floats("heights", heights)
        rates = three_floats("velocities", velocities)
        position, velocity = self.machine.forward_velocity(rows, rates)
        slopes = slopes_of(self._geometry, rows, position)
        platform = platform_rates(slopes, *squares_of(rows, position, rates, velocity))
        return self._mass_matrix(slopes), driven(self._numbers, slopes, (0.0, 0.0, 0.0), platform)

    def _with_friction(self, rates: Vector3, forces: Vector3, accelerations: Vector3) -> Vector3:
        """Add the friction; an acceleration that is not finite is refused here."""
        c1, c2, c3, d1, d2, d3 = self._friction
        v1, v2, v3 = rates
        f1, f2, f3 = forces
        if not (f1 + f2 + f3) * 0.0 == 0.0:
            finite_vector("accelerations", accelerations, 3)
            raise NotFiniteError("forces[0]", f1 + f2 + f3)
        return (
            f1 + d1 * v1 + (c1 if v1 > 0.0 else -c1 if v1 < 0.0 else 0.0),
            f2 + d2 * v2 + (c2 if v2 > 0.0 else -c2 if v2 < 0.0 else 0.0),
            f3 + d3 * v3 + (c3 if v3 > 0.0 else -c3 if v3 < 0.0 else 0.0),
        )

    def _mass_matrix(self, slopes: Slopes) -> Matrix3:
        """Return the mass matrix of the sliders."""
        sliders, couplings, mass, _, _ = self.constants
        # Its columns are the rates of the platform for each slider alone.
        columns = (
            platform_rates(slopes, 1.0, 0.0, 0.0),
            platform_rates(slopes, 0.0, 1.0, 0.0),
            platform_rates(slopes, 0.0, 0.0, 1.0),
        )
        rows = [[0.0] * 3 for _ in range(3)]
        for i, (xi, yi, zi) in enumerate(columns):
            for j in range(i, 3):
                xj, yj, zj = columns[j]
                entry = mass * (xi * xj + yi * yj + zi * zj)
                entry += couplings[i] * zj + couplings[j] * zi
                rows[i][j] = rows[j][i] = entry + sliders[i] if i == j else entry
        (a, b, c), (d, e, f), (g, h, k) = rows
        return (a, b, c), (d, e, f), (g, h, k)


def _against_dry_friction(
    matrix: Matrix3,
    driving: Sequence[float],
    dry: Sequence[float],
    before: Sequence[float],
) -> Vector3:
    r"""Return the x for which $A x + k \operatorname{sign} x = r$, where sign 0 is from -1 to 1.

    It is where $x^T A x / 2 - r x + \sum k_i |x_i|$ is least, so there is exactly one.

    Args:
        matrix: A, symmetric and positive definite. Shape (3, 3).
        driving: r. Shape (3,).
        dry: k. Shape (3,).
        before: numbers that are likely to have the signs of x. Shape (3,).
    """
    signs = tuple(
        1.0 if friction == 0.0 or each > 0.0 else -1.0 if each < 0.0 else 0.0
        for friction, each in zip(dry, before)
    )
    for _ in range(GUESSES):
        x, left = _balanced(matrix, driving, dry, signs)
        # A slider that moves against its friction stops; one that friction does not hold begins.
        found = tuple(
            sign
            if friction == 0.0 or (each * sign > 0.0 if sign else abs(rest) <= friction)
            else (0.0 if sign else copysign(1.0, rest))
            for friction, sign, each, rest in zip(dry, signs, x, left)
        )
        if found == signs:
            return x
        signs = found
    # The least value of all combinations: so no rounding error decides, and none is left out.
    best, least = (0.0, 0.0, 0.0), 0.0
    for signs in product(*((0.0, 1.0, -1.0) if friction > 0.0 else (1.0,) for friction in dry)):
        x, left = _balanced(matrix, driving, dry, signs)
        value = sum(
            friction * abs(each) - 0.5 * (force + rest) * each
            for friction, each, force, rest in zip(dry, x, driving, left)
        )
        if value < least:
            best, least = x, value
    return best


def _balanced(
    matrix: Matrix3,
    driving: Sequence[float],
    dry: Sequence[float],
    signs: Sequence[float],
) -> tuple[Vector3, list[float]]:
    """Return x for friction with these ``signs``, and what is left for the friction to hold."""
    pushing = [force - sign * friction for force, friction, sign in zip(driving, dry, signs)]
    x1, x2, x3 = x = _solved_with(matrix, pushing, signs)
    left = [force - a * x1 - b * x2 - c * x3 for force, (a, b, c) in zip(driving, matrix)]
    return x, left


def _solved_with(matrix: Matrix3, right: Sequence[float], signs: Sequence[float]) -> Vector3:
    """Return the solution of a symmetric system whose unknowns are zero where the sign is."""
    (a, b, c), (_, d, e), (_, _, f) = matrix
    r1, r2, r3 = right
    s1, s2, s3 = signs
    if s1 == 0.0:
        a, b, c, r1 = 1.0, 0.0, 0.0, 0.0
    if s2 == 0.0:
        b, d, e, r2 = 0.0, 1.0, 0.0, 0.0
    if s3 == 0.0:
        c, e, f, r3 = 0.0, 0.0, 1.0, 0.0
    # By Cholesky's decomposition without roots, which loses no digits of unequal masses.
    l21 = b / a
    l31 = c / a
    d2 = d - l21 * b
    l32 = (e - l31 * b) / d2
    d3 = f - l31 * c - l32 * l32 * d2
    y2 = r2 - l21 * r1
    y3 = (r3 - l31 * r1 - l32 * y2) / d3
    x2 = y2 / d2 - l32 * y3
    return r1 / a - l21 * x2 - l31 * y3, x2, y3
