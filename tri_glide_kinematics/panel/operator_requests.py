"""Requests of the operator, the buttons and fields that make them, and why some are not fulfilled.

The node fulfils the requests of the page that has the controls.
"""

from __future__ import annotations

import math
import re
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

import viser

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.link import MachineFacts, MachineLink
from tri_glide_kinematics.panel.operators import (
    LONGEST_GAP,
    Controls,
    HeldJog,
    MessageHistory,
    name_of,
)
from tri_glide_kinematics.panel.viser_parts import show_value
from tri_glide_kinematics.vectors import Vector3, scaled

# A refusal is shown for so long [s].
REFUSAL_SHOWN = 12.0

Wish = Callable[[], None]
Event = Any


def no_choice(handle: Any, value: object) -> str:
    """Return why a list or a group of buttons has no such choice; empty if it has.

    viser takes any text for a choice.
    """
    if value in getattr(handle, "options", (value,)):
        return ""
    return f"nothing done: there is no choice {str(value)[:20]!r}"


class OperatorRequests:
    """The requests of the operator, and who has the controls.

    Stop and the renewals of a held jog go to the machine straight from the thread that hears the
    page. Everything else is a wish, which the node's own thread fulfils. Stop drops all wishes that
    are older than itself, but not the changes of inputs: they move nothing, and are shown already.

    Attributes:
        server: of the page.
        gui: of the page, to whose open container all that the operator uses is added.
        controls: who has them.
        link: to the machine.
        refusal: what was refused last, and why; empty after a while.
        history: of what all pages were told.
        on_stop: ends, where the node spins, what is still on its way.
    """

    def __init__(self, link: MachineLink, server: viser.ViserServer) -> None:
        """Send by ``link``, whose refusals are shown on the pages of a ``server``."""
        self.server, self.gui = server, server.gui
        self.controls = Controls()
        self.link = link
        link.on_refusal = self.refuse
        self.refusal = ""
        self.history = MessageHistory()
        self.on_stop: list[Wish] = []
        self._refused_at = 0.0
        self._hold = HeldJog()
        # With whether they outlast Stop.
        self._wishes: deque[tuple[Wish, bool]] = deque()
        self._wishes_lock = threading.Lock()

    def refuse(self, reason: str, log: str = "") -> None:
        """Show why something is not done; ``log`` is what ``ik_node`` has written about it."""
        self.refusal, self._refused_at = reason, time.monotonic()
        self.history.add("refusal", reason, log)

    def may(self, page: int) -> bool:
        """Tell whether a ``page`` may act, and say who may if it may not."""
        holder = self.controls.holder
        if holder == page:
            return True
        who = "nobody: take them first" if holder is None else name_of(holder)
        self.refuse(f"{name_of(page)}: nothing done, as the controls are with {who}")
        return False

    def wish(self, wish: Wish, *, outlasts_stop: bool = False) -> None:
        """Have something done where the node spins; what ``outlasts_stop`` moves nothing."""
        with self._wishes_lock:
            self._wishes.append((wish, outlasts_stop))

    def on(self, wish: Callable[[Any], None]) -> Callable[[Event], Any]:
        """Return a callback of viser that fulfils a wish, if its page has the controls.

        The ``wish`` gets the value of what was pressed.
        """

        async def call(event: Event) -> None:
            if event.client_id is None:
                return
            if self.may(event.client_id):
                value = getattr(event.target, "value", None)
                if refusal := no_choice(event.target, value):
                    self.refuse(refusal)
                    return
                self.wish(lambda: wish(value))

        return call

    # Buttons and fields, which are added to the open container of the page.

    def button(self, label: str, do: Wish, **look: Any) -> viser.GuiButtonHandle:
        """Add a button, by which the node does something."""
        button = self.gui.add_button(label, **look)
        button.on_click(self.on(lambda _: do()))
        return button

    def buttons(
        self, label: str, actions: Mapping[str, Wish], of_any_page: Sequence[str] = ()
    ) -> None:
        """Add a group of buttons: by its words, what each has done.

        Those ``of_any_page`` need no controls.
        """
        group = self.gui.add_button_group(label, tuple(actions))
        press = self.on(lambda words: actions[words]())

        async def on_click(event: Event) -> None:
            if event.target.value in of_any_page:
                self.wish(actions[event.target.value])
            else:
                await press(event)

        group.on_click(on_click)

    def field(self, handle: Any, on_change: Callable[[Any], None] | None = None) -> OperatorsInput:
        """Take over an input of viser; ``on_change``, which moves nothing, gets what is set."""
        return OperatorsInput(self, handle, on_change)

    def number(self, label: str, number: float, **bounds: Any) -> OperatorsNumber:
        """Add a field with a ``number`` inside its ``bounds``."""
        return OperatorsNumber(self, label, number, **bounds)

    # What becomes of them

    def fulfil(self) -> None:
        """Do what is wished; called where the node spins."""
        while (wish := self._next()) is not None:
            try:
                wish()
            except KinematicsError as error:
                self.refuse(str(error))
        if self.refusal and time.monotonic() - self._refused_at > REFUSAL_SHOWN:
            self.refusal = ""

    async def stop(self, _: Event) -> None:
        """Stop the machine: any page may, at any time."""
        self.link.stop()
        self._hold.end()
        with self._wishes_lock:
            self._wishes = deque(each for each in self._wishes if each[1])
        # A wish that is being fulfilled at this moment comes to its end before this.
        self.wish(self._end_what_is_on_its_way)

    def _end_what_is_on_its_way(self) -> None:
        for end in self.on_stop:
            end()

    async def release(self, event: Event) -> None:
        """End the jog of a page at once."""
        self._end_hold(event.client_id)

    def hold(self, event: Event, direction: Vector3, speed: Callable[[], float]) -> None:
        """Jog at a ``speed`` [m/s] while a button is held: called again and again."""
        page, velocity = event.client_id, None
        try:
            velocity = scaled(direction, speed()) if self.may(page) else None
        except KinematicsError as error:
            self.refuse(str(error))
        if velocity is None:
            self._end_hold(page)
            # Should it get the controls now, or show a number, it has to press again.
            self._hold.bar(page)
        elif self._hold.renew(page, direction, time.monotonic()):
            self.link.jog(velocity)

    def end_hold(self) -> None:
        """Let a button that is held move nothing before it was released."""
        self._hold.end()

    def follow_twist_timeout(self, timeout: float) -> None:
        """End a hold before ``ik_node`` does, which then takes the next twist as a new jog [s]."""
        self._hold.longest_gap = min(LONGEST_GAP, 0.9 * timeout)

    def give(self, page: int) -> None:
        """Give up the controls of a page, and end what it did."""
        if self._end_hold(page):
            self._hold.bar(page)
        self.controls.give(page)

    async def leave(self, event: Event) -> None:
        """Give up the controls of a page that shows another address now."""
        self.give(event.client_id)

    async def opened(self, client: viser.ClientHandle) -> None:
        """Note that a page is there."""
        self.controls.opened(client.client_id)

    async def closed(self, client: viser.ClientHandle) -> None:
        """Note that a page has vanished, and end what it did."""
        self._end_hold(client.client_id)
        self.controls.closed(client.client_id)

    def answers(self, page: int, is_there: bool) -> None:
        """Take a page that does not answer for one that has vanished, until it does again."""
        if is_there:
            self.controls.opened(page)
            return
        self._end_hold(page)
        # When it comes back, it has to press again.
        self._hold.bar(page)
        self.controls.closed(page)

    def _next(self) -> Wish | None:
        with self._wishes_lock:
            return self._wishes.popleft()[0] if self._wishes else None

    def _end_hold(self, page: int) -> bool:
        is_jog = self._hold.release(page)
        if is_jog:
            self.link.jog()
        return is_jog


