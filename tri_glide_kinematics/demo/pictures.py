"""The pictures of the demonstrations."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tri_glide_kinematics.figures import Mark, Span, motion_figure
from tri_glide_kinematics.motion.limit_use import CommandStream
from tri_glide_kinematics.picture_commands import save_figure
from tri_glide_kinematics.vectors import FloatArray

if TYPE_CHECKING:
    from tri_glide_kinematics.demo.calibration_demo import Verdict
    from tri_glide_kinematics.demo.calm_demo import Swing
    from tri_glide_kinematics.demo.client import Leg, MachineSettings

TARGET_STYLE = {"marker": "o", "color": "tab:red", "markersize": 4}
START_STYLE = {"marker": "^", "color": "tab:green", "markersize": 7, "markerfacecolor": "none"}
END_STYLE = {"marker": "s", "color": "tab:green", "markersize": 6, "markerfacecolor": "none"}


def save_picture(
    folder: Path,
    legs: Sequence[Leg],
    path: FloatArray,
    stream: CommandStream,
    settings: MachineSettings,
) -> Path:
    """Draw the motion and return the path of the picture; its ``folder`` is made if there is none.

    The ``path`` has the measured positions of the platform. Shape (m, 3) [m].
    """
    marks, spans = [], []
    for before, leg in zip((None, *legs), legs):
        if leg.target:
            marks.append(Mark(leg.name, leg.target, TARGET_STYLE))
        else:
            if before:
                marks.append(Mark(f"{leg.name} starts", before.reached, START_STYLE))
            marks.append(Mark(f"{leg.name} ends", leg.reached, END_STYLE))
        if leg.target is None or leg.tolerance:
            spans.append(_span(leg, stream))
    figure = motion_figure(stream, path, settings.limits, settings.travel, marks, spans)
    folder.mkdir(parents=True, exist_ok=True)
    picture = folder / "demo.png"
    save_figure(figure, picture, 110)
    return picture


def _span(leg: Leg, stream: CommandStream) -> Span:
    last = min(leg.end, len(stream.times)) - 1
    return Span(leg.name, float(stream.times[leg.first]), float(stream.times[last]))


# The longest arrow, as a part of the radius.
ARROW = 0.35


def verdict_figure(targets: FloatArray, verdict: Verdict, radius: float) -> Figure:
    """Return a page with the errors at the ``targets``, shape (n, 3), within a ``radius`` [m]."""
    figure = Figure(figsize=(13.0, 8.5), layout="constrained")
    grid = figure.add_gridspec(2, 3, height_ratios=(1.5, 1.0))
    maps = (
        ("before", verdict.before),
        ("after", verdict.after),
        ("after, in itself*", verdict.in_itself),
    )
    largest = max(float(np.linalg.norm(errors[:, :2], axis=1).max()) for _, errors in maps)
    for column, (name, errors) in enumerate(maps):
        _draw_arrows(figure.add_subplot(grid[0, column]), targets, errors, radius, largest, name)
    bars = None
    for axis, letter in enumerate("xyz"):
        bars = figure.add_subplot(grid[1, axis], sharey=bars)
        _draw_bars(bars, verdict, axis, letter)
    figure.suptitle("Position error of the platform")
    figure.supxlabel(
        "* without the shift in x and y and the turn about z that no such data can tell", fontsize=9
    )
    return figure


def save_verdict(folder: Path, targets: FloatArray, verdict: Verdict, radius: float) -> Path:
    """Save the page, and return the path of the picture."""
    picture = folder / "calibration_demo.png"
    save_figure(verdict_figure(targets, verdict, radius), picture, 110)
    return picture


def _draw_arrows(
    axes: Axes, targets: FloatArray, errors: FloatArray, radius: float, largest: float, name: str
) -> None:
    """Draw errors in x and y as arrows, and write those in z beside them. Shapes (n, 3) [m].

    The ``largest`` error in x and y of all maps gives them one scale [m].
    """
    x, y = 1e3 * targets[:, 0], 1e3 * targets[:, 1]
    length = 1e3 * radius * ARROW / largest
    style: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "width": 0.008}
    arrows = axes.quiver(
        x, y, length * errors[:, 0], length * errors[:, 1], color="tab:red", **style
    )
    if name == "before":
        axes.quiverkey(arrows, 0.25, 0.94, 1e-3 * length, "1 mm", labelpos="E")
    axes.scatter(x, y, s=12, color="black", zorder=3)
    for place_x, place_y, error in zip(x, y, errors[:, 2]):
        text = f"z {1e6 * error:+.3g}"
        axes.annotate(
            text, (place_x, place_y), (0, -12), textcoords="offset points", ha="center", fontsize=8
        )
    reach = 1e3 * radius * 1.35
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), xlabel="x [mm]", ylabel="y [mm]")
    axes.set_aspect("equal")
    longest = 1e6 * float(np.linalg.norm(errors[:, :2], axis=1).max())
    axes.set_title(f"{name}\nlongest arrow {longest:.0f} µm; z in µm")


def _draw_bars(axes: Axes, verdict: Verdict, axis: int, letter: str) -> None:
    """Draw the largest errors and what was predicted, on a scale of powers of ten."""
    pairs = (
        ("before", verdict.before, None),
        ("after", verdict.after, verdict.predicted),
        ("after,\nin itself*", verdict.in_itself, verdict.predicted_in_itself),
    )
    for place, (_, errors, predicted) in enumerate(pairs):
        height = 1e6 * float(np.abs(errors[:, axis]).max())
        axes.bar(place, height, color="tab:blue", width=0.6)
        axes.text(place, height, f"{height:.3g}", ha="center", va="bottom", fontsize=9)
        if predicted is not None:
            expected = 2e6 * float(predicted[:, axis].max())
            axes.hlines(expected, place - 0.4, place + 0.4, color="tab:orange", linewidth=2.5)
    axes.plot([], [], color="tab:orange", linewidth=2.5, label="2 predicted standard deviations")
    axes.set_yscale("log")
    axes.margins(y=0.25)
    axes.set_xticks(range(len(pairs)), [name for name, _, _ in pairs])
    axes.set_ylabel("µm")
    axes.set_title(f"largest error in {letter}")
    if axis == 0:
        axes.legend(fontsize=8)


# Below, a distance is drawn as this [m].
FINEST = 1e-7


def swing_figure(swings: Sequence[Swing], close: float) -> Figure:
    """Return a page with how the platform came to rest, and what counts as there [m]."""
    motions = list(dict.fromkeys(swing.motion for swing in swings))
    figure = Figure(figsize=(13.0, 5.0), layout="constrained")
    shared: Axes | None = None
    for number, motion in enumerate(motions, start=1):
        axes = figure.add_subplot(1, len(motions), number, sharey=shared)
        shared = shared or axes
        for swing in swings:
            if swing.motion == motion:
                heights = 1e3 * np.maximum(swing.distances, FINEST)
                (line,) = axes.plot(swing.times, heights, label=f"shaper {swing.shaper}")
                axes.axvline(swing.arrival, color=line.get_color(), linestyle=":")
        axes.axhline(1e3 * close, color="gray", linestyle="--")
        axes.set_yscale("log")
        axes.set(title=motion, xlabel="time [s]")
        axes.grid(alpha=0.3)
    if shared is not None:
        shared.set_ylabel("distance from where it comes to rest [mm]")
        shared.legend()
    figure.suptitle("Swing of the platform (dotted: its setpoints have come to rest)")
    return figure


def save_swings(folder: Path, swings: Sequence[Swing], close: float) -> Path:
    """Save the page, and return the path of the picture; its ``folder`` is made if needed."""
    folder.mkdir(parents=True, exist_ok=True)
    picture = folder / "calm_demo.png"
    save_figure(swing_figure(swings, close), picture, 110)
    return picture
