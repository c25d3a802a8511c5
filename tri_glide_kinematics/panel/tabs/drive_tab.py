"""The tab with which the machine is driven."""

from __future__ import annotations

import json
import math
from functools import partial
from html import escape
from typing import Any

import viser

from tri_glide_kinematics.control import TEACH_SPEED, OperatingState
from tri_glide_kinematics.panel.link import MachineFacts
from tri_glide_kinematics.panel.machine import ShownMachine
from tri_glide_kinematics.panel.machine_scene import view_of
from tri_glide_kinematics.panel.operator_requests import (
    Event,
    OperatorRequests,
    ScaleSlider,
    SpeedFields,
)
from tri_glide_kinematics.panel.operators import RENEWALS
from tri_glide_kinematics.panel.viser_parts import uuid_of
from tri_glide_kinematics.panel.words import note
from tri_glide_kinematics.vectors import Vector3, plus, scaled, three

HOLD, OWN = "hold", "own"
STEPS = {"0.1": 1e-4, "1": 1e-3, "10": 1e-2}
USUAL_STEP, SMALLEST_STEP, LARGEST_STEP = 5.0, 0.001, 100.0  # mm, of the own step

# As they lie in the pad, row by row, with their keys; None leaves a place empty.
PAD: tuple[tuple[str, Vector3, str] | None, ...] = (
    None,
    ("Y+", (0.0, 1.0, 0.0), "ArrowUp"),
    ("Z+", (0.0, 0.0, 1.0), "PageUp"),
    ("X−", (-1.0, 0.0, 0.0), "ArrowLeft"),
    None,
    ("X+", (1.0, 0.0, 0.0), "ArrowRight"),
    None,
    ("Y−", (0.0, -1.0, 0.0), "ArrowDown"),
    ("Z−", (0.0, 0.0, -1.0), "PageDown"),
)
KEYS_HINT = (
    "arrows: X and Y, Page Up and Down: Z. Gamepad, in 'hold': with a shoulder button held, left "
    "stick or cross: X and Y, right stick: Z"
)

KEYS_STATE = '<div class="tri-glide-note" role="status" data-keys></div>'

# Of the platform [mm/s].
SLOWEST_JOG, USUAL_JOG, FASTEST_JOG = 0.01, 20.0, 200.0

TEACH_HINT = (
    f"the platform moves at {1000.0 * TEACH_SPEED:g} mm/s at most; this is no safety function"
)
SPEED_HINT = "largest speed of the platform on its way"

# From where the camera looks at the machine; None for where it stands on a new page. From above, y
# is up on the page.
VIEWS = {"top": (0.0, -1e-3, 1.0), "front": (0.0, -1.0, 0.0), "fit": None}


