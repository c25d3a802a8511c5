"""Masses and friction from the efforts of the drives.

Forces are linear in masses and friction, for any motion: the matrix of a motion is its *regressor*.
So least squares find them, with standard deviations. Some masses have no effect of their own on
any force, only together with others: such a sum is told instead.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.checks import (
    array_of_shape,
    finite,
    finite_array,
    finite_vector,
    non_negative,
)
from tri_glide_kinematics.dynamics.equations import (
    driven,
    platform_rates,
    slopes_of,
    squares_of,
)
from tri_glide_kinematics.dynamics.masses import STANDARD_GRAVITY, Arm, Masses
from tri_glide_kinematics.errors import KinematicsError, NotAChoiceError
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.wording import number_text

SLIDERS = (1, 2, 3)

CARRIAGES = tuple(f"carriage {i}" for i in SLIDERS)
COUNTERWEIGHTS = tuple(f"counterweight {i}" for i in SLIDERS)
PLATFORM = "platform"
ARM_MASSES = tuple(f"arm {i}" for i in SLIDERS)
ARM_MOMENTS = tuple(f"moment of arm {i}" for i in SLIDERS)
ARM_INERTIAS = tuple(f"inertia of arm {i}" for i in SLIDERS)
COULOMB = tuple(f"dry friction {i}" for i in SLIDERS)
VISCOUS = tuple(f"viscous friction {i}" for i in SLIDERS)

# The parameters with uniform arms, and with arms of any kind. The platform holds its payload.
UNIFORM_ARMS = (*CARRIAGES, *COUNTERWEIGHTS, PLATFORM, *ARM_MASSES, *COULOMB, *VISCOUS)
ANY_ARMS = (
    *(*CARRIAGES, *COUNTERWEIGHTS, PLATFORM),
    *(*ARM_MASSES, *ARM_MOMENTS, *ARM_INERTIAS, *COULOMB, *VISCOUS),
)

# Default: most machines have no counterweights [kg].
NO_COUNTERWEIGHTS: Mapping[str, float] = dict.fromkeys(COUNTERWEIGHTS, 0.0)

# Slower sliders tell little of their friction: near rest it may be anything [m/s].
SLOWEST = 0.002

# The squared distance of a column from sums of others, as a part of its own square, that is no more
# than rounding.
DEPENDENT = 1e-10
# Added to the noise of efforts [N].
TINY = 1e-12
# Counts in such sums, below which they are rounding errors of zero.
NO_PART = 1e-5


class NotIdentifiedError(KinematicsError):
    """Masses that the efforts do not tell, where all are needed."""

    def __init__(self, sums: tuple[str, ...], missing: tuple[str, ...]) -> None:
        """Store the ``sums`` of which only the sum is known, and what else is ``missing``."""
        super().__init__(
            f"not known alone: {', '.join(missing)}"
            + (f"; known are the sums {'; '.join(sums)}" if sums else "")
        )
        self.sums = sums
        self.missing = missing


class TooFewSamplesError(KinematicsError):
    """Less was measured than there are unknowns."""

    def __init__(self, count: int, unknowns: int) -> None:
        """Store the ``count`` of efforts of sliders in motion, and of the ``unknowns``."""
        super().__init__(
            f"{count} efforts of sliders in motion are too few for {unknowns} unknown masses and "
            "frictions"
        )
        self.count = count
        self.unknowns = unknowns


class Estimate(NamedTuple):
    """A mass, a friction, or a sum of them of which only the sum is known.

    Attributes:
        parts: the parameters, and how often each counts. For one that is known alone: itself.
        value: [kg], [N] or [N s/m].
        deviation: standard deviation, in the same unit.
    """

    parts: Mapping[str, float]
    value: float
    deviation: float

    @property
    def name(self) -> str:
        """The parameter, or the sum in words."""
        text = ""
        for name, count in self.parts.items():
            size = abs(count)
            times = "" if abs(size - 1.0) < NO_PART else f"{number_text(size, 4)} "
            sign = "-" if count < 0.0 else "+"
            text += f" {sign} {times}{name}" if text else f"{times}{name}"
        return text


class Identified(NamedTuple):
    """What the efforts tell.

    Attributes:
        estimates: one for each number that is known: of a parameter, or of a sum.
        known: what was given.
        silent: parameters without effect on any effort, of which nothing is known.
        noise: standard deviation of the efforts of each slider from the model. Shape (3,) [N].
    """

    estimates: tuple[Estimate, ...]
    known: Mapping[str, float]
    silent: tuple[str, ...]
    noise: Vector3

    @property
    def sums(self) -> tuple[str, ...]:
        """Sums of which nothing but the sum is known, in words."""
        return tuple(each.name for each in self.estimates if len(each.parts) > 1)

    @property
    def values(self) -> dict[str, float]:
        """The parameters that are known alone, those that were given too."""
        alone = {each.name: each.value for each in self.estimates if len(each.parts) == 1}
        return {**self.known, **alone}

    def masses(self, gravity: Vector3 = STANDARD_GRAVITY) -> Masses:
        """Return the masses of a machine with uniform arms; the payload counts as platform.

        Raises:
            NotIdentifiedError: if not all of them are known.
            OutOfBoundsError: if one of them is negative; then the motion tells too little of it.
        """
        values = self.values
        missing = tuple(name for name in UNIFORM_ARMS if name not in values)
        if missing:
            raise NotIdentifiedError(self.sums, missing)
        rows = (CARRIAGES, COUNTERWEIGHTS, ARM_MASSES, COULOMB, VISCOUS)
        carriages, counterweights, arms, coulomb, viscous = (
            (values[one], values[two], values[three]) for one, two, three in rows
        )
        return Masses(
            carriages,
            (Arm(arms[0]), Arm(arms[1]), Arm(arms[2])),
            values[PLATFORM],
            counterweights=counterweights,
            coulomb=coulomb,
            viscous=viscous,
            gravity=gravity,
        )


def regressor(
    machine: TriGlide,
    heights: ArrayLike,
    velocities: ArrayLike,
    accelerations: ArrayLike,
    *,
    gravity: Vector3 = STANDARD_GRAVITY,
    uniform_arms: bool = True,
) -> FloatArray:
    """Return the matrices that turn the parameters into the forces of the sliders.

    The parameters are those of ``UNIFORM_ARMS`` or ``ANY_ARMS``. The moment of an arm is its mass
    times its ``centre``; its inertia is that about its end at the carriage, over the square of its
    length [kg].

    Args:
        machine: whose sliders they are.
        heights: Shape (n, 3) [m].
        velocities: Shape (n, 3) [m/s].
        accelerations: Shape (n, 3) [m/s^2].
        gravity: Shape (3,) [m/s^2].
        uniform_arms: whether arms are uniform, so that their mass is all there is to know of them.

    Returns:
        Shape (n, 3, parameters); NaN where there is no pose.

    Raises:
        WrongShapeError: if an array has another shape.
        NotFiniteError: if a number is NaN or infinite.
    """
    rows = finite_array("heights", heights, (None, 3))
    shape = (len(rows), 3)
    rates = finite_array("velocities", velocities, shape).T
    second = finite_array("accelerations", accelerations, shape).T
    pull = np.array(finite_vector("gravity", gravity, 3))
    names = UNIFORM_ARMS if uniform_arms else ANY_ARMS
    # Forces are linear in the numbers of ``Constants``, and these in the parameters.
    none = np.zeros(3)
    parts = {PLATFORM: (none, none, 1.0, none, pull)}
    for i, unit in enumerate(np.eye(3)):
        weight = pull[2] * unit
        parts[CARRIAGES[i]] = unit, none, 0.0, weight, none
        parts[COUNTERWEIGHTS[i]] = unit, none, 0.0, -weight, none
        parts[ARM_MASSES[i]] = unit, none, 0.0, weight, none
        if uniform_arms:
            parts[ARM_MASSES[i]] = unit / 3.0, unit / 6.0, 1.0 / 3.0, weight / 2.0, pull / 2.0
        parts[ARM_MOMENTS[i]] = -2.0 * unit, unit, 0.0, -weight, pull
        parts[ARM_INERTIAS[i]] = unit, -unit, 1.0, none, none
    matrices = np.zeros((*shape, len(names)))
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        places = machine.forward_batch(rows).T
        slopes = slopes_of(machine.geometry, rows.T, places)
        squares = squares_of(rows.T, places, rates, platform_rates(slopes, *rates))
        platform = platform_rates(slopes, *(second + squares))
        for k, name in enumerate(names):
            if name in parts:
                numbers = np.hstack(parts[name]).tolist()
                matrices[:, :, k] = np.transpose(driven(numbers, slopes, second, platform))
        for i in range(3):
            matrices[:, i, names.index(COULOMB[i])] = np.sign(rates[i])
            matrices[:, i, names.index(VISCOUS[i])] = rates[i]
    return matrices


def identify(
    machine: TriGlide,
    heights: ArrayLike,
    velocities: ArrayLike,
    accelerations: ArrayLike,
    efforts: ArrayLike,
    *,
    gravity: Vector3 = STANDARD_GRAVITY,
    uniform_arms: bool = True,
    known: Mapping[str, float] = NO_COUNTERWEIGHTS,
    slowest: float = SLOWEST,
    used: ArrayLike | None = None,
) -> Identified:
    """Return masses and friction by least squares.

    Velocities and accelerations are best those that were commanded, as they are exact: an
    acceleration by differences of measured heights is mostly noise.

    Args:
        machine: whose sliders they are.
        heights: Shape (n, 3) [m].
        velocities: Shape (n, 3) [m/s].
        accelerations: Shape (n, 3) [m/s^2].
        efforts: forces of the drives, upwards positive. Shape (n, 3) [N].
        gravity: Shape (3,) [m/s^2].
        uniform_arms: as for ``regressor``.
        known: parameters that are known, by name, such as those that were weighed.
        slowest: efforts of a slider that is slower are left out, as its dry friction is not known
            [m/s].
        used: which of the other efforts count; all without it. Shape (n, 3).

    Raises:
        WrongShapeError: if an array has another shape.
        NotFiniteError: if a number is NaN or infinite, or a row of heights has no pose.
        NotAChoiceError: if ``known`` names what is no parameter.
        TooFewSamplesError: if fewer efforts are left than there are unknowns.
    """
    names = UNIFORM_ARMS if uniform_arms else ANY_ARMS
    for name, value in known.items():
        if name not in names:
            raise NotAChoiceError("known", name, names)
        finite(f"known {name}", value)
    matrices = regressor(
        machine, heights, velocities, accelerations, gravity=gravity, uniform_arms=uniform_arms
    )
    finite_array("regressor", matrices, matrices.shape)
    moving = np.abs(np.asarray(velocities)) >= non_negative("slowest", slowest, "m/s")
    if used is not None:
        moving &= array_of_shape("used", used, moving.shape).astype(bool)
    forces = finite_array("efforts", efforts, matrices.shape[:2])
    given = np.array([name in known for name in names])
    forces = forces - matrices[..., given] @ [known[name] for name in names if name in known]
    unknown = [name for name in names if name not in known]
    rows = [matrices[moving[:, i], i][:, ~given] for i in range(3)]
    right = [forces[moving[:, i], i] for i in range(3)]
    if sum(map(len, right)) <= len(unknown):
        raise TooFewSamplesError(sum(map(len, right)), len(unknown))
    squares = np.array([_product(part, part) for part in rows])
    products = np.array([_product(part, side[:, np.newaxis]) for part, side in zip(rows, right)])
    chosen, sums = _independent(squares.sum(axis=0))
    # Once to know the noise of each slider, then each by its own.
    noise = np.ones(3)
    for _ in range(2):
        weights = 1.0 / np.square(noise)
        matrix = np.tensordot(weights, squares[:, chosen][:, :, chosen], axes=1)
        scale = np.sqrt(np.diag(matrix))
        inverse = np.linalg.inv(matrix / np.outer(scale, scale))
        values = inverse @ (np.tensordot(weights, products[:, chosen, 0], axes=1) / scale) / scale
        left = [side - part[:, chosen] @ values for side, part in zip(right, rows)]
        # Without noise, as from a simulation, its size does not matter; but it is no divisor.
        noise = np.array([_deviation(each) for each in left]) + TINY
    deviations = np.sqrt(np.diag(inverse)) / scale
    estimates = []
    for k, (place, value, deviation) in enumerate(zip(chosen, values, deviations)):
        parts = {unknown[place]: 1.0}
        for other, counts in sums.items():
            if abs(counts[k]) > NO_PART:
                parts[unknown[other]] = float(counts[k])
        estimates.append(Estimate(parts, float(value), float(deviation)))
    told = set().union(*(each.parts for each in estimates))
    silent = tuple(name for name in unknown if name not in told)
    of_1, of_2, of_3 = noise.tolist()
    return Identified(tuple(estimates), dict(known), silent, (of_1, of_2, of_3))


def _deviation(values: FloatArray) -> float:
    """Return the standard deviation about zero."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 1.0


def _product(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return the transposed ``left`` times ``right``.

    Without the linear algebra library, which may share that out to threads, which wait for cores.
    """
    return np.asarray(np.einsum("nj,nk->jk", left, right))


def _independent(squares: FloatArray) -> tuple[list[int], dict[int, FloatArray]]:
    """Return the columns that are no sum of those before them, and the others as such sums.

    Args:
        squares: scalar products of the columns. Shape (k, k).

    Returns:
        The numbers of the independent columns, and for each other one how often each of these
        counts in it.
    """
    scale = np.sqrt(np.diag(squares))
    # A column of zeros has no effect at all: nothing can be known of it.
    safe = np.where(scale > 0.0, scale, 1.0)
    cosines = squares / np.outer(safe, safe)
    chosen: list[int] = []
    sums: dict[int, FloatArray] = {}
    for k in range(len(squares)):
        of_chosen = cosines[chosen, k]
        counts = np.linalg.solve(cosines[chosen][:, chosen], of_chosen)
        if cosines[k, k] - of_chosen @ counts > DEPENDENT:
            chosen.append(k)
        else:
            sums[k] = counts * safe[k] / safe[chosen]
    return chosen, {k: np.pad(each, (0, len(chosen) - len(each))) for k, each in sums.items()}
