"""Picture of a ring-down: what was measured, what the fit takes it for, and what is left."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tri_glide_kinematics.calibration.ringdown import Quantity, RingDown
from tri_glide_kinematics.vectors import FloatArray

COLORS = ("tab:blue", "tab:orange", "tab:green")

# Quantities as they are drawn: the unit, and how many of it are one in SI.
DRAWN = {Quantity.POSITION: ("mm", 1e3), Quantity.ACCELERATION: ("m/s²", 1.0)}

# Decay times of the slowest mode that are drawn of a longer recording.
DECAYS = 6.0


def ringdown_figure(found: RingDown) -> Figure:
    """Return a page with the swing of each axis, the residuals below it, and their spectra."""
    names = found.recording.names
    unit, scale = DRAWN[found.recording.quantity]
    times = found.recording.times - found.recording.times[0]
    figure = Figure(figsize=(11.0, 2.4 * len(names) + 5.0), layout="constrained")
    heights = (*[1.0] * len(names), 0.7, 1.0)
    grid = figure.add_gridspec(len(heights), 1, height_ratios=heights)
    rows = [figure.add_subplot(grid[row, 0]) for row in range(len(heights))]
    swing = scale * (found.recording.values - found.drift)
    fit = scale * (found.fit - found.drift)
    end = _shown_until(found, float(times[-1]))
    for axes, name, measured, fitted, color in zip(rows, names, swing.T, fit.T, COLORS):
        axes.plot(times, measured, ".", color=color, markersize=3.0, label=f"{name} measured")
        if found.modes or found.left_out:
            axes.plot(times, fitted, color="black", linewidth=0.8, label="fitted")
        _finish(axes, end, f"{name} without drift [{unit}]")
    _draw_residuals(rows[-2], times, scale * found.residuals, names)
    _finish(rows[-2], end, f"residual [{unit}]")
    rows[-2].set_xlabel("time from the first sample on [s]")
    _draw_spectra(rows[-1], found, swing, scale * found.residuals, unit)
    figure.suptitle(_title(found))
    return figure


def _title(found: RingDown) -> str:
    if found.reason is not None:
        return f"Not known: {found.reason.value}"
    return "\n".join(
        f"mode {place}: {one.frequency:.3f} ± {one.frequency_deviation:.2g} Hz, "
        f"damping {one.damping:.4f} ± {one.damping_deviation:.2g}"
        for place, one in enumerate(found.modes, 1)
    )


def _shown_until(found: RingDown, last: float) -> float:
    if not found.modes:
        return last
    return min(last, DECAYS / min(one.mode.decay for one in found.modes))


def _finish(axes: Axes, end: float, label: str) -> None:
    axes.set_xlim(0.0, end)
    axes.set_ylabel(label, fontsize=9)
    axes.axhline(0.0, color="0.7", linewidth=0.6, zorder=0)
    axes.legend(fontsize=8, loc="upper right")


def _draw_residuals(
    axes: Axes, times: FloatArray, residuals: FloatArray, names: tuple[str, ...]
) -> None:
    for name, left, color in zip(names, residuals.T, COLORS):
        axes.plot(times, left, color=color, linewidth=0.6, label=name)


def _draw_spectra(
    axes: Axes, found: RingDown, swing: FloatArray, residuals: FloatArray, unit: str
) -> None:
    """Draw the amplitude over the frequency, of all axes together."""
    times = found.recording.times
    uniform = np.linspace(times[0], times[-1], len(times))
    frequencies = np.fft.rfftfreq(len(times), float(uniform[1] - uniform[0]))
    for values, name, color in ((swing, "measured", "0.5"), (residuals, "residual", "tab:red")):
        columns = np.column_stack([np.interp(uniform, times, axis) for axis in values.T])
        size = 2.0 / len(times) * np.linalg.norm(np.fft.rfft(columns, axis=0), axis=1)
        axes.plot(frequencies[1:], size[1:], color=color, linewidth=0.9, label=name)
        if size[1:].max() > 0.0:
            axes.set_yscale("log")
    # The names of two near modes stand on either side.
    for one, side in zip(sorted(found.modes, key=lambda each: -each.frequency), ("left", "right")):
        axes.axvline(one.frequency, color="black", linestyle="--", linewidth=0.9)
        place: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "va": "bottom", "ha": side}
        axes.annotate(f"{one.frequency:.2f} Hz", (one.frequency, 1.01), **place)
    fastest = max((one.frequency for one in found.modes), default=frequencies[-1] / 3.0)
    axes.set_xlim(0.0, min(3.0 * fastest, float(frequencies[-1])))
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel(f"amplitude [{unit}]", fontsize=9)
    axes.legend(fontsize=8, loc="upper right")