class DriveTab:
    """Enabling, speed, jogs, steps, and a position to go to."""

    def __init__(self, requests: OperatorRequests, machine: ShownMachine) -> None:
        """Add all to the open container of the page, by which a ``machine`` is driven."""
        gui = requests.gui
        self._requests = requests
        self._machine = machine
        link = requests.link
        powers = {name: partial(link.enable, name == "enable") for name in ("enable", "disable")}
        requests.buttons("Machine", powers)
        motions = {name: partial(link.trigger, name) for name in ("pause", "resume")}
        requests.buttons("Motion", motions)
        self._teach: Any = gui.add_checkbox("Teach mode", False, hint=TEACH_HINT)
        self._is_teaching = False
        # Facts by which the teach mode was shown.
        self._shown: MachineFacts | None = None
        self._teach.on_update(self._set_teach_mode)
        self._scale = ScaleSlider(requests, "Speed", 100, "speed_scale")
        modes = {mode: partial(self._set_mode, mode) for mode in (HOLD, *STEPS, OWN)}
        requests.buttons("Jog [mm]", modes)
        self._own_step = requests.number(
            "Own step [mm]", USUAL_STEP, least=SMALLEST_STEP, most=LARGEST_STEP
        )
        self._speed = requests.number("Jog [mm/s]", USUAL_JOG, least=SLOWEST_JOG, most=FASTEST_JOG)
        self._mode = HOLD
        self._state: OperatingState | None = None
        self._buttons = [self._pad_button(direction) for _, direction, _ in filter(None, PAD)]
        keys = gui.add_checkbox("Keys, gamepad", False, hint=KEYS_HINT)
        self._keys = requests.field(keys, lambda _: self._show_pad())
        self._pad, self._on = gui.add_html(""), gui.add_html("")
        self._show_pad()
        self._show_on()
        with gui.add_folder("Go to"):
            self._place = [requests.number(f"{axis} [mm]", 0.0) for axis in "xyz"]
            self._go_speed = SpeedFields(requests, "at [mm/s]", SPEED_HINT)
            look = {"color": "blue", "icon": viser.Icon.PLAYER_PLAY}
            requests.button("Go", self._go, **look)
            requests.button("Take the present position", self._take_present)
        self._present: Vector3 | None = None
        gui.add_button_group("View", tuple(VIEWS)).on_click(self._look)

    def go_to(self, position: Vector3) -> None:
        """Go to a ``position``, at the speed that the fields show [m].

        Raises:
            WrongNumberError: if the field of the speed shows none.
        """
        self._machine.move_to(position, self._go_speed.value)

    def _go(self) -> None:
        self.go_to(three(0.001 * field.value for field in self._place))

    def show(self) -> None:
        """Show speed scale, teach mode, state and place of the machine, if one is known."""
        facts, state = self._machine.facts, self._machine.feeds.status.state
        if facts is None:
            return
        if state is not self._state:
            self._state = state
            self._show_on()
        is_first = self._present is None
        self._present = self._machine.commanded_position or self._present
        if is_first:
            self._take_present()
        self._scale.show(facts)
        if facts is not self._shown:
            self._shown = facts
            self._teach.value = self._is_teaching = facts.is_teaching

    def _take_present(self) -> None:
        if self._present is not None:
            for field, part in zip(self._place, self._present):
                field.set(round(1000.0 * part, 2) + 0.0)

    async def _look(self, event: Event) -> None:
        """Turn the camera of the page on which a view was chosen; any page may."""
        facts = self._machine.facts
        if event.client is None or facts is None:
            return
        position, middle = view_of(facts)
        if direction := VIEWS.get(event.target.value):
            position = plus(middle, scaled(direction, math.dist(position, middle)))
        with event.client.atomic():
            event.client.camera.position = position
            event.client.camera.look_at = middle

    async def _set_teach_mode(self, event: Event) -> None:
        """Ask for it: any page may make the machine slow, as any may stop it, but not fast."""
        if event.client_id is None:
            return
        wanted = event.target.value
        # It shows what the machine tells, not what was asked for.
        self._teach.value = self._is_teaching
        requests = self._requests
        if wanted or requests.may(event.client_id):
            requests.wish(lambda: requests.link.set_teach_mode(wanted), outlasts_stop=wanted)

    def _set_mode(self, mode: str) -> None:
        self._mode = mode
        self._show_pad()
        self._show_on()

    def _pad_button(self, direction: Vector3) -> Any:
        """Return a button that is not seen: the pad presses and holds it."""
        button = self._requests.gui.add_button("jog", visible=False)
        requests = self._requests

        async def hold(event: Event) -> None:
            requests.hold(event, direction, lambda: 0.001 * self._speed.value)

        def step(_: object) -> None:
            if self._mode != HOLD:
                size = STEPS.get(self._mode) or 0.001 * self._own_step.value
                self._machine.move_by(scaled(direction, size), 0.001 * self._speed.value)

        button.on_hold(hold, callback_hz=RENEWALS)
        button.on_click(requests.on(step))
        return button

    def _show_pad(self) -> None:
        mode = self._mode
        kind = "hold" if mode == HOLD else "press"
        buttons = iter(self._buttons)
        cells = []
        for entry in PAD:
            if entry is None:
                cells.append("<span></span>")
                continue
            name, _, key = entry
            uuid = uuid_of(next(buttons))
            by_key = f' data-key="{key}"' if self._keys.value else ""
            cells.append(f'<button type="button" data-{kind}="{uuid}"{by_key}>{name}</button>')
        size = "the own step" if mode == OWN else f"{mode} mm"
        words = "moves while it is held" if mode == HOLD else f"each press moves by {size}"
        if self._keys.value:
            words += f"; {KEYS_HINT}"
        keys = KEYS_STATE if self._keys.value else ""
        self._pad.content = f'<div class="tri-glide-pad">{"".join(cells)}</div>{note(words)}{keys}'

    def _show_on(self) -> None:
        """Tell the page which buttons of groups are on; it marks them.

        Not beside the pad: a button that is held there would be another one by then.
        """
        state = self._state
        off = OperatingState.DISABLED, OperatingState.FAULT, None
        on = {each: each == self._mode for each in (HOLD, *STEPS, OWN)}
        on["enable"], on["disable"] = state not in off, state is OperatingState.DISABLED
        on["pause"] = state is OperatingState.PAUSED
        self._on.content = f'<i hidden data-on="{escape(json.dumps(on))}"></i>'
