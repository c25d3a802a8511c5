"""Reads goals of transfers, and how their stations move."""

from __future__ import annotations

import time
from typing import Any

from rclpy.clock import Clock

from tri_glide_interfaces.msg import StationState
from tri_glide_kinematics.checks import finite
from tri_glide_kinematics.errors import OutOfBoundsError, WrongShapeError
from tri_glide_kinematics.motion.engine import Station, Transfer, TransferProgress
from tri_glide_kinematics.ros.messages import (
    age_of_target,
    ahead_of_steady,
    check_frame,
    has_stamp,
    steady_time,
    vector_of,
)

# A goal names at most so many stations, and each so many outputs.
MOST_STATIONS, MOST_OUTPUTS = 20, 20

# The longest time for which a place is foreseen, or is waited for [s].
LONGEST = 60.0


def transfer_of(request: Any, base_frame: str, clock: Clock) -> Transfer:
    """Return what a goal of ``~/transfer`` asks for.

    Raises:
        RefusedMessageError: if it is in another frame, or has a stamp of another clock.
        KinematicsError: if a number makes no sense.
    """
    check_frame("transfer", request.header.frame_id, (base_frame,))
    count = len(request.stations)
    if not 1 <= count <= MOST_STATIONS:
        raise OutOfBoundsError("number of stations", count, f"1 to {MOST_STATIONS}")
    stamp, leave, ahead = request.header.stamp, request.leave_at, ahead_of_steady(clock)
    seen = leave_at = time.monotonic()
    if has_stamp(stamp):
        age_of_target(stamp, clock, LONGEST, "transfer")
        seen = steady_time(stamp, ahead)
    if has_stamp(leave):
        leave_in = steady_time(leave, ahead) - leave_at
        if leave_in > LONGEST:
            raise OutOfBoundsError("leave_at", leave_in, f"at most {LONGEST:g} from now", "s")
        leave_at += leave_in
    return Transfer(
        [_station(station, number) for number, station in enumerate(request.stations)],
        request.height,
        tolerance=request.tolerance,
        allowed=request.allowed,
        lifts=request.lifts,
        seen=seen,
        leave_at=leave_at,
    )


def renewal_of(message: StationState, base_frame: str, clock: Clock) -> tuple[int, Station, float]:
    """Return which station moves otherwise, how, and when it was there, by time.monotonic() [s].

    Raises:
        KinematicsError: if it is in another frame, has no stamp, or a number is not finite.
    """
    check_frame("station state", message.header.frame_id, (base_frame,))
    age_of_target(message.header.stamp, clock, LONGEST, "station state")
    seen = steady_time(message.header.stamp, ahead_of_steady(clock))
    vectors = (message.position, message.velocity, message.acceleration)
    position, velocity, acceleration = (vector_of(each) for each in vectors)
    for value in (*position, *velocity, *acceleration):
        finite("station state", value)
    station = Station(position, 0.0, velocity, acceleration)
    return message.station, station, seen


def arrival_stamps(progress: TransferProgress, delay: float, clock: Clock) -> list[int]:
    """Return when the machine is at each station, by a ``clock`` [ns]; 0 where it gets to none.

    Args:
        progress: of the transfer.
        delay: from a setpoint to the motors [s].
        clock: of the node.
    """
    now = clock.now().nanoseconds
    return [
        now + round(1e9 * (arrival + delay)) if abs(arrival) < LONGEST else 0
        for arrival in progress.arrivals
    ]


def _station(message: Any, number: int) -> Station:
    outputs, times = message.outputs, message.output_times
    name = f"stations[{number}]"
    if len(outputs) != len(times):
        shape = f"({len(outputs)},), one for each of outputs"
        raise WrongShapeError(f"{name}.output_times", (len(times),), shape)
    if len(outputs) > MOST_OUTPUTS:
        raise OutOfBoundsError(f"outputs of {name}", len(outputs), f"at most {MOST_OUTPUTS}")
    for after, output in zip(times, outputs):
        if not abs(finite(f"{name}.output_times", after)) <= LONGEST:
            raise OutOfBoundsError(f"{name}.output_times", after, f"at most {LONGEST:g}", "s")
        finite(f"{name}.outputs.value", output.value)
    if not message.dwell <= LONGEST:
        raise OutOfBoundsError(f"{name}.dwell", message.dwell, f"at most {LONGEST:g}", "s")
    return Station(
        vector_of(message.position),
        message.dwell,
        vector_of(message.velocity),
        vector_of(message.acceleration),
        tuple(zip(times, outputs)),
    )
