#!/usr/bin/env python3
"""Follows a part on a conveyor until the part is at its end.

    python3 examples/follow_a_conveyor.py

A stand-in for the camera sees the part 30 times a second, and tells so 20 ms later.
"""

from __future__ import annotations

import signal
import sys
from contextlib import suppress

# Until ROS handles it, Ctrl-C just ends the process.
signal.signal(signal.SIGINT, signal.SIG_DFL)

import rclpy
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.time import Time

BEGIN, END, SPEED = -0.06, 0.06, 0.04  # m, m, m/s along x
ASIDE, HEIGHT = 0.02, 0.28  # m
PICTURE_PERIOD = 1.0 / 30.0  # s
LATENESS = Duration(nanoseconds=20_000_000)  # of the camera


class Camera(Node):
    """Tells where the part was, and how fast it moves."""

    def __init__(self) -> None:
        """Let the part set off as soon as somebody follows it."""
        super().__init__("camera")
        # Only the newest state is of use.
        self._publisher = self.create_publisher(Odometry, "target_state", QoSProfile(depth=1))
        self._begin: Time | None = None
        self.is_done = False
        self.create_timer(PICTURE_PERIOD, self._tell)

    def _tell(self) -> None:
        if not self._publisher.get_subscription_count():
            return
        # When the picture was made, and not now: ik_node works out where the part is by now.
        seen = self.get_clock().now() - LATENESS
        if self._begin is None:
            self._begin = seen
        x = BEGIN + SPEED * 1e-9 * (seen - self._begin).nanoseconds
        self.is_done = x >= END
        message = Odometry()
        message.header.stamp = seen.to_msg()
        message.header.frame_id = "tri_glide_base"
        place = message.pose.pose.position
        place.x, place.y, place.z = x, ASIDE, HEIGHT
        message.twist.twist.linear.x = SPEED
        self._publisher.publish(message)


def main() -> int:
    """Follow one part."""
    rclpy.init()
    camera = Camera()
    try:
        while not camera.is_done:
            rclpy.spin_once(camera)
        print("the part is at the end; ik_node stops when target_timeout is over")
    except (KeyboardInterrupt, ExternalShutdownException):
        return 1
    except Exception:
        # Ctrl-C ends ROS at once, also while a timer publishes.
        if rclpy.ok():
            raise
        return 1
    finally:
        # Ctrl-C may end ROS at this very moment (rclpy issue 1352).
        with suppress(RuntimeError):
            rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
