"""The twists of a jog: how often they have to come, and when a stopped jog may go on."""

from __future__ import annotations

import math

from tri_glide_kinematics.control.errors import CommandRefusedError
from tri_glide_kinematics.wording import number_text

# Twists that come less often than this are commands of a person, not a stream [s].
SLOWEST_STREAM = 1.0


class TwistStream:
    """Knows when twists came in, and whether their sender has let go of the stick after a stop.

    Attributes:
        timeout: longest time between two twists of a jog [s].
    """

    def __init__(self, timeout: float) -> None:
        """Wait for the first twist."""
        self.timeout = timeout
        self._received = -math.inf
        self._accepted = -math.inf
        self._release_needed = False

    def receive(self, now: float, released: bool) -> float:
        """Note a twist that comes in ``now`` [s], and return how long after the last one [s].

        Args:
            now: time of receipt [s].
            released: whether it is a twist of zero.
        """
        pause, self._received = now - self._received, now
        if released or pause > self.timeout:
            self._release_needed = False
        return pause

    def need_release(self) -> None:
        """Listen to no twist before there was one of zero, or a pause."""
        self._release_needed = True

    def check_released(self) -> None:
        """Check that twists are listened to.

        Raises:
            CommandRefusedError: if their sender did not let go since jogging was stopped.
        """
        if self._release_needed:
            raise CommandRefusedError(
                "jogging was stopped: it needs a twist of zero or a pause of "
                f"{self.timeout:g} s before it goes on"
            )

    def accept(self, received: float) -> None:
        """Note that a twist that came in at ``received`` [s] is carried out."""
        self._accepted = received

    def silence(self, now: float) -> str | None:
        """Return why a jog has to end ``now`` [s], or None."""
        if now - self._accepted > self.timeout:
            return f"no twist for {self.timeout:g} s"
        return None

    def remark(self, pause: float) -> str:
        """Return what is to be said of a stream with such a ``pause`` [s]; empty if it is fine."""
        if not self.timeout < pause < SLOWEST_STREAM:
            return ""
        return (
            f", {number_text(pause, 2)} s after the last one: longer than twist_timeout, "
            f"{self.timeout:g} s"
        )
