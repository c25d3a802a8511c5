r"""Bounds that are added to all motion: a largest speed of the platform, largest forces of sliders.

With $w_i$ from the joint of slider i to the platform, $\lambda$ the pulls of the arms over their
lengths, and the constants of ``dynamics``, the forces are

$$F_i = m_i \ddot h_i + b_i \ddot z - w_{g,i} + \lambda_i w_{i,z} + \text{friction}_i, \qquad
\sum_i \lambda_i w_i = M \ddot p + e \sum_i b_i \ddot h_i - W.$$

The second is a linear system whose matrix has the $w_i$ as columns. With the Taylor series of the
motion it is solved order by order; bounds of the inverse in a cell come from that in its middle and
a Neumann series, as in ``series.position_of``.

A part of a force limit is what a motion uses of what is left beside the force that holds the
weight. So a motion that takes n times as long uses, but for friction, the part over the square of
n.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

import numpy as np

from tri_glide_kinematics.checks import checked_vector, positive
from tri_glide_kinematics.dynamics import SliderForces
from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.motion.errors import AddedBoundError
from tri_glide_kinematics.motion.limits.limits import (
    DIFFERENCES_TOLERANCE,
    AddedBound,
    PathPlaces,
    PathRows,
    SeenParts,
    UsedParts,
)
from tri_glide_kinematics.motion.limits.series import (
    Series,
    heights_of,
    largest_inverse,
    largest_value,
    product,
)
from tri_glide_kinematics.motion.limits.setpoint import AT_REST, SliderState
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.wording import number_text, vector_text


@dataclass(frozen=True)
class PlatformSpeedLimit(AddedBound):
    """A largest speed of the platform.

    Attributes:
        machine: whose platform it is.
        speed: [m/s].
    """

    name = "a platform speed limit"
    quantity = "platform speed"
    order = 1

    machine: TriGlide
    speed: float

    def __post_init__(self) -> None:
        """Check the speed.

        Raises:
            NotFiniteError: if it is NaN or infinite.
            OutOfBoundsError: if it is not greater than zero.
        """
        object.__setattr__(self, "speed", positive("platform_speed_limit", self.speed, "m/s"))

    @property
    def platform_speed(self) -> float:
        """The speed [m/s]."""
        return self.speed

    def used(self, position: Series, half: FloatArray) -> UsedParts:
        """Return which part of the speed is used; its square is a series as well."""
        orders = np.arange(1.0, 6.0)[:, np.newaxis, np.newaxis]
        velocity, bounds = orders * position.values[1:], orders * position.bounds[1:]
        # Of the velocity the coefficients up to the third order are known, of the fourth the bound.
        padded = np.concatenate((velocity[:4], np.zeros((2, *velocity.shape[1:]))))
        squares = product(padded, padded).sum(axis=1)[:4]
        b0, b1, b2, b3, b4 = bounds
        rest = (2.0 * (b0 * b4 + b1 * b3) + b2 * b2).sum(axis=0)
        largest = largest_value(squares, rest, half)
        return UsedParts(np.sqrt(largest) / self.speed, np.sqrt(squares[0]) / self.speed)

    def seen(self, heights: FloatArray, period: float, rounding: float) -> SeenParts:
        """Return which part of the speed is used, by differences of the places of the platform.

        Such a difference is a mean of velocities, so it keeps each limit that they keep.
        """
        places = self.machine.forward_batch(heights)
        # Errors of all heights grow by the square root of 3 over the least singular value. As the
        # largest is at least that root, this is no more than the condition number.
        wrong = 2.0 * rounding * self.machine.condition_number_batch(places)
        steps = np.linalg.norm(np.diff(places, axis=0, prepend=places[:1]), axis=1)
        parts = np.maximum(steps - wrong, 0.0) / period / self.speed
        return SeenParts(
            parts,
            0.0,
            lambda row: (
                f"the platform moves at {steps[row] / period:.9g} m/s, {parts[row]:.6f} of its "
                f"limit, {number_text(self.speed)} m/s"
            ),
        )

    def error(self, part: float, time: float) -> AddedBoundError:
        """Return the error with the speed and the limit."""
        value = part * self.speed
        return AddedBoundError("speed of the platform", value, self.speed, "m/s", time)


# Second derivatives by the coefficients of a Taylor series, from the second to the fifth.
_SECOND = np.array((2.0, 6.0, 12.0, 20.0))[:, np.newaxis, np.newaxis]
_FIRST = np.array((1.0, 2.0, 3.0, 4.0))[:, np.newaxis, np.newaxis]


class CannotHoldError(KinematicsError):
    """A force limit is too low to hold the weight."""

    refusal = Refusal.OUT_OF_BOUNDS

    def __init__(
        self, slider: int, force: float, limit: float, direction: str, position: FloatArray
    ) -> None:
        """Store the index of the ``slider``, the ``force`` [N] that it needs, and the limit [N].

        Args:
            slider: index, 0 to 2 (the text counts from 1).
            force: that holds the weight, in the direction of the limit [N].
            limit: [N].
            direction: of the limit, ``up`` or ``down``.
            position: of the platform. Shape (3,) [m].
        """
        super().__init__(
            f"force_limit_{direction}[{slider}] = {number_text(limit)} N cannot hold the weight: "
            f"slider {slider + 1} needs {number_text(force)} N with the platform at "
            f"{vector_text(position)} m"
        )
        self.slider = slider
        self.force = force
        self.limit = limit


@dataclass(frozen=True, eq=False)
class ForceLimits(AddedBound):
    """Largest forces of the sliders.

    Attributes:
        forces: of the machine, with its masses.
        up: largest forces upwards. Shape (3,) [N].
        down: largest forces downwards. Shape (3,) [N].
    """

    name = "force limits"
    quantity = "force"
    order = 2

    forces: SliderForces
    up: Vector3
    down: Vector3

    def __post_init__(self) -> None:
        """Check the limits.

        Raises:
            WrongShapeError: if a limit has not three numbers.
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if a number is not greater than zero.
        """
        for name in ("up", "down"):
            checked = checked_vector(f"force_limit_{name}", getattr(self, name), positive, "N")
            object.__setattr__(self, name, checked)

    def __eq__(self, other: object) -> bool:
        """Return whether masses and limits are the same."""
        return (
            isinstance(other, ForceLimits)
            and self.forces.masses == other.forces.masses
            and self.machine == other.machine
            and (self.up, self.down) == (other.up, other.down)
        )

    def __hash__(self) -> int:
        """Return a number for sets."""
        return hash((self.forces.masses, self.up, self.down))

    @property
    def machine(self) -> TriGlide:  # type: ignore[override]
        """Whose sliders they are."""
        return self.forces.machine

    def check_holding(self, positions: FloatArray) -> None:
        """Check that the limits can hold the weight at rest.

        Args:
            positions: of the platform. Shape (n, 3) [m].

        Raises:
            CannotHoldError: names the slider, the force that it needs, and the limit.
        """
        still = np.zeros((len(positions), 3))
        heights = self.machine.inverse_batch(positions)
        needed = self.forces.forces_batch(heights, still, still)
        for sign, limit, direction in ((1.0, self.up, "up"), (-1.0, self.down, "down")):
            beyond = sign * needed - np.array(limit)
            row, slider = divmod(int(np.nan_to_num(beyond, nan=-inf).argmax()), 3)
            if beyond[row, slider] >= 0.0:
                force = float(sign * needed[row, slider])
                raise CannotHoldError(slider, force, limit[slider], direction, positions[row])

    def acceleration(self, heights: Vector3) -> float:
        """Return how fast all sliders may get faster, whichever way, at ``heights`` [m]."""
        held = self.forces.forces(heights, AT_REST, AT_REST)
        matrix = self.forces.mass_matrix(heights)
        return min(
            max(min(up - force, down + force), _LEAST_ROOM * up) / sum(map(abs, row))
            for up, down, force, row in zip(self.up, self.down, held, matrix)
        )

    @np.errstate(invalid="ignore", divide="ignore")
    def used(self, position: Series, half: FloatArray) -> UsedParts:
        """Return which part of the forces is used that are left beside the weight."""
        constants, masses = self.forces.constants, self.forces.masses
        heights = heights_of(self.machine.geometry, position, half)
        sliders, couplings = (
            np.array(each)[:, np.newaxis] for each in (constants.sliders, constants.couplings)
        )
        weights, weight = np.array(constants.weights), np.array(constants.weight)

        # The arms: component, slider, cell; about the middles, and bounds from the first order on.
        anchors = np.array(self.machine.geometry.anchors).T
        arms = np.repeat(position.values[:4, :, np.newaxis], 3, axis=2)
        arms[0, :2] -= anchors[..., np.newaxis]
        arms[:, 2] -= heights.values[:4]
        moving = np.repeat(position.bounds[:4, :, np.newaxis], 3, axis=2)
        moving[:, 2] += heights.bounds[:4]
        moving[0] = np.abs(arms[0]) + half * moving[1]
        inverse = np.linalg.inv(arms[0].transpose(2, 0, 1)).transpose(1, 2, 0)
        largest = largest_inverse(np.abs(inverse), half * moving[1])

        # Second derivatives of platform and heights; and what they ask of the arms.
        of_platform = _SECOND * position.values[2:], _SECOND * position.bounds[2:]
        of_heights = _SECOND * heights.values[2:], _SECOND * heights.bounds[2:]
        asked, asked_most = (constants.platform * platform for platform in of_platform)
        asked[:, 2] += (couplings * of_heights[0]).sum(axis=1)
        asked_most[:, 2] += (np.abs(couplings) * of_heights[1]).sum(axis=1)
        held = np.einsum("ijn,j->in", inverse, -weight)
        asked_with_weight = asked.copy()
        asked_with_weight[0] -= weight[:, np.newaxis]
        asked_most[0] += np.abs(weight)[:, np.newaxis]
        pulls = np.zeros((3, 3, len(half)))
        pulls_most = np.zeros((4, 3, len(half)))
        for order in range(4):
            most = asked_most[order].copy()
            for lower in range(1, order + 1):
                most += np.einsum("ijn,jn->in", moving[lower], pulls_most[order - lower])
            pulls_most[order] = np.einsum("ijn,jn->in", largest, most)
            if order < 3:
                right = asked_with_weight[order].copy()
                for lower in range(1, order + 1):
                    right -= np.einsum("ijn,jn->in", arms[lower], pulls[order - lower])
                pulls[order] = np.einsum("ijn,jn->in", inverse, right)

        # The forces: up to the second order about the middles, and a bound of the third.
        viscous = np.array(masses.viscous)[:, np.newaxis]
        table = (
            sliders * of_heights[0][:3]
            + couplings * of_platform[0][:3, 2:]
            + viscous * (_FIRST[:3] * heights.values[1:4])
        )
        rest = (
            sliders * of_heights[1][3]
            + np.abs(couplings) * of_platform[1][3, 2:]
            + viscous * (_FIRST[3] * heights.bounds[4])
        )
        for order in range(4):
            for lower in range(order + 1):
                if order < 3:
                    table[order] += pulls[order - lower] * arms[lower, 2]
                else:
                    rest += pulls_most[order - lower] * moving[lower, 2]
        table[0] -= weights[:, np.newaxis]
        still = held * arms[0, 2] - weights[:, np.newaxis]

        # Dry friction acts against the motion, whose direction may change in the cell.
        coulomb = np.array(masses.coulomb)[:, np.newaxis]
        rate, slack = heights.values[1], 2.0 * half * heights.bounds[2]
        most_part, middle_part = np.zeros(len(half)), np.zeros(len(half))
        for sign, limit in ((1.0, self.up), (-1.0, self.down)):
            room = np.array(limit)[:, np.newaxis] - sign * still
            room = np.where(room > 0.0, room, 0.0)
            friction = coulomb * np.sign(sign * rate + slack)
            coefficients = np.concatenate((sign * table, rest[np.newaxis]))
            top = largest_value(coefficients, np.zeros_like(rest), half)
            used = (top + friction - sign * still) / room
            there = (sign * (table[0] - still) + coulomb * np.sign(sign * rate)) / room
            # An unknown use counts as more, and stays unknown.
            most_part = np.maximum(most_part, used.max(axis=0))
            middle_part = np.fmax(middle_part, np.nan_to_num(there, nan=inf).max(axis=0))
        return UsedParts(most_part, middle_part)

    def part_at(self, state: SliderState) -> float:
        """Return which part of the forces is used in one ``state``; a series would take longer."""
        try:
            held = self.forces.forces(state.heights, AT_REST, AT_REST)
            driven = self.forces.forces(*state)
        except KinematicsError:
            return inf
        most = 0.0
        for up, down, still, force in zip(self.up, self.down, held, driven):
            for used, room in ((force - still, up - still), (still - force, down + still)):
                most = max(most, used / room if room > 0.0 else inf)
        return most

    def rows(self, places: PathPlaces, part: float = 1.0) -> PathRows:
        """Return the rows of the forces over what is left beside weight and friction."""
        positions, tangents, curvatures, speed = places
        along = self.forces.along_path(positions.T, tangents.T, curvatures.T)
        # Viscous friction is concave over the squared speed: so its tangent is no less.
        of_squared = 0.5 * along.speed / speed[:, np.newaxis]
        of_rest = 0.5 * along.speed * speed[:, np.newaxis]
        acceleration, squared = [], []
        for sign, limit in ((1.0, self.up), (-1.0, self.down)):
            room = part * (np.array(limit) - sign * along.rest) - sign * along.direction
            room = room - np.maximum(sign * of_rest, 0.0)
            room = np.maximum(room, _LEAST_ROOM * np.array(limit))
            acceleration.append((sign * along.acceleration / room).T)
            squared.append(
                ((sign * along.speed_squared + np.maximum(sign * of_squared, 0.0)) / room).T
            )
        return PathRows(np.concatenate(acceleration), np.concatenate(squared))

    def seen(self, heights: FloatArray, period: float, rounding: float) -> SeenParts:
        """Return which part of the limits the forces use that the motion asks for.

        The acceleration of a row is a mean over the period before it and that after it. But for
        the square of the period so is the force, and keeps each limit that the forces keep. Dry
        friction counts where the slider moves the same way in both periods; else it is taken to
        help.
        """
        masses = self.forces.masses
        smooth = SliderForces(self.machine, replace(masses, coulomb=(0.0,) * 3))
        rates = np.diff(heights, axis=0, prepend=heights[:1], append=heights[-1:]) / period
        before, after = rates[:-1], rates[1:]
        found = smooth.forces_batch(heights, 0.5 * (before + after), (after - before) / period)
        still = np.zeros(heights.shape)
        held = smooth.forces_batch(heights, still, still)
        wrong = rounding / period * np.array(masses.viscous)
        wrong = wrong + 4.0 * rounding / period**2 * sum(
            np.abs(smooth.forces_batch(heights, still, still + unit) - held) for unit in np.eye(3)
        )
        one_way = np.where(before * after > 0.0, np.sign(before), 0.0)
        parts, forces = np.zeros(heights.shape), np.zeros(heights.shape)
        bounds = np.array((self.up, self.down))
        for sign, bound in zip((1.0, -1.0), bounds):
            # At a turn, friction is against one of both ways.
            friction = np.array(masses.coulomb) * np.where(one_way == 0.0, -sign, one_way)
            part = (sign * (found + friction) - wrong) / bound
            forces = np.where(part > parts, found + friction, forces)
            parts = np.maximum(part, parts)

        def text(row: int) -> str:
            slider = int(parts[row].argmax())
            force = float(forces[row, slider])
            bound = float(bounds[0 if force > 0.0 else 1, slider])
            return (
                f"slider {slider + 1} needs {force:.6g} N, {parts[row, slider]:.6f} of its limit, "
                f"{number_text(bound)} N {'upwards' if force > 0.0 else 'downwards'}"
            )

        return SeenParts(parts.max(axis=1), DIFFERENCES_TOLERANCE * period**2, text)

    def error(self, part: float, time: float) -> AddedBoundError:
        """Return the error with the part of what the weight leaves of the limits."""
        return AddedBoundError("part of the force limits beside the weight", part, 1.0, "", time)


# A room for motion that is no larger than this part of a limit is none.
_LEAST_ROOM = 1e-6
