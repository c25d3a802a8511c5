#!/usr/bin/env python3
"""Jogs the platform with a joystick, for as long as a button is held.

    ros2 run joy joy_node
    python3 examples/jog_with_joystick.py --ros-args -p speed:=0.05

Left stick: x and y; right stick, up and down: z. Button 5 has to be held. When it is released, or
the joystick falls silent, the platform stops.
"""

import signal

# Until ROS handles it, Ctrl-C just ends the process.
signal.signal(signal.SIGINT, signal.SIG_DFL)

import rclpy
from geometry_msgs.msg import TwistStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Joy

AXES = (1, 0, 4)  # of the joystick, for x, y and z of the platform
PERIOD = 0.02  # s between two twists: well below ik_node's twist_timeout
SILENCE = 0.5  # s without a message of the joystick, after which it counts as released


class Jog(Node):
    """Turns the latest message of the joystick into a stream of twists."""

    def __init__(self) -> None:
        """Wait for the joystick."""
        super().__init__("jog_with_joystick")
        self._speed = self.declare_parameter("speed", 0.05).value  # m/s at full deflection
        self._button = self.declare_parameter("button", 5).value
        self._velocity = (0.0, 0.0, 0.0)
        self._received = self.get_clock().now()
        self._was_jogging = False
        self._publisher = self.create_publisher(TwistStamped, "target_twist", 1)
        self.create_subscription(Joy, "joy", self._on_joy, 1)
        self.create_timer(PERIOD, self._publish)

    def _on_joy(self, joy: Joy) -> None:
        buttons, axes = len(joy.buttons), len(joy.axes)
        if buttons <= self._button or axes <= max(AXES):
            self.get_logger().error(
                f"the joystick has {buttons} buttons and {axes} axes: at least {self._button + 1} "
                f"and {max(AXES) + 1} are needed; the parameter button names another one",
                throttle_duration_sec=1.0,
            )
            return
        held = bool(joy.buttons[self._button])
        self._velocity = tuple(held * self._speed * joy.axes[axis] for axis in AXES)
        self._received = self.get_clock().now()

    def _publish(self) -> None:
        silent = self.get_clock().now() - self._received
        velocity = self._velocity if silent.nanoseconds < 1e9 * SILENCE else (0.0, 0.0, 0.0)
        # A twist of zero ends the jog at once; afterwards the topic is left to others.
        if any(velocity) or self._was_jogging:
            twist = TwistStamped()
            linear = twist.twist.linear
            linear.x, linear.y, linear.z = velocity
            self._publisher.publish(twist)
        self._was_jogging = any(velocity)


def main() -> None:
    """Jog until Ctrl-C."""
    rclpy.init()
    try:
        rclpy.spin(Jog())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception:
        # Ctrl-C ends ROS at once, also while a timer publishes.
        if rclpy.ok():
            raise


if __name__ == "__main__":
    main()
