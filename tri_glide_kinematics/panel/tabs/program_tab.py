"""The tab with programs: chosen, proved, run, and how far the run is."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import NamedTuple

from tri_glide_interfaces.msg import MachineState
from tri_glide_interfaces.msg import ProgramRun as RunMessage
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.link import MachineFacts
from tri_glide_kinematics.panel.machine import ShownMachine
from tri_glide_kinematics.panel.operator_requests import (
    SLOWEST_SPEED,
    USUAL_SPEED,
    OperatorRequests,
    ScaleSlider,
)
from tri_glide_kinematics.panel.pace import Pace
from tri_glide_kinematics.panel.program_reading import ReadProgram, shown_text
from tri_glide_kinematics.panel.programs import ChosenProgram, Uploads
from tri_glide_kinematics.panel.tabs.program_files import FileActions, ProgramDrawing, ProgramFiles
from tri_glide_kinematics.panel.tabs.runs import Runs
from tri_glide_kinematics.panel.words import WARNING, clock_text, code, note, progress
from tri_glide_kinematics.programs import ProgramRun, RunState, from_line, load_kept

SHOW_PERIOD = 0.2  # s between two texts of the present line
# Sliders: label, largest value in per cent, and the parameter of ik_node.
SCALES = (("Override", 200, "path_speed_scale"), ("Rapids", 100, "rapid_scale"))


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


class ProgramTab:
    """Programs of a folder: chosen, checked, and run.

    Attributes:
        files: of which one is chosen.
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
        self._approach = requests.number("To the start [mm/s]", USUAL_SPEED, least=SLOWEST_SPEED)
        self._single_block = requests.field(
            gui.add_checkbox("Single block", initial_value=False), self._set_single_block
        )
        actions = {"check": self._check, "run": self._begin_run, "cancel": self._cancel}
        requests.buttons("Program", actions)
        trigger = requests.link.trigger
        motions: dict[str, Callable[[], None]] = {
            "pause": partial(trigger, "pause"),
            "go on": partial(trigger, "resume"),
            "stop": self._stop,
        }
        requests.buttons("Motion", motions, of_any_page=("stop",))
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
