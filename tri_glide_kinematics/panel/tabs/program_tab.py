"""The tab with programs: uploaded, seen before they run, proved, and run."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from html import escape
from pathlib import Path
from time import monotonic
from typing import Any

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
)
from tri_glide_kinematics.panel.link import MachineFacts, NewestWish
from tri_glide_kinematics.panel.machine_scene import NO_LINES, RGB
from tri_glide_kinematics.panel.operator_requests import OperatorRequests
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
    Uploads,
    send_file,
)
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
from tri_glide_kinematics.ros.goal_sender import ProgramLink
from tri_glide_kinematics.vectors import FloatArray, Vector3

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

    def mark(self, points: FloatArray) -> None:
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
        link: by which programs run.
        chosen: the one that is chosen, and what it does not say.
        files: the settings of programs, and the work zeros that are kept.
        left: how long the program that runs still takes, for the strip; empty if unknown.
        is_taken: returns whether a typed line has the machine, beside which no program begins.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        requests: OperatorRequests,
        link: ProgramLink,
        uploads: Uploads,
        settings_file: Path,
        zeros_file: Path,
        kept: Path,
        present: Callable[[], Vector3 | None],
    ) -> None:
        """Add all to the open container of the ``server``'s panel.

        Args:
            server: of the page.
            requests: of the operator.
            link: by which programs run.
            uploads: into the folder of the programs.
            settings_file: what programs do not say.
            zeros_file: the work zeros that are kept.
            kept: file that says how far a program came.
            present: returns where the platform is [m].
        """
        gui = server.gui
        self._requests = requests
        self._server = server
        self._folder = uploads.folder
        self._uploads = uploads
        self._kept = kept
        self.chosen = ChosenProgram(self._folder, settings_file, zeros_file, present)
        self.link, self.files = link, (settings_file, zeros_file)
        self.left = ""
        self.is_taken: Callable[[], bool] = lambda: False
        self._facts: MachineFacts | None = None
        self._run: ProgramRun | None = None
        self._marked = 0
        self._way = math.nan
        self._due = {"list": 0.0, "show": 0.0}
        self._drawing = ProgramDrawing(server.scene)
        uploads.on_file = self._take_file
        requests.link.on_resume = self._goes_on
        gui.add_html(UPLOAD)
        self._files = gui.add_dropdown("File", (NO_FILE, *self._folder.names()))
        self._file = OperatorsInput(requests, self._files, self._choose)
        self._dialect = OperatorsInput(
            requests,
            gui.add_dropdown("Dialect", (FROM_SETTINGS, *(each.value for each in Dialect))),
            self._choose_dialect,
        )
        self._line = OperatorsNumber(requests, gui, "From line", 1, least=1, is_whole=True)
        self._approach = OperatorsNumber(
            *(requests, gui, "To the start [mm/s]", USUAL_SPEED), least=SLOWEST_SPEED
        )
        self._single_block = OperatorsInput(
            requests, gui.add_checkbox("Single block", initial_value=False), self._set_single_block
        )
        buttons = gui.add_button_group("Program", ("check", "run", "cancel"))
        buttons.on_click(requests.on(self._press))
        press = requests.on(self._press)

        async def press_motion(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            # Any page may stop.
            if event.target.value == "stop":
                requests.wish(lambda: self._press("stop"))
            else:
                await press(event)

        buttons = gui.add_button_group("Motion", ("pause", "go on", "stop"))
        buttons.on_click(press_motion)
        self._scales = [
            self._scale(gui.add_slider(f"{label} [%]", 1, most, 1, 100), label.lower(), name)
            for label, most, name in SCALES
        ]
        with gui.add_folder("File and lines", expand_by_default=False):
            self._name = OperatorsInput(requests, gui.add_text("Name", ""))
            files = gui.add_button_group("This file", ("rename", "download", "delete"))
            files.on_click(requests.on(self._press_file))
            # A line of the listing presses the button of its row.
            self._rows = [gui.add_button("line", visible=False) for _ in range(LISTED)]
            for row, button in enumerate(self._rows):
                button.on_click(requests.on(partial(self._take_row, row)))
            self._listing = gui.add_html("")
        self._first = 1
        self._doomed = ("", -math.inf)
        # Texts change their height: below them, a button would move under the finger.
        self._progress = gui.add_html("")
        self._words = gui.add_html("")
        with suppress(KinematicsError):
            link.find(load_kept(kept))

    def step(self, facts: MachineFacts | None) -> None:
        """Take what has come, and go on; ``facts`` are those of the machine that is there."""
        try:
            self._step(facts)
        except (KinematicsError, OSError) as error:
            # The rest of the page is shown all the same.
            self._requests.refuse(f"program: {error}")

    def _step(self, facts: MachineFacts | None) -> None:
        if facts is not None and facts is not self._facts:
            self._facts = facts
            self._show_override()
            self.chosen.take_facts(facts)
        if not self.is_running and self.chosen.has_another_machine:
            self._load()
        self._take_answer()
        if self._run is not None and self.is_running:
            self._run.look(monotonic())
            if not self.is_running:
                self._end_run(self._run)

    def _scale(self, slider: Any, what: str, name: str) -> tuple[OperatorsInput, NewestWish]:
        """Return a ``slider`` that sets the parameter ``name``; a refusal calls it ``what``."""
        wish = NewestWish(self._requests.link, what, name, self._show_override)
        return OperatorsInput(self._requests, slider, lambda part: wish.set(0.01 * part)), wish

    def _show_override(self) -> None:
        """Show what the machine has."""
        if self._facts is not None:
            for (shown, wish), (_, _, name) in zip(self._scales, SCALES):
                if not wish.is_setting:
                    shown.set(max(1, round(100.0 * self._facts.values[name])))

    def show(self) -> None:
        """Show on the pages what there is."""
        if self._is_due("list", LIST_PERIOD):
            self._show_list()
        if self._is_due("show", SHOW_PERIOD):
            self._words.content = self._uploads.text + self.chosen.text(is_running=self.is_running)
            self._show_progress()
            self._show_lines()

    def stop(self) -> None:
        """End the run, if there is one: the machine was told to stop."""
        if self._run is not None:
            self._run.stop()

    def may_end(self) -> bool:
        """End the run, if there is one, and return whether its platform rests, outputs off."""
        self.stop()
        return self._run is None or self._run.is_delivered(monotonic())

    # Files

    def _take_file(self, name: str) -> None:
        """Choose a file that has just come, unless another one runs."""
        if not self.is_running:
            self._choose(name)
        elif name == self.chosen.name:
            self._requests.refuse(f"{name} runs as it was; the new one is read when the run ends")
        self._show_list()

    def _show_list(self) -> None:
        """Show which files there are."""
        chosen, names = self.chosen, self._folder.names()
        if chosen.name and chosen.name not in names and not self.is_running:
            self._requests.refuse(f"{chosen.name} is no longer in the folder of programs")
            self._choose(NO_FILE)
        elif chosen.is_changed and not self.is_running:
            self._requests.refuse(f"{chosen.changed}: it is read again")
            self._choose(chosen.name)
        if chosen.name and chosen.name not in names:
            names.insert(0, chosen.name)
        if (NO_FILE, *names) != tuple(self._files.options):
            self._files.options = (NO_FILE, *names)
        if self._files.value != (chosen.name or NO_FILE):
            self._file.set(chosen.name or NO_FILE)

    def _choose(self, name: str) -> None:
        if self.is_running:
            self._requests.refuse(f"nothing chosen: {self.chosen.name} runs")
            self._file.set(self.chosen.name)
            return
        self.chosen.name = "" if name == NO_FILE else name
        self._name.set(self.chosen.name)
        self._line.set(1)
        self._load()

    def _choose_dialect(self, dialect: str) -> None:
        if self.is_running:
            self._requests.refuse(f"dialect not changed: {self.chosen.name} runs")
            self._dialect.set(self.chosen.dialect)
            return
        self.chosen.dialect = dialect
        self._load()

    def _load(self) -> None:
        """Begin to read the file that is chosen, in place of what was read before."""
        self._run = None
        self._drawing.clear()
        self.chosen.load()

    def _take_answer(self) -> None:
        """Take what has been found out about the program, if that is there."""
        answer = self.chosen.take_answer()
        if isinstance(answer, ReadProgram):
            self._drawing.draw(answer)
            # Of another program, or of one that was driven to its end, nothing is kept.
            with suppress(KinematicsError):
                self._line.set(line_to_go_on_from(self._kept, answer.program))
        elif isinstance(answer, NotRead) and self.chosen.read is None and answer.line:
            self._line.set(answer.line)

    def _press_file(self, what: str) -> None:
        """Rename, send or delete the file that is chosen."""
        name = self.chosen.name
        if not name:
            self._requests.refuse("choose a program first")
        elif what == "download":
            send_file(self._server, self._requests, self._folder.path(name))
        elif self.is_running:
            self._requests.refuse(f"nothing done: {name} runs")
        elif what == "rename":
            self._folder.rename(name, new := self._name.value.strip())
            self._take_file(new)
        elif self._doomed[0] != name or monotonic() > self._doomed[1]:
            self._doomed = name, monotonic() + ASKED
            text = f"delete {name}? Press delete once more within {ASKED:g} s"
            self._requests.history.add(WARNING, text)
            self._requests.refuse(text)
        else:
            self._folder.remove(name)
            self._take_file(NO_FILE)
            self._requests.history.add(WARNING, f"{name} was deleted")

    def _take_row(self, row: int, _: object) -> None:
        """Let *run* begin at a line of the listing."""
        self._line.set(self._first + row)

    def _show_lines(self) -> None:
        """List lines around the one that runs, or that *run* begins at."""
        chosen = self.chosen
        if chosen.read is None:
            self._listing.content = ""
            return
        with suppress(KinematicsError):
            line = int(self._line.value)
            if self._run is not None and self.is_running:
                line = self._run.line
            lines = chosen.read.program.lines
            first = max(1, min(line - LISTED // 2, lines + 1 - LISTED))
            rows = (
                f'<button class="tri-glide-row{" now" * (each == line)}" '
                f'data-press="{uuid_of(button)}">{each}  {escape(chosen.text_of(each))}</button>'
                for each, button in zip(range(first, lines + 1), self._rows)
            )
            self._first, content = first, "".join(rows)
            if content != self._listing.content:
                self._listing.content = content

    # Runs

    @property
    def is_running(self) -> bool:
        """Whether a program runs."""
        return self._run is not None and self._run.state is not RunState.ENDED

    def has_output(self, output: tuple[str, int]) -> bool:
        """Return whether a program runs that changes an output, by its name and number."""
        read = self.chosen.read if self.is_running else None
        changes = (each for step in read.program.steps for each in step.changes) if read else ()
        return any((each.name, each.number) == output for each in changes)

    def _press(self, what: str) -> None:
        """Do what a button says."""
        if what == "check":
            if self._ready("nothing checked") is not None:
                self.chosen.prove()
        elif what == "run":
            self._begin_run()
        elif what == "cancel":
            self._due["show"] = 0.0
            if name := self._uploads.cancel():
                self._requests.history.add(WARNING, f"cancelled: {name} is being sent")
            elif self.chosen.is_in_work:
                self._requests.history.add(WARNING, f"cancelled: {self.chosen.in_work}")
                self.chosen.cancel()
            else:
                self._requests.refuse("nothing cancelled: no program is being sent, read or proved")
        elif what == "pause":
            self._requests.link.trigger("pause")
        elif what == "go on":
            self._requests.link.trigger("resume")
        elif self.is_running:
            self.stop()
        else:
            # Whatever moves, whoever drives it.
            self._requests.link.trigger("stop")

    def _begin_run(self) -> None:
        read = self._ready("nothing begun")
        if read is None:
            return
        reason = self.chosen.outside or self.chosen.error
        if reason:
            self._requests.refuse(f"nothing begun: {reason}")
            return
        self._way = math.nan
        self.chosen.begin_run()
        try:
            self._run = ProgramRun(
                self.link,
                from_line(read.program, int(self._line.value)),
                single_block=self._single_block.value,
                kept=self._kept,
                approach=0.001 * self._approach.value,
            )
        except KinematicsError as error:
            self._requests.refuse(shown_text(str(error), Path(read.program.file)))

    def _ready(self, nothing: str) -> ReadProgram | None:
        """Return the program, if it can be checked or run now; else say why ``nothing`` is done."""
        chosen = self.chosen
        if self.is_running:
            self._requests.refuse(f"{nothing}: {chosen.name} runs already")
        elif self.is_taken():
            self._requests.refuse(f"{nothing}: a typed line is not done yet")
        elif chosen.is_changed:
            self._requests.refuse(f"{nothing}: {chosen.changed}: it is read again")
            self._choose(chosen.name)
        elif chosen.is_in_work:
            self._requests.refuse(f"{nothing}: {chosen.in_work}")
        elif chosen.read is None:
            self._requests.refuse(f"{nothing}: {chosen.error or 'choose a program first'}")
        elif self._facts is None:
            self._requests.refuse(f"{nothing}: there is no machine")
        else:
            return chosen.read
        return None

    def _end_run(self, run: ProgramRun) -> None:
        """Offer to go on from where a run has ended."""
        self._line.set(1 if run.is_whole else max(run.line, 1))
        failed = next((each for each in run.reports if not each.is_good), None)
        if run.was_stopped:
            text = f"{self.chosen.name}: stopped at line {run.line:,}"
            self._requests.history.add(WARNING, text)
        elif failed is not None and failed.text:
            self._requests.refuse(f"{self.chosen.name}: {failed.text}")

    def _goes_on(self) -> bool:
        """Let a run that waits go on; return whether one did."""
        return self._run is not None and self._run.go_on()

    def _set_single_block(self, value: bool) -> None:
        if self._run is not None:
            self._run.single_block = value

    def _show_progress(self) -> None:
        run, chosen = self._run, self.chosen
        self.left = ""
        if not self.is_running and (told := self._told_of_other()):
            self._progress.content = told
            self._mark(0)
            return
        if run is None or chosen.read is None:
            self._progress.content = ""
            self._mark(0)
            return
        lines = chosen.read.program.lines
        is_done = run.is_whole
        line, words = (lines, "done") if is_done else (run.line, run.state.value)
        parts = [f"{words}: line {line:,} of {lines:,}"]
        machine, part = self.link.machine, line / lines
        # With single blocks, the machine knows no more than a line.
        way = math.nan
        if machine is not None and self.is_running and not self._single_block.value:
            # A jog while it is paused, and the way back, have ways of their own.
            if machine.target_kind == MachineState.TARGET_PATH:
                self._way = machine.way_remaining
            way = self._way
        if (whole := chosen.left(1)) > 0.0:
            part = 1.0 - chosen.left(line, way) / whole
        if self.is_running and (left := chosen.left(line, way, is_run=True)) >= 0.0:
            self.left = f"{clock_text(left)} left of {chosen.name}"
        if run.state is RunState.WAITING:
            parts.append(f"waits: {run.doing}")
            # On the other tabs the machine is only idle, its spindle on.
            self.left = f"{chosen.name} waits: {run.doing}"
        self._progress.content = progress(part, "; ".join(parts)) + code(chosen.text_of(line))
        self._mark(0 if is_done else line)

    def _told_of_other(self) -> str:
        """Return what the page tells of a run that somebody else drives, or drove until lost."""
        other = self.link.other
        if other is None:
            return ""
        name, line = Path(other.file).name, max(other.line, 1)
        is_here = Path(other.file) == self._folder.folder.absolute() / name
        if is_here and not self.chosen.name:
            self._choose(name)
        if self.link.other_goes_on:
            words = f"{other.driver} runs {name}: line {line:,} of {other.lines:,}; {other.doing}"
            part = line / max(other.lines, line)
            return progress(part, words)
        if other.state != RunMessage.ENDED:
            other.state = RunMessage.ENDED
            if is_here and name == self.chosen.name:
                self._line.set(line)
        return note(f"{name} ended at line {line:,}, because what drove it is gone")

    def _mark(self, line: int) -> None:
        """Mark a line of the path in the scene; 0 is none."""
        if line != self._marked:
            self._marked = line
            self._drawing.mark(self.chosen.points_at(line))

    def _is_due(self, name: str, period: float) -> bool:
        now = monotonic()
        if now < self._due[name]:
            return False
        self._due[name] = now + period
        return True
