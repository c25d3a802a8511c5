"""Pictures of an F-mechanism.

They show what source 001 shows in its figures 3 and 5 to 8.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from tri_glide_kinematics.equal_numbers import (
    SAME_PART,
    first_largest,
    within_turn,
    wrapped,
)
from tri_glide_kinematics.mechanisms.f_mechanism import (
    EventKind,
    FMechanism,
    FMechanismOverview,
    FMechanismPose,
    FMechanismTrace,
    as_points,
)
from tri_glide_kinematics.mechanisms.pictures.drawing import (
    DrawnMechanism,
    LengthUnit,
    Movie,
    angle_axis,
    angle_plots,
    degrees_text,
    draw_lines,
    draw_pivots,
    legend_beside,
    plane_axes,
    plane_figure,
    plot_angles,
)
from tri_glide_kinematics.mechanisms.pictures.skeleton import (
    CORNER_COLOURS,
    F_MECHANISM,
    INK,
    BranchCurve,
    Line,
    bounds,
    f_mechanism_points,
)
from tri_glide_kinematics.picture_commands import LIMIT_STYLE

SAMPLES = 1440
"""Crank angles over one turn at which a branch is drawn."""

FEWEST_SAMPLES = 300
"""Positions of a branch that make it look smooth."""

ON_BRANCH = 1e-6
"""Branches that pass a position within this [rad, sizes] both pass through it."""


def detailed_overview(
    mechanism: FMechanism, samples: int = SAMPLES, fewest: int = FEWEST_SAMPLES
) -> FMechanismOverview:
    """Return an overview whose branches all have samples enough to be drawn.

    Args:
        mechanism: to be drawn.
        samples: number of crank angles over one turn.
        fewest: number of samples that a branch has at least, however little the crank moves on it.
    """
    overview = mechanism.overview(samples)
    branches = tuple(_refined(mechanism, branch, fewest) for branch in overview.branches)
    return replace(overview, branches=branches)


def _refined(mechanism: FMechanism, branch: FMechanismTrace, fewest: int) -> FMechanismTrace:
    """Follow a branch on which the crank moves to and fro again, if it has too few samples."""
    if len(branch.angle) >= fewest or not branch.closed or not branch.turning_points:
        return branch
    turning = [event.crank_angle for event in branch.turning_points]
    # A range that ends just in the turning points would cut the branch off there.
    beyond = 0.01 * (max(turning) - min(turning))
    crank_angles = np.linspace(min(turning) - beyond, max(turning) + beyond, fewest)
    best = first_largest(np.abs(branch.singularity))
    start = float(branch.crank_angle[best])
    return mechanism.trace(start, branch.pose(best), crank_angles=crank_angles, through=True)


def describe(branch: FMechanismTrace) -> str:
    """Say in a few words how far the cranks can turn on a branch."""
    if branch.turns_fully:
        turns = abs(round(branch.turns))
        return "turns fully" if turns == 1 else f"turns fully, closes after {turns} turns"
    count = len(branch.turning_points)
    text = f"{count} turning point{'' if count == 1 else 's'}"
    last = branch.events[-1].kind
    if last is EventKind.SINGULAR:
        return f"{text}, ends in a singular position"
    return text if last is EventKind.CLOSED else f"{text}, not closed"


def evenly(curve: BranchCurve, count: int) -> list[int]:
    """Return indices of up to ``count`` positions that are spread evenly over a branch.

    Even in the crank angle where the crank turns one way; even in crank and platform angle
    together where it reverses, since the platform is fast there.
    """
    steps = np.abs(np.diff(curve.crank_angle))
    if curve.reverses:
        turn = np.abs(np.diff(curve.angle))
        steps = steps + np.minimum(turn, math.tau - turn)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    wanted = np.linspace(0.0, way[-1], count, endpoint=False)
    # A position that lies where it is wanted is taken, even if it seems to lie just before.
    return sorted(set(np.searchsorted(way, wanted - SAME_PART * way[-1]).tolist()))


def branch_through(overview: FMechanismOverview, pose: FMechanismPose) -> int:
    """Return the index of the branch on which a position lies."""

    def distance(branch: FMechanismTrace) -> float:
        curve = BranchCurve.of(branch)
        turns = np.stack([curve.crank_angle - pose.crank_angle, curve.angle - pose.angle])
        turns = np.abs(np.angle(np.exp(1j * turns)))
        apart = np.linalg.norm(curve.points[:, 6:] - pose.platform_joints, axis=(1, 2))
        return float(np.min(turns.sum(axis=0) + apart / branch.linkage.size))

    distances = [distance(branch) for branch in overview.branches]
    # In a bifurcation it lies on two branches, of which the first is taken.
    return next(i for i, found in enumerate(distances) if found <= min(distances) + ON_BRANCH)


def angle_that_is_drawn(overview: FMechanismOverview) -> float:
    """Return the middle of the first range of crank angles with the most positions [rad]."""
    most = overview.counts == overview.counts.max()
    first = int(np.argmax(most))
    rest = ~most[first:]
    length = int(np.argmax(rest)) if rest.any() else len(rest)
    return float(overview.crank_angles[first + length // 2])


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
    title = "F-mechanism: platform angle on all branches"
    figure, upper, lower = angle_plots(title, (4.0, 1.0), (9.5, 7.5))
    for number, branch in enumerate(overview.branches):
        curve = BranchCurve.of(branch)
        label = f"branch {number + 1}: {describe(branch)}"
        plot_angles(upper, within_turn(curve.crank_angle), curve.angle, f"C{number}", label)
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
    upper.set_ylabel("platform angle φ [°]")
    lower.set(ylabel="positions", ylim=(-0.4, 6.4))
    lower.set_yticks(range(0, 7, 2))
    low, high = upper.get_ylim()
    if high - low > 270.0:
        low, high = -180.0, 180.0
    angle_axis(upper, "y", low, high)
    angle_axis(lower, "x", 0.0, 360.0)
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
    title = (
        f"F-mechanism, branch {number + 1}: {describe(branch)}\n"
        f"drawn at crank angle {degrees_text(float(within_turn(curve.crank_angle[0])))}"
    )
    lines = [
        *_crank_circles(mechanism),
        *(
            Line(curve.points[:, joint], colour, f"path of {F_MECHANISM.names[joint]}")
            for joint, colour in F_MECHANISM.traced
        ),
        *(
            Line(curve.points[index][[6, 7, 8, 6]], INK, width=0.6, opacity=0.45)
            for index in evenly(curve, triangles)
        ),
    ]
    unit = LengthUnit.fitting(mechanism.size)
    figure, axes = plane_figure(lines, curve.points[0], unit, title, beside=2.2)
    DrawnMechanism(axes, F_MECHANISM, curve.points[0], unit, named=True)
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
    drawings = [f_mechanism_points(pivots, pose) for pose in poses]
    circles = _crank_circles(mechanism)
    rows = 1 if len(poses) < 4 else 2
    columns = max(1, math.ceil(len(poses) / rows))
    box = bounds(np.concatenate([*drawings, *(circle.places for circle in circles)]))
    width, height = (box[1] - box[0]).tolist()
    panel = 3.6
    figure = Figure(
        figsize=(panel * columns + 0.8, panel * rows * height / width + 0.9), layout="constrained"
    )
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for axes, pose, points in zip(grid.flat, poses, drawings):
        plane_axes(axes, box, unit)
        axes.label_outer()
        draw_lines(axes, circles, unit)
        DrawnMechanism(axes, F_MECHANISM, points, unit, named=True)
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
    pivots = mechanism.linkage.pivots
    # No cranks are drawn here, and the colours are those of the joints.
    lines = [replace(circle, colour=INK) for circle in _crank_circles(mechanism)]
    for number, branch in enumerate(overview.branches):
        points, style = BranchCurve.of(branch).points, _style(number)
        for joint, colour in F_MECHANISM.traced:
            label = f"{F_MECHANISM.names[joint]}, branch {number + 1}"
            lines.append(Line(points[:, joint], colour, label, style, 1.3))
    for pose in mechanism.poses(crank_angle):
        number = branch_through(overview, pose)
        corners = f_mechanism_points(pivots, pose)[[6, 7, 8, 6]]
        label = f"platform at {degrees_text(crank_angle)}, branch {number + 1}"
        lines.append(Line(corners, INK, label, _style(number), 1.4, joints=True))
    title = "F-mechanism: all positions of the platform joints"
    figure, axes = plane_figure(lines, as_points(np.array(pivots)), unit, title, beside=2.8)
    draw_pivots(axes, as_points(np.array(pivots)), unit)
    return figure


def _style(number: int) -> str:
    """Style of the lines of a branch."""
    return BRANCH_STYLES[number % len(BRANCH_STYLES)]


def _crank_circles(mechanism: FMechanism) -> list[Line]:
    linkage = mechanism.linkage
    circle = np.exp(1j * np.linspace(0.0, math.tau, 181))
    return [
        Line(as_points(pivot + crank * circle), colour, width=0.6, opacity=0.6)
        for pivot, crank, colour in zip(linkage.pivots, linkage.cranks, CORNER_COLOURS)
    ]


def f_mechanism_movie(branch: FMechanismTrace, title: str, frames: int) -> Movie:
    """Return the motion along one branch, on through its turning points.

    Args:
        branch: of an overview.
        title: of each frame, before its angles.
        frames: their number; fewer if the branch has not as many samples.
    """
    curve = BranchCurve.of(branch)
    shown = evenly(curve, frames)
    crank = within_turn(curve.crank_angle)
    captions = tuple(
        f"{title}\ncrank {degrees_text(float(crank[index]), 1)}, "
        f"platform {degrees_text(curve.angle[index], 1)}"
        for index in shown
    )
    unit = LengthUnit.fitting(branch.linkage.size)
    return Movie(F_MECHANISM, curve.points[shown], captions, curve.points, unit)
