#!/usr/bin/env python3
"""Follows a square with rounded corners, rests on it for a second, and goes on.

    python3 examples/follow_a_path.py

The square begins where the platform is. ik_node has to run, with a machine or the simulator.
"""

from __future__ import annotations

import signal
import sys
from contextlib import suppress

# Until ROS handles it, Ctrl-C just ends the process.
signal.signal(signal.SIGINT, signal.SIG_DFL)

import rclpy
from rclpy.action import ActionClient
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_srvs.srv import Trigger

from tri_glide_interfaces.action import FollowPath

CORNERS = [(0.03, 0.0, 0.25), (0.03, 0.03, 0.25), (0.0, 0.03, 0.25), (0.0, 0.0, 0.25)]  # m
TOLERANCE, SPEED = 0.001, 0.05  # m, m/s
REST = 1.0  # s


class PathFollower(Node):
    """Sends a path, pauses on it once, and waits for the end."""

    def __init__(self) -> None:
        """Look for the machine."""
        super().__init__("path_follower")
        self.result: FollowPath.Result | None = None
        self._is_paused = False
        self._path = ActionClient(self, FollowPath, "ik_node/follow_path")
        self._pause = self.create_client(Trigger, "ik_node/pause")
        self._resume = self.create_client(Trigger, "ik_node/resume")

    def send(self) -> None:
        """Wait for the machine and send the path."""
        for server in (self._pause, self._resume):
            server.wait_for_service()
        self._path.wait_for_server()
        goal = FollowPath.Goal()
        goal.kinds = [FollowPath.Goal.LINE] * len(CORNERS)
        goal.numbers = [number for corner in CORNERS for number in corner]
        goal.tolerances, goal.speeds = [TOLERANCE], [SPEED]  # for all of them
        self._path.send_goal_async(goal, self._on_feedback).add_done_callback(self._on_accepted)

    def _on_accepted(self, future: rclpy.Future) -> None:
        future.result().get_result_async().add_done_callback(self._on_result)

    def _on_result(self, future: rclpy.Future) -> None:
        self.result = future.result().result

    def _on_feedback(self, message: FollowPath.Impl.FeedbackMessage) -> None:
        told = message.feedback
        print(f"segment {told.segment + 1}, {1000.0 * told.way_remaining:.1f} mm to go")
        if told.way > told.way_remaining and not self._is_paused:
            self._is_paused = True
            self._pause.call_async(Trigger.Request()).add_done_callback(self._on_answer)
            self._timer = self.create_timer(REST, self._go_on)

    def _go_on(self) -> None:
        self._timer.cancel()
        self._resume.call_async(Trigger.Request()).add_done_callback(self._on_answer)

    def _on_answer(self, future: rclpy.Future) -> None:
        print(future.result().message)


def main() -> int:
    """Follow the path, and return 0 if the platform is at its end."""
    rclpy.init()
    node = PathFollower()
    try:
        node.send()
        while node.result is None:
            rclpy.spin_once(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        return 1
    except Exception:
        # Ctrl-C ends ROS at once, also while a request is sent.
        if rclpy.ok():
            raise
        return 1
    finally:
        # Ctrl-C may end ROS at this very moment (rclpy issue 1352).
        with suppress(RuntimeError):
            rclpy.try_shutdown()
    print(node.result.text)
    return 0 if node.result.code == FollowPath.Result.SUCCEEDED else 1


if __name__ == "__main__":
    sys.exit(main())
