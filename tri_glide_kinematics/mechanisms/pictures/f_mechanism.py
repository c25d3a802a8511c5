"""Pictures of an F-mechanism: its branches, the paths of its platform, and its positions.

They show what source 001 shows in its figures 3 and 5 to 8.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tri_glide_kinematics.drawing import LIMIT_STYLE
from tri_glide_kinematics.mechanisms.f_mechanism import EventKind, FMechanism, FMechanismOverview
from tri_glide_kinematics.mechanisms.pictures.drawing import (
    GRID_STYLE,
    INK,
    DrawnMechanism,
    LengthUnit,
    angle_axis,
    bounds,
    degrees_text,
    draw_pivots,
    legend_beside,
    plane_axes,
    plane_figure,
    wraps,
)
from tri_glide_kinematics.mechanisms.pictures.f_mechanism_branches import (
    CORNER_COLOURS,
    SKELETON,
    BranchCurve,
    branch_through,
    describe,
    evenly,
    skeleton_points,
)
from tri_glide_kinematics.rounding import within_turn, wrapped
from tri_glide_kinematics.vectors import FloatArray

BRANCH_STYLES = ("-", "--", "-.", ":")

SAME = 1e-7
"""Places on branches that differ by less are one [rad]."""

MARKS = {
    EventKind.TURNING_POINT: ("turning point", "o", "white"),
    EventKind.BIFURCATION: ("bifurcation", "X", INK),
    EventKind.SINGULAR: ("singular position", "D", INK),
}
"""Name, marker and its face of the places that are marked on branches."""


def angle_figure(overview: FMechanismOverview) -> Figure:
    """Draw the platform angle over the crank angle on all branches, and the number of positions."""
    figure = Figure(figsize=(9.5, 7.5), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": (4.0, 1.0)})
    for number, branch in enumerate(overview.branches):
        curve = BranchCurve.of(branch)
        crank = within_turn(curve.crank_angle)
        x, y = np.insert(
            np.degrees([crank, curve.angle]), wraps(crank, curve.angle), np.nan, axis=1
        )
        upper.plot(
            x,
            y,
            color=f"C{number}",
            linewidth=1.6,
            label=f"branch {number + 1}: {describe(branch)}",
        )
    for kind, (name, marker, face) in MARKS.items():
        places = np.array(_places(overview, kind))
        if places.size:
            upper.plot(
                *places.T,
                linestyle="",
                marker=marker,
                markersize=7.0,
                markerfacecolor=face,
                markeredgecolor=INK,
                zorder=5,
                label=f"{name} ({len(places)})",
            )
    lower.step(np.degrees(overview.crank_angles), overview.counts, where="mid", color=INK)
    for self_motion in overview.crank_angles[overview.self_motion]:
        for axes in (upper, lower):
            axes.axvline(math.degrees(self_motion), **LIMIT_STYLE, label="self-motion")
    upper.set(title="F-mechanism: platform angle on all branches", ylabel="platform angle φ [°]")
    lower.set(xlabel="crank angle [°]", ylabel="positions", ylim=(-0.4, 6.4))
    lower.set_yticks(range(0, 7, 2))
    low, high = upper.get_ylim()
    if high - low > 270.0:
        low, high = -180.0, 180.0
    angle_axis(upper, "y", low, high)
    angle_axis(lower, "x", 0.0, 360.0)
    for axes in (upper, lower):
        axes.grid(**GRID_STYLE)
    legend_beside(upper)
    return figure


def _places(overview: FMechanismOverview, kind: EventKind) -> list[tuple[float, float]]:
    """Return crank angle and platform angle [deg] of all places of one kind, each once."""
    events = [event for branch in overview.branches for event in branch.events]
    poses = [event.pose for event in events if event.kind is kind]
    if kind is EventKind.SINGULAR:
        poses += overview.singular_poses
    # Both branches that cross in a bifurcation report it.
    places: list[tuple[float, float]] = []
    for pose in poses:
        place = float(within_turn(pose.crank_angle)), pose.angle
        if not any(max(abs(wrapped(a - b)) for a, b in zip(place, p)) < SAME for p in places):
            places.append(place)
    return sorted((math.degrees(crank), math.degrees(angle)) for crank, angle in places)


def paths_figure(
    mechanism: FMechanism, overview: FMechanismOverview, number: int, triangles: int = 12
) -> Figure:
    """Draw the paths of the platform joints on one branch, and some of its positions.

    Args:
        mechanism: to be drawn.
        overview: of it.
        number: index of the branch.
        triangles: number of positions drawn faintly.
    """
    branch = overview.branches[number]
    curve = BranchCurve.of(branch)
    unit = LengthUnit.fitting(mechanism.size)
    box = bounds(np.concatenate([curve.points.reshape(-1, 2), _crank_ends(mechanism)]))
    figure, axes = plane_figure(box, unit, beside=2.2)
    _draw_crank_circles(axes, mechanism, unit)
    for joint, colour in SKELETON.traced:
        axes.plot(
            *(curve.points[:, joint] * unit.per_metre).T,
            color=colour,
            linewidth=1.8,
            label=f"path of {SKELETON.names[joint]}",
        )
    for index in evenly(curve, triangles):
        corners = curve.points[index][[6, 7, 8, 6]] * unit.per_metre
        axes.plot(*corners.T, color=INK, linewidth=0.6, alpha=0.45)
    DrawnMechanism(axes, SKELETON, curve.points[0], unit, named=True)
    axes.set_title(
        f"F-mechanism, branch {number + 1}: {describe(branch)}\n"
        f"drawn at crank angle {degrees_text(float(within_turn(curve.crank_angle[0])))}",
        fontsize=11,
    )
    legend_beside(axes)
    return figure


def positions_figure(
    mechanism: FMechanism, overview: FMechanismOverview, crank_angle: float
) -> Figure:
    """Draw all positions of the platform at one crank angle [rad] side by side.

    Raises:
        SelfMotionError: if the platform can move while the cranks stand still.
    """
    poses = mechanism.poses(crank_angle)
    unit = LengthUnit.fitting(mechanism.size)
    pivots = mechanism.linkage.pivots
    drawings = [skeleton_points(pivots, pose) for pose in poses]
    rows = 1 if len(poses) < 4 else 2
    columns = max(1, math.ceil(len(poses) / rows))
    box = bounds(np.concatenate([*drawings, _crank_ends(mechanism)]))
    width, height = (box[1] - box[0]).tolist()
    panel = 3.6
    figure = Figure(
        figsize=(panel * columns + 0.8, panel * rows * height / width + 0.9), layout="constrained"
    )
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for axes, pose, points in zip(grid.flat, poses, drawings):
        plane_axes(axes, box, unit)
        axes.label_outer()
        _draw_crank_circles(axes, mechanism, unit)
        DrawnMechanism(axes, SKELETON, points, unit, named=True)
        branch = branch_through(overview, pose)
        axes.set_title(
            f"φ = {degrees_text(pose.angle, 3)}, branch {branch + 1}",
            fontsize=10,
            color=f"C{branch}",
        )
    for axes in grid.flat[len(poses) :]:
        axes.set_axis_off()
    figure.suptitle(
        f"F-mechanism: {len(poses)} positions at crank angle {degrees_text(crank_angle)}"
    )
    return figure


def corners_figure(
    mechanism: FMechanism, overview: FMechanismOverview, crank_angle: float
) -> Figure:
    """Draw where the platform joints can be on all branches, and the positions at a crank angle.

    Raises:
        SelfMotionError: if the platform can move while the cranks stand still.
    """
    unit = LengthUnit.fitting(mechanism.size)
    curves = [BranchCurve.of(branch) for branch in overview.branches]
    places = [curve.points.reshape(-1, 2) for curve in curves]
    box = bounds(np.concatenate([*places, _crank_ends(mechanism)]))
    figure, axes = plane_figure(box, unit, beside=2.8)
    # No cranks are drawn here, and the colours are those of the joints.
    _draw_crank_circles(axes, mechanism, unit, (INK,) * 3)
    for number, curve in enumerate(curves):
        for joint, colour in SKELETON.traced:
            axes.plot(
                *(curve.points[:, joint] * unit.per_metre).T,
                color=colour,
                linestyle=BRANCH_STYLES[number % len(BRANCH_STYLES)],
                linewidth=1.3,
                label=f"{SKELETON.names[joint]}, branch {number + 1}",
            )
    for pose in mechanism.poses(crank_angle):
        number = branch_through(overview, pose)
        corners = np.array([*pose.platform_joints, pose.platform_joints[0]]) * unit.per_metre
        axes.plot(
            *corners.T,
            color=INK,
            linestyle=BRANCH_STYLES[number % len(BRANCH_STYLES)],
            linewidth=1.4,
            marker="o",
            markersize=4.0,
            markerfacecolor="white",
            label=f"platform at {degrees_text(crank_angle)}, branch {number + 1}",
        )
    draw_pivots(axes, np.array([(p.real, p.imag) for p in mechanism.linkage.pivots]), unit)
    axes.set_title("F-mechanism: all positions of the platform joints", fontsize=11)
    legend_beside(axes)
    return figure


def _crank_ends(mechanism: FMechanism) -> FloatArray:
    """Return the outermost places of the crank circles, shape (12, 2) [m]."""
    linkage = mechanism.linkage
    ends = [
        pivot + crank * direction
        for pivot, crank in zip(linkage.pivots, linkage.cranks)
        for direction in (1.0, 1.0j, -1.0, -1.0j)
    ]
    return np.array([(end.real, end.imag) for end in ends])


def _draw_crank_circles(
    axes: Axes,
    mechanism: FMechanism,
    unit: LengthUnit,
    colours: Sequence[str] = CORNER_COLOURS,
) -> None:
    linkage = mechanism.linkage
    circle = np.exp(1j * np.linspace(0.0, math.tau, 181))
    for pivot, crank, colour in zip(linkage.pivots, linkage.cranks, colours):
        places = (pivot + crank * circle) * unit.per_metre
        axes.plot(places.real, places.imag, color=colour, linewidth=0.6, alpha=0.6)
