"""What the controller tells about itself."""

from __future__ import annotations

from dataclasses import dataclass

from tri_glide_kinematics.control.operating_state import OperatingState


@dataclass(frozen=True)
class ControllerStatus:
    """What the controller does and why.

    Attributes:
        state: what it is doing.
        reason: why it is doing that.
        newest_target: the newest target that was accepted, in words; empty before the first.
        target_missed: whether the machine stands still and is not measured at its target.
        held_at_edge: whether the target leads out of the workspace, so that the platform is held.
    """

    state: OperatingState
    reason: str
    newest_target: str
    target_missed: bool
    held_at_edge: bool
