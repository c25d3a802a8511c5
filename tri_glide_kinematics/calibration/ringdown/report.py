"""A ring-down as a person reads it, and the parameter file for ``ik_node``."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from tri_glide_kinematics.calibration.ringdown.modes import (
    CombinedModes,
    NotKnown,
    Oscillation,
    RingDown,
)
from tri_glide_kinematics.calibration.ringdown.recording import Quantity
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.files import parameter_file, replace_file
from tri_glide_kinematics.keys import FileError
from tri_glide_kinematics.motion.shaping import ShaperKind
from tri_glide_kinematics.wording import list_text, number_text

MICROMETRES = 1e6  # in a metre

# Samples are missing where an interval is so many times as long as usual.
GAP = 3.0


class NoModeError(KinematicsError):
    """A recording does not tell a mode, or several do not.

    Attributes:
        reason: why.
    """

    def __init__(self, reason: NotKnown, report: str = "") -> None:
        """Store the ``reason``; the text has the ``report``, too."""
        text = f"the modes are not known: {reason.value}"
        super().__init__(f"{text}\n\n{report}" if report else text)
        self.reason = reason


class ModeFileError(FileError):
    """A parameter file with modes cannot be written."""


def ringdown_report(found: RingDown) -> str:
    """Return all that a ring-down has to say."""
    parts = [
        _data(found),
        "\n".join(_mode(found, place, mode) for place, mode in enumerate(found.modes, 1)),
        "" if found.reason is None else f"NOT KNOWN: {found.reason.value}",
        "\n".join(f"No mode: {_numbers(one)}: {why.value}" for one, why in found.left_out),
        _left(found),
    ]
    return "\n\n".join(part for part in parts if part)


def combined_report(found: CombinedModes) -> str:
    """Return what several swings say together, and what each of them does."""
    count = len(found.ringdowns)
    modes = [
        f"Mode {place}: {_numbers(mode)}, seen in {seen} of {count} swings"
        for place, (mode, seen) in enumerate(zip(found.modes, found.seen), 1)
    ]
    if found.reason is not None:
        modes.append(f"NOT KNOWN: {found.reason.value}")
    left_out = [f"No mode: {_numbers(one)}: {why.value}" for one, why in found.left_out]
    swings = [f"Swing {place}: {_swing(each)}" for place, each in enumerate(found.ringdowns, 1)]
    return "\n\n".join("\n".join(part) for part in (modes, left_out, swings) if part)


def _swing(found: RingDown) -> str:
    """Return in a line what one of several swings says."""
    times = found.recording.times
    size = f"{len(times)} samples in {number_text(times[-1] - times[0], 4)} s"
    if found.reason is not None:
        return f"{size}: not known: {found.reason.value}"
    return f"{size}: " + "; ".join(_numbers(mode, "") for mode in found.modes)


def mode_text(found: RingDown | CombinedModes, kind: ShaperKind, name: str) -> str:
    """Return the text of the parameter file ``name``, for a shaper of a ``kind``.

    Raises:
        NoModeError: if no mode is known.
    """
    if found.reason is not None:
        raise NoModeError(found.reason)
    head = (
        "Modes of one machine, from a ring-down. ik_node takes them after its other file:",
        f"--params-file tri_glide.yaml --params-file {name}",
    )
    frequencies = list_text((mode.frequency for mode in found.modes), 6)
    dampings = list_text((mode.damping for mode in found.modes), 6)
    rows = (
        ("shaper", kind.value, ""),
        ("mode_frequencies", frequencies, "Hz"),
        ("mode_dampings", dampings, "of the critical damping"),
    )
    return parameter_file(head, "ik_node", rows)


def save_modes(
    file: Path, found: RingDown | CombinedModes, kind: ShaperKind = ShaperKind.EI
) -> None:
    """Write the parameter file; an older one becomes ``NAME.bak``.

    Raises:
        NoModeError: if no mode is known.
        ModeFileError: if the file cannot be written, or one is there that was not written so.
    """
    text = mode_text(found, kind, file.name)
    with ModeFileError.of_writing(file):
        replace_file(file, text)


def _data(found: RingDown) -> str:
    times = found.recording.times
    axes = ", ".join(found.recording.names)
    text = (
        f"Measured: {len(times)} samples in {number_text(times[-1] - times[0], 4)} s, of {axes} "
        f"[{found.recording.quantity.value}]"
    )
    steps = np.diff(times)
    gaps = steps[steps > GAP * np.median(steps)]
    if gaps.size:
        text += f"\nGaps: {gaps.size}, the longest of {number_text(gaps.max(), 3)} s"
    if found.recording.overflows:
        text += (
            f"\nOVERFLOWS: {found.recording.overflows}; each time samples were lost, and it is not "
            "known where: frequency and damping are off. Record again, at a lower rate"
        )
    return text


def _mode(found: RingDown, place: int, mode: Oscillation) -> str:
    names = found.recording.names
    unit = found.recording.quantity
    # An acceleration is that of a swing that is smaller by the square of the angular frequency.
    scale = 1.0 if unit is Quantity.POSITION else (math.tau * mode.frequency) ** -2
    axes = ", ".join(
        f"{name} {number_text(MICROMETRES * scale * amplitude, 3)} µm at "
        f"{number_text(math.degrees(phase), 3)}°"
        for name, amplitude, phase in zip(names, mode.amplitudes, mode.phases)
    )
    return (
        f"Mode {place}: {_numbers(mode)}\n"
        f"  swings at the start by {axes}\n"
        f"  two modes less than {number_text(mode.resolution, 2)} Hz from each other would look "
        "like this one"
    )


def _numbers(one: Oscillation, remark: str = " (± one standard deviation)") -> str:
    frequency = _with_deviation(one.frequency, one.frequency_deviation)
    damping = _with_deviation(one.damping, one.damping_deviation)
    return f"frequency {frequency} Hz, damping {damping}{remark}"


def _with_deviation(value: float, deviation: float) -> str:
    """Return a number with as many decimals as the two first digits of its deviation."""
    if not (math.isfinite(deviation) and deviation > 0.0):
        return f"{number_text(value, 4)} ± {'?' if deviation else '0'}"
    decimals = min(max(1 - math.floor(math.log10(deviation)), 0), 9)
    shown = round(value, decimals) + 0.0
    return f"{shown:.{decimals}f} ± {deviation:.{decimals}f}"


def _left(found: RingDown) -> str:
    """Return what the fit does not explain."""
    noise = ", ".join(
        f"{name} {number_text(size, 3, 0.0)}"
        for name, size in zip(found.recording.names, found.noise)
    )
    unit = found.recording.quantity.value
    text = f"Residual (standard deviation): {noise} {unit}"
    if found.reason is None:
        text += f", {number_text(100.0 * found.unexplained, 2)} % of the energy of the swing"
    if found.is_explained:
        return f"{text}; it looks like noise"
    if found.reason is NotKnown.TOO_FEW_SAMPLES:
        return text
    return (
        f"{text}; it is MORE THAN WHITE NOISE: friction, play, another mode, a filter, or the "
        "motion was not over. The picture shows it"
    )
