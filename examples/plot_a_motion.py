#!/usr/bin/env python3
"""Records the next motion of the machine, from rest to rest, and plots it.

    python3 examples/plot_a_motion.py motion.png

Heights and velocities are those of joint_commands; accelerations are differences of velocities.
"""

import signal
import sys
from contextlib import suppress

# Until ROS handles it, Ctrl-C just ends the process.
signal.signal(signal.SIGINT, signal.SIG_DFL)

import matplotlib
import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import JointState

matplotlib.use("Agg")
from matplotlib import pyplot


class Recorder(Node):
    """Keeps the commands from the first that moves to the first that rests again."""

    def __init__(self) -> None:
        """Wait for a motion."""
        super().__init__("motion_recorder")
        self.commands: list[JointState] = []
        self.is_complete = False
        self.create_subscription(JointState, "joint_commands", self._on_command, 1000)
        self.get_logger().info("waiting for a motion")

    def _on_command(self, command: JointState) -> None:
        moves = any(command.velocity)
        if (moves or self.commands) and not self.is_complete:
            self.commands.append(command)
            self.is_complete = not moves


def plot(commands: list[JointState], file: str) -> None:
    """Draw heights, velocities and accelerations over time."""
    stamps = [command.header.stamp for command in commands]
    times = np.array([stamp.sec + 1e-9 * stamp.nanosec for stamp in stamps])
    times -= times[0]
    heights = np.array([command.position for command in commands])
    velocities = np.array([command.velocity for command in commands])
    accelerations = np.gradient(velocities, times, axis=0)
    figure, rows = pyplot.subplots(3, sharex=True, figsize=(8.0, 7.0), layout="constrained")
    for axes, values, label in zip(
        rows,
        (1000.0 * heights, velocities, accelerations),
        ("height [mm]", "velocity [m/s]", "acceleration [m/s²]"),
    ):
        axes.plot(times, values, label=commands[0].name)
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
    rows[0].legend()
    rows[-1].set_xlabel("time [s]")
    figure.savefig(file, dpi=110)


def main() -> int:
    """Record one motion and plot it."""
    file = [*remove_ros_args(sys.argv)[1:], "motion.png"][0]
    rclpy.init()
    recorder = Recorder()
    try:
        while not recorder.is_complete:
            rclpy.spin_once(recorder)
    except (KeyboardInterrupt, ExternalShutdownException):
        return 1
    finally:
        # Ctrl-C may end ROS at this very moment (rclpy issue 1352).
        with suppress(RuntimeError):
            rclpy.try_shutdown()
    plot(recorder.commands, file)
    print(f"{len(recorder.commands)} setpoints in {file}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
