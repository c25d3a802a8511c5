"""What is done by hand beside jogs: lines that are typed, own buttons, work zero, and outputs."""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from html import escape
from typing import Any

import viser

from tri_glide_kinematics.control import IDLE, OperatingState
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.keys import load_text
from tri_glide_kinematics.panel.link import MachineFacts
from tri_glide_kinematics.panel.machine import ShownMachine
from tri_glide_kinematics.panel.operator_requests import (
    Event,
    OperatorRequests,
)
from tri_glide_kinematics.panel.program_reading import mark_of
from tri_glide_kinematics.panel.programs import ChosenProgram
from tri_glide_kinematics.panel.tabs.runs import OutputKey, Runs
from tri_glide_kinematics.panel.viser_parts import uuid_of
from tri_glide_kinematics.panel.words import note, position_text, table
from tri_glide_kinematics.programs import (
    LONGEST_TEXT,
    WORK_OFFSETS,
    KeptError,
    Output,
    Program,
    ProgramRun,
    ProgramSettings,
    buttons_file,
    check_program,
    load_buttons,
    load_zeros,
    read_short,
    touched_off,
    write_buttons,
    write_zeros,
)
from tri_glide_kinematics.vectors import Vector3, minus

MOST_LINES = 30  # in the history
# Outputs that have a switch, and those that are shown: anybody may tell of others.
MOST_SWITCHES, MOST_VALUES = 12, 100
MOST_BUTTONS = 24
LONGEST_NAME = 24  # characters, of a button
SAME_PLACE = 1e-7  # m, and of a speed at rest m/s

# A switch shows what was asked for so often at most, 10 to 30 times a second, if it is not told.
SHOWS = 10

# Those of M3, M7 and M8 have a switch before anything is told of them.
SPINDLE = ("spindle", 0)
USUAL = (SPINDLE, ("flood", 0), ("mist", 0))
# Nothing is switched on in these states, nor while none is known.
NOT_READY = (None, OperatingState.DISABLED, OperatingState.FAULT, OperatingState.WAITING)
AXES = {"x": (0,), "y": (1,), "z": (2,), "all": (0, 1, 2)}

FIELD = (
    '<div class="tri-glide-line"><input type="text" data-line="{}" aria-label="line of G-code" '
    'placeholder="a line of G-code, Enter" autocomplete="off" spellcheck="false"></div>'
)


class LineDriver:
    """Proves a line of G-code, or the short program of a button, and then drives it.

    Stop, and all else of the page, goes on while it is proved.
    """

    def __init__(
        self, requests: OperatorRequests, machine: ShownMachine, runs: Runs, chosen: ChosenProgram
    ) -> None:
        """Drive a ``machine`` by ``runs``; what a line does not say is as for the ``chosen``."""
        self._requests, self._machine, self._runs, self._chosen = requests, machine, runs, chosen
        # Proved from a place [m] on.
        self._what = ""
        self._from: Vector3 | None = None
        self._proof: Future[Program] | None = None
        self._run: ProgramRun | None = None
        self._prover = ThreadPoolExecutor(1)

    def drive(self, text: str, name: str = "") -> None:
        """Begin to read and prove a ``text``; it is driven, as ``name``, when that is done.

        Raises:
            KinematicsError: if it cannot be driven now.
        """
        if self._runs.is_reserved or self._runs.drives(self._run):
            raise KinematicsError("nothing driven: another line is not done yet")
        self._what = name or text
        self._run, self._from = None, self._machine.place
        self._check_ready()
        assert self._machine.facts is not None and self._from is not None
        settings, facts = self._chosen.settings(), self._machine.facts
        self._proof = self._prover.submit(
            _proved, text, name or "typed", settings, self._from, facts
        )
        self._runs.is_reserved = True

    def step(self) -> None:
        """Drive what is proved, unless Stop was pressed meanwhile.

        Raises:
            KinematicsError: if it cannot be driven.
        """
        if self._runs.is_reserved and self._proof is not None and self._proof.done():
            self._runs.is_reserved = False
            program = self._proof.result()
            self._check_ready()
            self._run = ProgramRun(self._runs.link, program)
            self._runs.begin(self._run, self._tell_failure)

    @property
    def words(self) -> str:
        """What is done with the newest line, in words; empty before the first."""
        words = "is proved" if self._runs.is_reserved else ""
        if (run := self._run) is not None:
            words = "done" if run.is_whole else run.doing or run.state.value
        return f"{self._what}: {words}" if words else ""

    def _tell_failure(self) -> None:
        reports = self._run.reports if self._run is not None else ()
        failed = [each.text for each in reports if each.text and not each.is_good]
        if failed:
            self._requests.refuse(f"{self._what}: {failed[0]}")

    def _check_ready(self) -> None:
        """Check that the line that is proved can be driven now.

        Raises:
            KinematicsError: if not; it says why.
        """
        place, status, reason = self._machine.place, self._machine.feeds.status, ""
        if self._runs.is_running:
            reason = "a program runs"
        elif place is None or self._from is None:
            reason = "the place of the platform is not known"
        elif status.state is not IDLE:
            reason = f"the machine is {status.word}, and has to be idle"
        elif math.dist(place, self._from) > SAME_PLACE:
            reason = "the platform was moved meanwhile"
        if reason:
            raise KinematicsError(f"nothing driven: {reason}")


