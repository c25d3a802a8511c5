"""The tab with programs: uploaded, seen before they run, proved, and run."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from html import escape
from pathlib import Path
from time import monotonic
from typing import NamedTuple

import numpy as np
import viser

from tri_glide_interfaces.msg import MachineState
from tri_glide_interfaces.msg import ProgramRun as RunMessage
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.inputs import (
    SLOWEST_SPEED,
    USUAL_SPEED,
    OperatorsInput,
    OperatorsNumber,
    ScaleSlider,
    add_button,
    add_buttons,
)
from tri_glide_kinematics.panel.link import MachineFacts
from tri_glide_kinematics.panel.machine import ShownMachine
from tri_glide_kinematics.panel.machine_scene import NO_LINES, RGB
from tri_glide_kinematics.panel.operator_requests import OperatorRequests
from tri_glide_kinematics.panel.pace import Pace
from tri_glide_kinematics.panel.program_reading import (
    CUT,
    OUTSIDE,
    RAPID,
    NotRead,
    ReadProgram,
    shown_text,
)
from tri_glide_kinematics.panel.programs import (
    FROM_SETTINGS,
    NO_FILE,
    ChosenProgram,
    ProgramFolder,
    Uploads,
    send_file,
)
from tri_glide_kinematics.panel.tabs.runs import Runs
from tri_glide_kinematics.panel.viser_parts import uuid_of
from tri_glide_kinematics.panel.words import WARNING, clock_text, code, note, progress
from tri_glide_kinematics.programs import (
    Dialect,
    ProgramRun,
    RunState,
    from_line,
    line_to_go_on_from,
    load_kept,
)

UPLOAD = '<label class="tri-glide-upload">Upload a program<input type="file" data-upload></label>'
LIST_PERIOD = 1.0  # s between two looks into the folder
SHOW_PERIOD = 0.2  # s between two texts of the present line
ASKED = 5.0  # s within which one more press removes a file
LISTED = 15  # lines
# Sliders: label, largest value in per cent, and the parameter of ik_node.
SCALES = (("Override", 200, "path_speed_scale"), ("Rapids", 100, "rapid_scale"))

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
        self._is_drawn = False
        self._marked = 0

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

    def mark(self, line: int) -> None:
        """Mark what a ``line`` drives; 0 is none."""
        if line != self._marked:
            self._marked = line
            points = self._chosen.points_at(line)
            pairs = np.stack((points[:-1], points[1:]), axis=1) if len(points) else NO_LINES
            self._present.points = pairs.astype(np.float32)

    def clear(self) -> None:
        """Draw nothing."""
        if self._is_drawn:
            self._scene.remove_by_name("/program")
            self._is_drawn = False
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
            add_button(requests, "line", partial(self._take, row), visible=False)
            for row in range(LISTED)
        ]
        self._html = requests.gui.add_html("")

    def _take(self, row: int) -> None:
        self._line.set(self._first + row)

    def show(self) -> None:
        """Show the lines around the one that runs, or that *run* begins at."""
        chosen, content = self._chosen, ""
        if chosen.read is not None:
            try:
                line = (
                    chosen.run.line if chosen.run and chosen.is_running else int(self._line.value)
                )
            except KinematicsError:
                # Somebody is typing.
                return
            lines = chosen.read.program.lines
            self._first = max(1, min(line - LISTED // 2, lines + 1 - LISTED))
            content = "".join(
                f'<button class="tri-glide-row{" now" * (each == line)}" '
                f'data-press="{uuid_of(button)}">{each}  {escape(chosen.text_of(each))}</button>'
                for each, button in zip(range(self._first, lines + 1), self._rows)
            )
        if content != self._html.content:
            self._html.content = content


class Progress(NamedTuple):
    """How far a run is.

    Attributes:
        text: for the tab.
        line: the present one, which is marked; 0 for none.
        left: how long it still takes, or what it waits for, for the strip; empty if unknown.
    """

    text: str = ""
    line: int = 0
    left: str = ""


class RunProgress:
    """Tells how far the run of the chosen program is."""

    def __init__(self, chosen: ChosenProgram) -> None:
        """Follow the runs of what is ``chosen``."""
        self._chosen = chosen
        self._run: ProgramRun | None = None
        self._way = math.nan

    def look(self, told: MachineState, *, is_single: bool) -> Progress:
        """Return it by what the machine has ``told``; ``is_single`` is whether lines are single."""
        chosen, run = self._chosen, self._chosen.run
        if run is None or chosen.read is None:
            return Progress()
        if run is not self._run:
            self._run, self._way = run, math.nan
        lines = chosen.read.program.lines
        is_done = run.is_whole
        line, words = (lines, "done") if is_done else (run.line, run.state.value)
        texts, left, part = [f"{words}: line {line:,} of {lines:,}"], "", line / lines
        # With single blocks, the machine knows no more than a line.
        way = math.nan
        if chosen.is_running and not is_single:
            # A jog while it is paused, and the way back, have ways of their own.
            if told.target_kind == MachineState.TARGET_PATH:
                self._way = told.way_remaining
            way = self._way
        if (whole := chosen.left(1)) > 0.0:
            part = 1.0 - chosen.left(line, way) / whole
        if chosen.is_running and (seconds := chosen.left(line, way, is_run=True)) >= 0.0:
            left = f"{clock_text(seconds)} left of {chosen.name}"
        if run.state is RunState.WAITING:
            texts.append(f"waits: {run.doing}")
            # On the other tabs the machine is only idle, its spindle on.
            left = f"{chosen.name} waits: {run.doing}"
        text = progress(part, "; ".join(texts)) + code(chosen.text_of(line))
        return Progress(text, 0 if is_done else line, left)


class ProgramFiles:
    """The files of the folder: one is chosen, renamed, sent or deleted, unless it runs.

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
        uploads.on_file = self.take
        gui.add_html(UPLOAD)
        self._files = gui.add_dropdown("File", (NO_FILE, *self._folder.names()))
        self._file = OperatorsInput(requests, self._files, self.choose)
        self._dialect = OperatorsInput(
            requests,
            gui.add_dropdown("Dialect", (FROM_SETTINGS, *(each.value for each in Dialect))),
            self._choose_dialect,
        )
        self.line = OperatorsNumber(requests, "From line", 1, least=1, is_whole=True)

    def step(self, kept: Path) -> None:
        """Take what has been found out about the file; ``kept`` says how far a program came."""
        if not self._chosen.is_running and self._chosen.has_another_machine:
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
        self._name = OperatorsInput(requests, requests.gui.add_text("Name", ""))
        actions = {"rename": self._rename, "download": self._send, "delete": self._delete}
        add_buttons(requests, "This file", actions)
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


