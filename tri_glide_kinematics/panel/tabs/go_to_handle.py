"""A handle in the scene that is dragged to where the platform should go."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import viser

from tri_glide_kinematics.panel.tabs.operator_requests import Desk
from tri_glide_kinematics.vectors import Vector3


@dataclass
class Drag:
    """A drag by the page with the controls; what others do to the handle does not count.

    Attributes:
        place: where the handle belongs [m].
        page: that drags it, None if it is let go.
    """

    place: Vector3 = (0.0, 0.0, 0.0)
    page: int | None = None

    def begin(self, page: int) -> None:
        """Note that the page with the controls has taken it."""
        self.page = page

    def move(self, page: int, place: Vector3) -> None:
        """Note where a ``page`` has moved it [m]."""
        if self.page == page:
            self.place = place

    def end(self, page: int) -> Vector3 | None:
        """Return where a ``page`` has let it go [m], None if it was not the one that dragged it."""
        if self.page != page:
            return None
        self.page = None
        return self.place


# A handle that is nobody's follows the machine in steps of this [m].
STEP = 0.001


class GoToHandle:
    """The handle: it sends a target when it is released, and says beside it if that is refused."""

    def __init__(
        self, server: viser.ViserServer, desk: Desk, size: float, move_to: Callable[[Vector3], None]
    ) -> None:
        """Put it into the scene, not to be seen before it has a place.

        Args:
            server: of the page.
            desk: of the operator.
            size: of its arrows [m].
            move_to: goes to a position [m].
        """
        self._server = server
        self._desk = desk
        self._move_to = move_to
        self._drag = Drag()
        self._asked: Vector3 | None = None
        self._handle = server.scene.add_transform_controls(
            "/go_to", scale=size, disable_rotations=True, depth_test=False, visible=False
        )
        self._handle.on_update(self._on_update)
        self._label = server.scene.add_label("/refusal", "", visible=False)

    def remove(self) -> None:
        """Remove it."""
        self._handle.remove()
        self._label.remove()

    def follow(self, position: Vector3 | None) -> None:
        """Follow the machine at rest, and show why the last target was refused [m]."""
        refusal = self._desk.refusal if self._asked is not None else ""
        if self._label.visible != bool(refusal) or (refusal and self._label.text != refusal):
            self._label.text = refusal
            self._label.position = self._asked or (0.0, 0.0, 0.0)
            self._label.visible = bool(refusal)
        if position is None or self._drag.page is not None or refusal:
            return
        if math.dist(self._handle.position, position) > STEP:
            self._drag.place = position
            self._handle.position = position
        if not self._handle.visible:
            self._handle.visible = True

    async def _on_update(self, event: Any) -> None:
        # viser tells of the end of a drag when a page vanishes, too: that is no wish to move.
        page, drag = event.client_id, self._drag
        is_there = page in self._server.get_clients()
        if event.phase == "end" or not is_there:
            place = drag.end(page)
            if is_there and self._desk.may(page) and place is not None:
                target = place
                self._desk.wish(lambda: self._go(target))
        elif self._desk.controls.holder != page:
            self._handle.position = drag.place
        elif event.phase == "start":
            drag.begin(page)
            self._asked = None
        else:
            x, y, z = map(float, self._handle.position)
            drag.move(page, (x, y, z))

    def _go(self, position: Vector3) -> None:
        self._asked = position
        self._desk.refusal = ""
        self._move_to(position)