class TypedLines:
    """The field for a line of G-code, with those that were typed before.

    Attributes:
        lines: the newest one first.
    """

    def __init__(self, requests: OperatorRequests, driver: LineDriver) -> None:
        """Add it to the open container of the page."""
        gui = requests.gui
        self._requests, self._driver = requests, driver
        self.lines: deque[str] = deque(maxlen=MOST_LINES)
        self._typed: Any = gui.add_text("line", "", visible=False)
        self._typed.on_update(self._take)
        gui.add_html(FIELD.format(uuid_of(self._typed)))
        self._history, self._told = gui.add_html(""), gui.add_html("")

    def show(self) -> None:
        """Show what was typed, and what is done with it."""
        lines = escape(json.dumps(list(self.lines)))
        words = self._driver.words
        self._history.content = f'<span hidden data-lines="{lines}"></span>'
        self._told.content = note(words) if words else ""

    async def _take(self, event: Event) -> None:
        text = event.target.value.strip()
        if event.client_id is not None and text:
            # The same line may be sent again.
            self._typed.value = ""
            if self._requests.may(event.client_id):
                self._requests.wish(lambda: self._drive(text))

    def _drive(self, text: str) -> None:
        if text in self.lines:
            self.lines.remove(text)
        self.lines.appendleft(text)
        self._driver.drive(text)


class OwnButtons:
    """Buttons that the operator has made: each drives a short program."""

    def __init__(
        self,
        requests: OperatorRequests,
        driver: LineDriver,
        chosen: ChosenProgram,
        newest_line: Callable[[], str],
    ) -> None:
        """Add them to the open container of the page.

        A button is made of the ``chosen`` program, or of the ``newest_line``; empty for none.
        """
        gui = requests.gui
        self._requests, self._driver = requests, driver
        self._chosen, self._newest_line = chosen, newest_line
        self._file = buttons_file(chosen.files[1])
        self._mark: object = None
        # Programs by the names of their buttons, and what is seen of them.
        self._buttons: dict[str, tuple[str, viser.GuiButtonHandle]] = {}
        # Above what changes its height: a button must not move under the finger.
        self._folder = gui.add_folder("Own buttons", expand_by_default=self._file.exists())
        with self._folder:
            self._name = requests.field(gui.add_text("Button", ""))
            actions = {
                "newest line": lambda: self._make(self._line_text),
                "chosen file": lambda: self._make(self._file_text),
                "remove": self._remove,
            }
            requests.buttons("Own", actions)

    def step(self) -> None:
        """Show those of the file, if they have changed.

        Raises:
            KinematicsError: if it has no meaning.
        """
        mark = mark_of(self._file)
        if mark == self._mark:
            return
        # Before it is read: a mistake in it is told once, not in each frame.
        self._mark = mark
        programs = load_buttons(self._file)
        for name, (text, button) in tuple(self._buttons.items()):
            if programs.get(name) != text:
                button.remove()
                del self._buttons[name]
        for name, text in programs.items():
            if name not in self._buttons:
                drive = partial(self._driver.drive, text, name)
                with self._folder:
                    button = self._requests.button(name, drive)
                self._buttons[name] = text, button

    def _remove(self) -> None:
        name, programs = self._name.value.strip(), load_buttons(self._file)
        if programs.pop(name, None) is None:
            raise KinematicsError(f"nothing removed: no button has the name {name!a}")
        self._write(programs)

    def _make(self, text_of: Callable[[], str]) -> None:
        """Make a button with the name in the field."""
        name, programs = self._name.value.strip(), load_buttons(self._file)
        if not name.isprintable() or not 0 < len(name) <= LONGEST_NAME:
            reason = f"a name has 1 to {LONGEST_NAME} characters that can be printed"
            has = f"{len(name)}: {name[:LONGEST_NAME]!a}"
            raise KinematicsError(f"nothing made: {reason}, not {has}")
        if name in programs or len(programs) == MOST_BUTTONS:
            there = f"is a button {name}" if name in programs else f"are {MOST_BUTTONS}"
            raise KinematicsError(f"nothing made: there {there} already; remove one first")
        self._write({**programs, name: text_of()})

    def _file_text(self) -> str:
        return load_text(self._chosen.path, KeptError, LONGEST_TEXT)

    def _line_text(self) -> str:
        line = self._newest_line()
        if not line:
            raise KinematicsError("nothing made: type a line first")
        return line

    def _write(self, programs: dict[str, str]) -> None:
        with KeptError.of_writing(self._file):
            write_buttons(self._file, programs)


