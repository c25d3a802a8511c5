"""Knowledge of a machine before anything is measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.calibration.fit.unknowns import MACHINE, MachineParameters
from tri_glide_kinematics.checks import positive
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.wording import number_text


@dataclass(frozen=True)
class Priors:
    """The nominal values with standard deviations: how far the real machine may be from them.

    The default assumes a machine that was built with care: each coordinate of an anchor is known to
    1 mm, each arm to 0.5 mm and each slider's zero to 2 mm (one standard deviation each, all
    independent and normally distributed).

    Attributes:
        anchors: standard deviation of each coordinate of each anchor [m].
        arm_lengths: standard deviation of each length [m].
        height_offsets: standard deviation of each offset [m].
        mean: around which the parameters lie; None for the nominal machine of the calibration.
    """

    anchors: float = 1e-3
    arm_lengths: float = 5e-4
    height_offsets: float = 2e-3
    mean: MachineParameters | None = None

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            NotFiniteError: if a standard deviation is NaN or infinite.
            OutOfBoundsError: if one is not greater than zero.
        """
        for name in ("anchors", "arm_lengths", "height_offsets"):
            value = positive(f"standard deviation of {name}", getattr(self, name), "m")
            object.__setattr__(self, name, value)

    def deviations(self) -> FloatArray:
        """Return the standard deviations of all twelve parameters. Shape (12,) [m]."""
        return np.repeat([self.anchors, self.arm_lengths, self.height_offsets], [6, 3, 3])

    def __str__(self) -> str:
        """Return in words what is assumed."""
        anchors, arms, offsets = (
            number_text(1000.0 * value, 3)
            for value in (self.anchors, self.arm_lengths, self.height_offsets)
        )
        return (
            f"anchors within {anchors} mm in x and in y, arms within {arms} mm, height offsets "
            f"within {offsets} mm of the nominal ones (standard deviations)"
        )


# Without priors, a direction counts as determined if the data fix it better than this [m]: worse
# than that, the nominal machine of a careful builder is the better guess.
DETERMINED = 1.5e-4

# Without priors, how well residuals agree with each other is judged after a fit in all directions
# that the data fix better than this [m]: those between explain residuals, but are not believed.
JUDGED = 2e-3

# With priors, a direction counts as determined if the data at least halve its standard deviation.
# Else a machine that is calibrated again and again, each time from the last result, would wander.
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
        return cls(mean, np.diag(priors.deviations()), True)

    def spectrum(self, matrix: FloatArray) -> Spectrum:
        """Return what equations with these derivatives say about u.

        Args:
            matrix: derivatives of residuals by all unknowns, by standard deviations. Shape (n, m)
                [1/m].
        """
        machine, others = matrix[:, :MACHINE] @ self.scale, matrix[:, MACHINE:]
        if others.shape[1]:
            # What plates and frames can explain as well says nothing about the machine.
            machine = machine - others @ np.linalg.lstsq(others, machine, rcond=None)[0]
        # Rows of zeros, so that there is a direction for each parameter.
        padded = np.concatenate((machine, np.zeros((MACHINE, MACHINE))))
        _, strengths, directions = np.linalg.svd(padded, full_matrices=False)
        return Spectrum(strengths, directions.T, self.is_prior)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Directions of u and how strongly the data speak about each.

    Attributes:
        strengths: inverse of the standard deviation by the data alone, falling. Shape (12,).
        directions: columns, at right angles to each other. Shape (12, 12).
        is_prior: see ``Knowledge``.
    """

    strengths: FloatArray
    directions: FloatArray
    is_prior: bool

    @property
    def deviations(self) -> FloatArray:
        """Standard deviation of u along each direction; infinite without any knowledge of it."""
        if self.is_prior:
            return np.asarray(1.0 / np.sqrt(1.0 + np.square(self.strengths)))
        with np.errstate(divide="ignore"):
            deviations = 1.0 / self.strengths
        return np.where(deviations < ENDLESS, deviations, np.inf)

    @property
    def determined(self) -> int:
        """Number of directions that the data determine; they are the first."""
        return int((self.deviations < (LEARNED if self.is_prior else DETERMINED)).sum())

    @property
    def judged(self) -> int:
        """Number of directions that are fitted to judge the residuals; they are the first."""
        return len(self.strengths) if self.is_prior else int((self.deviations < JUDGED).sum())
