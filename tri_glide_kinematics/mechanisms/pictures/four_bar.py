"""Pictures of a four-bar linkage."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tri_glide_kinematics.equal_numbers import SAME_ANGLE
from tri_glide_kinematics.mechanisms.four_bar import (
    Branch,
    CrankLimitError,
    FourBar,
)
from tri_glide_kinematics.mechanisms.pictures.drawing import (
    DrawnMechanism,
    LengthUnit,
    Movie,
    angle_axis,
    angle_plots,
    degrees_text,
    legend_beside,
    plane_figure,
    plot_angles,
)
from tri_glide_kinematics.mechanisms.pictures.skeleton import (
    BLUE,
    FOUR_BAR,
    GREEN,
    ORANGE,
    PURPLE,
    Line,
    default_crank_angle,
    four_bar_points,
)
from tri_glide_kinematics.picture_commands import LIMIT_STYLE
from tri_glide_kinematics.vectors import FloatArray

SAMPLES = 721
"""Crank angles for each interval that the crank can reach."""

BRANCH_STYLES = {Branch.OPEN: "-", Branch.CROSSED: "--"}


def crank_angles(linkage: FourBar, samples: int = SAMPLES) -> list[FloatArray]:
    """Return crank angles over each interval that the crank can reach, each of shape (n,) [rad].

    They lie denser towards the limits, where all other angles change without bound. A full turn
    starts at zero.
    """
    if linkage.crank_turns_fully:
        return [np.linspace(0.0, math.tau, samples)]
    parts = np.sin(np.linspace(-0.5 * math.pi, 0.5 * math.pi, samples))
    return [
        np.clip(0.5 * (low + high) + 0.5 * (high - low) * parts, low, high)
        for low, high in sorted(linkage.crank_ranges)
    ]


def interval_around(linkage: FourBar, crank_angle: float) -> FloatArray:
    """Return those of :func:`crank_angles` whose interval holds ``crank_angle`` [rad].

    Raises:
        CrankLimitError: if none does.
    """
    for angles in crank_angles(linkage):
        middle = 0.5 * (angles[0] + angles[-1])
        if abs(math.remainder(crank_angle - middle, math.tau)) <= angles[-1] - middle + SAME_ANGLE:
            return angles
    raise CrankLimitError(crank_angle, linkage.crank_ranges)


def coupler_curve_figure(
    linkage: FourBar,
    coupler_point: tuple[float, float],
    branch: Branch = Branch.OPEN,
    crank_angle: float | None = None,
) -> Figure:
    """Draw the path of a point of the coupler plane on both branches, and the linkage on it.

    Args:
        linkage: to be drawn.
        coupler_point: x from the crank pin towards the rocker pin, y to the left of it [m].
        branch: on which the linkage is drawn.
        crank_angle: at which it is drawn [rad]; by default that of :func:`default_crank_angle`.

    Raises:
        CrankLimitError: if the linkage cannot be closed at the crank angle.
    """
    if crank_angle is None:
        crank_angle = default_crank_angle(linkage)
    linkage.pose(crank_angle, branch)
    shown = linkage.sweep([crank_angle]).branch(branch)
    (pose,) = four_bar_points(linkage, shown, coupler_point)
    unit = LengthUnit.fitting(linkage.lengths.longest)
    lines: list[Line] = []
    for angles in crank_angles(linkage):
        for drawn in Branch:
            points = four_bar_points(linkage, linkage.sweep(angles).branch(drawn), coupler_point)
            style, label = BRANCH_STYLES[drawn], f"path of P, {drawn.value} branch"
            lines.append(Line(points[:, 4], PURPLE, label, style))
            for pin, colour in ((1, BLUE), (2, GREEN)):
                lines.append(Line(points[:, pin], colour, width=0.7, opacity=0.6))
    for link, colour in (("crank", BLUE), ("coupler", ORANGE), ("rocker", GREEN)):
        label = f"{link}, {getattr(linkage, link) * unit.per_metre:.4g} {unit.name}"
        lines.append(Line(np.full((1, 2), np.nan), colour, label, width=2.2))
    title = (
        f"Four-bar linkage, {linkage.grashof_class.value}\n"
        f"at crank angle {degrees_text(crank_angle)}, {branch.value} branch"
    )
    figure, axes = plane_figure(lines, pose, unit, title, beside=2.4, margin=0.14)
    DrawnMechanism(axes, FOUR_BAR, pose, unit, named=True)
    return figure


def angles_figure(linkage: FourBar) -> Figure:
    """Draw coupler, rocker and transmission angle of both branches over the crank angle."""
    title = f"Four-bar linkage, {linkage.grashof_class.value}"
    figure, upper, lower = angle_plots(title, (1.5, 1.0), (9.0, 8.0))
    intervals = crank_angles(linkage)
    for angles in intervals:
        sweep = linkage.sweep(angles)
        for branch in Branch:
            part, style = sweep.branch(branch), BRANCH_STYLES[branch]
            for name, values, colour in (
                ("coupler", part.coupler_angles, ORANGE),
                ("rocker", part.rocker_angles, GREEN),
            ):
                plot_angles(upper, angles, values, colour, f"{name}, {branch.value} branch", style)
        plot_angles(lower, angles, sweep.open.transmission_angles, BLUE, "both branches")
    _mark_extremes(lower, linkage, intervals)
    _mark_limits((upper, lower), linkage)
    upper.set_ylabel("angle from the x axis [°]")
    lower.set_ylabel("transmission angle [°]")
    angle_axis(upper, "y", -180.0, 180.0)
    angle_axis(lower, "y", 0.0, 180.0)
    ends = np.degrees([(angles[0], angles[-1]) for angles in intervals])
    border = 0.0 if linkage.crank_turns_fully else 0.05 * float(np.ptp(ends))
    angle_axis(lower, "x", float(ends.min()) - border, float(ends.max()) + border)
    for axes in (upper, lower):
        legend_beside(axes)
    return figure


def _mark_limits(plots: Sequence[Axes], linkage: FourBar) -> None:
    """Draw the crank's limits as lines; a crank that turns fully has none."""
    if linkage.crank_turns_fully:
        return
    limits = sorted({limit for ends in linkage.crank_ranges for limit in ends})
    label = "\n".join(["limits of the crank:", *(degrees_text(limit, 3) for limit in limits)])
    for axes in plots:
        for limit in limits:
            axes.axvline(math.degrees(limit), **LIMIT_STYLE, label=label)