class ProgramTab:
    """Programs of a folder: chosen, checked, and run.

    Attributes:
        left: how long the program that runs still takes, for the strip; empty if unknown.
    """

    def __init__(
        self,
        requests: OperatorRequests,
        machine: ShownMachine,
        runs: Runs,
        uploads: Uploads,
        chosen: ChosenProgram,
        kept: Path,
    ) -> None:
        """Add all to the open container of the page.

        Args:
            requests: of the operator.
            machine: that programs are for.
            runs: by which they run.
            uploads: into the folder of the programs.
            chosen: the one that is chosen.
            kept: file that says how far a program came.
        """
        gui = requests.gui
        self._requests, self._machine, self._runs = requests, machine, runs
        self._uploads, self._chosen, self._kept = uploads, chosen, kept
        self.left = ""
        self._facts: MachineFacts | None = None
        self._run_progress = RunProgress(chosen)
        self._pace = Pace(SHOW_PERIOD)
        self._drawing = ProgramDrawing(requests.server.scene, chosen)
        self.files = ProgramFiles(requests, uploads, chosen, self._drawing)
        self._approach = OperatorsNumber(
            requests, "To the start [mm/s]", USUAL_SPEED, least=SLOWEST_SPEED
        )
        self._single_block = OperatorsInput(
            requests, gui.add_checkbox("Single block", initial_value=False), self._set_single_block
        )
        actions = {"check": self._check, "run": self._begin_run, "cancel": self._cancel}
        add_buttons(requests, "Program", actions)
        trigger = requests.link.trigger
        motions: dict[str, Callable[[], None]] = {
            "pause": partial(trigger, "pause"),
            "go on": partial(trigger, "resume"),
            "stop": self._stop,
        }
        add_buttons(requests, "Motion", motions, of_any_page=("stop",))
        self._scales = [ScaleSlider(requests, *scale) for scale in SCALES]
        with gui.add_folder("File and lines", expand_by_default=False):
            self._actions = FileActions(requests, uploads.folder, chosen, self.files)
        # Texts change their height: below them, a button would move under the finger.
        self._progress = gui.add_html("")
        self._words = gui.add_html("")
        with suppress(KinematicsError):
            runs.link.find(load_kept(kept))

    def step(self) -> None:
        """Take in what has come of the machine and of the program."""
        try:
            facts = self._machine.facts
            if facts is not None:
                for scale in self._scales:
                    scale.show(facts)
            if facts is not None and facts is not self._facts:
                self._facts = facts
                self._chosen.take_facts(facts)
            self.files.step(self._kept)
        except (KinematicsError, OSError) as error:
            # The rest of the page is shown all the same.
            self._requests.refuse(f"program: {error}")

    def show(self) -> None:
        """Show on the pages what there is."""
        self.files.show()
        if self._pace.is_due():
            self._words.content = self._uploads.text + self._chosen.text
            self._show_progress()
            self._actions.show()

    def _check(self) -> None:
        self._ready("nothing checked")
        self._chosen.prove()

    def _cancel(self) -> None:
        """End what is being done with a file."""
        self._pace.hurry()
        if name := self._uploads.cancel():
            self._requests.history.add(WARNING, f"cancelled: {name} is being sent")
        elif self._chosen.is_in_work:
            self._requests.history.add(WARNING, f"cancelled: {self._chosen.in_work}")
            self._chosen.cancel()
        else:
            raise KinematicsError("nothing cancelled: no program is being sent, read or proved")

    def _stop(self) -> None:
        """End the run at rest on its path, or else whatever moves, whoever drives it."""
        if self._chosen.is_running:
            self._runs.stop()
        else:
            self._requests.link.trigger("stop")

    def _begin_run(self) -> None:
        read, chosen = self._ready("nothing begun"), self._chosen
        if reason := chosen.outside or chosen.error:
            raise KinematicsError(f"nothing begun: {reason}")
        try:
            run = ProgramRun(
                self._runs.link,
                from_line(read.program, int(self.files.line.value)),
                single_block=self._single_block.value,
                kept=self._kept,
                approach=0.001 * self._approach.value,
            )
        except KinematicsError as error:
            raise KinematicsError(shown_text(str(error), Path(read.program.file))) from error
        chosen.begin_run(run)
        changes = (each for step in read.program.steps for each in step.changes)
        self._runs.begin(run, self._end_run, ((each.name, each.number) for each in changes))

    def _ready(self, nothing: str) -> ReadProgram:
        """Return the program, if it can be checked or run now.

        Raises:
            KinematicsError: if it cannot; it says why ``nothing`` is done.
        """
        chosen = self._chosen
        if self._chosen.is_running:
            reason = f"{chosen.name} runs already"
        elif self._runs.is_taken:
            reason = "a typed line is not done yet"
        elif chosen.is_changed:
            reason = f"{chosen.changed}: it is read again"
            self.files.choose(chosen.name)
        elif chosen.is_in_work:
            reason = chosen.in_work
        elif chosen.read is None:
            reason = chosen.error or "choose a program first"
        elif self._facts is None:
            reason = "there is no machine"
        else:
            return chosen.read
        raise KinematicsError(f"{nothing}: {reason}")

    def _end_run(self) -> None:
        """Offer to go on from where the run has ended."""
        run = self._chosen.run
        if run is None:
            return
        self.files.line.set(1 if run.is_whole else max(run.line, 1))
        failed = next((each for each in run.reports if not each.is_good), None)
        if run.was_stopped:
            text = f"{self._chosen.name}: stopped at line {run.line:,}"
            self._requests.history.add(WARNING, text)
        elif failed is not None and failed.text:
            self._requests.refuse(f"{self._chosen.name}: {failed.text}")

    def _set_single_block(self, value: bool) -> None:
        if self._chosen.run is not None:
            self._chosen.run.single_block = value

    def _show_progress(self) -> None:
        text = "" if self._chosen.is_running else self._told_of_other()
        found = Progress(text)
        if not text:
            told, is_single = self._machine.feeds.status.message, self._single_block.value
            found = self._run_progress.look(told, is_single=is_single)
        self._progress.content, self.left = found.text, found.left
        self._drawing.mark(found.line)

    def _told_of_other(self) -> str:
        """Return what the page tells of a run that somebody else drives, or drove until lost."""
        other = self._runs.link.other
        if other is None:
            return ""
        name, line = Path(other.file).name, max(other.line, 1)
        is_here = Path(other.file) == self._uploads.folder.folder.absolute() / name
        if is_here and not self._chosen.name:
            self.files.choose(name)
        if self._runs.link.other_goes_on:
            words = f"{other.driver} runs {name}: line {line:,} of {other.lines:,}; {other.doing}"
            part = line / max(other.lines, line)
            return progress(part, words)
        if other.state != RunMessage.ENDED:
            other.state = RunMessage.ENDED
            if is_here and name == self._chosen.name:
                self.files.line.set(line)
        return note(f"{name} ended at line {line:,}, because what drove it is gone")
