"""Publishes the health of a node on /diagnostics once a second."""

from __future__ import annotations

from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from tri_glide_kinematics.control import Health
from tri_glide_kinematics.ros.messages import set_stamp
from tri_glide_kinematics.wording import number_text

HARDWARE_ID = "tri_glide"


def status_message(name: str, health: Health) -> DiagnosticStatus:
    """Return ``health`` as a message from the node with this full name, without the first slash.

    Its namespace tells its machine from others, here and in ``hardware_id``.
    """
    namespace, slash, _ = name.rpartition("/")
    return DiagnosticStatus(
        level=bytes([health.level]),
        name=name,
        message=health.message,
        hardware_id=f"{namespace}{slash}{HARDWARE_ID}",
        values=[KeyValue(key=key, value=_text(value)) for key, value in health.values.items()],
    )


class DiagnosticsPublisher:
    """Asks a node for its health once a second, by a steady clock."""

    def __init__(self, node: Node, health: Callable[[], Health]) -> None:
        """Publish what ``health`` returns under the full name of ``node``."""
        self._node = node
        self._health = health
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        node.create_timer(1.0, self._publish, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _publish(self) -> None:
        message = DiagnosticArray()
        set_stamp(message.header.stamp, self._node.get_clock())
        name = self._node.get_fully_qualified_name()[1:]
        message.status = [status_message(name, self._health())]
        self._publisher.publish(message)


def _text(value: object) -> str:
    return number_text(value, 6) if isinstance(value, float) else str(value)
