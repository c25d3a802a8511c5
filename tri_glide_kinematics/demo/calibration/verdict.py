"""Whether a calibrated machine is as right as its calibration says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.calibration.fit import Calibration, plane_basis
from tri_glide_kinematics.demo.calibration.course import Judged
from tri_glide_kinematics.vectors import FloatArray

# Of all that is right, all but one in 16,000 lies within so many standard deviations.
WITHIN = 4.0
# By so much the sliders may be off that follow their commands, and the encoders that round [m].
SERVO = 3e-6


@dataclass(frozen=True, eq=False)
class Verdict:
    """Errors before and after, and what was predicted.

    Attributes:
        before: Shape (n, 3) [m].
        after: Shape (n, 3) [m].
        in_itself: after, without the shift in x and y and the turn about z that fit best.
            Shape (n, 3) [m].
        predicted: standard deviations of ``after``. Shape (n, 3) [m].
        predicted_in_itself: of ``in_itself``. Shape (n, 3) [m].
    """

    before: FloatArray
    after: FloatArray
    in_itself: FloatArray
    predicted: FloatArray
    predicted_in_itself: FloatArray

    @classmethod
    def of(cls, before: Judged, after: Judged, calibration: Calibration) -> Verdict:
        """Compare what was reached at the same targets before and after a ``calibration``."""
        return cls(
            before.errors,
            after.errors,
            without_plane_motion(after),
            calibration.position_uncertainties(after.targets),
            calibration.position_uncertainties(after.targets, aligned=True),
        )

    @property
    def is_good(self) -> bool:
        """Whether all errors are as small as predicted."""
        pairs = (
            (self.after, self.predicted),
            (self.in_itself, self.predicted_in_itself),
        )
        return all(
            bool((np.abs(errors) <= WITHIN * deviations + SERVO).all())
            for errors, deviations in pairs
        )


def without_plane_motion(judged: Judged) -> FloatArray:
    """Return errors less the shift in x and y and the turn about z that fit best. Shape (n, 3)."""
    basis = plane_basis(judged.targets, (0.0, 0.0)).reshape(-1, 3)
    errors = judged.errors.ravel()
    motion, *_ = np.linalg.lstsq(basis, errors, rcond=None)
    left: FloatArray = (errors - basis @ motion).reshape(-1, 3)
    return left


def table(verdict: Verdict) -> str:
    """Return the largest errors in each direction as a table."""
    columns = (
        ("before", verdict.before),
        ("after", verdict.after),
        ("predicted (1 sd)", verdict.predicted),
        ("after, in itself *", verdict.in_itself),
        ("predicted (1 sd)", verdict.predicted_in_itself),
    )
    lines = ["largest error [µm]" + "".join(f"{name:>20}" for name, _ in columns)]
    for axis, letter in enumerate("xyz"):
        numbers = (1e6 * float(np.abs(values[:, axis]).max()) for _, values in columns)
        lines.append(f"{letter:18}" + "".join(f"{number:20.1f}" for number in numbers))
    lines.append("* without the shift in x and y and the turn about z that no such data can tell")
    return "\n".join(lines)
