"""The files of programs on the page: chosen, drawn, listed, renamed, sent and deleted."""

from __future__ import annotations

import math
from contextlib import suppress
from functools import partial
from html import escape
from pathlib import Path
from time import monotonic

import numpy as np
import viser

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.machine_scene import NO_LINES, RGB
from tri_glide_kinematics.panel.operator_requests import (
    OperatorRequests,
    OperatorsNumber,
)
from tri_glide_kinematics.panel.pace import Pace
from tri_glide_kinematics.panel.program_reading import CUT, OUTSIDE, RAPID, NotRead, ReadProgram
from tri_glide_kinematics.panel.programs import (
    FROM_SETTINGS,
    NO_FILE,
    ChosenProgram,
    ProgramFolder,
    Uploads,
    send_file,
)
from tri_glide_kinematics.panel.viser_parts import uuid_of
from tri_glide_kinematics.panel.words import WARNING
from tri_glide_kinematics.programs import Dialect, line_to_go_on_from

UPLOAD = '<label class="tri-glide-upload">Upload a program<input type="file" data-upload></label>'
LIST_PERIOD = 1.0  # s between two looks into the folder
ASKED = 5.0  # s within which one more press removes a file
LISTED = 15  # lines

# Colours of the path, and of the line that runs: red, green and blue from 0 to 255.
COLORS: dict[int, RGB] = {CUT: (0, 30, 130), RAPID: (110, 110, 110), OUTSIDE: (220, 0, 0)}
PRESENT: RGB = (230, 0, 200)


class ProgramDrawing:
    """The path of a program in the scene, and the present line of it."""

    def __init__(self, scene: viser.SceneApi, chosen: ChosenProgram) -> None:
        """Draw what is ``chosen`` into a ``scene``; nothing yet."""
        self._scene, self._chosen = scene, chosen
        self._present = scene.add_line_segments(
            "/program_line", NO_LINES, PRESENT, thickness=7.0, thickness_units="screen"
        )
        self._path: viser.LineSegmentsHandle | None = None
        self._marked = 0

    def draw(self, read: ReadProgram) -> None:
        """Draw the path of a program in place of the last one."""
        self.clear()
        if len(read.points):
            colors = np.array([COLORS[look] for look in sorted(COLORS)], dtype=np.uint8)
            self._path = self._scene.add_line_segments(
                "/program",
                read.points,
                np.repeat(colors[read.looks][:, np.newaxis], 2, axis=1),
                thickness=2.0,
                thickness_units="screen",
            )

    def mark(self, line: int) -> None:
        """Mark what a ``line`` drives; 0 is none."""
        if line != self._marked:
            self._marked = line
            points = self._chosen.points_at(line)
            pairs = np.stack((points[:-1], points[1:]), axis=1) if len(points) else NO_LINES
            self._present.points = pairs.astype(np.float32)

    def clear(self) -> None:
        """Draw nothing."""
        if self._path is not None:
            self._path.remove()
            self._path = None
        self.mark(0)


