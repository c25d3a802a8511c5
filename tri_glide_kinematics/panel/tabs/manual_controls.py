"""What is done by hand beside jogs: the work zero, a line that is typed, and outputs."""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Callable
from html import escape
from pathlib import Path
from threading import Thread
from time import monotonic

import viser

from tri_glide_kinematics.control import OperatingState
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.machine import (
    Event,
    Feeds,
    MachineFacts,
    OperatorRequests,
    OperatorsInput,
    OperatorsNumber,
    note,
    position_text,
)
from tri_glide_kinematics.panel.program_reading import mark_of
from tri_glide_kinematics.panel.tabs.program_tab import ProgramTab
from tri_glide_kinematics.programs import (
    WORK_OFFSETS,
    Output,
    Program,
    ProgramRun,
    RunState,
    check_program,
    load_zeros,
    read_line,
    touched_off,
    write_zeros,
)
from tri_glide_kinematics.ros.goal_sender import ProgramLink
from tri_glide_kinematics.vectors import Vector3, minus

MOST_LINES = 30  # in the history
MOST_OUTPUTS = 12  # that have a switch
LONGEST_NAME = 20  # of an output that is shown [characters]
LOOK_PERIOD = 0.5  # s between two looks at the files
SHOW_PERIOD = 0.2  # s
# The platform rests, and is where the line was proved from, within this [m].
SAME_PLACE = 1e-7

# Who switches them on by hand: those of M3, M7 and M8, which are there before anything is told.
SPINDLE = ("spindle", 0)
USUAL = (SPINDLE, ("flood", 0), ("mist", 0))
AXES = {"x": (0,), "y": (1,), "z": (2,), "all": (0, 1, 2)}

FIELD = (
    '<div class="tri-glide-line"><input type="text" data-line="{}" aria-label="line of G-code" '
    'placeholder="a line of G-code, Enter" autocomplete="off" spellcheck="false"></div>'
)


