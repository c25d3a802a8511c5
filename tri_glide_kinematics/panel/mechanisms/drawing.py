"""Draws a mechanism on an upright plane of the scene."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from viser import LabelHandle, LineSegmentsHandle, PointCloudHandle, SceneApi

from tri_glide_kinematics.mechanisms.pictures import BLUE, GREEN, ORANGE, PURPLE, bounds
from tri_glide_kinematics.panel.mechanisms.questions import Branch
from tri_glide_kinematics.panel.mechanisms.show import Show
from tri_glide_kinematics.vectors import FloatArray, Vector3

# A drawing is fitted anew when its largest side is below or above these parts of the good size.
TOO_SMALL, TOO_LARGE = 0.5, 1.2


@dataclass(frozen=True, eq=False)
class Fit:
    """From metres of a mechanism to metres of the scene.

    Attributes:
        scale: of the drawing.
        centre: of the mechanism, which lies in the centre of the drawing. Shape (2,) [m].
    """

    scale: float
    centre: FloatArray

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return points of the drawing, on its plane. Shape (..., 2) to (..., 3) [m]."""
        flat = (points - self.centre) * self.scale
        return np.concatenate([flat, np.zeros((*flat.shape[:-1], 1))], axis=-1)


def fitted(box: FloatArray, size: float, before: Fit | None) -> Fit:
    """Return a fit that brings the larger side of a box to ``size`` [m].

    While a length is being changed the drawing keeps its scale, so that the change can be seen: the
    fit ``before``, of the same mechanism, is kept as long as it is good enough. The ``box`` has the
    lowest and the highest corner. Shape (2, 2) [m].
    """
    if before is not None:
        low, high = (box - before.centre) * before.scale
        reach = 2.0 * max(np.abs(low).max(), np.abs(high).max())
        if size * TOO_SMALL <= reach <= size * TOO_LARGE:
            return before
    side = float((box[1] - box[0]).max())
    return Fit(size / side, 0.5 * (box[0] + box[1]))


SIZE = 0.7  # m
# The plane of the mechanism is that of x and z in the scene: a quarter turn about x.
UPRIGHT = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)

INK, PALE = "#3C3C3C", "#96A8BA"
PATH_COLOURS = (ORANGE, GREEN, PURPLE)

# Nearer to the viewer lies what is more important.
OTHERS, PIVOTS, PATHS, FOLLOWED, MARKS = 0.0, 0.004, 0.006, 0.010, 0.014


