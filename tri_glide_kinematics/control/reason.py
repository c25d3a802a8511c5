"""Why the controller is in its state: for programs a cause, for people a text."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class Cause(IntEnum):
    """Why it is in its state, as programs read it: ``MachineState`` says what each one means."""

    COMMAND = 1
    SLOW_STREAM = 2
    EDGE = 3
    PAUSE_ASKED = 4
    TARGET_REACHED = 5
    TARGET_NOT_REACHED = 6
    TARGET_TOO_FAR = 7
    TARGET_REFUSED = 8
    STOP_ASKED = 9
    DISABLE_ASKED = 10
    ENABLE_ASKED = 11
    CANCELLED = 12
    RELEASED = 13
    TWISTS_SILENT = 14
    TARGETS_SILENT = 15
    STARTED_DISABLED = 16
    NO_MEASUREMENT = 17
    MEASUREMENT = 18
    LOOKING_FOR_OTHERS = 19
    OTHER_PUBLISHER = 20
    MEASUREMENTS_SILENT = 21
    MEASUREMENT_JUMP = 22
    MEASUREMENT_NOT_FINITE = 23
    TRACKING_ERROR = 24
    PROGRAM_ERROR = 25
    NODE_ENDS = 26


@dataclass(frozen=True)
class Reason:
    """A cause, and the text that tells people more about it.

    Attributes:
        cause: what programs decide by.
        text: what people read; nothing is decided by it.
    """

    cause: Cause
    text: str

    def __str__(self) -> str:
        """Return the text."""
        return self.text
