"""A calibration as a person reads it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.calibration.fit import (
    PARAMETER_NAMES,
    Calibration,
    Proposal,
    Region,
    Residual,
)
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.wording import number_text

# Places lie on this many rings about the centre.
RINGS = 8


@dataclass(frozen=True, eq=False)
class UncertaintyMap:
    """Standard deviations of x, y and z over a disc; they do not depend on z.

    Attributes:
        region: the disc with its n places.
        before: by what was assumed. Shape (n, 3) [m]; infinite where nothing is known.
        after: by the calibration. Shape (n, 3) [m].
        aligned: the same, if a shift in x and y and a turn about z do not matter. Shape (n, 3) [m].
    """

    region: Region
    before: FloatArray
    after: FloatArray
    aligned: FloatArray

    @classmethod
    def of(cls, calibration: Calibration) -> UncertaintyMap:
        """Return the map of a ``calibration``."""
        whole = Region.of(calibration.geometry)
        region = Region.disc(whole.center, whole.radius, RINGS)
        return cls(
            region,
            calibration.position_uncertainties_before(region.places),
            calibration.position_uncertainties(region.places),
            calibration.position_uncertainties(region.places, aligned=True),
        )


# Below it a length is written in micrometres [m].
MICROMETRES_BELOW = 1e-4
MILLIMETRES = 1e3
QUESTION = (
    "Is the height of the plate right? If the machine may be so far from what was assumed, say so "
    "in the priors"
)
PLURALS = {"touch": "touches", "position": "positions", "distance": "distances"}


def report(calibration: Calibration, proposals: Sequence[Proposal] = (), remark: str = "") -> str:
    """Return all that a calibration has to say.

    Args:
        calibration: to be told of.
        proposals: of what to measure next.
        remark: on these, in words.
    """
    parts = [
        _data(calibration),
        _contradictions(calibration),
        _parameters(calibration),
        _places(UncertaintyMap.of(calibration)),
        _undetermined(calibration),
        _residuals(calibration.residuals),
        _listed("Warnings", calibration.warnings),
        _listed("What would help most, the best first", map(_proposal, proposals)),
        remark,
    ]
    return "\n\n".join(part for part in parts if part)


def length_text(length: float) -> str:
    """Return a length [m] in the unit that suits it; infinite stands for what is not known."""
    if not math.isfinite(length):
        return "not known"
    if abs(length) < MICROMETRES_BELOW:
        return f"{number_text(1e6 * length, 3)} µm"
    return f"{number_text(1e3 * length, 3)} mm"


def _data(calibration: Calibration) -> str:
    counts = Counter(one.name.split()[0] for one in calibration.residuals)
    texts = [f"{count} {kind if count == 1 else PLURALS[kind]}" for kind, count in counts.items()]
    priors = "nothing" if calibration.priors is None else str(calibration.priors)
    squares = number_text(calibration.chi_squared, 3)
    freedom = calibration.degrees_of_freedom
    spread = number_text(math.sqrt(2.0 * freedom), 2)
    return (
        f"Measured: {', '.join(texts)}\n"
        f"Assumed before: {priors}\n"
        f"Residuals: chi-squared is {squares}, expected {freedom} ± {spread}"
    )


def contradiction(calibration: Calibration) -> str:
    """Return in words why the result is not to be used; empty if it is."""
    if not calibration.is_contradicted:
        return ""
    parts = ["measurements and assumptions contradict each other"]
    if calibration.has_gross_residuals:
        parts.append(
            f"chi-squared is {number_text(calibration.chi_squared, 3)}, expected "
            f"{calibration.degrees_of_freedom}; the standard deviations are not valid"
        )
    if calibration.has_many_outliers:
        parts.append(
            f"{len(calibration.outliers)} of {len(calibration.residuals)} measurements contradict "
            "the others, which may be the wrong ones"
        )
    far = calibration.far_from_priors
    if far:
        name = max(far, key=lambda each: far[each])
        parts.append(f"{name} is {_distance(far[name])}")
    return ": ".join((parts[0], "; ".join(parts[1:])))


def _contradictions(calibration: Calibration) -> str:
    """Return what contradicts the assumptions, which spoils all numbers below."""
    if not calibration.is_contradicted:
        return ""
    far = [f"{name} is {_distance(size)}" for name, size in calibration.far_from_priors.items()]
    parts = (f"NOT VALID: {contradiction(calibration)}", _listed(QUESTION, far))
    return "\n".join(filter(None, parts))


def _distance(size: float) -> str:
    return f"{number_text(size, 3)} standard deviations from what was assumed"


def _parameters(calibration: Calibration) -> str:
    lines = [
        f"{'parameter [mm]':18}{'nominal':>12}{'calibrated':>13}{'change':>10}{'± (1 sd)':>12}"
    ]
    rows = zip(
        PARAMETER_NAMES,
        _for_table(calibration.nominal.vector),
        _for_table(calibration.machine.vector),
        _for_table(calibration.standard_deviations),
    )
    for name, nominal, value, deviation in rows:
        known = f"{deviation:.4f}" if math.isfinite(deviation) else "not known"
        change = value - nominal
        lines.append(f"{name:18}{nominal:12.4f}{value:13.4f}{change:+10.4f}{known:>12}")
    return "\n".join(lines)


def _for_table(lengths: FloatArray) -> FloatArray:
    """Return lengths [m] in millimetres, without a sign where a zero is written."""
    rounded: FloatArray = np.round(MILLIMETRES * lengths, 4) + 0.0
    return rounded


def _places(uncertainty: UncertaintyMap) -> str:
    radius = number_text(1e3 * uncertainty.region.radius, 3)
    columns = (uncertainty.before, uncertainty.after, uncertainty.aligned)
    lines = [
        f"How well the platform's position is known within {radius} mm of the axis, at the worst "
        "place (1 sd):",
        f"   {'before':>12}{'after':>12}{'in itself *':>14}",
    ]
    for axis, name in enumerate("xyz"):
        before, after, aligned = (length_text(_worst(column[:, axis])) for column in columns)
        lines.append(f"{name}  {before:>12}{after:>12}{aligned:>14}")
    lines.append(
        "* if a shift in x and y and a turn about z do not matter: what a part is off that is made"
    )
    lines.append("  with the machine")
    return "\n".join(lines)


def _worst(values: FloatArray) -> float:
    return float(np.nanmax(values)) if np.isfinite(values).any() else math.inf


def _undetermined(calibration: Calibration) -> str:
    if not calibration.unidentified:
        return "The measurements determine all twelve parameters."
    where = "as it was assumed to be" if calibration.priors is None else "as the priors say"
    return _listed(
        f"Not determined by these measurements, and left {where}", calibration.unidentified
    )


def _residuals(residuals: Sequence[Residual]) -> str:
    lines = [f"{'measurement [µm]':18}{'residual':>11}{'by the others *':>17}{'in sd':>8}"]
    for one in residuals:
        left, others = (f"{1e6 * _size(values):+.1f}" for values in (one.error, one.left_out))
        size = f"{one.size:.1f}"
        if not math.isfinite(one.size):
            others = size = "-"
        mark = "  left out: contradicts the others" if one.is_outlier else ""
        lines.append(f"{one.name:18}{left:>11}{others:>17}{size:>8}{mark}")
    lines.append("* predicted by all other measurements, minus measured; of a position its length")
    return "\n".join(lines)


def _size(values: Sequence[float]) -> float:
    return values[0] if len(values) == 1 else math.hypot(*values)


def _proposal(one: Proposal) -> str:
    places = " to ".join(
        "(" + ", ".join(number_text(1e3 * value, 4) for value in place) + ") mm"
        for place in one.places
    )
    target = f" of {one.target!r}" if one.target else ""
    volume = number_text(100.0 * one.volume, 3)
    return f"{one.kind}{target} at {places}: the uncertain volume shrinks to {volume} %"


def _listed(title: str, texts: Iterable[str]) -> str:
    lines = [f"- {text}" for text in texts]
    return "\n".join([f"{title}:", *lines]) if lines else ""