class ManualControls:
    """Work zero, a line that is typed, and outputs, in folders of their own."""

    def __init__(
        self,
        gui: viser.GuiApi,
        requests: OperatorRequests,
        link: ProgramLink,
        feeds: Feeds,
        programs: ProgramTab,
        files: tuple[Path, Path],
        place: Callable[[], Vector3 | None],
    ) -> None:
        """Add all to the open container of ``gui``.

        Args:
            gui: of the page.
            requests: of the operator.
            link: by which lines run.
            feeds: what the machine tells.
            programs: whose settings hold here, too, and beside whose run no line runs.
            files: of the settings of programs, and of the work zeros that are kept.
            place: returns where the platform is, as the strip shows it [m].
        """
        self._requests, self._link, self._feeds = requests, link, feeds
        self._programs, self._files, self._place = programs, files, place
        self._facts: MachineFacts | None = None
        self._due = {"look": 0.0, "show": 0.0}
        # Work offsets in force, and why they are not known; by the marks of their files.
        self._marks: object = None
        self._zeros: dict[str, Vector3] = {}
        self._trouble = ""
        # The line that is proved, from where, and what comes of that; then its run.
        self._lines: deque[str] = deque(maxlen=MOST_LINES)
        self._proof: tuple[Vector3, list[Program | str]] | None = None
        self._run: ProgramRun | None = None
        self._guess = ""
        self._boxes: dict[tuple[str, int], viser.GuiCheckboxHandle] = {}
        programs.is_taken = lambda: self.is_busy
        go_on = requests.link.on_resume
        requests.link.on_resume = lambda: self._goes_on() or go_on()
        with gui.add_folder("Line"):
            self._typed = gui.add_text("line", "", visible=False)
            self._typed.on_update(self._take_line)
            gui.add_html(FIELD.format(self._typed._impl.uuid))
            self._history = gui.add_html("")
            self._told = gui.add_html("")
            self._show_history()
        with gui.add_folder("Work zero", expand_by_default=False):
            self._name = OperatorsInput(requests, gui.add_dropdown("Offset", WORK_OFFSETS))
            self._value = OperatorsNumber(requests, gui, "This place is [mm]", 0.0)
            buttons = gui.add_button_group("Set", (*AXES, "clear"))
            buttons.on_click(requests.on(self._touch_off))
            self._zero_text = gui.add_html("")
        self._gui = gui
        self._folder = gui.add_folder("Outputs", expand_by_default=False)
        with self._folder:
            self._speed = OperatorsNumber(requests, gui, "Spindle [1/min], < 0: M4", 1000.0)
        for key in USUAL:
            self._add_switch(key)

    @property
    def is_busy(self) -> bool:
        """Whether a line is proved or driven."""
        return self._proof is not None or self._is_running

    @property
    def _is_running(self) -> bool:
        return self._run is not None and self._run.state is not RunState.ENDED

    def step(self, facts: MachineFacts | None) -> None:
        """Go on; ``facts`` are those of the machine that is there."""
        self._facts = facts
        if self._is_due("look", LOOK_PERIOD):
            self._look_at_files()
        if self._proof is not None and self._proof[1]:
            (place, (answer,)), self._proof = self._proof, None
            if isinstance(answer, str):
                self._requests.refuse(f"nothing driven: {answer}")
            elif reason := self._why_not(place):
                self._requests.refuse(f"nothing driven: {reason}")
            else:
                self._guess = answer.guess
                self._run = ProgramRun(self._link, answer)
        if self._run is not None and self._is_running:
            self._run.look(monotonic())
            failed = next((each for each in self._run.reports if not each.is_good), None)
            if not self._is_running and failed is not None and failed.text:
                self._requests.refuse(f"{self._lines[0]}: {failed.text}")

    def stop(self) -> None:
        """End the line, if there is one: the machine was told to stop."""
        self._proof = None
        if self._run is not None:
            self._run.stop()

    def show(self) -> None:
        """Show on the pages what there is."""
        if not self._is_due("show", SHOW_PERIOD):
            return
        run, words = self._run, ""
        if self._proof is not None:
            words = f"{self._lines[0]}: is proved"
        elif run is not None:
            done = "done" if run.is_whole else run.doing or run.state.value
            words = f"{self._lines[0]}: {done}; {self._guess}".removesuffix("; ")
        _put(self._told, note(words) if words else "")
        zero = self._zeros.get(self._name.value, (0.0, 0.0, 0.0))
        _put(self._zero_text, note(self._trouble or f"its zero: {position_text(zero)}"))
        for key in self._feeds.outputs:
            if key not in self._boxes and len(self._boxes) < MOST_OUTPUTS:
                self._add_switch(key)
        for key, box in self._boxes.items():
            value = self._feeds.outputs.value(key)
            label = f"{_name(key)}: {'not told' if value is None else f'{value:g}'}"
            if box.label != label:
                box.label = label
            if box.value != bool(value):
                box.value = bool(value)

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
        marks = tuple(map(mark_of, self._files))
        if marks == self._marks:
            return
        self._marks = marks
        try:
            self._zeros, self._trouble = dict(self._programs.settings().offsets), ""
        except KinematicsError as error:
            self._zeros, self._trouble = {}, str(error)

    def _touch_off(self, what: str) -> None:
        """Set some axes of the chosen work zero by the present place, or take it away."""
        self._look_at_files()
        _, file = self._files
        zeros, name, place = load_zeros(file), self._name.value, self._place()
        if what == "clear":
            zeros.pop(name, None)
        elif place is None or not self._rests:
            why = "moves" if place is not None else "is nobody knows where"
            self._requests.refuse(f"nothing set: the platform {why}")
            return
        else:
            value = 0.001 * self._value.value
            zeros[name] = touched_off(self._zeros.get(name), place, AXES[what], value)
        try:
            write_zeros(file, zeros)
        except OSError as error:
            self._requests.refuse(f"nothing set: {file}: {error.strerror or error}")
        self._look_at_files()

    @property
    def _rests(self) -> bool:
        return not self._feeds.status.message.speed > SAME_PLACE

    # A line

    async def _take_line(self, event: Event) -> None:
        text = event.target.value.strip()
        if event.client_id is None or not text:
            return
        # The same line may be sent again.
        self._typed.value = ""
        if self._requests.may(event.client_id):
            self._requests.wish(lambda: self._prove(text))

    def _prove(self, text: str) -> None:
        """Begin to read and prove a line; it is driven when that is done."""
        if text in self._lines:
            self._lines.remove(text)
        if not self.is_busy:
            self._lines.appendleft(text)
            self._show_history()
        place = self._place()
        reason = "another line is not done yet" if self.is_busy else self._why_not(place)
        if reason or place is None or self._facts is None:
            self._requests.refuse(f"nothing driven: {reason}")
            return
        facts, settings, answers = self._facts, self._programs.settings(), []
        answers: list[Program | str]

        def prove() -> None:
            try:
                program = read_line(text, settings, place)
                check_program(program, facts.workspace, *facts.bounds)
                answers.append(program)
            except KinematicsError as error:
                answers.append(str(error))

        self._run, self._proof = None, (place, answers)
        # Stop, and all else of the page, goes on meanwhile.
        Thread(target=prove, daemon=True).start()

    def _why_not(self, proved_from: Vector3 | None) -> str:
        """Return why no line can be driven now that begins at a place [m]; empty if one can."""
        place, state = self._place(), self._feeds.status.state
        if self._programs.is_running:
            return "a program runs"
        if self._facts is None or place is None or proved_from is None:
            return "there is no machine"
        if state is not OperatingState.IDLE:
            return f"the machine is {self._feeds.status.word}, and has to be idle"
        if math.dist(place, proved_from) > SAME_PLACE:
            return "the platform was moved meanwhile"
        return ""

    def _goes_on(self) -> bool:
        """Let a line that waits go on; return whether one did."""
        if self._run is None or self._run.state is not RunState.WAITING:
            return False
        self._run.go_on()
        return True

    def _show_history(self) -> None:
        lines = escape(json.dumps(list(self._lines)))
        self._history.content = f'<span hidden data-lines="{lines}"></span>'

    # Outputs

    def _add_switch(self, key: tuple[str, int]) -> None:
        with self._folder:
            box = self._boxes[key] = self._gui.add_checkbox(_name(key), initial_value=False)

        async def switch(event: Event) -> None:
            if event.client_id is None:
                return
            wanted = bool(event.target.value)
            # It shows what is told, not what was asked for.
            box.value = bool(self._feeds.outputs.value(key))
            if self._requests.may(event.client_id):
                self._requests.wish(lambda: self._switch(key, wanted), outlasts_stop=not wanted)

        box.on_update(switch)

    def _switch(self, key: tuple[str, int], on: bool) -> None:
        """Switch an output as a program does: off at any time, on only if the machine may move."""
        status, name = self._feeds.status, _name(key)
        if self._programs.has_output(*key):
            self._requests.refuse(f"{name} not switched: the program that runs does so")
        elif on and (self._facts is None or status.state in NOT_READY):
            self._requests.refuse(f"{name} not switched on: the machine is {status.word or 'gone'}")
        else:
            value = self._speed.value if key == SPINDLE else self._feeds.outputs.value_on(key)
            self._link.put_out(Output(*key, value if on else 0.0, 0, 0))

    def _is_due(self, name: str, period: float) -> bool:
        now = monotonic()
        if now < self._due[name]:
            return False
        self._due[name] = now + period
        return True


# Nothing is switched on in these states, nor while the machine is not known.
NOT_READY = (None, OperatingState.DISABLED, OperatingState.FAULT, OperatingState.WAITING)


def _name(key: tuple[str, int]) -> str:
    name = ascii(key[0][:LONGEST_NAME])[1:-1]
    return name if key in USUAL else f"{name} {key[1]}"


def _put(html: viser.GuiHtmlHandle, content: str) -> None:
    """Show a text, which is sent only if it is new."""
    if html.content != content:
        html.content = content
