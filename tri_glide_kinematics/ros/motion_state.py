"""Tells where the sliders are and where they are to be, at a lower rate than that of the cycle."""

from __future__ import annotations

import math

from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from tri_glide_interfaces.msg import MotionState
from tri_glide_kinematics.motion.engine import SliderState
from tri_glide_kinematics.ros.parameter_table import Values
from tri_glide_kinematics.ros.stamped_triples import FIRST, FOURTH, SECOND, THIRD, StampedTriples
from tri_glide_kinematics.vectors import Vector3

TOPIC = "~/motion_state"
# One that is lost is as good as the next one; nobody holds the cycle.
NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)

UNKNOWN: Vector3 = (math.nan, math.nan, math.nan)
NO_SETPOINT = SliderState(UNKNOWN, UNKNOWN, UNKNOWN)

# A share of the cycles is added up in floats, and 1 may be missed by their rounding.
WHOLE = 1.0 - 1e-9


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
