"""The machine of the page: which jogs and steps of the operator still count by what it tells."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tri_glide_kinematics.control import IDLE, JOGGING, MOVING, Cause, OperatingState
from tri_glide_kinematics.vectors import Vector3, plus


@dataclass
class JogWatch:
    """Tells by what ``ik_node`` says about itself when a jog was ended by somebody else.

    A jog whose messages were late for a moment, as a busy browser sends them, was not. One that was
    released has ended, too, but by then another button may be held.
    """

    _has_jogged: bool = False

    def has_ended(self, state: OperatingState | None, cause: Cause | None) -> bool:
        """Take a state and its cause; return whether what is held must not go on."""
        if state is JOGGING:
            self._has_jogged = True
        elif self._has_jogged and cause not in (Cause.TWISTS_SILENT, Cause.RELEASED):
            self._has_jogged = False
            return True
        return False


# Until a step that was sent is seen as a motion [s].
STEP_PATIENCE = 0.5


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
        if not (is_on_way and (state is MOVING or now - self._sent_at < STEP_PATIENCE)):
            self.drop()
        start = self.target or place
        if start is not None:
            self.target = plus(start, step)
            self._sent_at = now
        return self.target
