"""Animations of mechanisms as GIF files.

matplotlib's own writer draws each frame as a whole, with a palette of its own: for the mechanisms
in ``config/`` it takes ten times as long, and its files have two to three times the size.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from tri_glide_kinematics.equal_numbers import within_turn
from tri_glide_kinematics.mechanisms.f_mechanism import FMechanismTrace
from tri_glide_kinematics.mechanisms.four_bar import Branch, FourBar
from tri_glide_kinematics.mechanisms.pictures import f_mechanism, four_bar
from tri_glide_kinematics.mechanisms.pictures.drawing import (
    DrawnMechanism,
    LengthUnit,
    degrees_text,
    plane_figure,
)
from tri_glide_kinematics.mechanisms.pictures.skeleton import (
    F_MECHANISM,
    FOUR_BAR,
    INK,
    Line,
    Skeleton,
)
from tri_glide_kinematics.vectors import FloatArray

FRAMES_PER_SECOND = 15
RESOLUTION = 72.0  # dots per inch: small files
COLOURS = 64  # few, for small files too
NEARLY_WHITE = 248  # of 255; what is lighter becomes white


@dataclass(frozen=True)
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


def f_mechanism_movie(branch: FMechanismTrace, title: str, frames: int) -> Movie:
    """Return the motion along one branch, on through its turning points.

    Args:
        branch: of an overview.
        title: of each frame, before its angles.
        frames: their number; fewer if the branch has not as many samples.
    """
    curve = f_mechanism.BranchCurve.of(branch)
    shown = f_mechanism.evenly(curve, frames)
    crank = within_turn(curve.crank_angle)
    captions = tuple(
        f"{title}\ncrank {degrees_text(float(crank[index]), 1)}, "
        f"platform {degrees_text(curve.angle[index], 1)}"
        for index in shown
    )
    unit = LengthUnit.fitting(branch.linkage.size)
    return Movie(F_MECHANISM, curve.points[shown], captions, curve.points, unit)


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
            :func:`.four_bar.default_crank_angle`.

    Raises:
        CrankLimitError: if the linkage cannot be closed at the crank angle.
    """
    if crank_angle is None:
        crank_angle = four_bar.default_crank_angle(linkage)
    # A linkage with one change point needs two turns to come back to its start.
    turns = 2.0 if linkage.lengths.stretches != linkage.lengths.folds else 1.0
    if linkage.crank_turns_fully:
        shown = np.linspace(0.0, turns * math.tau, frames, endpoint=False)
        path = np.linspace(0.0, turns * math.tau, four_bar.SAMPLES)
    else:
        path = four_bar.interval_around(linkage, crank_angle)
        # The quarter keeps the way back off the frames of the way there.
        phases = math.tau * (np.arange(frames) + 0.25) / frames
        shown = 0.5 * (path[0] + path[-1]) - 0.5 * (path[-1] - path[0]) * np.cos(phases)
    points, paths = (
        four_bar.skeleton_points(linkage, linkage.sweep(angles).branch(branch), coupler_point)
        for angles in (shown, path)
    )
    captions = tuple(
        f"Four-bar linkage, {branch.value} branch\ncrank {degrees_text(angle, 1)}"
        for angle in shown.tolist()
    )
    unit = LengthUnit.fitting(linkage.lengths.longest)
    return Movie(FOUR_BAR, points, captions, paths, unit)


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