def _mark_extremes(axes: Axes, linkage: FourBar, intervals: Sequence[FloatArray]) -> None:
    """Mark the smallest and the largest transmission angle wherever they are met."""
    extremes = linkage.transmission_extremes
    lowest, highest = intervals[0][0], intervals[-1][-1]
    for angle, value, name, marker in (
        (extremes.smallest_at, extremes.smallest, "smallest", "v"),
        (extremes.largest_at, extremes.largest, "largest", "^"),
    ):
        # The transmission angle is symmetric to the ground line.
        mirrored = 2.0 * linkage.ground_angle - angle
        places = {
            round(place, 12)
            for start in (angle, mirrored)
            for place in (start - math.tau, start, start + math.tau)
            if lowest - 1e-9 <= place <= highest + 1e-9
        }
        axes.plot(
            np.degrees(sorted(places)),
            np.degrees([value] * len(places)),
            linestyle="",
            marker=marker,
            color=ORANGE if marker == "v" else GREEN,
            clip_on=False,
            zorder=5,
            label=f"{name}: {degrees_text(value)}",
        )


def four_bar_movie(
    linkage: FourBar,
    coupler_point: tuple[float, float],
    branch: Branch,
    frames: int,
    crank_angle: float | None = None,
) -> Movie:
    """Return the motion on one branch: all the way round, or to and fro between two limits.

    Args:
        linkage: to be drawn.
        coupler_point: x from the crank pin towards the rocker pin, y to the left of it [m].
        branch: to be followed.
        frames: their number.
        crank_angle: that lies between the two limits [rad]; by default that of
            :func:`default_crank_angle`.

    Raises:
        CrankLimitError: if the linkage cannot be closed at the crank angle.
    """
    if crank_angle is None:
        crank_angle = default_crank_angle(linkage)
    # A linkage with one change point needs two turns to come back to its start.
    turns = 2.0 if linkage.lengths.stretches != linkage.lengths.folds else 1.0
    if linkage.crank_turns_fully:
        shown = np.linspace(0.0, turns * math.tau, frames, endpoint=False)
        path = np.linspace(0.0, turns * math.tau, SAMPLES)
    else:
        path = interval_around(linkage, crank_angle)
        # The quarter keeps the way back off the frames of the way there.
        phases = math.tau * (np.arange(frames) + 0.25) / frames
        shown = 0.5 * (path[0] + path[-1]) - 0.5 * (path[-1] - path[0]) * np.cos(phases)
    points, paths = (
        four_bar_points(linkage, linkage.sweep(angles).branch(branch), coupler_point)
        for angles in (shown, path)
    )
    captions = tuple(
        f"Four-bar linkage, {branch.value} branch\ncrank {degrees_text(angle, 1)}"
        for angle in shown.tolist()
    )
    unit = LengthUnit.fitting(linkage.lengths.longest)
    return Movie(FOUR_BAR, points, captions, paths, unit)
