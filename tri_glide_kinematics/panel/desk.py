"""What the tabs of the page share: who may act, and how wishes get to where the node spins."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import Any

import viser

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.controls import Controls, name_of
from tri_glide_kinematics.panel.hold import HeldJog
from tri_glide_kinematics.panel.machine_link import MachineLink
from tri_glide_kinematics.panel.status_words import REFUSAL_SHOWN
from tri_glide_kinematics.vectors import Vector3

Wish = Callable[[], None]
Event = Any


class Desk:
    """The operator's desk.

    Stop and the renewals of a held jog go to the machine straight from the thread that hears the
    page. Everything else is a wish, which the node's own thread fulfils.

    Attributes:
        controls: who has them.
        link: to the machine.
        refusal: what was refused last, and why; empty after a while.
        stops: how often Stop was pressed.
    """

    def __init__(self, link: MachineLink) -> None:
        """Send by ``link``."""
        self.controls = Controls()
        self.link = link
        self.refusal = ""
        self.stops = 0
        self._refused_at = 0.0
        self._hold = HeldJog()
        self._wishes: deque[Wish] = deque()

    def refuse(self, reason: str) -> None:
        """Show why something is not done."""
        self.refusal, self._refused_at = reason, time.monotonic()

    def may(self, page: int) -> bool:
        """Tell whether a ``page`` may act, and say who may if it may not."""
        holder = self.controls.holder
        if holder == page:
            return True
        who = "nobody: take them first" if holder is None else name_of(holder)
        self.refuse(f"{name_of(page)}: nothing done, as the controls are with {who}")
        return False

    def wish(self, wish: Wish) -> None:
        """Have something done where the node spins."""
        self._wishes.append(wish)

    def on(
        self, wish: Callable[[Any], None], otherwise: Wish | None = None
    ) -> Callable[[Event], Any]:
        """Return a callback of viser that fulfils a wish, if its page has the controls.

        Args:
            wish: gets the value of what was changed or pressed.
            otherwise: is done if the page has them not.
        """

        async def call(event: Event) -> None:
            if event.client_id is None:
                return
            if self.may(event.client_id):
                value = getattr(event.target, "value", None)
                self.wish(lambda: wish(value))
            elif otherwise is not None:
                self.wish(otherwise)

        return call

    def fulfil(self) -> None:
        """Do what is wished; called where the node spins."""
        while self._wishes:
            try:
                self._wishes.popleft()()
            except KinematicsError as error:
                self.refuse(str(error))
        if self.refusal and time.monotonic() - self._refused_at > REFUSAL_SHOWN:
            self.refusal = ""

    async def stop(self, _: Event) -> None:
        """Stop the machine: any page may, at any time."""
        self.link.stop()
        self._hold.release()
        self.stops += 1

    async def release(self, event: Event) -> None:
        """End the jog of a page at once."""
        self._end_hold(event.client_id)

    def hold(self, event: Event, direction: Vector3, speed: float) -> None:
        """Jog while a button is held: called again and again.

        Args:
            event: of the button.
            direction: unit vector.
            speed: of the platform [m/s].
        """
        page = event.client_id
        if self._hold.renew(page, direction, time.monotonic()) and self.controls.holder == page:
            x, y, z = direction
            self.link.jog((speed * x, speed * y, speed * z))
        elif self.controls.holder != page:
            self.may(page)

    def give(self, page: int) -> None:
        """Give up the controls of a page, and end what it did."""
        self._end_hold(page)
        self.controls.give(page)

    async def opened(self, client: viser.ClientHandle) -> None:
        """Note that a page is there."""
        self.controls.opened(client.client_id)

    async def closed(self, client: viser.ClientHandle) -> None:
        """Note that a page has vanished, and end what it did."""
        self._end_hold(client.client_id)
        self.controls.closed(client.client_id)

    def _end_hold(self, page: int) -> None:
        if self._hold.release(page):
            self.link.jog()
