"""The tab with programs: uploaded, seen before they run, proved, and run."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from time import monotonic
from typing import BinaryIO

import numpy as np
import viser

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.machine import (
    Bounds,
    MachineFacts,
    OperatorRequests,
    OperatorsInput,
)
from tri_glide_kinematics.panel.machine_scene import NO_LINES, RGB
from tri_glide_kinematics.panel.markup import bar, code, note, table
from tri_glide_kinematics.panel.program_files import NO_FILE, Uploads
from tri_glide_kinematics.panel.program_reading import (
    CUT,
    OUTSIDE,
    RAPID,
    Mark,
    NotRead,
    Reading,
    ReadingProcess,
    ReadProgram,
    mark_of,
    points_of_line,
    shown_text,
)
from tri_glide_kinematics.programs import (
    Dialect,
    PathRun,
    ProgramCheck,
    ProgramSettings,
    RunState,
    from_line,
    line_to_go_on_from,
    load_settings,
)
from tri_glide_kinematics.ros.program_run import ProgramLink, ProgramRun
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.wording import number_text

FROM_SETTINGS = "as in the settings"
UPLOAD = '<label class="tri-glide-upload">Upload a program<input type="file" data-upload></label>'
LIST_PERIOD = 1.0  # s between two looks into the folder
SHOW_PERIOD = 0.2  # s between two texts of the present line
LONGEST_LINE = 80  # characters of it that are shown
MOST_TOLD = 5  # words that a program has and the machine does not do
MOST_LINES = 100_000_000  # of a program, for the field of a line: more than any file has

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
        uploads: takes files of pages into the folder.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        requests: OperatorRequests,
        link: ProgramLink,
        uploads: Uploads,
        settings_file: Path,
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
            kept: file that says how far a program came.
            present: returns where the platform is [m].
        """
        gui = server.gui
        self._requests = requests
        self._link = link
        self._folder = uploads.folder
        self._uploads = uploads
        self._settings_file = settings_file
        self._kept = kept
        self._present = present
        self._facts: MachineFacts | None = None
        # Of what was read last: the machine, the marks of both files, and what they do not say.
        self._machine: MachineFacts | None = None
        self._marks: tuple[Mark, Mark] = ((), ())
        self._settings = ProgramSettings()
        self._name = ""
        self._process: ReadingProcess | None = None
        self._stream: BinaryIO | None = None
        self._read: ReadProgram | None = None
        self._check: ProgramCheck | None = None
        # How long the steps take from each one on, by the check [s].
        self._left: FloatArray = np.zeros(1)
        # Bounds for which the proof holds, and whether the machine has others since.
        self._bounds: Bounds | None = None
        self._is_outdated = False
        self._error = ""
        self._run: ProgramRun | None = None
        self._marked = 0
        self._wanted_override: float | None = None
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
        self._used_dialect = FROM_SETTINGS
        self._line = OperatorsInput(
            requests, gui.add_number("From line", 1, min=1, max=MOST_LINES, step=1)
        )
        self._single_block = OperatorsInput(
            requests, gui.add_checkbox("Single block", initial_value=False), self._set_single_block
        )
        buttons = gui.add_button_group("Program", ("check", "run"))
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
        slider = gui.add_slider("Override [%]", min=1, max=200, step=1, initial_value=100)
        self._override = OperatorsInput(requests, slider, self._set_override)
        # Texts change their height: below them, a button would move under the finger.
        self._progress = gui.add_html("")
        self._words = gui.add_html("")

    def step(self, facts: MachineFacts | None) -> None:
        """Take what has come, and go on; ``facts`` are those of the machine that is there."""
        try:
            self._step(facts)
        except (KinematicsError, OSError) as error:
            # The rest of the page is shown all the same.
            self._requests.refuse(f"program: {error}")

    def _step(self, facts: MachineFacts | None) -> None:
        if facts is not None and facts is not self._facts:
            self._take_facts(facts)
        if self._facts is not None and not self._is_running:
            machine, self._machine = self._machine, self._facts
            if machine is not self._facts and (
                machine is None or not machine.is_same_machine(self._facts)
            ):
                self._load()
        self._take_answer()
        if self._run is not None and self._is_running:
            self._run.look()
            if not self._is_running:
                self._end_run(self._run)

    def _take_facts(self, facts: MachineFacts) -> None:
        self._facts = facts
        self._override.set(max(1, round(100.0 * facts.values["path_speed_scale"])))
        bounds, self._bounds = self._bounds, facts.bounds
        if bounds in (None, self._bounds) or self._read is None:
            return
        # A proof that is under way begins anew, with the new bounds.
        is_check = self._process is not None
        self._is_outdated |= not is_check and bool(self._check or self._error)
        self._check, self._error = None, ""
        if is_check:
            self._prove()

    def show(self) -> None:
        """Show on the pages what there is."""
        if self._is_due("list", LIST_PERIOD):
            self._show_list()
        if self._is_due("show", SHOW_PERIOD):
            self._words.content = self._text()
            self._show_progress()

    def stop(self) -> None:
        """End the run, if there is one: the machine was told to stop."""
        if self._run is not None:
            self._run.stop()

    def close(self) -> None:
        """End the process that reads, if there is one."""
        if self._process is not None:
            self._process.end()
            self._process = None

    # Files

    def _take_file(self, name: str) -> None:
        """Choose a file that has just come, unless another one runs."""
        if not self._is_running:
            self._choose(name)
        elif name == self._name:
            self._requests.refuse(f"{name} runs as it was; the new one is read when the run ends")
        self._show_list()

    def _show_list(self) -> None:
        """Show which files there are."""
        names = self._folder.names()
        if self._name and self._name not in names and not self._is_running:
            self._requests.refuse(f"{self._name} is no longer in the folder of programs")
            self._choose(NO_FILE)
        elif self._is_changed and not self._is_running:
            self._requests.refuse(f"{self._changed}: it is read again")
            self._choose(self._name)
        if self._name and self._name not in names:
            names.insert(0, self._name)
        if (NO_FILE, *names) != tuple(self._files.options):
            self._files.options = (NO_FILE, *names)
        if self._files.value != (self._name or NO_FILE):
            self._file.set(self._name or NO_FILE)

    def _choose(self, name: str) -> None:
        if self._is_running:
            self._requests.refuse(f"nothing chosen: {self._name} runs")
            self._file.set(self._name)
            return
        self._name = "" if name == NO_FILE else name
        self._line.set(1)
        self._load()

    def _choose_dialect(self, dialect: str) -> None:
        if self._is_running:
            self._requests.refuse(f"dialect not changed: {self._name} runs")
            self._dialect.set(self._used_dialect)
            return
        self._used_dialect = dialect
        self._load()

    @property
    def _is_changed(self) -> bool:
        """Whether the files are others than those that were read."""
        return bool(self._name) and self._marks != self._marks_now()

    @property
    def _changed(self) -> str:
        return f"{self._name}, or the settings of programs, were changed"

    def _marks_now(self) -> tuple[Mark, Mark]:
        return mark_of(self._folder.folder / self._name), mark_of(self._settings_file)

    def _load(self) -> None:
        """Begin to read the file that is chosen, in place of what was read before."""
        self.close()
        self._run = self._read = self._check = None
        self._error = ""
        self._is_outdated = False
        self._drawing.clear()
        if self._stream is not None:
            self._stream.close()
            self._stream = None
        if self._name:
            self._marks = self._marks_now()
            try:
                path = self._folder.path(self._name)
                self._settings = self._settings_now()
            except KinematicsError as error:
                self._error = shown_text(str(error), self._settings_file)
                return
            with suppress(OSError):
                self._stream = path.open("rb")
            self._begin_reading(path, is_check=False)

    def _begin_reading(self, path: Path, *, is_check: bool) -> None:
        facts, bounds = self._facts, self._bounds
        if facts is not None and bounds is not None:
            self._process = ReadingProcess(
                Reading(path, self._settings, facts.workspace, *bounds, is_check, self._marks[0])
            )

    def _settings_now(self) -> ProgramSettings:
        """Return what programs do not say themselves."""
        settings = load_settings(self._settings_file)
        if self._used_dialect != FROM_SETTINGS:
            settings = replace(settings, dialect=Dialect(self._used_dialect))
        if settings.start is None and settings.home is None:
            settings = replace(settings, start=self._present())
        return settings

    def _take_answer(self) -> None:
        """Take what has been found out about the program, if that is there."""
        if self._process is None or self._process.answer is None:
            return
        answer, self._process = self._process.answer, None
        if isinstance(answer, NotRead):
            self._error = answer.reason
            if self._read is None and answer.line:
                self._line.set(answer.line)
        elif isinstance(answer, ProgramCheck):
            self._check = answer
            self._left = np.append(np.cumsum(answer.durations[::-1])[::-1], 0.0)
        else:
            self._read = answer
            self._drawing.draw(answer)
            # Of another program, or of one that was driven to its end, nothing is kept.
            with suppress(KinematicsError):
                self._line.set(line_to_go_on_from(self._kept, answer.program))

    # Runs

    @property
    def _is_running(self) -> bool:
        return self._run is not None and self._run.state is not RunState.ENDED

    def _press(self, what: str) -> None:
        """Do what a button says."""
        if what == "check":
            self._begin_check()
        elif what == "run":
            self._begin_run()
        elif what == "pause":
            self._requests.link.trigger("pause")
        elif what == "go on":
            self._requests.link.trigger("resume")
        elif self._is_running:
            self.stop()
        else:
            self._requests.refuse("nothing stopped: no program runs")

    def _begin_check(self) -> None:
        if self._ready("nothing checked") is None:
            return
        self._check, self._error, self._is_outdated = None, "", False
        self._prove()

    def _prove(self) -> None:
        self.close()
        self._begin_reading(self._folder.path(self._name), is_check=True)

    def _begin_run(self) -> None:
        read = self._ready("nothing begun")
        if read is None:
            return
        reason = _outside(read) if read.outside else self._error
        if reason:
            self._requests.refuse(f"nothing begun: {reason}")
            return
        try:
            self._run = ProgramRun(
                self._link,
                from_line(read.program, self._line.value),
                single_block=self._single_block.value,
                kept=self._kept,
            )
        except KinematicsError as error:
            self._requests.refuse(shown_text(str(error), Path(read.program.file)))

    def _ready(self, nothing: str) -> ReadProgram | None:
        """Return the program, if it can be checked or run now; else say why ``nothing`` is done."""
        if self._is_running:
            self._requests.refuse(f"{nothing}: {self._name} runs already")
        elif self._is_changed:
            self._requests.refuse(f"{nothing}: {self._changed}: it is read again")
            self._choose(self._name)
        elif self._process is not None:
            self._requests.refuse(f"{nothing}: {self._in_work}")
        elif self._read is None:
            self._requests.refuse(f"{nothing}: {self._error or 'choose a program first'}")
        elif self._facts is None:
            self._requests.refuse(f"{nothing}: there is no machine")
        else:
            return self._read
        return None

    def _end_run(self, run: ProgramRun) -> None:
        """Offer to go on from where a run has ended."""
        self._line.set(1 if run.is_whole else max(run.line, 1))
        failed = next((each for each in run.reports if not each.is_good), None)
        if failed is not None and failed.text:
            self._requests.refuse(f"{self._name}: {failed.text}")

    def _goes_on(self) -> bool:
        """Let a run that waits go on; return whether one did."""
        if self._run is None or self._run.state is not RunState.WAITING:
            return False
        self._run.go_on()
        return True

    def _set_single_block(self, value: bool) -> None:
        if self._run is not None:
            self._run.single_block = value

    def _set_override(self, value: float) -> None:
        """Set by how much the speeds of programs are multiplied; of several the newest is sent."""
        is_setting, self._wanted_override = self._wanted_override is not None, 0.01 * value
        if not is_setting:
            self._send_override()

    def _send_override(self) -> None:
        sent = self._wanted_override

        def then() -> None:
            is_newest, self._wanted_override = self._wanted_override == sent, self._wanted_override
            if is_newest:
                self._wanted_override = None
            else:
                self._send_override()

        link = self._requests.link
        if not link.set_parameters("override", {"path_speed_scale": sent}, then):
            self._wanted_override = None

    # Texts

    @property
    def _in_work(self) -> str:
        what = "proved" if self._read is not None else "read"
        return f"{self._name} is being {what}"

    def _text(self) -> str:
        """Return what is known of the program."""
        parts = [note(self._uploads.text)] if self._uploads.text else []
        if self._process is not None:
            parts.append(note(f"{self._in_work} ..."))
        if self._is_running and self._is_changed:
            text = f"{self._changed}: what runs is what was read before"
            parts.append(note(text, is_bad=True))
        if self._read is not None and self._read.outside:
            parts.append(note(f"{_outside(self._read)} (drawn in red)", is_bad=True))
        if self._error:
            parts.append(note(self._error, is_bad=True))
        if self._is_outdated:
            text = "the limits or the shaper have changed since the check: check again"
            parts.append(note(text, is_bad=True))
        if self._read is not None:
            parts.append(table(self._facts_of(self._read)))
            told = self._read.program.told
            words = [f"line {each.line}: {each.word}: {each.reason}" for each in told[:MOST_TOLD]]
            if len(told) > MOST_TOLD:
                words.append(f"and {len(told) - MOST_TOLD} more")
            if words:
                parts.append(note(f"not done: {'; '.join(words)}"))
        return "".join(parts)

    def _facts_of(self, read: ReadProgram) -> list[tuple[str, ...]]:
        rows: list[tuple[str, ...]] = [("lines", f"{read.program.lines:,}")]
        for name, low, high in zip("xyz", read.lower, read.upper):
            rows.append((name, f"{_millimetres(low)} to {_millimetres(high)} mm"))
        if self._check is not None:
            rows.append(("way", f"{_millimetres(self._check.length)} mm"))
            rows.append(("duration", _clock(self._check.duration)))
        else:
            rows.append(("duration", "not known before the check"))
        return rows

    def _show_progress(self) -> None:
        run, read = self._run, self._read
        if run is None or read is None:
            self._progress.content = ""
            self._mark(None, 0)
            return
        line = run.line if self._is_running or not run.is_whole else read.program.lines
        words = run.state.value if self._is_running or not run.is_whole else "done"
        parts = [f"{words}: line {line:,} of {read.program.lines:,}"]
        left = self._time_left(line)
        part = line / read.program.lines
        if left is not None and self._check is not None and self._check.duration:
            part = 1.0 - left / self._check.duration
        if left is not None and self._is_running:
            # The check knows no override.
            at_whole = "" if self._override.value == 100 else " at 100 %"
            parts.append(f"{_clock(left)} left{at_whole}")
        if run.state is RunState.WAITING:
            parts.append(f"waits: {run.doing}")
        self._progress.content = "".join(
            (
                table([(f"{100.0 * part:.0f} %", bar(part))]),
                note("; ".join(parts)),
                code(self._text_of(line)),
            )
        )
        self._mark(read, line if self._is_running or not run.is_whole else 0)

    def _time_left(self, line: int) -> float | None:
        """Return how long the program takes from a ``line`` on [s]; None before the check."""
        read, machine = self._read, self._link.machine
        if read is None or self._check is None:
            return None
        present = read.steps_at(line)
        left = float(self._left[present.stop])
        for index in present:
            step = read.program.steps[index]
            if isinstance(step, PathRun):
                behind = len(step.lines) - int(np.searchsorted(step.lines, line))
                part = behind / len(step.lines)
                # With single blocks, the machine knows no more than a line.
                if machine is not None and self._is_running and not self._single_block.value:
                    told = machine.way_remaining / read.ways[index]
                    part = min(told, 1.0) if math.isfinite(told) else part
                left += part * self._check.durations[index]
        return left

    def _text_of(self, line: int) -> str:
        """Return what stands in a ``line`` of the file that was read."""
        starts = self._read.line_starts if self._read is not None else ()
        if self._stream is None or not 0 < line < len(starts):
            return ""
        begin, end = int(starts[line - 1]), int(starts[line])
        try:
            self._stream.seek(begin)
            text = self._stream.read(min(end - begin, 4 * LONGEST_LINE))
        except OSError:
            return ""
        return text.decode("utf-8", "replace").strip()[:LONGEST_LINE]

    def _mark(self, read: ReadProgram | None, line: int) -> None:
        """Mark a line of the path in the scene; 0 is none."""
        if line == self._marked:
            return
        self._marked = line
        places: FloatArray = np.empty((0, 3))
        if read is not None:
            for run in (read.program.steps[index] for index in read.steps_at(line)):
                if isinstance(run, PathRun):
                    places = points_of_line(run, line)
        self._drawing.mark(places)

    def _is_due(self, name: str, period: float) -> bool:
        now = monotonic()
        if now < self._due[name]:
            return False
        self._due[name] = now + period
        return True


def _outside(read: ReadProgram) -> str:
    return f"line {read.outside:,} leads outside the workspace"


def _millimetres(length: float) -> str:
    return number_text(round(1000.0 * length, 3))


def _clock(duration: float) -> str:
    """Return a ``duration`` [s] in minutes and seconds, or in hours."""
    seconds = math.ceil(duration)
    hours, rest = divmod(seconds, 3600)
    minutes = f"{rest // 60}:{rest % 60:02d}"
    return f"{hours}:{rest // 60:02d}:{rest % 60:02d}" if hours else minutes
