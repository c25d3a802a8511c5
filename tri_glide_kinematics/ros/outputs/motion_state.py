"""Measured and commanded motion of the sliders, told less often than in each cycle."""

from __future__ import annotations

import math
from struct import Struct
from typing import NamedTuple

from rclpy.node import Node
from rclpy.qos import QoSProfile

from tri_glide_interfaces.msg import MotionState
from tri_glide_kinematics.motion.limits import SliderState
from tri_glide_kinematics.ros.cdr import (
    FIRST,
    FOURTH,
    SECOND,
    STAMP_END,
    STAMP_OFFSET,
    THIRD,
    StampedTriples,
    byte_order,
)
from tri_glide_kinematics.settings import Values
from tri_glide_kinematics.vectors import Vector3

TOPIC = "~/motion_state"
# Only the newest one counts. Who is slow may take it as best effort.
NEWEST = QoSProfile(depth=1)

UNKNOWN: Vector3 = (math.nan, math.nan, math.nan)
NO_SETPOINT = SliderState(UNKNOWN, UNKNOWN, UNKNOWN)

# By the order of bytes: the stamp with the size of the frame's name, and the numbers.
HEADS = {order: Struct(f"{order}iII") for order in "<>"}
NUMBERS = {order: Struct(f"{order}12d") for order in "<>"}

# A share of the cycles is added up in floats, and 1 may be missed by their rounding.
WHOLE = 1.0 - 1e-9


class Motion(NamedTuple):
    """The slider data of a message.

    Attributes:
        stamp: when that was, by the clock of ``ik_node`` [s].
        commanded: None while there is no setpoint.
        measured: true heights. Shape (3,) [m]; None if they are not known.
    """

    stamp: float
    commanded: SliderState | None
    measured: Vector3 | None


class MotionStates:
    """The topic ``~/motion_state``, on which nothing is published while nobody listens."""

    def __init__(self, node: Node, values: Values) -> None:
        """Create the publisher on ``node``."""
        message = MotionState(
            commanded_heights=FIRST,
            commanded_velocities=SECOND,
            commanded_accelerations=THIRD,
            measured_heights=FOURTH,
        )
        message.header.frame_id = values["base_frame"]
        self._message = StampedTriples(message, 4)
        self._now = node.get_clock().now
        self._publisher = node.create_publisher(MotionState, TOPIC, NEWEST)
        self._share = min(1.0, values["state_publish_rate"] / values["rate"])
        self._passed = 0.0

    def is_due(self) -> bool:
        """Tell whether to publish in this cycle; to be called once in each."""
        self._passed += self._share
        if self._passed < WHOLE:
            return False
        self._passed -= 1.0
        return self._publisher.get_subscription_count() > 0

    def publish(self, setpoint: SliderState | None, measured: Vector3 | None) -> None:
        """Publish the setpoint of this cycle and measured true heights [m], None if unknown."""
        stamp = divmod(self._now().nanoseconds, 1_000_000_000)
        heights, velocities, accelerations = setpoint or NO_SETPOINT
        numbers = heights, velocities, accelerations, measured or UNKNOWN
        self._publisher.publish(self._message.at(*stamp, *numbers))


def read_motion(data: bytes) -> Motion:
    """Return what the bytes of a message tell.

    To make a message of them takes ten times as long. The numbers are its last part, and begin at a
    multiple of their size, counted from the stamp.
    """
    order = byte_order(data)
    seconds, nanoseconds, name = HEADS[order].unpack_from(data, STAMP_OFFSET)
    end_of_name = STAMP_END + 4 + name
    numbers = NUMBERS[order].unpack_from(data, end_of_name + (STAMP_OFFSET - end_of_name) % 8)
    commanded = SliderState(numbers[0:3], numbers[3:6], numbers[6:9])
    measured = numbers[9:12]
    return Motion(
        seconds + 1e-9 * nanoseconds,
        commanded if all(map(math.isfinite, commanded.heights)) else None,
        measured if all(map(math.isfinite, measured)) else None,
    )
