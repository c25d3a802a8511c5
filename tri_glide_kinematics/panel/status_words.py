"""What the page says about the machine, in a word, a colour and a line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

READY, MOTION, WARNING, FAULT = "ready", "motion", "warning", "fault"
# States that are asked for elsewhere.
IDLE, MOVING, JOGGING = "idle", "moving", "jogging"
# Part of the reason why a jog has ended whose twists did not come any more.
LATE_TWIST = "no twist for "

COLORS = {
    IDLE: READY,
    MOVING: MOTION,
    JOGGING: MOTION,
    "tracking": MOTION,
    "stopping": WARNING,
    "waiting": WARNING,
    "disabled": WARNING,
    "fault": FAULT,
}
# A refusal is shown for so long [s].
REFUSAL_SHOWN = 12.0


@dataclass(frozen=True)
class MachineStatus:
    """What ``ik_node`` says about itself.

    Attributes:
        state: in a word; empty before it has said anything.
        reason: of the state, with a remark if there is one.
        refused: number of commands that were refused.
        last_refusal: what was refused last, and why.
    """

    state: str = ""
    reason: str = ""
    refused: int = 0
    last_refusal: str = ""

    @classmethod
    def of(cls, values: Mapping[str, str]) -> MachineStatus:
        """Read the values of a message of ``~/status``."""
        remark = values.get("remark", "")
        reason = "; ".join(filter(None, (values.get("reason", ""), remark)))
        refused = values.get("refused commands", "0")
        return cls(
            values.get("state", ""),
            reason,
            int(refused) if refused.isdigit() else 0,
            values.get("last refusal", ""),
        )

    @property
    def color(self) -> str:
        """The colour of the state."""
        return COLORS.get(self.state, WARNING)
