"""The state of the machine on the page: a word, a colour and a line."""

from __future__ import annotations

from dataclasses import dataclass

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.control import Cause, OperatingState
from tri_glide_kinematics.ros.outputs import cause_of, state_of

READY, MOTION, WARNING, FAULT = "ready", "motion", "warning", "fault"

COLORS = {
    OperatingState.IDLE: READY,
    OperatingState.MOVING: MOTION,
    OperatingState.JOGGING: MOTION,
    OperatingState.TRACKING: MOTION,
    OperatingState.STOPPING: WARNING,
    OperatingState.WAITING: WARNING,
    OperatingState.DISABLED: WARNING,
    OperatingState.PAUSED: WARNING,
    OperatingState.FAULT: FAULT,
}
# A refusal is shown for so long [s].
REFUSAL_SHOWN = 12.0


@dataclass(frozen=True)
class MachineStatus:
    """What ``ik_node`` says about itself.

    Attributes:
        state: None before it has said anything, or if it is none that is known here.
        cause: of the state; None likewise.
        reason: of the state in words, with a remark if there is one.
        refused: number of commands that were refused.
        last_refusal: what was refused last, and why, in words.
    """

    state: OperatingState | None = None
    cause: Cause | None = None
    reason: str = ""
    refused: int = 0
    last_refusal: str = ""

    @classmethod
    def of(cls, message: MachineState) -> MachineStatus:
        """Read a message of ``~/machine_state``."""
        return cls(
            state_of(message),
            cause_of(message),
            "; ".join(filter(None, (message.reason, message.remark))),
            message.refused,
            message.refusal_text,
        )

    @property
    def word(self) -> str:
        """The state in a word; empty if it is not known."""
        return "" if self.state is None else self.state.name.lower()

    @property
    def color(self) -> str:
        """The colour of the state."""
        return WARNING if self.state is None else COLORS[self.state]