class Listing:
    """Lines around the one that runs, or that *run* begins at; a click on one chooses it."""

    def __init__(
        self,
        requests: OperatorRequests,
        chosen: ChosenProgram,
        line: OperatorsNumber,
    ) -> None:
        """Add it to the open container of the page; a click sets the first ``line``."""
        self._chosen, self._line = chosen, line
        self._first = 1
        # A line of the listing presses the button of its row.
        self._rows = [
            requests.button("line", partial(self._take, row), visible=False)
            for row in range(LISTED)
        ]
        self._html = requests.gui.add_html("")

    def _take(self, row: int) -> None:
        self._line.set(self._first + row)

    def show(self) -> None:
        """Show the lines around the one that runs, or that *run* begins at."""
        chosen, content = self._chosen, ""
        if chosen.read is not None:
            # While somebody is typing, the last number holds.
            line = chosen.run.line if chosen.run and chosen.is_running else int(self._line.last)
            lines = chosen.read.program.lines
            self._first = max(1, min(line - LISTED // 2, lines + 1 - LISTED))
            content = "".join(
                f'<button class="tri-glide-row{" now" * (each == line)}" '
                f'data-press="{uuid_of(button)}">{each}  {escape(chosen.text_of(each))}</button>'
                for each, button in zip(range(self._first, lines + 1), self._rows)
            )
        self._html.content = content


class ProgramFiles:
    """The files of the folder: one of them is chosen, unless one runs.

    Attributes:
        line: at which *run* begins.
    """

    def __init__(
        self,
        requests: OperatorRequests,
        uploads: Uploads,
        chosen: ChosenProgram,
        drawing: ProgramDrawing,
    ) -> None:
        """Add the choice to the open container of the page; what is ``chosen`` is drawn."""
        gui = requests.gui
        self._requests, self._chosen, self._drawing = requests, chosen, drawing
        self._folder = uploads.folder
        self._pace = Pace(LIST_PERIOD)
        uploads.on_file = self._take_sent
        gui.add_html(UPLOAD)
        self._files = gui.add_dropdown("File", (NO_FILE, *self._folder.names()))
        self._file = requests.field(self._files, self.choose)
        self._dialect = requests.field(
            gui.add_dropdown("Dialect", (FROM_SETTINGS, *(each.value for each in Dialect))),
            self._choose_dialect,
        )
        self.line = requests.number("From line", 1, least=1, is_whole=True)

    def step(self, kept: Path) -> None:
        """Take what has been found out about the file; ``kept`` says how far a program came."""
        if not self._chosen.is_running and self._chosen.is_of_another_machine:
            self._load()
        answer = self._chosen.take_answer()
        if isinstance(answer, ReadProgram):
            self._drawing.draw(answer)
            # Of another program, or of one that was driven to its end, nothing is kept.
            with suppress(KinematicsError):
                self.line.set(line_to_go_on_from(kept, answer.program))
        elif isinstance(answer, NotRead) and self._chosen.read is None and answer.line:
            self.line.set(answer.line)

    def show(self) -> None:
        """Show which files there are."""
        if self._pace.is_due():
            self._show_list()

    def _take_sent(self, name: str) -> None:
        """Choose a file that a page has sent; where another one gives way, this is told."""
        chosen = self._chosen
        if chosen.is_in_work and not chosen.is_running and name != chosen.name:
            self._requests.history.add(WARNING, f"{chosen.in_work} no more: {name} was sent")
        self.take(name)

    def take(self, name: str) -> None:
        """Choose a file that has just come, unless another one runs."""
        if not self._chosen.is_running:
            self.choose(name)
        elif name == self._chosen.name:
            self._requests.refuse(f"{name} runs as it was; the new one is read when the run ends")
        self._show_list()

    def choose(self, name: str) -> None:
        """Choose a file by its ``name``, unless one runs."""
        if self._chosen.is_running:
            self._requests.refuse(f"nothing chosen: {self._chosen.name} runs")
            self._file.set(self._chosen.name)
            return
        self._chosen.name = "" if name == NO_FILE else name
        self.line.set(1)
        self._load()

    def _choose_dialect(self, dialect: str) -> None:
        if self._chosen.is_running:
            self._requests.refuse(f"dialect not changed: {self._chosen.name} runs")
            self._dialect.set(self._chosen.dialect)
            return
        self._chosen.dialect = dialect
        self._load()

    def _load(self) -> None:
        """Begin to read the file that is chosen, in place of what was read before."""
        self._drawing.clear()
        self._chosen.load()

    def _show_list(self) -> None:
        chosen, names = self._chosen, self._folder.names()
        if chosen.name and chosen.name not in names and not chosen.is_running:
            self._requests.refuse(f"{chosen.name} is no longer in the folder of programs")
            self.choose(NO_FILE)
        elif chosen.is_changed and not chosen.is_running:
            self._requests.refuse(f"{chosen.changed}: it is read again")
            self.choose(chosen.name)
        if chosen.name and chosen.name not in names:
            names.insert(0, chosen.name)
        if (NO_FILE, *names) != tuple(self._files.options):
            self._files.options = (NO_FILE, *names)
        if self._files.value != (chosen.name or NO_FILE):
            self._file.set(chosen.name or NO_FILE)


class FileActions:
    """What is done with the chosen file: renamed, sent and deleted; and its lines."""

    def __init__(
        self,
        requests: OperatorRequests,
        folder: ProgramFolder,
        chosen: ChosenProgram,
        files: ProgramFiles,
    ) -> None:
        """Add all to the open container of the page; another file is chosen by ``files``."""
        self._requests, self._folder = requests, folder
        self._chosen, self._files = chosen, files
        self._shown = ""
        self._doomed = ("", -math.inf)
        self._name = requests.field(requests.gui.add_text("Name", ""))
        actions = {"rename": self._rename, "download": self._send, "delete": self._delete}
        requests.buttons("This file", actions)
        self._listing = Listing(requests, chosen, files.line)

    def show(self) -> None:
        """Show the name and the lines of the file."""
        if self._chosen.name != self._shown:
            self._shown = self._chosen.name
            self._name.set(self._shown)
        self._listing.show()

    def _send(self) -> None:
        send_file(self._requests, self._chosen.path)

    def _rename(self) -> None:
        self._folder.rename(self._idle_file(), new := self._name.value.strip())
        self._files.take(new)

    def _delete(self) -> None:
        """Delete the file if this is asked for twice."""
        name = self._idle_file()
        if self._doomed[0] != name or monotonic() > self._doomed[1]:
            self._doomed = name, monotonic() + ASKED
            text = f"delete {name}? Press delete once more within {ASKED:g} s"
            self._requests.history.add(WARNING, text)
            raise KinematicsError(text)
        self._folder.remove(name)
        self._files.take(NO_FILE)
        self._requests.history.add(WARNING, f"{name} was deleted")

    def _idle_file(self) -> str:
        """Return the name of the file that is chosen.

        Raises:
            KinematicsError: if there is none, or it runs.
        """
        _ = self._chosen.path
        if self._chosen.is_running:
            raise KinematicsError(f"nothing done: {self._chosen.name} runs")
        return self._chosen.name
