"""What is done by hand beside jogs: lines that are typed, own buttons, work zero, and outputs."""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from html import escape
from time import monotonic
from typing import Any

import viser

from tri_glide_kinematics.control import IDLE, OperatingState
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.keys import load_text
from tri_glide_kinematics.panel.inputs import OperatorsInput, OperatorsNumber
from tri_glide_kinematics.panel.link import Feeds, MachineFacts
from tri_glide_kinematics.panel.operator_requests import Event, OperatorRequests
from tri_glide_kinematics.panel.program_reading import mark_of
from tri_glide_kinematics.panel.tabs.program_tab import ProgramTab
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
    RunState,
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
MOST_OUTPUTS = 12  # that are shown
MOST_BUTTONS = 24
LONGEST_NAME = 24  # characters, of a button
SAME_PLACE = 1e-7  # m, and of a speed at rest m/s

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


class ManualControls:
    """Lines that are typed, own buttons, work zero, and outputs, in folders of their own."""

    def __init__(
        self,
        gui: viser.GuiApi,
        requests: OperatorRequests,
        feeds: Feeds,
        programs: ProgramTab,
        place: Callable[[], Vector3 | None],
    ) -> None:
        """Add all to the open container of ``gui``.

        Args:
            gui: of the page.
            requests: of the operator.
            feeds: what the machine tells.
            programs: whose settings hold here, too, and beside whose run no line runs.
            place: returns where the platform is, as the strip shows it [m].
        """
        self._gui, self._requests, self._feeds = gui, requests, feeds
        self._programs, self._place = programs, place
        self._facts: MachineFacts | None = None
        # Work offsets in force, and the marks of the files that say so.
        self._zeros: dict[str, Vector3] = {}
        self._marks: object = None
        # The newest line comes first.
        self._lines: deque[str] = deque(maxlen=MOST_LINES)
        # A line or a button is proved from a place [m] on, and then driven.
        self._what = ""
        self._from: Vector3 | None = None
        self._proof: Future[Program] | None = None
        self._run: ProgramRun | None = None
        # Stop, and all else of the page, goes on while a line is proved.
        self._prover = ThreadPoolExecutor(1)
        self._boxes: dict[tuple[str, int], Any] = {}
        # Programs of own buttons by their names, and what is seen of them.
        self._buttons_file = buttons_file(programs.files[1])
        self._buttons: dict[str, tuple[str, Any]] = {}
        programs.is_taken = lambda: self._is_busy
        go_on = requests.link.on_resume
        # A line that waits goes on, or else a program.
        requests.link.on_resume = lambda: (self._run is not None and self._run.go_on()) or go_on()
        # Above what changes its height: a button must not move under the finger.
        is_used = self._buttons_file.exists()
        self._own = gui.add_folder("Own buttons", expand_by_default=is_used)
        with self._own:
            self._own_name = OperatorsInput(requests, gui.add_text("Button", ""))
            change = gui.add_button_group("Own", ("newest line", "chosen file", "remove"))
            change.on_click(requests.on(self._change_buttons))
        with gui.add_folder("Line"):
            self._typed: Any = gui.add_text("line", "", visible=False)
            self._typed.on_update(self._take_line)
            gui.add_html(FIELD.format(uuid_of(self._typed)))
            self._history, self._told = gui.add_html(""), gui.add_html("")
        with gui.add_folder("Work zero", expand_by_default=False):
            self._name = OperatorsInput(requests, gui.add_dropdown("Offset", WORK_OFFSETS))
            self._value = OperatorsNumber(requests, gui, "This place is [mm]", 0.0)
            buttons = gui.add_button_group("Set", (*AXES, "clear"))
            buttons.on_click(requests.on(self._set_zero))
            self._zero_text = gui.add_html("")
        self._folder = gui.add_folder("Outputs", expand_by_default=False)
        with self._folder:
            self._speed = OperatorsNumber(requests, gui, "M3, or M4 if < 0 [1/min]", 1000.0)
            self._values = gui.add_html("")
        for key in USUAL:
            self._add_switch(key)

    def step(self, facts: MachineFacts | None) -> None:
        """Go on; ``facts`` are those of the machine that is there."""
        self._facts = facts
        try:
            self._look_at_files()
            if self._proof is not None and self._proof.done():
                proof, self._proof = self._proof, None
                program = proof.result()
                self._check_ready()
                self._run = ProgramRun(self._programs.link, program)
        except KinematicsError as error:
            self._requests.refuse(f"{error}")
        if self._run is not None and self._is_busy:
            self._run.look(monotonic())
            failed = [each.text for each in self._run.reports if each.text and not each.is_good]
            if not self._is_busy and failed:
                self._requests.refuse(f"{self._what}: {failed[0]}")

    def stop(self) -> None:
        """End the line, if there is one: the machine was told to stop."""
        self._proof = None
        if self._run is not None:
            self._run.stop()

    def may_end(self) -> bool:
        """End the line, if there is one, and return whether its platform rests, outputs off."""
        self.stop()
        return self._run is None or self._run.is_delivered(monotonic())

    def show(self) -> None:
        """Show on the pages what there is."""
        run, words = self._run, "is proved" if self._proof is not None else ""
        if run is not None:
            words = "done" if run.is_whole else run.doing or run.state.value
        told = self._feeds.outputs
        lines = escape(json.dumps(list(self._lines)))
        zero = position_text(self._zeros.get(self._name.value, (0.0, 0.0, 0.0)))
        for html, content in (
            (self._history, f'<span hidden data-lines="{lines}"></span>'),
            (self._told, note(f"{self._what}: {words}") if words else ""),
            (self._zero_text, note(f"its zero: {zero}")),
            (self._values, table((_name(key), f"{told[key][1]:g}") for key in told)),
        ):
            if html.content != content:
                html.content = content
        for key in tuple(told)[:MOST_OUTPUTS]:
            if key not in self._boxes:
                self._add_switch(key)
        for key, box in self._boxes.items():
            is_on = bool(told.get(key, (0, 0.0))[1])
            if box.value != is_on:
                box.value = is_on

    @property
    def work_text(self) -> str:
        """Where the platform is from the work zero, for the strip; empty if that is the same."""
        place, name = self._place(), self._name.value
        zero = self._zeros.get(name)
        if place is None or zero is None or not any(zero):
            return ""
        return f"\n{name}: {position_text(minus(place, zero))}"

    # Work zero

    def _look_at_files(self) -> None:
        marks = tuple(map(mark_of, (*self._programs.files, self._buttons_file)))
        if marks != self._marks:
            self._marks, self._zeros = marks, {}
            self._zeros = dict(self._programs.chosen.settings().offsets)
            self._show_buttons(load_buttons(self._buttons_file))

    def _set_zero(self, what: str) -> None:
        """Set some axes of the chosen work zero by the present place, or take it away."""
        _, file = self._programs.files
        zeros, name, place = load_zeros(file), self._name.value, self._place()
        if what == "clear":
            zeros.pop(name, None)
        elif place is None or self._feeds.status.message.speed > SAME_PLACE:
            raise KinematicsError("nothing set: the platform moves, or its place is not known")
        else:
            value = 0.001 * self._value.value
            zeros[name] = touched_off(self._zeros.get(name), place, AXES[what], value)
        try:
            write_zeros(file, zeros)
        except OSError as error:
            raise KinematicsError(f"nothing set: {file}: {error.strerror or error}") from error

    # A line, and buttons

    @property
    def _is_busy(self) -> bool:
        """Whether a line is proved or driven."""
        is_running = self._run is not None and self._run.state is not RunState.ENDED
        return is_running or self._proof is not None

    async def _take_line(self, event: Event) -> None:
        text = event.target.value.strip()
        if event.client_id is not None and text:
            # The same line may be sent again.
            self._typed.value = ""
            if self._requests.may(event.client_id):
                self._requests.wish(lambda: self._prove(text))

    def _prove(self, text: str, name: str = "") -> None:
        """Begin to read and prove a line, or a button by its name; it is driven when that is done.

        Raises:
            KinematicsError: if it cannot be driven now.
        """
        if self._is_busy:
            raise KinematicsError("nothing driven: another line is not done yet")
        if not name:
            if text in self._lines:
                self._lines.remove(text)
            self._lines.appendleft(text)
        self._what = name or text
        self._run, self._from = None, self._place()
        self._check_ready()
        assert self._facts is not None and self._from is not None
        settings = self._programs.chosen.settings()
        self._proof = self._prover.submit(
            _proved, text, name or "typed", settings, self._from, self._facts
        )

    def _change_buttons(self, what: str) -> None:
        """Make a button with the name in the field, or remove it."""
        name, buttons = self._own_name.value.strip(), load_buttons(self._buttons_file)
        if what == "remove":
            if buttons.pop(name, None) is None:
                raise KinematicsError(f"nothing removed: no button has the name {name!a}")
        elif not name.isprintable() or not 0 < len(name) <= LONGEST_NAME:
            reason = f"a name has 1 to {LONGEST_NAME} characters that can be printed"
            has = f"{len(name)}: {name[:LONGEST_NAME]!a}"
            raise KinematicsError(f"nothing made: {reason}, not {has}")
        elif name in buttons or len(buttons) == MOST_BUTTONS:
            reason = f"there is a button {name}" if name in buttons else f"there are {MOST_BUTTONS}"
            raise KinematicsError(f"nothing made: {reason} already; remove one first")
        elif what == "chosen file":
            buttons[name] = load_text(self._programs.chosen.path, KeptError, LONGEST_TEXT)
        elif self._lines:
            buttons[name] = self._lines[0]
        else:
            raise KinematicsError("nothing made: type a line first")
        with KeptError.of_writing(self._buttons_file):
            write_buttons(self._buttons_file, buttons)

    def _show_buttons(self, programs: dict[str, str]) -> None:
        """Show a button for each of the ``programs``, by their names."""
        for name, (text, button) in tuple(self._buttons.items()):
            if programs.get(name) != text:
                button.remove()
                del self._buttons[name]
        for name in (each for each in programs if each not in self._buttons):
            with self._own:
                button = self._gui.add_button(name)
            button.on_click(self._requests.on(partial(self._press, name, programs[name])))
            self._buttons[name] = programs[name], button

    def _press(self, name: str, text: str, _: object) -> None:
        self._prove(text, name)

    def _check_ready(self) -> None:
        """Check that the line that is proved can be driven now.

        Raises:
            KinematicsError: if not; it says why.
        """
        place, status, reason = self._place(), self._feeds.status, ""
        if self._programs.is_running:
            reason = "a program runs"
        elif place is None or self._from is None:
            reason = "the place of the platform is not known"
        elif status.state is not IDLE:
            reason = f"the machine is {status.word}, and has to be idle"
        elif math.dist(place, self._from) > SAME_PLACE:
            reason = "the platform was moved meanwhile"
        if reason:
            raise KinematicsError(f"nothing driven: {reason}")

    # Outputs

    def _add_switch(self, key: tuple[str, int]) -> None:
        with self._folder:
            box = self._boxes[key] = self._gui.add_checkbox(_name(key), initial_value=False)

        async def switch(event: Event) -> None:
            if event.client_id is None:
                return
            wanted = event.target.value
            # It shows what is told, not what was asked for.
            self._boxes[key].value = not wanted
            if self._requests.may(event.client_id):
                self._requests.wish(lambda: self._switch(key, wanted), outlasts_stop=not wanted)

        box.on_update(switch)

    def _switch(self, key: tuple[str, int], on: bool) -> None:
        """Switch an output as a program does: off at any time, on only if the machine may move."""
        status, name = self._feeds.status, _name(key)
        if self._programs.has_output(key):
            raise KinematicsError(f"{name} not switched: the program that runs does so")
        if on and (self._facts is None or status.state in NOT_READY):
            raise KinematicsError(f"{name} not switched on: the machine is {status.word or 'gone'}")
        full = self._speed.value if key == SPINDLE else 255.0 if key[0] == "fan" else 1.0
        self._programs.link.put_out(Output(*key, full if on else 0.0, 0, 0))


def _proved(
    text: str, name: str, settings: ProgramSettings, place: Vector3, facts: MachineFacts
) -> Program:
    program = read_short(text, settings, place, name)
    check_program(program, facts.workspace, *facts.bounds)
    return program


def _name(key: tuple[str, int]) -> str:
    name = ascii(key[0][:20])[1:-1]
    return name if key in USUAL else f"{name} {key[1]}"
