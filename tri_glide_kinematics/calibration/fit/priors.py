"""Knowledge of a machine before anything is measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.calibration.fit.unknowns import MACHINE, MachineParameters
from tri_glide_kinematics.checks import non_negative, positive
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.wording import number_text

PRIOR_KINDS = ("anchors", "arm_lengths", "height_offsets", "common_radius", "common_arm_length")


@dataclass(frozen=True)
class Priors:
    """The nominal values with standard deviations: how far the real machine may be from them.

    The default assumes a machine that was built with care: each coordinate of an anchor is known to
    1 mm, each arm to 0.5 mm and each slider's zero to 2 mm (one standard deviation each, all
    independent and normally distributed). All anchors together may be nearer to their centre or
    farther from it, and all arms together shorter or longer, by 1 mm: a wrong radius or a wrong
    length on the drawing is wrong for all three.

    Attributes:
        anchors: standard deviation of each coordinate of each anchor [m].
        arm_lengths: standard deviation of each length [m].
        height_offsets: standard deviation of each offset [m].
        mean: around which the parameters lie; None for the nominal machine of the calibration.
        common_radius: standard deviation of what is common to the distances of all anchors from
            their centre; 0 if nothing is [m].
        common_arm_length: standard deviation of what is common to all lengths; 0 if nothing is [m].
    """

    anchors: float = 1e-3
    arm_lengths: float = 5e-4
    height_offsets: float = 2e-3
    mean: MachineParameters | None = None
    common_radius: float = 1e-3
    common_arm_length: float = 1e-3

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            NotFiniteError: if a standard deviation is NaN or infinite.
            OutOfBoundsError: if one is not greater than zero, or one of what is common less.
        """
        for name in PRIOR_KINDS:
            check = non_negative if name.startswith("common") else positive
            value = check(f"standard deviation of {name}", getattr(self, name), "m")
            object.__setattr__(self, name, value)

    def deviations(self) -> FloatArray:
        """Return those of all twelve parameters without what is common. Shape (12,) [m]."""
        return np.repeat([self.anchors, self.arm_lengths, self.height_offsets], [6, 3, 3])

    def covariance(self, machine: FloatArray) -> FloatArray:
        """Return the covariance of all twelve about a ``machine``. Shape (12, 12) [m^2]."""
        outwards = machine[:6].reshape(3, 2) - machine[:6].reshape(3, 2).mean(axis=0)
        outwards = outwards / np.linalg.norm(outwards, axis=1, keepdims=True)
        common = np.zeros((MACHINE, 2))
        common[:6, 0] = self.common_radius * outwards.ravel()
        common[6:9, 1] = self.common_arm_length
        return np.asarray(np.diag(np.square(self.deviations())) + common @ common.T)

    def __str__(self) -> str:
        """Return in words what is assumed."""
        anchors, arms, offsets, radius, length = (
            number_text(1000.0 * getattr(self, name), 3) for name in PRIOR_KINDS
        )
        return (
            f"anchors within {anchors} mm in x and in y, arms within {arms} mm, height offsets "
            f"within {offsets} mm of the nominal ones, besides a radius that is wrong for all by "
            f"{radius} mm and a length of all arms by {length} mm (standard deviations)"
        )


# Without priors, a direction is fitted if the data fix it better than this [m]: worse than that,
# the nominal machine of a careful builder is the better guess.
FITTED = 1e-3

# Without priors, how well residuals agree with each other is judged after a fit in all directions
# that the data fix better than this [m]: those between explain residuals, but are not believed.
JUDGED = 2e-3

# With priors all directions are fitted; one counts as determined if the data at least halve its
# standard deviation.
LEARNED = 0.5

# Directions whose standard deviation is larger than this are not in the data at all [m].
ENDLESS = 1.0


@dataclass(frozen=True, eq=False)
class Knowledge:
    """Mean and covariance of the machine before anything is measured.

    Attributes:
        mean: the machine that is assumed. Shape (12,) [m].
        scale: machine = mean + scale u. Shape (12, 12).
        is_prior: whether u has the covariance 1; without priors nothing is known of it.
    """

    mean: FloatArray
    scale: FloatArray
    is_prior: bool

    @classmethod
    def of(cls, nominal: FloatArray, priors: Priors | None) -> Knowledge:
        """Return what ``priors`` say of a ``nominal`` machine; None for nothing."""
        if priors is None:
            return cls(nominal, np.eye(MACHINE), False)
        mean = nominal if priors.mean is None else priors.mean.vector
        return cls(mean, np.asarray(np.linalg.cholesky(priors.covariance(mean)), float), True)

    def spectrum(self, matrix: FloatArray) -> Spectrum:
        """Return what equations with these derivatives say about u.

        Args:
            matrix: derivatives of residuals by all unknowns, by standard deviations. Shape (n, m)
                [1/m].
        """
        machine, others = matrix[:, :MACHINE] @ self.scale, matrix[:, MACHINE:]
        if others.shape[1]:
            # A direction that plates and frames explain as well says nothing about the machine.
            machine = machine - others @ np.linalg.lstsq(others, machine, rcond=None)[0]
        # Rows of zeros, so that there is a direction for each parameter.
        padded = np.concatenate((machine, np.zeros((MACHINE, MACHINE))))
        left, strengths, directions = np.linalg.svd(padded, full_matrices=False)
        return Spectrum(strengths, directions.T, left[: len(matrix)], self.is_prior)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Directions of u and how strongly the data speak about each.

    Attributes:
        strengths: inverse of the standard deviation by the data alone, falling. Shape (12,).
        directions: columns, at right angles to each other. Shape (12, 12).
        changes: of the residuals along each direction, of unit length. Shape (n, 12).
        is_prior: see ``Knowledge``.
    """

    strengths: FloatArray
    directions: FloatArray
    changes: FloatArray
    is_prior: bool

    @property
    def deviations(self) -> FloatArray:
        """Standard deviation of u along each direction; infinite without any knowledge of it."""
        if self.is_prior:
            return np.asarray(1.0 / np.sqrt(1.0 + np.square(self.strengths)))
        with np.errstate(divide="ignore"):
            deviations = 1.0 / self.strengths
        return np.where(deviations < ENDLESS, deviations, np.inf)

    def errors(self, residuals: FloatArray) -> FloatArray:
        """Return how far off the machine that leaves these may be along each direction.

        Without priors, directions that are not fitted stay as they were assumed to be, so that the
        way to where the data see the machine is an error, too. Shape (12,), root mean squares.
        """
        deviations = self.deviations
        if self.is_prior:
            return deviations
        ways = np.where(np.isfinite(deviations), deviations, 0.0) * (residuals @ self.changes)
        return np.hypot(deviations, ways)

    @property
    def determined(self) -> int:
        """Number of directions that the data determine; they are the first."""
        return int((self.deviations < (LEARNED if self.is_prior else FITTED)).sum())

    @property
    def judged(self) -> int:
        """Number of directions that are fitted to judge the residuals; they are the first."""
        return len(self.strengths) if self.is_prior else int((self.deviations < JUDGED).sum())
