"""What ``ik_node`` does and why, as the message ``MachineState``."""

from __future__ import annotations

import math

from geometry_msgs.msg import Point, Vector3
from rclpy.clock import Clock

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.control import Cause, ControllerStatus, OperatingState
from tri_glide_kinematics.reason_log import RefusalLog
from tri_glide_kinematics.ros.messages import set_stamp

TOPIC = "~/machine_state"

NUMBERS: dict[OperatingState, int] = {
    state: getattr(MachineState, state.name) for state in OperatingState
}
STATES = {number: state for state, number in NUMBERS.items()}
CAUSES = {cause.value: cause for cause in Cause}


def machine_state(
    status: ControllerStatus, refused: RefusalLog, remark: str, frame: str, clock: Clock
) -> MachineState:
    """Return the message about a ``status``, with commands that were ``refused``.

    The ``remark`` is something beside the state that somebody should know; empty for none.
    """
    distance = status.target_distance
    message = MachineState(
        state=NUMBERS[status.state],
        sends_setpoints=status.leads,
        cause=int(status.reason.cause),
        reason=status.reason.text,
        target_kind=int(status.target_kind or MachineState.TARGET_NONE),
        target_reached=status.target_reached,
        target_distance=math.nan if distance is None else distance,
        target_text=status.newest_target,
        speed_scale=status.speed_scale,
        refused=refused.total,
        refusal=int(refused.refusal),
        refusal_text=refused.last,
        remark=remark,
    )
    message.header.frame_id = frame
    set_stamp(message.header.stamp, clock)
    _write(status.target_position, message.target)
    _write(status.target_velocity, message.target_velocity)
    return message


def state_of(message: MachineState) -> OperatingState | None:
    """Return the state that a message tells; None if it is none that is known here."""
    return STATES.get(message.state)


def cause_of(message: MachineState) -> Cause | None:
    """Return the cause that a message tells; None if it is none that is known here."""
    return CAUSES.get(message.cause)


def _write(values: tuple[float, float, float] | None, part: Point | Vector3) -> None:
    part.x, part.y, part.z = values or (math.nan, math.nan, math.nan)
