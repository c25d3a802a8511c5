"""Requests of the operator: who may act, and how a wish gets to the node's own thread."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import Any

import viser

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.hold import LONGEST_GAP, HeldJog
from tri_glide_kinematics.panel.machine_link import MachineLink
from tri_glide_kinematics.panel.status_words import REFUSAL_SHOWN
from tri_glide_kinematics.panel.tabs.controls import Controls, name_of
from tri_glide_kinematics.vectors import Vector3

Wish = Callable[[], None]
Event = Any


class Desk:
    """The operator's desk.

    Stop and the renewals of a held jog go to the machine straight from the thread that hears the
    page. Everything else is a wish, which the node's own thread fulfils. Stop drops all wishes that
    are older than itself.

    Attributes:
        controls: who has them.
        link: to the machine.
        refusal: what was refused last, and why; empty after a while.
        stops: how often Stop was pressed.
    """

    def __init__(self, link: MachineLink, on_stop: Wish) -> None:
        """Send by ``link``; ``on_stop`` ends, where the node spins, what is still on its way."""
        self.controls = Controls()
        self.link = link
        self.refusal = ""
        self.stops = 0
        self._on_stop = on_stop
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

    def on(self, wish: Callable[[Any], None]) -> Callable[[Event], Any]:
        """Return a callback of viser that fulfils a wish, if its page has the controls.

        The ``wish`` gets the value of what was pressed.
        """

        async def call(event: Event) -> None:
            if event.client_id is None:
                return
            if self.may(event.client_id):
                value = getattr(event.target, "value", None)
                # viser takes any text for a choice.
                if value not in getattr(event.target, "options", (value,)):
                    self.refuse(f"nothing done: there is no choice {str(value)[:20]!r}")
                    return
                self.wish(lambda: wish(value))

        return call

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
        self._wishes.clear()
        # A wish that is being fulfilled at this moment comes to its end before this.
        self.wish(self._on_stop)
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
        if not self.may(page):
            # Should it get the controls now, it has to press again.
            self._hold.bar(page)
        elif self._hold.renew(page, direction, time.monotonic()):
            x, y, z = direction
            self.link.jog((speed * x, speed * y, speed * z))

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
        # Stop may empty it at any moment.
        try:
            return self._wishes.popleft()
        except IndexError:
            return None

    def _end_hold(self, page: int) -> bool:
        is_jog = self._hold.release(page)
        if is_jog:
            self.link.jog()
        return is_jog
