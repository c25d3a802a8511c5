"""Errors that a node survives, in its log: a few lines a second, however many there are."""

from __future__ import annotations

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from tri_glide_kinematics.reason_log import ReasonLog

LINES_PER_SECOND = 1


class ErrorLog:
    """Logs what was dropped because of an error that whoever sent it has made."""

    def __init__(self, node: Node) -> None:
        """Log as ``node``."""
        self._node = node
        logger = node.get_logger()
        # Each place that logs has one severity, as rclpy refuses another one: this one is its own.
        self._reasons = ReasonLog(lambda text: logger.error(text), LINES_PER_SECOND)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(1.0, self._reasons.end_of_second, clock=steady)

    def add(self, error: Exception) -> None:
        """Tell of an ``error``, unless the node is being shut down."""
        if self._node.context.ok():
            self._reasons.add(f"dropped a request: {type(error).__name__}: {error}")
