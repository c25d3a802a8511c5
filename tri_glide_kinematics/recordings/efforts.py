"""Masses and friction from a recording of measured heights and efforts.

Accelerations are those of the measured heights. Heights and efforts go through the same filter, so
that what is left of both belongs together; of its rows, only so many are kept that the noise of
each is its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from tri_glide_kinematics.dynamics import (
    NO_COUNTERWEIGHTS,
    STANDARD_GRAVITY,
    Identified,
    Masses,
    identify,
)
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import parameter_file, replace_file
from tri_glide_kinematics.recordings.setpoint_files import Recording, RecordingError
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.wording import list_text, number_text

# Length of the filter, a Hann window. In a longer one the machine moves so far that its forces are
# no longer linear; a shorter one leaves more of the steps of encoders in the accelerations [s].
WINDOW = 0.02
LEAST_HALF = 2

# Times between two rows differ from the others by no more than this part, or something is missing.
SAME_PERIOD = 0.5

# A slider that is slower within the window may turn, and its dry friction with it [m/s].
SLOWEST = 0.005


class Filtered(NamedTuple):
    """What a filter leaves of a recording.

    Attributes:
        rows: heights, velocities, accelerations and efforts. Shape (4, n, 3) [m, m/s, m/s^2, N].
        used: whether the slider moves one way in all of the window. Shape (n, 3).
    """

    rows: FloatArray
    used: NDArray[np.bool_]


def measured_masses(
    recording: Recording,
    machine: TriGlide,
    *,
    height_offsets: Vector3 = (0.0, 0.0, 0.0),
    gravity: Vector3 = STANDARD_GRAVITY,
    uniform_arms: bool = True,
    known: Mapping[str, float] = NO_COUNTERWEIGHTS,
) -> Identified:
    """Return masses and friction as the efforts of a recording tell them.

    Args:
        recording: measured heights as the drives tell them, and efforts.
        machine: that moved.
        height_offsets: true heights less those that the drives tell. Shape (3,) [m].
        gravity: Shape (3,) [m/s^2].
        uniform_arms: as for ``dynamics.identify``.
        known: likewise.

    Raises:
        NotFiniteError: if a row of heights has no pose.
        NotAChoiceError: if ``known`` names what is no parameter.
        TooFewSamplesError: if too little moves in it.
        KinematicsError: if it has no efforts.
    """
    if recording.efforts is None:
        raise KinematicsError("the recording has no efforts")
    parts = [_filtered(*each) for each in _stretches(recording, recording.efforts)]
    rows = np.concatenate([np.empty((4, 0, 3)), *(each.rows for each in parts)], axis=1)
    heights, velocities, accelerations, efforts = rows
    used = np.concatenate([np.empty((0, 3), dtype=bool), *(each.used for each in parts)])
    return identify(
        machine,
        heights + np.array(height_offsets),
        velocities,
        accelerations,
        efforts,
        gravity=gravity,
        uniform_arms=uniform_arms,
        known=known,
        slowest=0.0,
        used=used,
    )


def _stretches(
    recording: Recording, efforts: FloatArray
) -> Iterator[tuple[float, FloatArray, FloatArray]]:
    """Yield the period [s], heights and efforts of each stretch in which nothing is missing."""
    numbers = np.column_stack((recording.stamps, recording.heights, efforts))
    numbers = numbers[np.isfinite(numbers).all(axis=1)]
    stamps = numbers[:, 0]
    steps = np.diff(stamps)
    if not len(steps):
        return
    period = float(np.median(steps))
    ends = np.flatnonzero(~(np.abs(steps - period) <= SAME_PERIOD * period)) + 1
    for some in np.split(np.arange(len(stamps)), ends):
        if len(some) > 1:
            # Equally spaced, as a filter needs them.
            times = np.arange(stamps[some[0]], stamps[some[-1]] + 0.5 * period, period)
            columns = [np.interp(times, stamps[some], each) for each in numbers[some, 1:].T]
            rows = np.stack(columns, axis=1)
            yield period, rows[:, :3], rows[:, 3:]


def _filtered(period: float, heights: FloatArray, efforts: FloatArray) -> Filtered:
    """Return what the filter leaves of a stretch; no rows if it is shorter than the filter."""
    half = max(round(0.5 * WINDOW / period), LEAST_HALF)
    taps = 2 * half + 1
    window = np.hanning(taps + 2)[1:-1]
    window /= window.sum()
    # Of each end: half of the filter, a row for the differences, half of the look around.
    if len(heights) < 2 * taps + 1:
        return Filtered(np.empty((4, 0, 3)), np.empty((0, 3), dtype=bool))

    def smooth(rows: FloatArray) -> FloatArray:
        return np.stack([np.convolve(each, window, mode="valid") for each in rows.T], axis=1)

    places, forces = smooth(heights), smooth(efforts)[1:-1]
    velocities = (places[2:] - places[:-2]) / (2.0 * period)
    accelerations = (places[2:] - 2.0 * places[1:-1] + places[:-2]) / period**2
    around = sliding_window_view(velocities, taps, axis=0)
    used = (around.min(axis=-1) > SLOWEST) | (around.max(axis=-1) < -SLOWEST)
    rows = np.stack((places[1:-1], velocities, accelerations, forces))[:, half:-half]
    # With two thirds of the window from one to the next, the noise of all rows is used once.
    step = 2 * taps // 3
    return Filtered(rows[:, ::step], used[::step])


def _unit(name: str) -> str:
    return "N s/m" if name.startswith("viscous") else "N" if name.startswith("dry") else "kg"


def masses_report(found: Identified) -> str:
    """Return a text about masses and friction, and what cannot be known of them."""
    lines = [f"{'':34}{'value':>12}{'standard deviation':>22}"]
    for each in found.estimates:
        unit = _unit(next(iter(each.parts)))
        doubt = "" if each.value > 1.96 * each.deviation else "  may be zero"
        lines.append(
            f"{f'{each.name} [{unit}]':34}{each.value:>12.4f}{each.deviation:>22.4f}{doubt}"
        )
    given = [f"{name} = {number_text(value)} {_unit(name)}" for name, value in found.known.items()]
    noise = ", ".join(f"{each:.3g}" for each in found.noise)
    for words, told in (
        ("given", ", ".join(given)),
        ("only their sums are known", "; ".join(found.sums)),
        ("nothing is known of", ", ".join(found.silent)),
        ("standard deviation of the efforts of the sliders from these", f"{noise} N"),
    ):
        if told:
            lines.append(f"{words}: {told}")
    return "\n".join(lines)


def save_masses(file: Path, masses: Masses) -> None:
    """Write a parameter file of ``ik_node``; an older one becomes ``NAME.bak``.

    Raises:
        RecordingError: if it cannot be written, or a file is there that was not written so.
    """
    head = (
        "Masses of one machine, by its efforts. ik_node takes them after its other file:",
        f"--params-file tri_glide.yaml --params-file {file.name}",
        "The platform is that with all that it carried.",
    )
    rows = (
        ("carriage_masses", list_text(masses.carriages, 6), "kg"),
        ("platform_mass", f"{masses.platform:.6f}", "kg"),
        ("payload", 0.0, "kg"),
        ("arm_masses", list_text((arm.mass for arm in masses.arms), 6), "kg"),
        ("counterweight_masses", list_text(masses.counterweights, 6), "kg"),
        ("coulomb_friction", list_text(masses.coulomb, 6), "N"),
        ("viscous_friction", list_text(masses.viscous, 6), "N s/m"),
    )
    with RecordingError.of_writing(file):
        replace_file(file, parameter_file(head, "ik_node", rows))
