"""Pictures of a motion: the platform's path in space and the sliders' course over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D
from numpy.typing import NDArray

from tri_glide_kinematics.motion.command_stream import CommandStream
from tri_glide_kinematics.motion.limits import SliderLimits

LIMIT_STYLE: dict[str, Any] = {"color": "0.35", "linestyle": "--", "linewidth": 0.9}
MILLIMETRES = 1000.0


def motion_figure(
    stream: CommandStream,
    path: NDArray[np.float64],
    limits: SliderLimits,
    travel: tuple[Sequence[float], Sequence[float]],
    stops: Sequence[tuple[str, Sequence[float]]] = (),
) -> Figure:
    """Draw what the sliders were told and what the platform did.

    Args:
        stream: the commanded heights with their derivatives.
        path: measured positions of the platform. Shape (m, 3) [m].
        limits: of the sliders; drawn as dashed lines.
        travel: lowest and highest heights of the three sliders, each of shape (3,) [m].
        stops: names and positions [m] of the targets, marked on the path.

    Returns:
        A figure that has no window; save it with ``savefig``.
    """
    figure = Figure(figsize=(13.0, 8.0), layout="constrained")
    grid = figure.add_gridspec(4, 2, width_ratios=(1.0, 1.25))
    _draw_path(figure.add_subplot(grid[:, 0], projection="3d"), path, stops)
    courses = (
        ("height [m]", stream.heights, travel),
        ("velocity [m/s]", stream.velocities, _both_signs(limits.velocity)),
        ("acceleration [m/s²]", stream.accelerations, _both_signs(limits.acceleration)),
        ("jerk [m/s³]", stream.jerks, _both_signs(limits.jerk)),
    )
    first: Axes | None = None
    for row, (label, values, bounds) in enumerate(courses):
        axes = figure.add_subplot(grid[row, 1], sharex=first)
        first = first or axes
        for slider in range(3):
            axes.plot(stream.times, values[:, slider], linewidth=0.9, label=f"slider {slider + 1}")
        for bound in sorted({*bounds[0], *bounds[1]}):
            axes.axhline(bound, **LIMIT_STYLE)
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
        axes.tick_params(labelbottom=row == len(courses) - 1)
        if row == 0:
            axes.plot([], [], label="limit", **LIMIT_STYLE)
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.32), ncols=4, frameon=False)
    axes.set_xlabel("time [s]")
    return figure


def _both_signs(bounds: Sequence[float]) -> tuple[list[float], list[float]]:
    return [-bound for bound in bounds], list(bounds)


def _draw_path(
    axes: Axes3D, path: NDArray[np.float64], stops: Sequence[tuple[str, Sequence[float]]]
) -> None:
    x, y, z = (path * MILLIMETRES).T
    axes.plot(x, y, z, linewidth=1.0)
    for name, position in stops:
        px, py, pz = (coordinate * MILLIMETRES for coordinate in position)
        axes.plot([px], [py], [pz], marker="o", color="tab:red", markersize=4)
        axes.text(px, py, pz, f" {name}", fontsize=9)
    axes.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]", title="platform path")
    axes.set_aspect("equal")
    axes.set_box_aspect(None, zoom=0.85)  # the labels of the last axis would be cut off
    axes.locator_params(nbins=5)