# Buttons and fields: only the page with the controls uses them.

# What a field of a number may show, and how much of another text is told [characters].
DECIMAL = re.compile(r"[-+]?(?:[0-9]{1,9}(?:[.,][0-9]{0,9})?|[.,][0-9]{1,9})", re.ASCII)
WHOLE = re.compile(r"[-+]?[0-9]{1,9}", re.ASCII)
THOUSAND = re.compile(r"[-+]?[1-9][0-9]{0,2},[0-9]{3}", re.ASCII)
LONGEST_NUMBER = 20
# Of the fields of speeds [mm/s].
USUAL_SPEED, SLOWEST_SPEED = 50.0, 0.01


class OperatorsInput:
    """An input that only the page with the controls changes; on the others it goes back.

    Attributes:
        value: that the operator, or the program, has set last.
    """

    def __init__(
        self,
        requests: OperatorRequests,
        handle: Any,
        on_change: Callable[[Any], None] | None = None,
    ) -> None:
        """Take over an input of viser; ``on_change``, which moves nothing, gets what is set."""
        self.value = handle.value
        self._requests = requests
        self._handle = handle
        self._on_change = on_change
        handle.on_update(self._take)

    def set(self, value: Any) -> None:
        """Set it by the program."""
        self.value = value
        show_value(self._handle, value)

    async def _take(self, event: Event) -> None:
        if event.client_id is None:
            return
        if not self._requests.may(event.client_id):
            self._handle.value = self.value
            return
        value = event.target.value
        if refusal := self._refusal(value):
            self._requests.refuse(refusal)
            self._handle.value = self.value
            return
        self.value = value
        on_change = self._on_change
        if on_change is not None:
            self._requests.wish(lambda: on_change(value), outlasts_stop=True)

    def _refusal(self, value: Any) -> str:
        """Return why a list or a slider cannot have a ``value``; empty if it can."""
        if refusal := no_choice(self._handle, value):
            return refusal
        low, high = (getattr(self._handle, name, None) for name in ("min", "max"))
        if low is None or high is None or low <= value <= high:
            return ""
        what = f"{self._handle.label}: {_shown(value)}"
        return f"nothing done: {what} must be from {_shown(low)} to {_shown(high)}"


