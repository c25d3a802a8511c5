"""Who drags the handle, and to where: viser lets every page move it."""

from __future__ import annotations

from dataclasses import dataclass

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