class WorkZero:
    """The work offsets, which the operator sets by the present place."""

    def __init__(
        self,
        requests: OperatorRequests,
        machine: ShownMachine,
        chosen: ChosenProgram,
    ) -> None:
        """Add fields to the open container of the page; the offsets are those of the ``chosen``."""
        gui = requests.gui
        self._machine, self._chosen = machine, chosen
        # Those in force, and the marks of the files that say so.
        self._zeros: dict[str, Vector3] = {}
        self._marks: object = None
        self._name = requests.field(gui.add_dropdown("Offset", WORK_OFFSETS))
        self._value = requests.number("This place is [mm]", 0.0)
        actions: dict[str, Callable[[], None]] = {
            name: partial(self._set, axes) for name, axes in AXES.items()
        }
        requests.buttons("Set", {**actions, "clear": self._clear})
        self._text = gui.add_html("")

    def step(self) -> None:
        """Take over what the files say, if they have changed.

        Raises:
            KinematicsError: if they have no meaning.
        """
        marks = tuple(map(mark_of, self._chosen.files))
        if marks != self._marks:
            self._marks, self._zeros = marks, {}
            self._zeros = dict(self._chosen.settings().offsets)

    def show(self) -> None:
        """Show the chosen offset."""
        zero = position_text(self._zeros.get(self._name.value, (0.0, 0.0, 0.0)))
        self._text.content = note(f"its zero: {zero}")

    @property
    def text(self) -> str:
        """Where the platform is from the work zero, for the strip; empty if that is the same."""
        place, name = self._machine.place, self._name.value
        zero = self._zeros.get(name)
        if place is None or zero is None or not any(zero):
            return ""
        return f"\n{name}: {position_text(minus(place, zero))}"

    def _set(self, axes: tuple[int, ...]) -> None:
        """Set some axes of the chosen offset by the present place."""
        place, name = self._machine.place, self._name.value
        if place is None or self._machine.feeds.status.message.speed > SAME_PLACE:
            raise KinematicsError("nothing set: the platform moves, or its place is not known")
        value = 0.001 * self._value.value
        self._write({name: touched_off(self._zeros.get(name), place, axes, value)})

    def _clear(self) -> None:
        """Go back to the offset of the settings."""
        self._write({}, without=self._name.value)

    def _write(self, changes: dict[str, Vector3], without: str = "") -> None:
        _, file = self._chosen.files
        zeros = {**load_zeros(file), **changes}
        zeros.pop(without, None)
        try:
            write_zeros(file, zeros)
        except OSError as error:
            raise KinematicsError(f"nothing set: {file}: {error.strerror or error}") from error


