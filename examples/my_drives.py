#!/usr/bin/env python3
"""Stands between ik_node and the drives of a machine: a frame for a program of your own.

    python3 examples/my_drives.py

The drives here are not real: each slider is where it was told to be one setpoint before. Put yours
in their place, in ``Drives``. This is for drives that take a setpoint whenever it comes. Those that
want exactly one target for each SYNC need a store (docs/your_machine.md, "Playing out").
"""

from __future__ import annotations

import signal
import sys
from contextlib import suppress

# Until ROS handles it, Ctrl-C just ends the process.
signal.signal(signal.SIGINT, signal.SIG_DFL)

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import JointState

SLIDERS = ("slider_1", "slider_2", "slider_3")  # in the order of joint_names
PERIOD = 0.002  # s, of measured heights
SILENCE = 0.02  # s without a setpoint, after which the drives hold their place


class Drives:
    """The drives of the three sliders. Here is what you replace."""

    def __init__(self) -> None:
        """Begin where the encoders say the sliders are."""
        self._heights = [0.6, 0.6, 0.6]  # m
        self._told = list(self._heights)

    def measure(self) -> list[float]:
        """Return what the encoders say [m]."""
        return self._heights

    def follow(self, heights: list[float], velocities: list[float]) -> None:
        """Drive to ``heights`` [m]; ``velocities`` [m/s] are for the feed-forward of the drives."""
        self._heights, self._told = self._told, heights

    def hold(self) -> None:
        """Brake to rest, and hold this place: no setpoint has come for a while."""
        self._told = self._heights


class MyDrives(Node):
    """Passes setpoints to the drives, and publishes measured heights."""

    def __init__(self) -> None:
        """Publish heights from now on."""
        super().__init__("my_drives")
        self._drives = Drives()
        self._last_setpoint = self.get_clock().now()
        self._publisher = self.create_publisher(JointState, "joint_states", QoSProfile(depth=5))
        # Here the newest setpoint counts; an older one is worth nothing. Who plays setpoints out
        # needs all of them: reliable, with a depth of 100.
        newest = QoSProfile(depth=1, reliability=qos_profile_sensor_data.reliability)
        self.create_subscription(JointState, "joint_commands", self._on_setpoint, newest)
        self.create_timer(PERIOD, self._publish)

    def _on_setpoint(self, message: JointState) -> None:
        places = [message.name.index(name) for name in SLIDERS]
        self._drives.follow(
            [message.position[place] for place in places],
            [message.velocity[place] for place in places],
        )
        self._last_setpoint = self.get_clock().now()

    def _publish(self) -> None:
        now = self.get_clock().now()
        if (now - self._last_setpoint).nanoseconds > 1e9 * SILENCE:
            self._drives.hold()
        message = JointState()
        message.header.stamp = now.to_msg()  # the time of the measurement
        message.name = list(SLIDERS)
        message.position = list(self._drives.measure())
        self._publisher.publish(message)


def main() -> int:
    """Run until Ctrl-C."""
    rclpy.init()
    try:
        rclpy.spin(MyDrives())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception:
        # Ctrl-C ends ROS at once, also while a timer publishes.
        if rclpy.ok():
            raise
    finally:
        # Ctrl-C may end ROS at this very moment (rclpy issue 1352).
        with suppress(RuntimeError):
            rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
