"""The mechanisms tab: its controls, and its drawing on an upright plane of the scene."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from viser import (
    ClientHandle,
    GuiApi,
    GuiEvent,
    GuiSliderHandle,
    LabelHandle,
    LineSegmentsHandle,
    PointCloudHandle,
    SceneApi,
)

from tri_glide_kinematics.mechanisms import MechanismFile, MechanismFileError, load_mechanism
from tri_glide_kinematics.mechanisms.f_mechanism import FMechanism
from tri_glide_kinematics.mechanisms.four_bar import FourBar
from tri_glide_kinematics.mechanisms.pictures import BLUE, GREEN, ORANGE, PURPLE, bounds
from tri_glide_kinematics.panel.mechanisms.questions import (
    Branch,
    Dimension,
    Shown,
    ShownFMechanism,
    ShownFourBar,
)
from tri_glide_kinematics.panel.mechanisms.show import Show
from tri_glide_kinematics.vectors import FloatArray, Vector3

# Draws a mechanism on an upright plane of the scene.

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
        root: of all, seen while a mechanism is shown.
        nodes: lines and points by their names: ``others`` for all positions but the ``followed``
            one, with its ``joints`` and the ``tips`` that draw ``path_0`` and so on; ``pivots``;
            ``marks`` on the paths.
    """

    def __init__(self, scene: SceneApi, name: str, centre: Vector3) -> None:
        """Add the nodes below ``name``, unseen; ``centre`` is that of the drawing [m]."""
        self._scene = scene
        self._name = name
        self.root = scene.add_frame(
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

    def hide(self) -> None:
        """Show nothing; what is drawn next may be another mechanism."""
        self.root.visible = False
        self._draw_branch(None)
        self._fit = None

    def draw(self, show: Show) -> None:
        """Show what is known of a mechanism."""
        skeleton, pivots = show.mechanism.skeleton, show.pivots
        places = [pivots, *(position.points for position in show.positions)]
        if show.branch is not None:
            places.append(show.branch.extent)
        fit = fitted(bounds(np.concatenate(places), margin=0.0), SIZE, self._fit)
        if fit is not self._fit or show.branch is not self._branch:
            self._fit = fit
            self._draw_branch(show.branch, show.mechanism.paths)
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
        self.root.visible = True

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


# The controls of the mechanisms tab.

NONE = "none"
CENTRE: Vector3 = (0.9, 0.0, 0.45)  # m, of the drawing: beside the machine, at half its height
VIEW_MARGIN = 1.6  # height of what the camera sees, at least, in drawings
VIEW_SIDES = (-0.4, 1.4)  # m, along x: the machine and the drawing
NARROW = 0.7  # width by height of a page that has its controls below the scene
STEPS_PER_TURN = 720  # of the slider of the crank
SHOWN_PER_SECOND = 20.0  # positions that are shown while the crank turns by itself
SLIDER_AFTER = 0.1  # s between two places of the slider while the crank turns by itself
LONGEST_PAUSE = 0.25  # s, after which a crank that turns by itself does not catch up


class MechanismsTab:
    """Shows a mechanism of a file, changed and turned by sliders.

    ``step`` is called from the thread that spins the node, at least ten times a second. It reads
    the sliders; what the page sends is only kept by viser until then.

    Attributes:
        choice: of a file, or none.
        crank: angle of the crank [deg].
        plays: whether it turns by itself.
        speed: with which it does [deg/s].
        sliders: of the dimensions of the mechanism on show [mm], [deg].
        words: what the tab says.
        drawing: in the scene.
    """

    def __init__(self, gui: GuiApi, scene: SceneApi, folder: Path) -> None:
        """Add the controls to the open container of ``gui``; the files are those of ``folder``."""
        self._gui = gui
        # The rest of the page, Stop before all else, goes on while a branch is traced.
        self._worker = ThreadPoolExecutor(1)
        self._files = example_files(folder)
        self.drawing = Drawing(scene, "/mechanism", CENTRE)
        self._show: Show | None = None
        self._chosen = NONE
        self._dimensions: tuple[Dimension, ...] = ()
        self.sliders: list[GuiSliderHandle[float]] = []
        # Of the crank, where we have put the slider, and where the crank then was [deg].
        self._slider_at = self._crank_at = 0.0
        # Filled by viser's threads.
        self._presses: deque[Callable[[], None]] = deque()
        self._advanced_at = -math.inf
        self._slider_set_at = -math.inf
        self._views: dict[int, tuple[Any, Any]] = {}

        self.choice = gui.add_dropdown("Mechanism", (NONE, *self._files), initial_value=NONE)
        self.choice.on_update(self._look)
        self._controls = gui.add_folder("Crank", visible=False)
        with self._controls:
            self.crank = gui.add_slider("angle [deg]", -180.0, 180.0, 360.0 / STEPS_PER_TURN, 0.0)
            self.plays = gui.add_checkbox("turns by itself", False)
            self.speed = gui.add_slider("speed [deg/s]", 5.0, 180.0, 5.0, 45.0)
            button = gui.add_button("Follow the next position")
            button.on_click(lambda _: self._presses.append(self.follow_next))
        self.words = gui.add_markdown("")
        self._lengths = gui.add_folder("Dimensions", visible=False)
        with self._lengths:
            button = gui.add_button("As in the file")
            button.on_click(lambda _: self._presses.append(self.reset))

    def step(self, time: float) -> None:
        """Do what the controls ask for, and draw what is new.

        ``time`` is of a steady clock [s].
        """
        if self.choice.value != self._chosen:
            self._choose(self.choice.value)
        while self._presses:
            self._presses.popleft()()
        show = self._show
        if show is None:
            return
        show.change([self._read(*pair) for pair in zip(self._dimensions, self.sliders)])
        self.crank.disabled = plays = self.plays.value
        if plays:
            self._play(show, time)
        else:
            self._advanced_at = time
            self._turn(show, self.crank.value)
        if show.step():
            self.drawing.draw(show)
            self.words.content = _markdown(show)

    def follow_next(self) -> None:
        """Follow the next one of the positions at this crank angle."""
        if self._show is not None:
            self._show.follow_next()

    def reset(self) -> None:
        """Give the sliders the numbers of the file."""
        for dimension, slider in zip(self._dimensions, self.sliders):
            _put(slider, _tenth(dimension.shown(dimension.value)))

    def _play(self, show: Show, time: float) -> None:
        """Turn the crank on, a few times a second."""
        passed = time - self._advanced_at
        if passed < 1.0 / SHOWN_PER_SECOND:
            return
        self._advanced_at = time
        show.advance(math.radians(self.speed.value) * min(passed, LONGEST_PAUSE))
        if time - self._slider_set_at >= SLIDER_AFTER:
            self._slider_set_at = time
            self._set_crank(show.crank_angle)

    def _turn(self, show: Show, angle: float) -> None:
        """Turn the crank to where the slider stands [deg]."""
        if angle != self._slider_at:
            show.turn(math.radians(angle - self._crank_at))
            self._slider_at = self._crank_at = angle

    def _set_crank(self, crank_angle: float) -> None:
        """Move the slider, which is no wish to turn."""
        self._crank_at = math.degrees(math.remainder(crank_angle, math.tau))
        step = 360.0 / STEPS_PER_TURN
        self._slider_at = round(self._crank_at / step) * step
        _put(self.crank, self._slider_at)

    def _choose(self, name: str) -> None:
        """Show the mechanism of a file, or none."""
        self._chosen = name
        self.drawing.hide()
        self.words.content = ""
        for slider in self.sliders:
            slider.remove()
        self.sliders.clear()
        shown = shown_of(self._files[name]) if name in self._files else None
        self._show = Show(shown, self._worker) if shown else None
        self._controls.visible = self._lengths.visible = self._show is not None
        _put(self.plays, False)
        if shown is None or self._show is None:
            return
        self._dimensions = shown.dimensions
        with self._lengths:
            self.sliders.extend(self._add_slider(item) for item in self._dimensions)
        self._set_crank(self._show.crank_angle)

    def _add_slider(self, dimension: Dimension) -> GuiSliderHandle[float]:
        return self._gui.add_slider(
            f"{dimension.label} [{dimension.unit}]",
            _tenth(dimension.shown(dimension.lowest)),
            _tenth(dimension.shown(dimension.highest)),
            0.1,
            _tenth(dimension.shown(dimension.value)),
        )

    def _read(self, dimension: Dimension, slider: GuiSliderHandle[float]) -> float:
        """Return a number in [m] or [rad]: that of the file to its last digit if not changed."""
        if slider.value == _tenth(dimension.shown(dimension.value)):
            return dimension.value
        return dimension.read(slider.value)

    def _look(self, event: GuiEvent[Any]) -> None:
        """Turn the camera of the page where the choice was made to the drawing, or back."""
        client = event.client
        if client is None:
            return
        camera = client.camera
        if event.target.value == NONE:
            if client.client_id in self._views:
                _move(client, *self._views.pop(client.client_id))
            return
        self._views.setdefault(client.client_id, (camera.position, camera.look_at))
        _move(client, *view_of(camera.fov, camera.aspect))


def shown_of(file: MechanismFile) -> Shown | None:
    """Return what is shown of the mechanism of a file, or none if it is not a planar one."""
    if isinstance(file.mechanism, FourBar):
        return ShownFourBar(file, file.mechanism)
    if isinstance(file.mechanism, FMechanism):
        return ShownFMechanism(file.mechanism)
    return None


def example_files(folder: Path) -> dict[str, MechanismFile]:
    """Return the planar mechanisms of a folder by the names of their files."""
    files = {}
    for path in sorted(folder.glob("*.yaml")):
        try:
            file = load_mechanism(path)
        except MechanismFileError:
            # A file of something else: parameters of nodes, or a drive.
            continue
        if isinstance(file.mechanism, FourBar | FMechanism):
            files[path.stem] = file
    return files


def view_of(fov: float, aspect: float) -> tuple[Vector3, Vector3]:
    """Return from where and whither a camera looks that sees the machine and the whole drawing.

    ``fov`` is the camera's angle from top to bottom [rad], ``aspect`` width by height.
    """
    left, right = VIEW_SIDES
    middle = 0.5 * (left + right)
    _, y, z = CENTRE
    height = max(VIEW_MARGIN * SIZE, (right - left) / aspect)
    # The controls cover the lower half of a narrow page, and Stop its upper part.
    down = 0.15 * height if aspect < NARROW else 0.0
    distance = height / (2.0 * math.tan(0.5 * fov))
    return (middle, y - distance, z - down), (middle, y, z - down)


def _move(client: ClientHandle, position: Any, look_at: Any) -> None:
    with client.atomic():
        client.camera.position = position
        client.camera.look_at = look_at


def _put(control: Any, value: bool | float) -> None:
    """Set the value of a control, which mypy takes for one that is only read."""
    control.value = value


def _markdown(show: Show) -> str:
    """Return what the tab says: what is wrong before all else."""
    problem = f"**{show.problem}**" if show.problem else ""
    return "\n\n".join(filter(None, (problem, show.words)))


def _tenth(number: float) -> float:
    """Return the nearest value of a slider, whose steps are tenths."""
    return round(number, 1)
