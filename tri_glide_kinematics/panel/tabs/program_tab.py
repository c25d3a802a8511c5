"""The tab with programs: uploaded, seen before they run, proved, and run."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from time import monotonic

import numpy as np
import viser

from tri_glide_kinematics.panel.machine_facts import MachineFacts
from tri_glide_kinematics.panel.machine_scene import NO_LINES, RGB
from tri_glide_kinematics.panel.markup import note, table
from tri_glide_kinematics.panel.program_files import ProgramFolder, Uploads
from tri_glide_kinematics.panel.program_reading import (
    CUT,
    OUTSIDE,
    RAPID,
    NotRead,
    ReadProgram,
    Reading,
    ReadingProcess,
    points_of_line,
)
from tri_glide_kinematics.panel.tabs.operator_requests import OperatorRequests, OperatorsInput
from tri_glide_kinematics.programs import Dialect, ProgramCheck, ProgramSettings, load_settings
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import number_text

NO_FILE = "choose a program"
UPLOAD = '<label class="tri-glide-upload">Upload a program<input type="file" data-upload></label>'
LIST_PERIOD = 1.0  # s between two looks into the folder
SHOW_PERIOD = 0.2  # s between two texts of the present line
LONGEST_LINE = 80  # characters of it that are shown
MOST_TOLD = 5

COLORS: dict[int, RGB] = {CUT: (20, 70, 160), RAPID: (140, 140, 140), OUTSIDE: (220, 20, 20)}
PRESENT: RGB = (230, 0, 200)


class ProgramDrawing:
    """The path of a program in the scene, and the present line of it."""

    def __init__(self, scene: viser.SceneApi) -> None:
        """Draw into a ``scene``; nothing yet."""
        self._scene = scene
        self._present = scene.add_line_segments(
            "/program_line", NO_LINES, PRESENT, thickness=7.0, thickness_units="screen"
        )
        self._is_drawn = False

    def draw(self, read: ReadProgram) -> None:
        """Draw the path of a program in place of the last one."""
        self.clear()
        if len(read.points):
            colors = np.array([COLORS[look] for look in sorted(COLORS)], dtype=np.uint8)
            self._scene.add_line_segments(
                "/program",
                read.points,
                np.repeat(colors[read.looks][:, np.newaxis], 2, axis=1),
                thickness=2.0,
                thickness_units="screen",
            )
            self._is_drawn = True

    def mark(self, points: np.ndarray) -> None:
        """Mark the polyline through ``points``, shape (n, 3) [m]."""
        pairs = np.stack((points[:-1], points[1:]), axis=1) if len(points) else NO_LINES
        self._present.points = pairs.astype(np.float32)

    def clear(self) -> None:
        """Draw nothing."""
        if self._is_drawn:
            self._scene.remove_by_name("/program")
            self._is_drawn = False
        self.mark(np.empty((0, 3)))


class ProgramTab:
    """Programs of a folder.

    Attributes:
        uploads: takes files of pages into the folder.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        requests: OperatorRequests,
        folder: ProgramFolder,
        settings_file: str,
        present: Callable[[], Vector3 | None],
        ask: Callable[[int, str, int], None],
    ) -> None:
        """Add all to the open container of the ``server``'s panel.

        The settings of programs are in a ``settings_file``, empty for none; ``present`` returns
        where the platform is [m]; ``ask`` asks a page for pieces of a file.
        """
        gui = server.gui
        self.uploads = Uploads(folder, requests, ask, self._take_file)
        self._requests = requests
        self._folder = folder
        self._settings_file = settings_file
        self._present = present
        self._facts: MachineFacts | None = None
        self._name = ""
        self._process: ReadingProcess | None = None
        self._stream: BinaryIO | None = None
        self._read: ReadProgram | None = None
        self._check: ProgramCheck | None = None
        self._error = ""
        self._due = {"list": 0.0, "show": 0.0}
        self._drawing = ProgramDrawing(server.scene)
        gui.add_html(UPLOAD)
        self._files = gui.add_dropdown("File", (NO_FILE, *folder.names()))
        self._file = OperatorsInput(requests, self._files, self._choose)
        self._dialect = OperatorsInput(
            requests,
            gui.add_dropdown("Dialect", (FROM_SETTINGS, *(each.value for each in Dialect))),
            lambda _: self._load(is_check=False),
        )
        self._words = gui.add_html("")
        buttons = gui.add_button_group("Program", ("check", "run", "go on", "stop"))
        buttons.on_click(requests.on(self._press))

    def step(self, facts: MachineFacts | None) -> None:
        """Take what has come, and go on; ``facts`` are those of the machine that is there."""
        if facts is not None:
            is_new = self._facts is None or not self._facts.is_same_machine(facts)
            self._facts = facts
            if is_new and self._name:
                self._load(is_check=False)
        self._take_answer()

    def show(self) -> None:
        """Show on the pages what there is."""
        if self._is_due("list", LIST_PERIOD):
            self._show_list()
        if self._is_due("show", SHOW_PERIOD):
            self._words.content = self._text()

    def close(self) -> None:
        """End what was begun."""
        if self._process is not None:
            self._process.end()
            self._process = None

    # Files

    def _take_file(self, name: str) -> None:
        """Choose a file that has just come."""
        self._show_list(name)
        self._file.set(name)
        self._choose(name)

    def _show_list(self, chosen: str = "") -> None:
        """Show which files there are."""
        names = self._folder.names()
        if self._name and self._name not in names:
            self._choose("")
            self._requests.refuse("the program that was chosen is no longer in the folder")
        options = (NO_FILE, *names)
        if options != tuple(self._files.options):
            # What is chosen stays so.
            self._files.options = options
            self._file.set(self._name or NO_FILE)

    def _choose(self, name: str) -> None:
        self._name = "" if name == NO_FILE else name
        self._load(is_check=False)

    def _load(self, *, is_check: bool) -> None:
        """Begin to read the file that is chosen, or to prove it."""
        self.close()
        self._error = ""
        self._check = None
        if not is_check:
            self._forget()
        if not self._name or self._facts is None:
            return
        path = self._folder.path(self._name)
        settings = self._settings()
        self._process = ReadingProcess(
            Reading(path, settings, self._facts.workspace, self._facts.limits, is_check)
        )

    def _settings(self) -> ProgramSettings:
        """Return what programs do not say themselves."""
        file = self._settings_file
        settings = load_settings(file) if file else ProgramSettings()
        if self._dialect.value != FROM_SETTINGS:
            settings = replace(settings, dialect=Dialect(self._dialect.value))
        if settings.start is None:
            settings = replace(settings, start=self._present())
        return settings
