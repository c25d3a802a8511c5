"""Pictures of a calibration, and of a ring-down: measured, what the fit takes it for, residuals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.tri import Triangulation

from tri_glide_kinematics.calibration.fit import Calibration, Region, Residual
from tri_glide_kinematics.calibration.ringdown import Quantity, RingDown
from tri_glide_kinematics.calibration.session import UncertaintyMap
from tri_glide_kinematics.vectors import FloatArray

LEVELS = 24  # values between which a map changes its colour
# Of all that is right, so much lies within twice the standard deviation.
USUAL = 2.0
KEPT_COLOR, OUTLIER_COLOR = "tab:blue", "tab:red"


def calibration_figure(calibration: Calibration) -> Figure:
    """Return a page with residuals, and x, y, z over the workspace before and after."""
    uncertainty = UncertaintyMap.of(calibration)
    rows = (
        ("before", uncertainty.before),
        ("after", uncertainty.after),
        ("after, in itself*", uncertainty.aligned),
    )
    figure = Figure(figsize=(11.0, 14.0), layout="constrained")
    grid = figure.add_gridspec(len(rows) + 1, 3, height_ratios=(1.0, 1.0, 1.0, 0.85))
    for row, (name, values) in enumerate(rows):
        maps = [figure.add_subplot(grid[row, axis]) for axis in range(3)]
        draw_maps(maps, uncertainty.region, values, [f"{letter} {name}" for letter in "xyz"])
    draw_residuals(figure.add_subplot(grid[-1, :]), calibration.residuals)
    figure.suptitle("Standard deviation of the platform's position, and the residuals")
    figure.supxlabel(
        "* if a shift in x and y and a turn about z do not matter: within what the machine makes",
        fontsize=9,
    )
    return figure


def draw_maps(
    maps: Sequence[Axes], region: Region, values: FloatArray, titles: Sequence[str]
) -> None:
    """Draw lengths over a disc, in maps of one scale of colours.

    Args:
        maps: one for each column.
        region: the disc with its places.
        values: at these places; some may be infinite or NaN. Shape (n, len(maps)) [m].
        titles: of the maps; the largest value is added to each.
    """
    x, y = (1e3 * region.places[:, axis] for axis in (0, 1))
    known = [bool(np.isfinite(column).all()) for column in values.T]
    shown = values[:, known]
    largest = float(shown.max(initial=0.0))
    unit, scale = ("µm", 1e6) if largest < 1e-3 else ("mm", 1e3)
    # One value everywhere has no levels.
    least = min(float(shown.min(initial=largest)), largest - max(1e-3 * largest, 1e-12))
    levels = scale * np.linspace(least, largest + 1e-3 * (largest - least), LEVELS)
    drawn = None
    for axes, column, title, is_known in zip(maps, values.T, titles, known):
        axes.set_aspect("equal")
        if is_known:
            triangles = Triangulation(x, y)
            drawn = axes.tricontourf(triangles, scale * column, levels=levels, cmap="viridis")
            worst = scale * float(column.max())
            axes.set_title(f"{title}:\nat most {worst:.3g} {unit}", fontsize=10)
        else:
            _draw_unknown(axes, region)
            axes.set_title(title, fontsize=10)
        axes.set_xlabel("x [mm]", fontsize=8)
        axes.set_ylabel("y [mm]", fontsize=8)
        axes.tick_params(labelsize=8)
    if drawn is not None:
        maps[0].figure.colorbar(drawn, ax=list(maps), label=unit, shrink=0.85, format="%.3g")


def _draw_unknown(axes: Axes, region: Region) -> None:
    radius = 1e3 * region.radius
    middle_x, middle_y = (1e3 * number for number in region.center)
    disc = Circle((middle_x, middle_y), radius, facecolor="0.92", edgecolor="0.6", hatch="//")
    axes.add_patch(disc)
    style: dict[str, Any] = {"ha": "center", "va": "center", "backgroundcolor": "white"}
    axes.text(middle_x, middle_y, "not known", **style)
    x, y = (1e3 * region.places[:, axis] for axis in (0, 1))
    axes.set(xlim=(x.min(), x.max()), ylim=(y.min(), y.max()))


def draw_residuals(axes: Axes, residuals: Sequence[Residual]) -> None:
    """Draw the residual of each measurement, and by how much the others contradict it.

    Both are in standard deviations of the measurement, those with three coordinates as their size.
    """
    names = [one.name for one in residuals]
    left = [
        float(np.sqrt(np.mean(np.square(one.error)))) / one.measurement.standard_deviation
        for one in residuals
    ]
    signs = [np.sign(one.error[0]) if len(one.error) == 1 else 1.0 for one in residuals]
    colors = [OUTLIER_COLOR if one.is_outlier else KEPT_COLOR for one in residuals]
    places = np.arange(len(names))
    axes.axhspan(-USUAL, USUAL, color="0.92", label="within 2 standard deviations")
    axes.bar(places, np.multiply(signs, left), color=colors, label="residual")
    axes.scatter(
        places,
        np.multiply(signs, [one.size for one in residuals]),
        facecolors="none",
        edgecolors="black",
        zorder=3,
        label="against all others (by what these predict)",
    )
    for place, one in zip(places, residuals):
        if one.is_outlier:
            axes.annotate(f"{one.name} left out", (float(place), 0.0), rotation=90, ha="center")
    axes.axhline(0.0, color="black", linewidth=0.8)
    # Of many names, not all have room.
    shown = places[:: max(1, len(names) // 30)]
    axes.set_xticks(shown, [names[place] for place in shown], rotation=60, ha="right", fontsize=8)
    largest = max([USUAL, *map(abs, left)])
    if largest > 10.0:
        axes.set_yscale("symlog", linthresh=USUAL)
    axes.set_ylabel("standard deviations")
    axes.legend(fontsize=8, loc="best")


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
    for name, left, color in zip(names, scale * found.residuals.T, COLORS):
        rows[-2].plot(times, left, color=color, linewidth=0.6, label=name)
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
