"""What the controller tells about itself."""

from __future__ import annotations

from dataclasses import dataclass

from tri_glide_kinematics.control.operating_state import OperatingState, Reason
from tri_glide_kinematics.motion.engine import TargetKind
from tri_glide_kinematics.vectors import Vector3


@dataclass(frozen=True)
class ControllerStatus:
    """What the controller does and why.

    Attributes:
        state: what it is doing.
        reason: why it is doing that.
        newest_target: the newest target that was accepted, in words; empty before the first.
        target_missed: whether the machine stands still and is not measured at its target.
        held_at_edge: whether the target leads out of the workspace, so that the platform is held.
        target_reached: whether the machine stands still and is measured at its target.
        target_distance: that was measured when this was decided, one way or the other [m].
        target_kind: of the newest target; None before the first.
        target_position: its place, or end. Shape (3,) [m]; None if it has none.
        target_velocity: Shape (3,) [m/s]; None if it has none.
        leads: whether there is a setpoint in each cycle.
        speed_scale: by how much velocities are reduced.
    """

    state: OperatingState
    reason: Reason
    newest_target: str
    target_missed: bool
    held_at_edge: bool
    target_reached: bool = False
    target_distance: float | None = None
    target_kind: TargetKind | None = None
    target_position: Vector3 | None = None
    target_velocity: Vector3 | None = None
    leads: bool = False
    speed_scale: float = 1.0