class Drawing:
    """The nodes of the scene that show one mechanism; they are made once and change their points.

    All calls come from one thread.

    Attributes:
        nodes: lines and points by their names: ``others`` for all positions but the ``followed``
            one, with its ``joints`` and the ``tips`` that draw ``path_0`` and so on; ``pivots``;
            ``marks`` on the paths.
    """

    def __init__(self, scene: SceneApi, name: str, centre: Vector3) -> None:
        """Add the nodes below ``name``, unseen; ``centre`` is that of the drawing [m]."""
        self._scene = scene
        self._name = name
        self._root = scene.add_frame(
            name, show_axes=False, wxyz=UPRIGHT, position=centre, visible=False
        )
        self._paths = [
            self._lines(f"path_{number}", colour, 0.0025, PATHS)
            for number, colour in enumerate(PATH_COLOURS)
        ]
        self.nodes: dict[str, LineSegmentsHandle | PointCloudHandle] = {
            "others": self._lines("others", PALE, 0.0045, OTHERS),
            "followed": self._lines("followed", BLUE, 0.007, FOLLOWED),
            "pivots": self._points("pivots", INK, 0.016, "rounded", PIVOTS),
            "joints": self._points("joints", BLUE, 0.010, "circle", FOLLOWED),
            "tips": self._points("tips", ORANGE, 0.012, "circle", MARKS),
            "marks": self._points("marks", ORANGE, 0.014, "diamond", MARKS),
        }
        self.nodes.update((f"path_{number}", node) for number, node in enumerate(self._paths))
        self._labels: list[LabelHandle] = []
        self._branch: Branch | None = None
        self._fit: Fit | None = None

    @property
    def is_seen(self) -> bool:
        """Whether a mechanism is shown."""
        return self._root.visible

    def hide(self) -> None:
        """Show nothing; what is drawn next may be another mechanism."""
        self._root.visible = False
        self._draw_branch(None)
        self._fit = None

    def draw(self, show: Show) -> None:
        """Show what is known of a mechanism."""
        skeleton, pivots = show.questions.skeleton, show.pivots
        places = [pivots, *(position.points for position in show.positions)]
        if show.branch is not None:
            places.append(show.branch.extent)
        fit = fitted(bounds(np.concatenate(places), margin=0.0), SIZE, self._fit)
        if fit is not self._fit or show.branch is not self._branch:
            self._fit = fit
            self._draw_branch(show.branch, show.questions.paths)
        others = [
            skeleton.lines(position.points)
            for index, position in enumerate(show.positions)
            if index != show.followed
        ]
        nodes = self.nodes
        _set_points(nodes["pivots"], fit(pivots))
        _set_points(nodes["others"], fit(np.concatenate([np.empty((0, 2, 2)), *others])))
        if show.followed is None:
            for name in ("followed", "joints", "tips"):
                nodes[name].visible = False
        else:
            points = show.positions[show.followed].points
            _set_points(nodes["followed"], fit(skeleton.lines(points)))
            _set_points(nodes["joints"], fit(points))
            _set_points(nodes["tips"], fit(points[[index for index, _ in skeleton.traced]]))
        self._root.visible = True

    def _draw_branch(self, branch: Branch | None, paths: tuple[int, ...] = ()) -> None:
        """Draw paths and marks, which stay while the crank turns."""
        self._branch = branch
        for label in self._labels:
            label.remove()
        self._labels.clear()
        if branch is None or self._fit is None:
            for node in (*self._paths, self.nodes["marks"]):
                node.visible = False
            return
        for node in self._paths[len(paths) :]:
            node.visible = False
        for node, index in zip(self._paths, paths):
            path = branch.points[:, index]
            _set_points(node, self._fit(np.stack([path[:-1], path[1:]], axis=1)))
        places = self._fit(np.array([mark.place for mark in branch.marks]).reshape(-1, 2))
        _set_points(self.nodes["marks"], places)
        for number, (mark, place) in enumerate(zip(branch.marks, places)):
            label = self._scene.add_label(
                f"{self._name}/mark_{number}",
                mark.label,
                position=(place[0], place[1], MARKS),
                font_screen_scale=0.8,
                anchor="bottom-left",
            )
            self._labels.append(label)

    def _lines(self, name: str, colour: str, thickness: float, layer: float) -> LineSegmentsHandle:
        return self._scene.add_line_segments(
            f"{self._name}/{name}",
            np.zeros((1, 2, 3)),
            rgb(colour),
            thickness=thickness,
            position=(0.0, 0.0, layer),
            visible=False,
        )

    def _points(
        self, name: str, colour: str, size: float, shape: Any, layer: float
    ) -> PointCloudHandle:
        return self._scene.add_point_cloud(
            f"{self._name}/{name}",
            np.zeros((1, 3)),
            rgb(colour),
            point_size=size,
            point_shape=shape,
            precision="float32",
            point_shading="flat",
            position=(0.0, 0.0, layer),
            visible=False,
        )


def _set_points(node: LineSegmentsHandle | PointCloudHandle, points: FloatArray) -> None:
    """Give a node its points. A node without points is hidden instead."""
    if len(points):
        node.points = points.astype(np.float32)
    node.visible = len(points) > 0


def rgb(colour: str) -> tuple[int, int, int]:
    """Return a colour such as ``#0072B2`` in the way that viser reads."""
    red, green, blue = bytes.fromhex(colour[1:])
    return red, green, blue