class Outputs:
    """The outputs with their newest values, and a switch for each."""

    def __init__(self, requests: OperatorRequests, machine: ShownMachine, runs: Runs) -> None:
        """Add them to the open container of the page; they are switched by the link of ``runs``."""
        gui = requests.gui
        self._requests, self._machine, self._runs = requests, machine, runs
        self._boxes: dict[OutputKey, Any] = {}
        # Switches that show what was asked for, and how often they still do so if it is not told.
        self._asked: dict[OutputKey, int] = {}
        self._folder = gui.add_folder("Outputs", expand_by_default=False)
        with self._folder:
            self._speed = requests.number("M3, or M4 if < 0 [1/min]", 1000.0)
            self._values = gui.add_html("")
        for key in USUAL:
            self._add_switch(key)

    def show(self) -> None:
        """Show what was told last of each."""
        told = self._machine.feeds.outputs
        shown = tuple(told)[:MOST_VALUES]
        self._values.content = table((_name(key), f"{told[key][1]:g}") for key in shown)
        for key in shown[:MOST_SWITCHES]:
            if key not in self._boxes:
                self._add_switch(key)
        for key, box in self._boxes.items():
            is_on, left = bool(told.get(key, (0, 0.0))[1]), self._asked.pop(key, 0)
            if left and box.value is not is_on:
                self._asked[key] = left - 1
            else:
                box.value = is_on

    def _add_switch(self, key: OutputKey) -> None:
        with self._folder:
            box = self._requests.gui.add_checkbox(_name(key), initial_value=False)
        self._boxes[key] = box

        async def switch(event: Event) -> None:
            if event.client_id is None:
                return
            wanted = event.target.value
            if self._requests.may(event.client_id):
                # Until it is told: a click on a switch that shows "off" is none on "off".
                self._asked[key] = SHOWS
                self._requests.wish(lambda: self._switch(key, wanted), outlasts_stop=not wanted)
            else:
                self._boxes[key].value = not wanted

        box.on_update(switch)

    def _switch(self, key: OutputKey, on: bool) -> None:
        """Switch an output as a program does: off at any time, on only if the machine may move."""
        status, name = self._machine.feeds.status, _name(key)
        refusal = ""
        if self._runs.owns(key):
            refusal = f"{name} not switched: the program that runs does so"
        elif on and (self._machine.facts is None or status.state in NOT_READY):
            refusal = f"{name} not switched on: the machine is {status.word or 'gone'}"
        if refusal:
            self._asked.pop(key, None)
            raise KinematicsError(refusal)
        full = self._speed.value if key == SPINDLE else 255.0 if key[0] == "fan" else 1.0
        self._runs.link.put_out(Output(*key, full if on else 0.0, 0, 0))


class ManualControls:
    """Lines that are typed, own buttons, work zero, and outputs, in folders of their own."""

    def __init__(
        self,
        requests: OperatorRequests,
        machine: ShownMachine,
        runs: Runs,
        chosen: ChosenProgram,
    ) -> None:
        """Add all to the open container of the page.

        Args:
            requests: of the operator.
            machine: that is driven.
            runs: by which lines run.
            chosen: program, whose settings hold here, too.
        """
        gui = requests.gui
        self._requests = requests
        self._driver = LineDriver(requests, machine, runs, chosen)
        self._own = OwnButtons(requests, self._driver, chosen, self._newest_line)
        with gui.add_folder("Line"):
            self._typed = TypedLines(requests, self._driver)
        with gui.add_folder("Work zero", expand_by_default=False):
            self.work_zero = WorkZero(requests, machine, chosen)
        self._outputs = Outputs(requests, machine, runs)

    def step(self) -> None:
        """Go on with what is done by hand."""
        for part in (self._driver, self._own, self.work_zero):
            try:
                part.step()
            except KinematicsError as error:
                self._requests.refuse(str(error))

    def show(self) -> None:
        """Show on the pages what there is."""
        for part in (self._typed, self.work_zero, self._outputs):
            part.show()

    def _newest_line(self) -> str:
        return self._typed.lines[0] if self._typed.lines else ""


def _proved(
    text: str, name: str, settings: ProgramSettings, place: Vector3, facts: MachineFacts
) -> Program:
    program = read_short(text, settings, place, name)
    check_program(program, facts.workspace, *facts.bounds)
    return program


def _name(key: OutputKey) -> str:
    name = ascii(key[0][:20])[1:-1]
    return name if key in USUAL else f"{name} {key[1]}"
