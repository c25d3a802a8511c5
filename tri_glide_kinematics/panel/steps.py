"""Steps that are pressed one after the other: they add up for as long as they are on their way."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tri_glide_kinematics.control import IDLE, MOVING, OperatingState
from tri_glide_kinematics.vectors import Vector3

# Until a step that was sent is seen as a motion [s].
PATIENCE = 0.5


@dataclass
class Steps:
    """Remembers where the last step leads to.

    The next one goes on from there if nothing has come in between. If something has, it begins
    where the platform is: it must not lead to where nobody wants it to go any more.

    Attributes:
        target: of the last step, None if it counts no more [m].
    """

    target: Vector3 | None = None
    _sent_at: float = -math.inf

    def drop(self) -> None:
        """Let the next step begin where the platform is."""
        self.target = None

    def look(self, state: OperatingState | None) -> None:
        """Drop the last step if the machine does something else by now."""
        if state not in (IDLE, MOVING):
            self.drop()

    def go_on(
        self,
        step: Vector3,
        place: Vector3 | None,
        state: OperatingState | None,
        *,
        is_on_way: bool,
        now: float,
    ) -> Vector3 | None:
        """Return the target of another step, None if it is not known where that begins [m].

        Args:
            step: by how much to go on [m].
            place: where the platform is commanded to be, None if that is not known [m].
            state: of the machine.
            is_on_way: whether the goal of the last step has not ended.
            now: time.monotonic() [s].
        """
        if not (is_on_way and (state is MOVING or now - self._sent_at < PATIENCE)):
            self.drop()
        start = self.target or place
        if start is not None:
            x, y, z = start
            self.target = (x + step[0], y + step[1], z + step[2])
            self._sent_at = now
        return self.target
