"""Pictures of a motion."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase
from matplotlib.gridspec import SubplotSpec
from matplotlib.transforms import Bbox
from mpl_toolkits.mplot3d import Axes3D, proj3d
from numpy.typing import NDArray

from tri_glide_kinematics.motion.limit_use import CommandStream
from tri_glide_kinematics.motion.limits import SliderLimits
from tri_glide_kinematics.picture_commands import LIMIT_STYLE, MILLIMETRES
from tri_glide_kinematics.vectors import FloatArray

# A course with more points is drawn by the lowest and the highest point of so many intervals.
INTERVALS = 4000

# Places labels beside points of a picture so that they cover neither each other nor a line.

DIRECTIONS = 16  # from a point in which its label may stand
# Nearest and farthest distance of a label from its point, as parts of its height.
DISTANCES = (0.7, 1.2, 1.8, 2.6)
# Two labels that cover each other are as bad as this many covered points of a line.
COVERED_LABEL = 1000.0


def label_centres(
    points: FloatArray, sizes: FloatArray, line: FloatArray, margin: float
) -> FloatArray:
    """Return where the centres of labels are best placed, one after the other.

    Args:
        points: that are labelled, in any unit. Shape (n, 2).
        sizes: width and height of each label. Shape (n, 2).
        line: points of what is drawn, close to each other. Shape (m, 2).
        margin: distance that labels keep from all else.

    Returns:
        Shape (n, 2).
    """
    angles = 2.0 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    centres: list[FloatArray] = []
    for index, (point, size) in enumerate(zip(points, sizes)):
        # From the point, past its distance, to the middle of the label; near places first.
        ways = np.add.outer(np.multiply(DISTANCES, size[1]), np.abs(directions) @ size / 2.0)
        places = (point + ways[..., np.newaxis] * directions).reshape(-1, 2)
        others = np.vstack((line, np.delete(points, index, axis=0)))
        apart = np.abs(places[:, np.newaxis] - others)
        costs = (apart < size / 2.0 + margin).all(axis=2).sum(axis=1)
        costs = costs + np.repeat(DISTANCES, DIRECTIONS)
        for centre, other_size in zip(centres, sizes):
            apart = np.abs(places - centre)
            costs[(apart < (size + other_size) / 2.0 + margin).all(axis=1)] += COVERED_LABEL
        centres.append(places[costs.argmin()])
    return np.array(centres).reshape(-1, 2)


class Mark(NamedTuple):
    """A place on the path that is marked and named.

    Attributes:
        name: its label.
        position: Shape (3,) [m].
        style: as matplotlib takes it.
    """

    name: str
    position: Sequence[float]
    style: Mapping[str, Any]


class Span(NamedTuple):
    """A part of the motion that is shaded and named, from a time to another [s]."""

    name: str
    begin: float
    end: float


def motion_figure(
    stream: CommandStream,
    path: NDArray[np.float64],
    limits: SliderLimits,
    travel: tuple[Sequence[float], Sequence[float]],
    marks: Sequence[Mark] = (),
    spans: Sequence[Span] = (),
) -> Figure:
    """Draw what the sliders were told and what the platform did.

    Args:
        stream: the commanded heights with their derivatives.
        path: measured positions of the platform. Shape (m, 3) [m].
        limits: of the sliders; drawn as dashed lines.
        travel: lowest and highest heights of the three sliders, each of shape (3,) [m].
        marks: places on the path.
        spans: parts of the motion.

    Returns:
        A figure that has no window; save it with ``savefig``.
    """
    figure = Figure(figsize=(13.0, 8.0), layout="constrained")
    grid = figure.add_gridspec(4, 2, width_ratios=(1.0, 1.25))
    space = figure.add_subplot(grid[:, 0], projection="3d")
    _draw_path(space, path, marks)
    _draw_courses(figure, [grid[row, 1] for row in range(4)], stream, limits, travel, spans)
    figure.draw_without_rendering()  # only then all places on the page are known
    _label(space, path, marks)
    return figure


def file_figure(
    stream: CommandStream,
    path: NDArray[np.float64],
    limits: SliderLimits,
    travel: tuple[Sequence[float], Sequence[float]],
    spans: Sequence[Span],
    title: str,
) -> Figure:
    """Draw the motion of a file: the platform from above and from the side, and the sliders.

    Args:
        stream: the heights with their derivatives.
        path: positions of the platform, one for each row of the stream. Shape (n, 3) [m].
        limits: of the sliders; drawn as dashed lines.
        travel: lowest and highest heights of the three sliders, each of shape (3,) [m].
        spans: parts of the motion.
        title: over the platform's path.

    Returns:
        A figure that has no window; save it with ``savefig``.
    """
    figure = Figure(figsize=(13.0, 8.0), layout="constrained")
    # Two pictures beside each other, whose rows do not line up.
    left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=(1.0, 1.4))[0]
    above, side = left.subplots(2, 1)
    grid = right.add_gridspec(4, 1)
    moves = np.append(True, np.diff(path, axis=0).any(axis=1))
    x, y, z = (path[moves] * MILLIMETRES).T
    for axes, upwards, name in ((above, y, "y"), (side, z, "z")):
        axes.plot(x, upwards, linewidth=0.9)
        axes.plot(x[0], upwards[0], "o", color="tab:green", label="start")
        axes.plot(x[-1], upwards[-1], "s", color="tab:red", markersize=4.0, label="end")
        axes.set(xlabel="x [mm]", ylabel=f"{name} [mm]")
        axes.set_aspect("equal", adjustable="datalim")
        axes.grid(alpha=0.3)
    above.set_title(f"{title}\nfrom above")
    side.set_title("from the side")
    above.legend(loc="best", fontsize=9)
    _draw_courses(right, [grid[row, 0] for row in range(4)], stream, limits, travel, spans)
    return figure


def _draw_courses(
    figure: FigureBase,
    places: Sequence[SubplotSpec],
    stream: CommandStream,
    limits: SliderLimits,
    travel: tuple[Sequence[float], Sequence[float]],
    spans: Sequence[Span],
) -> None:
    """Draw heights and their derivatives over the time, one below the other."""
    courses = (
        ("height [m]", stream.heights, travel),
        ("velocity [m/s]", stream.velocities, _both_signs(limits.velocity)),
        ("acceleration [m/s²]", stream.accelerations, _both_signs(limits.acceleration)),
        ("jerk [m/s³]", stream.jerks, _both_signs(limits.jerk)),
    )
    first: Axes | None = None
    for row, (label, values, bounds) in enumerate(courses):
        axes = figure.add_subplot(places[row], sharex=first)
        first = first or axes
        for slider in range(3):
            course = _envelope(stream.times, values[:, slider])
            axes.plot(*course, linewidth=0.9, label=f"slider {slider + 1}")
        for bound in sorted({*bounds[0], *bounds[1]}):
            axes.axhline(bound, **LIMIT_STYLE)
        for span in spans:
            axes.axvspan(span.begin, span.end, color="tab:green", alpha=0.12, linewidth=0.0)
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
        axes.tick_params(labelbottom=row == len(courses) - 1)
        if row == 0:
            axes.plot([], [], label="limit", **LIMIT_STYLE)
            for span in spans:
                middle = (span.begin + span.end) / 2.0
                where = axes.get_xaxis_transform()
                axes.text(middle, 0.82, span.name, transform=where, ha="center", fontsize=9)
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.32), ncols=4, frameon=False)
    axes.set_xlabel("time [s]")


def _envelope(times: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return fewer points of a course: of each of many intervals the lowest and the highest.

    Args:
        times: Shape (n,) [s].
        values: Shape (n,).
    """
    size = len(times) // INTERVALS
    if size < 4:
        return times, values
    whole = len(times) // size * size
    rows = values[:whole].reshape(-1, size)
    ends = np.sort(np.stack((rows.argmin(axis=1), rows.argmax(axis=1)), axis=1), axis=1)
    kept = (ends + size * np.arange(len(rows))[:, np.newaxis]).ravel()
    kept = np.append(kept, np.arange(whole, len(times)))
    return times[kept], values[kept]