class WrongNumberError(KinematicsError):
    """A field shows no number that it may have.

    Attributes:
        label: of the field.
        text: that it showed.
    """

    def __init__(self, label: str, text: str, wanted: str) -> None:
        """Store both, and what is ``wanted``, in words."""
        super().__init__(f"nothing done: {label}: {text[:LONGEST_NUMBER]!r} must be {wanted}")
        self.label = label
        self.text = text


class OperatorsNumber:
    """A number that only the page with the controls changes.

    It is a field of text: one for numbers alters what is typed, key by key, until it is a number
    that it may have. What is none is told when the number is needed; then the last one is shown.

    Attributes:
        last: that it has shown.
    """

    def __init__(
        self,
        requests: OperatorRequests,
        label: str,
        number: float,
        *,
        least: float = -math.inf,
        most: float = math.inf,
        is_whole: bool = False,
        hint: str | None = None,
        on_change: Callable[[float], None] | None = None,
    ) -> None:
        """Add the field to the open container of the page, with a ``number`` inside its bounds."""
        self._label, self._is_whole = label, is_whole
        self._least, self._most = least, most
        self.last = number
        self._on_change = on_change
        field_of_text = requests.gui.add_text(label, _shown(number), hint=hint)
        self._input = OperatorsInput(requests, field_of_text, self._take)

    @property
    def value(self) -> float:
        """The number that the field shows.

        Raises:
            WrongNumberError: if it shows none that it may have; from now on it shows the last one.
        """
        try:
            return self._read(str(self._input.value))
        except WrongNumberError:
            self.set(self.last)
            raise

    def set(self, number: float) -> None:
        """Show a number."""
        self.last = number
        self._input.set(_shown(number))

    def _take(self, text: str) -> None:
        # Somebody may still be typing: nothing is told about what is no number yet.
        with suppress(WrongNumberError):
            self.last = self._read(str(text))
            if self._on_change is not None:
                self._on_change(self.last)

    def _read(self, text: str) -> float:
        kind = (
            "a whole number"
            if self._is_whole
            else "a number such as 2.5 (a point, where a comma may part thousands)"
        )
        bounds = (("least", self._least), ("most", self._most))
        told = (f"at {name} {_shown(bound)}" for name, bound in bounds if math.isfinite(bound))
        wanted = ", ".join((kind, *told))
        pattern = WHOLE if self._is_whole else DECIMAL
        number = float(text.replace(",", ".")) if pattern.fullmatch(text.strip()) else math.nan
        # A comma may be that of a thousand, too.
        if not self._least <= number <= self._most or THOUSAND.fullmatch(text.strip()):
            raise WrongNumberError(self._label, text, wanted)
        return number


def _shown(number: float) -> str:
    return f"{number:.10g}"


class ScaleSlider:
    """A slider in per cent for a factor among the parameters of ``ik_node``.

    Pages set it again and again: of several values the newest is sent, when the one before is
    answered. What the machine has then is shown only when none is on its way.
    """

    def __init__(self, requests: OperatorRequests, label: str, most: int, name: str) -> None:
        """Add it, up to ``most``, to the open container; ``name`` is that of the parameter."""
        self._link, self._what, self._name = requests.link, label.lower(), name
        # By which facts its value was shown.
        self._shown: MachineFacts | None = None
        self._wanted: float | None = None
        self._is_setting = False
        slider = requests.gui.add_slider(f"{label} [%]", min=1, max=most, step=1, initial_value=100)
        self._input = OperatorsInput(requests, slider, self._set)

    def show(self, facts: MachineFacts) -> None:
        """Show what the machine has, unless another value is on its way there."""
        if facts is not self._shown and not self._is_setting:
            self._shown = facts
            self._input.set(max(1, round(100.0 * facts.values[self._name])))

    def _set(self, part: float) -> None:
        self._wanted = 0.01 * part
        if not self._is_setting:
            self._send()

    def _send(self, _: bool = True) -> None:
        value, self._wanted = self._wanted, None
        self._is_setting = value is not None and self._link.set_parameters(
            self._what, {self._name: value}, self._send
        )
        if not self._is_setting:
            self._shown = None


class SpeedFields:
    """A speed of the platform, or the choice that it goes as fast as the sliders can."""

    def __init__(self, requests: OperatorRequests, label: str, hint: str | None = None) -> None:
        """Add both to the open container of the page."""
        self._speed = OperatorsNumber(requests, label, USUAL_SPEED, least=SLOWEST_SPEED, hint=hint)
        self._fastest = OperatorsInput(
            requests, requests.gui.add_checkbox("As fast as it can", initial_value=False)
        )

    @property
    def value(self) -> float:
        """The speed; 0 for the fastest [m/s].

        Raises:
            WrongNumberError: if the field shows none.
        """
        return 0.0 if self._fastest.value else 0.001 * self._speed.value
