"""The controls of the mechanisms tab."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

from viser import ClientHandle, GuiApi, GuiEvent, GuiSliderHandle, SceneApi

from tri_glide_kinematics.mechanisms import MechanismFile, MechanismFileError, load_mechanism
from tri_glide_kinematics.mechanisms.f_mechanism import FMechanism
from tri_glide_kinematics.mechanisms.four_bar import FourBar
from tri_glide_kinematics.panel.mechanisms.drawing import SIZE, Drawing
from tri_glide_kinematics.panel.mechanisms.questions import (
    Dimension,
    FMechanismQuestions,
    FourBarQuestions,
    Questions,
)
from tri_glide_kinematics.panel.mechanisms.show import MechanismRequests, Show
from tri_glide_kinematics.vectors import Vector3

NONE = "none"
CENTRE: Vector3 = (0.9, 0.0, 0.45)  # m, of the drawing: beside the machine, at half its height
VIEW_MARGIN = 1.6  # height of what the camera sees, at least, in drawings
VIEW_SIDES = (-0.4, 1.4)  # m, along x: the machine and the drawing
NARROW = 0.7  # width by height of a page that has its controls below the scene
STEPS_PER_TURN = 720  # of the slider of the crank
SHOWN_PER_SECOND = 20.0  # positions that are asked for while the crank turns by itself
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

    def __init__(
        self, gui: GuiApi, scene: SceneApi, requests: MechanismRequests, folder: Path
    ) -> None:
        """Add the controls to the open container of ``gui``; the files are those of ``folder``."""
        self._gui = gui
        self._requests = requests
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
        """Do what the controls ask for, and draw what has been answered.

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
        if show.step(time):
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
        """Turn the crank on, so often that answers keep up."""
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
        questions = questions_about(self._files[name]) if name in self._files else None
        self._show = Show(questions, self._requests) if questions else None
        self._controls.visible = self._lengths.visible = self._show is not None
        _put(self.plays, False)
        if questions is None or self._show is None:
            return
        self._dimensions = questions.dimensions
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


def questions_about(file: MechanismFile) -> Questions | None:
    """Return the questions about the mechanism of a file, or none if it is not a planar one."""
    if isinstance(file.mechanism, FourBar):
        return FourBarQuestions(file, file.mechanism)
    if isinstance(file.mechanism, FMechanism):
        return FMechanismQuestions(file.mechanism)
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