def _both_signs(bounds: Sequence[float]) -> tuple[list[float], list[float]]:
    return [-bound for bound in bounds], list(bounds)


def _draw_path(axes: Axes3D, path: NDArray[np.float64], marks: Sequence[Mark]) -> None:
    x, y, z = (path * MILLIMETRES).T
    axes.plot(x, y, z, linewidth=1.0)
    for mark in marks:
        px, py, pz = (coordinate * MILLIMETRES for coordinate in mark.position)
        axes.plot([px], [py], [pz], linestyle="none", **mark.style)
    axes.set(xlabel="x [mm]", ylabel="y [mm]", zlabel="z [mm]", title="platform path")
    axes.set_aspect("equal")
    axes.view_init(elev=28.0, azim=-72.0)  # no axis of the machine is seen end on
    axes.set_box_aspect(None, zoom=0.92)  # the labels of the last axis would be cut off
    axes.locator_params(nbins=5)


def _label(axes: Axes3D, path: NDArray[np.float64], marks: Sequence[Mark]) -> None:
    """Write the names of ``marks`` beside them, where they cover nothing."""
    if not marks:
        return
    places = np.array([mark.position for mark in marks])
    to_page = axes.transData.inverted()
    texts = [
        axes.annotate(mark.name, (0.0, 0.0), fontsize=9, ha="center", va="center") for mark in marks
    ]
    boxes: list[Bbox] = [text.get_window_extent() for text in texts]
    sizes = np.array([(box.width, box.height) for box in boxes])
    points = _on_page(axes, places)
    centres = label_centres(points, sizes, _on_page(axes, path), margin=2.0)
    for text, centre in zip(texts, to_page.transform(centres)):
        text.set_position(centre)


def _on_page(axes: Axes3D, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return positions [m] as pixels of the page. Shape (n, 2)."""
    x, y, _ = proj3d.proj_transform(*(positions * MILLIMETRES).T, axes.get_proj())
    return np.asarray(axes.transData.transform(np.column_stack((x, y))))
