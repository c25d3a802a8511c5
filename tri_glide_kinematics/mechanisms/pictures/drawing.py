"""Parts of all pictures of mechanisms."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MultipleLocator
from PIL import Image

from tri_glide_kinematics.equal_numbers import SAME_PART, directions, first_largest
from tri_glide_kinematics.mechanisms.pictures.skeleton import INK, Line, Skeleton, bounds
from tri_glide_kinematics.picture_commands import MILLIMETRES
from tri_glide_kinematics.vectors import FloatArray

GRID_STYLE: dict[str, Any] = {"alpha": 0.3, "linewidth": 0.6}

_LARGE = 3.0  # m, from which on a mechanism is drawn in metres


@dataclass(frozen=True)
class LengthUnit:
    """The unit of the axes of a plane.

    Attributes:
        name: its symbol.
        per_metre: how many of it make a metre.
    """

    name: str
    per_metre: float

    @classmethod
    def fitting(cls, size: float) -> LengthUnit:
        """Return millimetres for all but large mechanisms; ``size`` is the largest length [m]."""
        return cls("m", 1.0) if size >= _LARGE else cls("mm", MILLIMETRES)


class DrawnMechanism:
    """A mechanism on axes, which can be moved from one position to another."""

    def __init__(
        self,
        axes: Axes,
        skeleton: Skeleton,
        points: FloatArray,
        unit: LengthUnit,
        named: bool = False,
    ) -> None:
        """Draw the skeleton.

        Args:
            axes: of :func:`plane_axes`.
            skeleton: what is joined to what.
            points: shape (k, 2) [m].
            unit: of the axes.
            named: whether to write the names of the points beside them.
        """
        self._skeleton = skeleton
        self._unit = unit
        self._plate = Polygon(
            np.zeros((3, 2)),
            facecolor=to_rgba(skeleton.plate_colour, 0.15),
            edgecolor=skeleton.plate_colour,
            linewidth=1.8,
            joinstyle="round",
            zorder=3,
        )
        axes.add_patch(self._plate)
        self._links = [
            axes.plot(
                [], [], color=link.colour, linewidth=link.width, solid_capstyle="round", zorder=4
            )[0]
            for link in skeleton.links
        ]
        (self._joints,) = axes.plot(
            [],
            [],
            linestyle="",
            marker="o",
            markersize=5.0,
            markerfacecolor="white",
            markeredgecolor=INK,
            markeredgewidth=1.1,
            zorder=6,
        )
        draw_pivots(axes, points[list(skeleton.pivots)], unit)
        self.move(points)
        if named:
            self._write_names(axes, points)

    def move(self, points: FloatArray) -> list[Line2D | Polygon]:
        """Move the drawing to other points, shape (k, 2) [m], and return what has changed."""
        scaled = points * self._unit.per_metre
        self._plate.set_xy(scaled[list(self._skeleton.plate)])
        for line, link in zip(self._links, self._skeleton.links):
            line.set_data(*scaled[[link.start, link.end]].T)
        self._joints.set_data(*scaled.T)
        return [self._plate, *self._links, self._joints]

    def _write_names(self, axes: Axes, points: FloatArray) -> None:
        """Write each name on the side of its point to which no link leads."""
        edges = self._skeleton.edges
        for index, name in enumerate(self._skeleton.names):
            neighbours = [a if b == index else b for a, b in edges if index in (a, b)]
            x, y = _free_direction(points[neighbours] - points[index])
            drop = 0.0
            if index in self._skeleton.pivots:
                x, y = 0.0, -1.0 if y < -SAME_PART else 1.0
                drop = 6.0 if y < 0.0 else 0.0  # the bearing stands there
            axes.annotate(
                name,
                points[index] * self._unit.per_metre,
                xytext=(8.0 * x, 8.0 * y - drop),
                textcoords="offset points",
                ha="center" if abs(x) < 0.4 else "left" if x > 0.0 else "right",
                va="center" if abs(y) < 0.4 else "bottom" if y > 0.0 else "top",
                fontsize=9,
                color=INK,
                path_effects=[withStroke(linewidth=2.5, foreground="white")],
                zorder=7,
            )


def _free_direction(vectors: FloatArray) -> tuple[float, float]:
    """Return the unit vector in the middle of the widest gap between vectors, shape (k, 2)."""
    angles = np.sort(directions(vectors[:, 0] + 1j * vectors[:, 1]))
    gaps = np.diff(angles, append=angles[0] + math.tau)
    widest = first_largest(gaps)
    middle = float(angles[widest] + 0.5 * gaps[widest])
    return math.cos(middle), math.sin(middle)


def draw_pivots(axes: Axes, pivots: FloatArray, unit: LengthUnit) -> None:
    """Draw fixed points, shape (k, 2) [m], as bearings."""
    axes.plot(
        *(pivots * unit.per_metre).T,
        linestyle="",
        marker="^",
        markersize=12.0,
        markerfacecolor="0.75",
        markeredgecolor=INK,
        markeredgewidth=0.8,
        zorder=2,
    )


def plane_axes(axes: Axes, box: FloatArray, unit: LengthUnit) -> Axes:
    """Turn axes into a plane with equal scales that shows a box of :func:`bounds`."""
    (left, bottom), (right, top) = (box * unit.per_metre).tolist()
    axes.set(
        xlim=(left, right),
        ylim=(bottom, top),
        xlabel=f"x [{unit.name}]",
        ylabel=f"y [{unit.name}]",
    )
    axes.set_aspect("equal")
    axes.grid(**GRID_STYLE)
    return axes


def draw_lines(axes: Axes, lines: Sequence[Line], unit: LengthUnit) -> None:
    """Draw lines on a plane."""
    for line in lines:
        (drawn,) = axes.plot(
            *(line.places * unit.per_metre).T,
            color=line.colour,
            linestyle=line.style,
            linewidth=line.width,
            alpha=line.opacity,
            label=line.label,
        )
        if line.joints:
            drawn.set(marker="o", markersize=4.0, markerfacecolor="white")


def plane_figure(
    lines: Sequence[Line],
    points: FloatArray,
    unit: LengthUnit,
    title: str = "",
    beside: float = 0.0,
    margin: float = 0.1,
) -> tuple[Figure, Axes]:
    """Return a figure with one plane, on which lines are drawn.

    Args:
        lines: to be drawn.
        points: of a mechanism that is to be in view as well. Shape (..., 2) [m].
        unit: of the axes.
        title: above them.
        beside: room to the right of the plane for a legend [inch]; without it there is none.
        margin: free border over the larger side.
    """
    box = bounds(np.concatenate([points.reshape(-1, 2), *(line.places for line in lines)]), margin)
    width, height = (box[1] - box[0]).tolist()
    scale = 6.0 / max(width, height)
    figure = Figure(
        figsize=(max(3.0, scale * width) + 1.0 + beside, max(3.0, scale * height) + 1.2),
        layout="constrained",
    )
    axes = plane_axes(figure.add_subplot(), box, unit)
    draw_lines(axes, lines, unit)
    axes.set_title(title, fontsize=11)
    if beside:
        legend_beside(axes)
    return figure, axes


def angle_plots(
    title: str, heights: tuple[float, float], size: tuple[float, float]
) -> tuple[Figure, Axes, Axes]:
    """Return a figure with two plots over the crank angle, above each other.

    Args:
        title: above them.
        heights: of both to each other.
        size: of the figure, sideways and upwards [inch].
    """
    figure = Figure(figsize=size, layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=heights)
    upper.set_title(title)
    lower.set_xlabel("crank angle [°]")
    for axes in (upper, lower):
        axes.grid(**GRID_STYLE)
    return figure, upper, lower


def plot_angles(
    axes: Axes, crank: FloatArray, angle: FloatArray, colour: str, label: str, style: str = "-"
) -> None:
    """Draw an angle over the crank angle, broken where either jumps by a full turn.

    Args:
        axes: of :func:`angle_plots`.
        crank: within one turn, shape (n,) [rad].
        angle: likewise.
        colour: of the line.
        label: in the legend.
        style: of the line.
    """
    steps = np.maximum(np.abs(np.diff(crank)), np.abs(np.diff(angle)))
    jumps = np.flatnonzero(steps > math.pi) + 1
    x, y = np.insert(np.degrees([crank, angle]), jumps, np.nan, axis=1)
    axes.plot(x, y, color=colour, linestyle=style, linewidth=1.6, label=label)


def angle_axis(axes: Axes, which: str, low: float, high: float) -> None:
    """Set limits and round ticks of an axis that shows angles; limits in [deg]."""
    span = high - low
    steps = (1, 2, 5, 10, 15, 30, 45, 60, 90, 180)
    step = next((step for step in steps if span / step < 9.0 + SAME_PART), 360)
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_locator(MultipleLocator(step))
    (axes.set_xlim if which == "x" else axes.set_ylim)(low, high)


def legend_beside(axes: Axes) -> None:
    """Put a legend to the right of the axes, each label once."""
    handles = dict(zip(*reversed(axes.get_legend_handles_labels())))
    axes.legend(
        handles.values(),
        handles.keys(),
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        borderaxespad=0.0,
        frameon=False,
        fontsize=9,
    )


def degrees_text(angle: float, digits: int = 2) -> str:
    """Write an angle [rad] in degrees, with a minus sign instead of a hyphen."""
    # Adding zero takes the sign off a zero.
    rounded = round(math.degrees(angle), digits) + 0.0
    return f"{rounded:.{digits}f}°".replace("-", "\N{MINUS SIGN}")


# Animations as GIF files.
#
# matplotlib's own writer draws each frame as a whole, with a palette of its own: for the mechanisms
# in ``config/`` it takes ten times as long, and its files have two to three times the size.

FRAMES_PER_SECOND = 15
RESOLUTION = 72.0  # dots per inch: small files
COLOURS = 64  # few, for small files too
NEARLY_WHITE = 248  # of 255; what is lighter becomes white


@dataclass(frozen=True, eq=False)
class Movie:
    """A motion of a mechanism, ready to be drawn.

    Attributes:
        skeleton: what is joined to what.
        points: of the skeleton, frame by frame. Shape (n, k, 2) [m].
        captions: what stands above each frame, n texts.
        paths: of the points, sampled closely. Shape (m, k, 2) [m].
        unit: of the axes.
    """

    skeleton: Skeleton
    points: FloatArray
    captions: tuple[str, ...]
    paths: FloatArray
    unit: LengthUnit


def save_movie(movie: Movie, file: Path, on_frame: Callable[[], None] = lambda: None) -> None:
    """Write a GIF that repeats without end.

    Args:
        movie: to be drawn.
        file: path that ends in ``.gif``.
        on_frame: called after each frame.

    Raises:
        OSError: if the file cannot be written.
    """
    colours = dict(movie.skeleton.traced)
    lines = [
        Line(points, colours[number], width=1.5, opacity=0.7)
        if number in colours
        else Line(points, INK, width=0.5, opacity=0.4)
        for number, points in enumerate(movie.paths.swapaxes(0, 1))
        if number not in movie.skeleton.pivots
    ]
    figure, axes = plane_figure(lines, movie.paths, movie.unit)
    drawn = DrawnMechanism(axes, movie.skeleton, movie.points[0], movie.unit)
    title = axes.set_title(movie.captions[0], fontsize=11)
    # Parts that stand still are drawn once; only those that move are drawn again on top of them.
    moved = [*drawn.move(movie.points[0]), title]
    for artist in moved:
        artist.set_animated(True)
    canvas = FigureCanvasAgg(figure)
    figure.set_dpi(RESOLUTION)
    canvas.draw()
    background = canvas.copy_from_bbox(figure.bbox)
    images: list[Image.Image] = []
    palette: Image.Image | None = None
    for points, caption in zip(movie.points, movie.captions):
        title.set_text(caption)
        drawn.move(points)
        canvas.restore_region(background)
        for artist in moved:
            axes.draw_artist(artist)
        image = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
        # One palette without dithering lets frames differ only where something has moved.
        palette = palette or _palette(image)
        images.append(image.quantize(palette=palette, dither=Image.Dither.NONE))
        on_frame()
    images[0].save(
        file,
        save_all=True,
        append_images=images[1:],
        duration=round(1000.0 / FRAMES_PER_SECOND),
        loop=0,
    )


def _palette(image: Image.Image) -> Image.Image:
    """Return an image whose palette suits ``image``, and whose lightest colour is white."""
    reduced = image.quantize(COLOURS, Image.Quantize.MEDIANCUT)
    colours = np.reshape(reduced.getpalette() or [], (-1, 3))
    colours[(colours >= NEARLY_WHITE).all(axis=1)] = 255
    palette = Image.new("P", (1, 1))
    palette.putpalette(colours.ravel().tolist())
    return palette
