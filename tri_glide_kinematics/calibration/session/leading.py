"""What one knows of a machine that is led, and how long one waits for it."""

from __future__ import annotations

from dataclasses import dataclass

from tri_glide_kinematics.control import Cause, OperatingState

# Who asks right after a motion has to wait for the time of rest that is asked for [s].
LONGEST_WAIT = 1.0


@dataclass(frozen=True)
class MachineView:
    """What ik_node told last of itself.

    Attributes:
        state: None before it has told one, or if it is none that is known here.
        cause: of the state; None likewise.
        text: the reason, for people.
        stops: changes when it is stopped, disabled, in a fault or started anew; None before it has
            told them.
    """

    state: OperatingState | None = None
    cause: Cause | None = None
    text: str = ""
    stops: int | None = None

    def __str__(self) -> str:
        """Return state and reason in words."""
        state = "not heard yet" if self.state is None else self.state.name.lower()
        return f"ik_node is {state}: {self.text}"
