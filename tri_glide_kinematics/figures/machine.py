"""A picture of a machine: maps of how well it works where, and cuts through its workspace."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tri_glide_kinematics.picture_commands import LIMIT_STYLE, MILLIMETRES
from tri_glide_kinematics.sizing import height_ranges, level_corners, maps
from tri_glide_kinematics.vectors import FloatArray
from tri_glide_kinematics.workspace import Workspace

# Places along each side of a map, and of a cut.
PLACES = 201
CUT_PLACES = 801

LEVELS = 8  # lines of equal values in a map, about


def machine_figure(
    workspace: Workspace,
    velocities: Sequence[float],
    resolution: float,
    title: str,
    deviations: Callable[[FloatArray], FloatArray] | None = None,
) -> Figure:
    """Draw maps of a machine, seen from above, and two cuts through its workspace.

    Args:
        workspace: of the machine.
        velocities: largest one of each slider. Shape (3,) [m/s].
        resolution: step of the drives [m].
        title: of the picture.
        deviations: returns standard deviations of the platform's position at places, shape (n, 3)
            to shape (n, 3) [m]; for a map of what a calibration leaves.

    Returns:
        A figure that has no window; save it with ``savefig``.
    """
    lower, upper = level_corners(workspace)
    edge = 0.03 * float((upper - lower).max())
    x, y = (np.linspace(lower[k] - edge, upper[k] + edge, PLACES) for k in range(2))
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    found = maps(workspace, places, velocities, resolution)
    low, high = found.heights
    drawn = [
        ("condition number", found.conditions, "viridis_r"),
        ("speed in every direction [m/s]", found.speeds, "viridis"),
        ("force in every direction,\nas part of that of one drive", found.forces, "viridis"),
        (
            f"resolution [µm], drives of {1e6 * resolution:g} µm",
            1e6 * found.resolutions,
            "viridis_r",
        ),
        ("least stiffness,\nas part of that of one drive", found.stiffnesses, "viridis"),
    ]
    if deviations is None:
        drawn.append(("height of the workspace [mm]", MILLIMETRES * (high - low), "viridis"))
    else:
        middle = np.column_stack((places, 0.5 * (low + high)))
        sizes = np.full(len(places), np.nan)
        known = np.isfinite(low)
        sizes[known] = np.linalg.norm(deviations(middle[known]), axis=1)
        label = "uncertainty of the calibration [µm]"
        drawn.append((label, 1e6 * sizes, "viridis_r"))
    figure = Figure(figsize=(17.0, 8.5), layout="constrained")
    figure.suptitle(f"{title} (triangles: anchors of the arms)")
    axes = figure.subplots(2, 4)
    for place, (label, values, colours) in zip(axes.flat, drawn):
        _draw_map(figure, place, x, y, values.reshape(len(y), len(x)), label, colours)
        anchors = MILLIMETRES * np.array(workspace.machine.geometry.anchors)
        place.plot(*anchors.T, "k^", markersize=5.0)
    middle_of_anchors = np.mean(workspace.machine.geometry.anchors, axis=0)
    center = np.clip(middle_of_anchors, lower, upper)
    for axis, place in enumerate(axes.flat[6:]):
        _draw_cut(place, workspace, axis, center, (x, y)[axis])
    return figure


def _draw_map(
    figure: Figure,
    axes: Axes,
    x: FloatArray,
    y: FloatArray,
    values: FloatArray,
    label: str,
    colours: str,
) -> None:
    shown = np.where(np.isfinite(values), values, np.nan)
    x, y = MILLIMETRES * x, MILLIMETRES * y
    axes.set_title(label, fontsize=10)
    axes.set(xlabel="x [mm]", ylabel="y [mm]")
    axes.set_aspect("equal")
    if np.isfinite(shown).any():
        image = axes.pcolormesh(x, y, shown, cmap=colours, shading="nearest", rasterized=True)
        figure.colorbar(image, ax=axes, shrink=0.75)
        if np.nanmax(shown) - np.nanmin(shown) > 1e-9 * abs(float(np.nanmax(shown))):
            lines = axes.contour(x, y, shown, LEVELS, colors="white", linewidths=0.6)
            axes.clabel(lines, fontsize=7, fmt="%g")


def _draw_cut(
    axes: Axes, workspace: Workspace, axis: int, center: FloatArray, along: FloatArray
) -> None:
    """Draw where the platform may be in an upright plane along x or along y."""
    fine = np.linspace(along[0], along[-1], CUT_PLACES)
    places = np.tile(center, (len(fine), 1))
    places[:, axis] = fine
    low, high = MILLIMETRES * height_ranges(workspace, places)
    name, other = "xy"[axis], "yx"[axis]
    axes.fill_between(MILLIMETRES * fine, low, high, color="tab:blue", alpha=0.35, linewidth=0.0)
    axes.plot(MILLIMETRES * fine, low, color="tab:blue", linewidth=1.0)
    axes.plot(MILLIMETRES * fine, high, color="tab:blue", linewidth=1.0)
    limits = workspace.limits
    for height in {*limits.lower_heights, *limits.upper_heights}:
        axes.axhline(MILLIMETRES * height, **LIMIT_STYLE)
    axes.plot([], [], label="ends of slider travel", **LIMIT_STYLE)
    axes.legend(loc="best", fontsize=8)
    axes.set_title(f"cut at {other} = {MILLIMETRES * center[1 - axis] + 0.0:.0f} mm", fontsize=10)
    axes.set(xlabel=f"{name} [mm]", ylabel="z [mm]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(alpha=0.3)
